"""The page as text: what it contains, what it escapes, how large it is."""

import dataclasses
import itertools
import json
import re
from pathlib import Path

import numpy as np
import pytest

from harness.analysis.compare import compare
from harness.analysis.rare import margin_with_unseen
from harness.analysis.repricing import choose, reprice
from harness.analysis.side import Side
from harness.economics.cost_terms import MARGIN
from harness.metrics.columns import EVENT_COLUMNS
from harness.report.page.document import embedded, report_page
from harness.report.page.entries import entries_of
from harness.report.page.sections import break_even, break_even_histogram, profit_curve
from harness.report.repriced import SHOWN, TITLES
from harness.report.verdict import rankings
from harness.statistics.interval import Interval
from harness.statistics.paired import together
from harness.storage.tables import read_rows, write_table
from harness.study.manifest import map_digest
from harness.study.stored_run import StoredStack, load_run
from harness.world.map.scene_io import load_scene

EVIL = "<script>alert(1)"
# words of other events
NO_CONTACT = ("the food", "from here on", "it was still", "the robot needed help")
MOST_BYTES = 15_000_000  # of three stacks with 100 deliveries each and 20 recordings


def data_of(page):
    """What the page's scripts read."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    assert found
    data = json.loads(found[1])
    return data


def test_a_report_holds_the_figures_of_its_runs(write_run, record):
    folder = write_run(
        "one",
        stacks=("mine", "other"),
        episodes=30,
        map_sha256=map_digest(load_scene("sidewalk")),
    )
    record(folder, "mine", range(3))
    run = load_run(str(folder))
    data = shown(run, replays=2)
    assert [entry["label"] for entry in data["entries"]] == ["mine", "other"]
    assert len(data["deliveries"]["entry"]) == 60
    listed = data["deliveries"]
    profits = [
        value for value, entry in zip(listed["profit"], listed["entry"], strict=True) if entry == 0
    ]
    margin = data["headline"]["stacks"][0]["margin"]
    assert margin["lo"] < margin["v"] < margin["hi"]
    unseen = margin_with_unseen(run, run.stacks[0])
    assert (margin["lo"], margin["hi"]) == (unseen.low, unseen.high), "as on a screen"
    assert "unseen" not in data["headline"]["stacks"][0]
    first, second = (Side(run, stack) for stack in run.stacks)
    gap = data["comparisons"][0]["rows"][0]
    assert gap["metric"].startswith("Contribution margin")
    admitted = compare(first, second).unseen
    assert gap["difference"]["lo"] <= admitted.low and gap["difference"]["hi"] >= admitted.high
    assert np.mean(profits) == pytest.approx(margin["v"], abs=1e-3)
    assert data["profit"][0]["sum"][-1] == pytest.approx(sum(profits), abs=0.01)
    steps = data["waterfall"][0]
    assert steps["revenue"] - sum(cost for _, cost in steps["terms"]) == pytest.approx(
        steps["margin"]["v"], abs=1e-4
    )
    assert data["tables"]["columns"][2] == {"title": "Nav2 w/ GPS", "n": 100, "paper": True}
    assert len(data["tables"]["columns"]) == 2 + 8
    assert (data["comparisons"][0]["a"], data["comparisons"][0]["pairs"]) == ("mine", 30)
    assert len(data["scenery"]["sidewalk"]["obstacles"]) == len(load_scene("sidewalk").obstacles)
    assert data["basis"]["runs"][0]["seed"] == 0
    assert any(
        price["key"] == "delivery_fee" and price["source"] for price in data["basis"]["prices"]
    )
    assert (len(data["replays"]), len(data["trajectories"])) == (2, 3)
    assert "1 more recorded deliveries are not in this page" in data["basis"]["notes"][0]


def test_the_page_and_its_verdict_test_all_pairs_together(write_run):
    """Whoever looks at three stacks has three chances to find a difference."""
    late = {"b": 16, "c": 12}

    def change(row):
        row.update({key: 0 for key in row if key.endswith("_contacts")})
        row.update(outcome="sla", pedestrian_injury_usd=0.0, collision_delta_v_mps=0.0)
        if row["episode"] % 30 < late.get(row["stack"], 0) and row["episode"] % 2:
            row["outcome"] = "timeout"

    stacks = ("a", "b", "c")
    run = load_run(str(write_run("three", stacks, episodes=30, change=change, crowd=0.0)))
    sides = [Side(run, stack) for stack in run.stacks]
    comparisons = [compare(*pair, [MARGIN]) for pair in itertools.combinations(sides, 2)]
    family = together([each.differences[MARGIN].paired for each in comparisons])
    shown_rows = [each["rows"] for each in shown(run)["comparisons"]]
    for rows, pair, (first, second) in zip(
        shown_rows, family, itertools.combinations("abc", 2), strict=True
    ):
        (margin,) = (row for row in rows if row["metric"].startswith("Contribution margin"))
        assert bool(margin["better"]) == pair.is_significant, (first, second)
    alone = [each.differences[MARGIN].paired.is_significant for each in comparisons]
    assert alone == [True, True, False]
    assert [pair.is_significant for pair in family] == [True, False, False]
    means = {stack.name: Interval(3.0 - n, None, None, 30) for n, stack in enumerate(run.stacks)}
    told = rankings([(side.stack.name, side, means[side.stack.name]) for side in sides])
    assert told[0].startswith("a earned more than b")
    assert told[1].startswith("These deliveries cannot rank a and c")


@pytest.mark.slow
def test_a_replay_tells_why_in_the_words_of_explain(write_run, record, navbench):
    folder = write_run("one", episodes=6, crowd=1.0)
    record(folder, "mine", range(6))
    told = {each["episode"]: each["reasons"] for each in shown(folder)["replays"]}
    counts = []
    for episode in range(6):
        events = json.loads(navbench("explain", folder, episode, "--json")[1])["events"]
        counts.append(len(events))
        assert [
            (round(each["stamp_s"], 2), each["cost_usd"], each["words"]) for each in events
        ] == [(each["time"], each["cost"], each["words"]) for each in told[episode]]
    assert max(counts) > 1
    (folder / "recordings" / "mine-0-decisions.parquet").write_bytes(b"nothing")
    costly = next(number for number in range(1, 6) if counts[number])
    (folder / "recordings" / f"mine-{costly}-decisions.parquet").unlink()
    told = {each["episode"]: each["reasons"] for each in shown(folder)["replays"]}
    assert told[0] == told[costly] == []


def page_of(*runs, replays=20):
    """The page of runs, or of run folders."""
    loaded = [load_run(str(each)) if isinstance(each, Path) else each for each in runs]
    return report_page(loaded, replays, "2026-01-01")


def shown(*runs, replays=20):
    """What its scripts read."""
    return data_of(page_of(*runs, replays=replays))


@pytest.mark.slow
def test_the_costliest_recordings_are_carried(write_run, record):
    folder = write_run("one", episodes=30)
    record(folder, "mine", range(30))
    data = shown(folder, replays=3)
    worst = np.argsort(data["deliveries"]["profit"], kind="stable")[:3].tolist()
    assert sorted(worst) == [each["episode"] for each in data["replays"]]


def test_a_damaged_recording_is_named_and_the_others_are_carried(write_run, record):
    folder = write_run("one", episodes=6)
    record(folder, "mine", range(3))
    (folder / "recordings" / "mine-1.npz").write_bytes(b"no archive")
    data = shown(folder, replays=5)
    assert [each["episode"] for each in data["replays"]] == [0, 2]
    assert [episode for _, episode, _ in data["trajectories"]] == [0, 2]
    assert any("mine-1.npz: is damaged" in note for note in data["basis"]["notes"])


@pytest.mark.slow
def test_two_maps_of_one_name_are_told_apart_and_neither_is_drawn_for_the_other(write_run, record):
    digest, folders = map_digest(load_scene("sidewalk")), []
    for name, known in (("a", "0123456789abcdef"), ("b", digest)):
        folders.append(write_run(name, episodes=2, map_sha256=known))
        record(folders[-1], "mine", range(1))
    data = shown(*folders, replays=5)
    other, own = "sidewalk (0123456789ab)", f"sidewalk ({digest[:12]})"
    assert list(data["scenery"]) == [own]
    assert [each["map"] for each in data["replays"]] == [other, own]
    assert [mission[2] for mission in data["missions"]] == [other] * 2 + [own] * 2
    (note,) = data["basis"]["notes"]
    assert "the map of a is not drawn: map 'sidewalk' has changed since the run" in note


def test_a_map_that_one_of_two_runs_still_finds_is_drawn_for_both(write_run, rename_map):
    digest = map_digest(load_scene("sidewalk"))
    folders = [write_run(name, episodes=2, map_sha256=digest) for name in ("a", "b")]
    rename_map(folders[0], "/nowhere/sidewalk.yaml")
    data = shown(*folders, replays=0)
    assert (list(data["scenery"]), data["basis"]["notes"]) == (["sidewalk"], [])
    assert {mission[2] for mission in data["missions"]} == {"sidewalk"}


def test_recorded_people_are_told_by_their_recording_and_not_by_a_number(write_run):
    folder = write_run("one", episodes=2)
    world, manifest = folder / "params" / "world.yaml", folder / "run.json"
    told = [shown(folder)["basis"]["runs"][0]["people"]]
    text, replayed = (
        world.read_text(encoding="utf-8"),
        "replay: {file: people.csv}\n  model: replay",
    )
    world.write_text(text.replace("model: random_walk", replayed), encoding="utf-8")
    about = json.loads(manifest.read_text(encoding="utf-8"))
    for asked in (None, "/data/plaza.csv"):
        manifest.write_text(json.dumps({**about, "people": asked}), encoding="utf-8")
        told.append(shown(folder)["basis"]["runs"][0]["people"])
    assert told == ["20 (random_walk)", "replayed from people.csv", "replayed from plaza.csv"]


def test_a_run_that_is_given_by_two_ways_is_one_run_with_all_its_stacks(write_run, tmp_path):
    folder = write_run("one", stacks=("mine", "other"), episodes=3)
    (tmp_path / "link").symlink_to(folder)
    runs = [load_run(f"{folder}:mine"), load_run(f"{tmp_path / 'link'}:other")]
    (run,) = shown(*runs)["basis"]["runs"]
    assert run["deliveries"] == {"mine": 3, "other": 3}


def test_a_delivery_that_touched_anything_is_listed_as_such(write_run):
    # as after a counted contact with something that has no price
    def forget(row):
        things = (
            name for name in row if name.endswith("_contacts") and name != "pedestrian_contacts"
        )
        row |= dict.fromkeys(things, 0)

    folder = write_run("one", episodes=40, change=forget)
    run = load_run(str(folder))
    touching = {event["episode"] for event in run.events}
    people = {event["episode"] for event in run.events if event["kind"] == "pedestrian"}
    assert 0 < len(people) < len(touching) < 40
    assert shown(folder)["deliveries"]["touched"] == [number in touching for number in range(40)]


def test_an_event_and_its_contact_have_one_time(write_run, record):
    folder = write_run("one", episodes=6, crowd=1.0)
    record(folder, "mine", range(6))
    events = read_rows(folder / "events.parquet", EVENT_COLUMNS)
    write_table(
        folder / "events.parquet",
        EVENT_COLUMNS,
        [{**e, "stamp_s": e["stamp_s"] + 0.0167} for e in events],
    )
    shared = 0
    for each in shown(folder)["replays"]:
        stamps = {hit[2] for hit in each["contacts"] if hit[5] > 0}
        told = {
            why["time"]
            for why in each["reasons"]
            if not why["words"].split(": ")[1].startswith(NO_CONTACT)
        }
        assert told == stamps
        shared += len(told)
    assert shared > 0


def test_who_pays_is_what_price_says(write_run):
    run = load_run(str(write_run("one", stacks=("a", "b"), episodes=12)))
    expected = reprice(run, choose(run, None, {}, ()))
    told = shown(run, replays=0)["accountings"]
    assert sum("the published rule forgives" in note for note in told["notes"]) == len(run.stacks)
    assert [row["title"] for row in told["rows"]] == [TITLES[name] for name in SHOWN]
    for number, name in enumerate(SHOWN):
        margins = [
            each.accountings[name].intervals["contribution_margin"].as_json() for each in expected
        ]
        assert told["rows"][number]["cells"] == margins, name


def test_where_nobody_was_touched_the_page_does_not_ask_who_pays(write_run):
    assert shown(write_run("one", episodes=5, crowd=0.0))["accountings"] is None


def test_the_same_stack_of_two_runs_has_two_names(write_run):
    runs = [load_run(str(write_run(name, episodes=5))) for name in ("before", "after")]
    assert [each["label"] for each in shown(*runs)["entries"]] == [
        "before:mine",
        "after:mine",
    ]


def test_texts_of_runs_stay_texts(write_run, record, rename_map):
    folder = write_run("evil", stacks=(EVIL,), episodes=4)
    record(folder, EVIL, range(2))
    rename_map(folder, EVIL)
    page = page_of(folder)
    assert EVIL not in page
    assert page.count("<script") == 4  # data, two recordings, program
    data = data_of(page)
    assert data["entries"][0]["label"] == data["basis"]["runs"][0]["map"] == EVIL
    assert "<title>&lt;script&gt;alert(1) – navbench</title>" in page


def test_embedded_json_cannot_end_its_element():
    text = embedded({"a": "</script><!--&\u2028"})
    assert not set("<>&\u2028") & set(text)
    assert json.loads(text) == {"a": "</script><!--&\u2028"}


def test_a_page_asks_nobody_for_anything(write_run):
    page = page_of(write_run("one", episodes=3))
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', page)
    assert policy and policy[1].startswith("default-src 'none'; img-src data:;")
    assert set(re.findall(r"https?://[^\s'\"]+", page)) <= {"http://www.w3.org/2000/svg"}
    assert not re.search(r"\.innerHTML|document\.write|\beval\(|new Function", page)


@pytest.mark.slow
def test_a_large_report_is_small_enough(write_run, record):
    def long(row):
        row["duration_s"] = 120.0

    folder = write_run("large", stacks=("a", "b", "c"), episodes=100, change=long)
    for stack, count in (("a", 7), ("b", 7), ("c", 6)):
        record(folder, stack, range(count), beams=360, people=20)
    page = page_of(folder)
    assert len(data_of(page)["replays"]) == 20
    assert len(page.encode()) < MOST_BYTES


def test_without_cargo_the_money_is_undefined_and_the_page_says_so(write_run):
    def arrive(row):
        row |= {"outcome": "arrived", "pieces_lost": None, "pieces_at_start": None}

    data = shown(write_run("bare", episodes=5, change=arrive))
    assert data["headline"]["stacks"][0]["margin"]["v"] is None
    assert (data["profit"], data["breakEven"]) == ([], [])
    assert {each["why"] for each in data["noBreakEven"]} == {"the cargo was not simulated"}
    assert data["outcomes"][0]["shares"]["arrived"] == 1.0
    assert data["deliveries"]["profit"] == [None] * 5


def test_a_margin_that_is_not_told_has_no_profit_and_no_break_even(write_run):
    def fail(row):
        if row["episode"] == 3:
            row["error"] = "world: gone"

    data = shown(write_run("failed", episodes=30, change=fail))
    assert data["headline"]["stacks"][0]["margin"]["v"] is None
    assert (data["profit"], data["breakEven"]) == ([], [])
    assert {each["why"] for each in data["noBreakEven"]} == {"too many deliveries have no result"}


def test_profit_is_summed_in_order_within_a_band_of_what_chance_allows():
    curve = profit_curve(np.array([2.0, -1.0, 4.0]), np.arange(3), 0)
    assert (curve["k"], curve["sum"]) == ([1.0, 2.0, 3.0], [2.0, 1.0, 5.0])
    assert curve["low"][-1] >= -3.0 and curve["high"][-1] <= 12.0


def test_no_band_is_claimed_from_one_mission_or_from_missions_that_are_alike():
    for margin, clusters, sums in (
        (np.full(4, 2.5), np.array([0, 0, 1, 1]), [5.0, 10.0]),
        (np.array([-3.0]), np.array([0]), [-3.0]),
    ):
        curve = profit_curve(margin, clusters, 0)
        assert (curve["sum"], curve["low"], curve["high"]) == (sums, None, None)


def test_a_margin_that_is_not_positive_never_breaks_even():
    found = break_even_histogram(np.array([-1.0, 0.0, 1.0, 2.0]), 1000.0)
    assert found["never"] == 0.5
    assert sum(found["shares"]) == pytest.approx(0.5)
    assert found["edges"][0] == pytest.approx(500.0, rel=0.01) and found["edges"][
        -1
    ] == pytest.approx(1000.0, rel=0.01)
    assert break_even_histogram(np.array([-1.0]), 1.0) == {"edges": [], "shares": [], "never": 1.0}


def test_the_command_writes_a_page_and_refuses_what_it_cannot(write_run, tmp_path, navbench):
    folder, page = write_run("one", episodes=3), tmp_path / "r.html"
    (tmp_path / "d.html").mkdir()
    for (run, file), status, said in (
        ((folder, page), 0, "r.html: "),
        ((folder, tmp_path / "r.pdf"), 1, "give a name that ends with .html"),
        ((folder, tmp_path / "no" / "r.html"), 1, "its folder does not exist"),
        ((folder, tmp_path / "d.html"), 1, "it is a folder; give a file"),
        ((tmp_path, page), 1, "holds no run"),
    ):
        code, out, err = navbench("report", run, "--again", 0, "--out", file)
        lines = 1 if status else 3  # who drove where, the page, the next command
        assert (code, said in out + err, (out + err).count("\n")) == (status, True, lines)
    assert page.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")


def test_a_stack_of_errors_only_is_named(write_run):
    run = load_run(str(write_run("one", episodes=3)))
    broken = StoredStack("broken", run.stacks[0].carries, run.stacks[0].localizer, 3, ())
    changed = dataclasses.replace(run, stacks=(*run.stacks, broken))
    assert (
        "one: broken is left out: all 3 deliveries of it ended in an error"
        in shown(changed)["basis"]["notes"]
    )


def test_what_a_run_has_not_driven_is_said(write_run):
    run = load_run(str(write_run("one", stacks=("some", "none"), episodes=3)))
    some, none = (
        dataclasses.replace(each, rows=each.rows[:kept])
        for each, kept in zip(run.stacks, (2, 0), strict=True)
    )
    changed = dataclasses.replace(run, stacks=(some, none))
    assert shown(changed)["basis"]["notes"][-2:] == [
        "one: some has driven 2 of its 3 deliveries; --resume of the run goes on",
        "one: none is left out: it has driven nothing yet; --resume of the run goes on",
    ]


def test_nothing_is_told_of_breaking_even_where_all_earned_the_same(write_run):
    def alike(row):
        row |= {"outcome": "sla", "distance_m": 50.0, "motion_energy_wh": 1.0}

    quiet, lively = (
        write_run("quiet", episodes=9, crowd=0.0, change=alike),
        write_run("lively", episodes=9),
    )
    assert [break_even(entries_of([load_run(str(each))])) != [] for each in (quiet, lively)] == [
        False,
        True,
    ]


def test_texts_that_utf_8_does_not_have_do_no_harm(write_run, navbench, tmp_path):
    folder = write_run("one", episodes=2)
    about = json.loads((folder / "run.json").read_text())
    (folder / "run.json").write_text(json.dumps({**about, "command": ["navbench", "\ud800"]}))
    (folder / "params" / "rules.yaml").write_text("1: a\n2026-01-01: b\nc: d\n")
    assert navbench("report", folder, "--out", tmp_path / "r.html")[0] == 0
    run = data_of((tmp_path / "r.html").read_text(encoding="utf-8"))["basis"]["runs"][0]
    assert "?" in run["command"] and len(run["rules version"]) == 12
