"""``navbench check``: verdicts on finished runs, and on deliveries of a few seconds."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest

import navbench
from harness.analysis import check as analysis
from harness.analysis.check import Looks, missions_that_decide, reach_at, verdict_of
from harness.economics.prices import load_prices
from harness.statistics.betting import bound_at_every_look
from harness.statistics.interval import Interval
from harness.storage.new_run import ABLATION, CHECK
from harness.storage.run_folder import JOURNAL
from harness.storage.shipped import shipped
from harness.study.places import Where
from navbench.api import check as api
from navstack.errors import InputError
from tests.rules import short_rules

RULES = short_rules(2.0)
STOCK = (shipped("params") / "nav2" / "stock.yaml").read_text(encoding="utf-8")


def injured(usd: float):
    """Change a row so that its margin falls."""

    def change(row):
        row["pedestrian_injury_usd"] += usd

    return change


@pytest.mark.parametrize(
    ("bound", "verdict"),
    [
        ((-9.0, -0.1), "worse"),
        ((0.1, 9.0), "better"),
        ((-0.9, 0.8), "alike"),
        ((-0.9, -0.2), "alike"),
        ((-1.1, 0.5), "undecided"),
        ((None, None), "undecided"),
    ],
)
def test_the_bound_alone_decides(bound: tuple[float | None, float | None], verdict: str) -> None:
    assert verdict_of(Interval(0.0, *bound, 9), 1.0) == verdict


def test_a_look_that_decides_ends_the_check() -> None:
    looks = Looks(1.0)
    for _ in range(200):
        looks.add(-40.0)
    decided = looks.missions
    assert looks.is_decided and decided < 20
    for _ in range(200):
        looks.add(90.0)
    assert looks.missions == decided and looks.bound.high < 0.0


def test_losses_count_as_far_as_hits_cost() -> None:
    """One mission in twenty costs a dear hit, and the others earn a little more."""
    prices = load_prices("robot_crash_tests")
    reach = reach_at(prices)
    assert reach_at(load_prices()) == pytest.approx(100.0, rel=0.01) and reach > 10_000.0
    differences = np.where(np.arange(400) % 20 == 0, -4000.0, 15.0)
    assert differences.mean() < 0.0 < np.clip(differences, -100.0, 100.0).mean()
    assert verdict_of(bound_at_every_look(differences, 100.0), 1.0) == "better"
    assert verdict_of(bound_at_every_look(differences, reach), 1.0) != "better"
    looks = Looks(1.0, reach)
    for each in differences.tolist():
        looks.add(each)
    assert verdict_of(looks.bound, 1.0) != "better"


def test_the_missions_that_would_decide_do() -> None:
    differences = np.random.default_rng(3).choice([-58.0, 0.0, 0.0, 0.0, 46.0], 100)
    more = missions_that_decide(differences, 1.0)
    times = 1.0 + more / differences.size
    assert verdict_of(bound_at_every_look(differences, 100.0, times), 1.0) == "worse"
    assert verdict_of(bound_at_every_look(differences, 100.0, 0.9 * times), 1.0) == "undecided"


def test_missions_beyond_the_last_doubling_decide_too() -> None:
    differences = np.array([30.0, -28.3] * 10)
    more = missions_that_decide(differences, 0.5)
    assert more is not None and 512 < 1.0 + more / differences.size <= 1000


def test_finished_runs_get_a_verdict_a_document_and_three_replays(write_run, navbench) -> None:
    old = write_run("before")
    new = write_run("after", change=injured(60.0))
    status, text, _ = navbench("check", old, new, "--json")
    document = json.loads(text)
    assert (status, document["verdict"], document["more_needed"]) == (0, "worse", None)
    difference = document["margin_difference"]
    assert difference["n"] == 40 and difference["value"] == pytest.approx(-60.0)
    assert difference["low"] < -60.0 < difference["high"] < 0.0
    assert [len(each["new"]["replay"]) for each in document["missions"]] == [4, 4, 4]
    assert document["missions"][0]["new"]["replay"][2] == f"{new}:mine"

    status, text, _ = navbench("check", new, old, "--fail-if", "worse")
    lines = text.splitlines()
    assert status == 0 and lines[1].startswith("better: NEW less OLD is +60.00 [")
    assert lines[0].startswith(f"NEW {old} against OLD {new}") and len(lines) <= 25
    assert "in time, intact after" in text and "sla" not in text


def test_a_run_against_itself_is_alike(write_run, navbench) -> None:
    run = write_run("before", ["a", "b"])
    for words in ((f"{run}:a", f"{run}:a"), (f"{run}:a", f"{run}/../before:a")):
        status, text, _ = navbench("check", *words)
        assert status == 0 and "alike: both drive by the same parameters" in text
    _, text, _ = navbench("check", f"{run}:a", f"{run}:b")
    assert "alike: both" not in text


def test_what_the_sides_do_not_share_is_told_of_both(write_run, navbench) -> None:
    old, new = write_run("a", localizer="gps"), write_run("b", localizer="amcl", pedestrians=7)
    first, *_ = navbench("check", old, new)[1].splitlines()
    assert "localizer gps (OLD) and amcl (NEW); world easy" in first
    assert "people 20 (" in first and "people 7 (" in first


def test_a_changed_folder_is_offered_no_option_that_its_command_lacks(write_run, navbench) -> None:
    run = write_run("before", episodes=2)
    (run / "params" / ABLATION).write_text("a: 1\n")
    (run / "params" / "world.yaml").write_text("count: 1\n")
    status, _, err = navbench("ablate", "--resume", run)
    assert status == 1 and "restore it, or begin anew" in err and "--force" not in err


@pytest.mark.parametrize("mark", [ABLATION, CHECK])
def test_only_the_folder_of_a_check_is_gone_on_with(write_run, navbench, mark: str) -> None:
    run = write_run("be fore", ["old", "new"])
    (run / "params" / mark).write_text("a: 1\n")
    *_, last = navbench("check", f"{run}:old", f"{run}:new")[1].splitlines()
    command = ["compare", f"{run}:old", f"{run}:new"]
    if mark == CHECK:
        command = ["check", "--resume", str(run), "--budget", "30m"]
    assert shlex.split(last.removeprefix("next: ")) == ["navbench", *command]


def test_a_check_by_meetings_is_no_run_and_its_stacks_are_compared(write_run, navbench) -> None:
    folder = write_run("run", episodes=2)
    (folder / "params" / "check.yaml").touch()
    (folder / "missions.jsonl").touch()
    for table in folder.glob("*.parquet"):
        table.unlink()
    status, _, said = navbench("price", folder)
    assert status == 1 and "a check by meetings, without a table of deliveries" in said
    assert said.rstrip().endswith(
        f"compare {folder}:STACK {folder}:STACK compares two of its stacks"
    )


def test_the_localizer_is_that_of_both_sides() -> None:
    both = api.study_of("nav2-stock", "nav2-gps", Where(workers=1), localizer="gps-ekf")
    assert [stack.localizer for stack in both.stacks] == ["gps-ekf", "gps-ekf"]


def test_a_worse_one_fails_where_asked_to_and_leaves_a_comment(
    write_run,
    navbench,
    tmp_path: Path,
) -> None:
    comment = tmp_path / "comment.md"
    words = ("check", write_run("before"), write_run("a`b|c", change=injured(60.0)))
    status, _, _ = navbench(*words, "--fail-if", "worse", "--markdown", comment)
    text = comment.read_text()
    assert status == 4 and "**worse**: NEW less OLD is -60.00" in text
    assert text.count("navbench replay") == 3 and "a`b" not in text


def test_screen_and_comment_tell_what_ended_in_an_error(write_run, navbench, tmp_path) -> None:
    def fail(row):
        if row["episode"] in (2, 7):
            row["error"] = "world: gone"

    runs, comment = (write_run("a"), write_run("b", change=fail)), tmp_path / "comment.md"
    status, screen, _ = navbench("check", *runs, "--markdown", comment)
    told = "2 deliveries ended in an error; such missions are left out"
    assert status == 3 and told in screen and told in comment.read_text()


def test_runs_that_say_little_are_not_decided_and_say_how_many_more_would(
    write_run, navbench
) -> None:
    status, text, _ = navbench(
        "check", write_run("a"), write_run("b", change=injured(1.5)), "--json"
    )
    document = json.loads(text)
    assert (status, document["verdict"]) == (0, "undecided")
    assert 100 < document["more_needed"] < 1000


@pytest.mark.parametrize(
    ("words", "status", "told"),
    [
        (("nav2-stock", "nav2-gsp"), 1, "did you mean 'nav2-gps'"),
        (("nav2-stock", "no/such.yaml"), 1, "no/such.yaml"),
        (("nav2-stock", "nav2-gps", "--within", "-1"), 1, "--within"),
        (("nav2-stock", "nav2-gps", "--localizer", "gsp"), 1, "did you mean 'gps'"),
        (("nav2-stock", "nav2-gps", "--budget", "soon"), 1, "--budget 'soon' is no duration"),
        (("nav2-stock", "nav2-gps", "--markdown", "comment.txt"), 1, ".md"),
        (("nav2-stock",), 2, "Missing argument"),
        (("nav2-stock", "nav2-gps", "--fail-if", "slower"), 1, "worse"),
        (("nav2-stock", "{run}"), 1, "give two Nav2 files or stacks, or two run folders"),
        (("{run}", "{run}", "--seed", "3"), 1, "leave out --seed"),
        (("{run}", "{run}", "--budget", "10m"), 1, "leave out --budget"),
        (("{run}", "{run}", "--workers", "0"), 1, "leave out --workers"),
        (("{run}", "{run}", "--markdown", "{run}/no/comment.md"), 1, "no/comment.md"),
        (("--resume", "{run}", "nav2-gps"), 1, "leave out OLD"),
        (("--resume", "{run}"), 1, "is no check"),
        (("--resume", "{run}/nowhere"), 1, "holds no run"),
    ],
)
def test_what_cannot_be_checked_is_one_line(
    write_run,
    navbench,
    words: tuple[str, ...],
    status: int,
    told: str,
) -> None:
    run = str(write_run("finished", episodes=2))
    found, out, err = navbench("check", *(word.format(run=run) for word in words))
    assert (found, out) == (status, "")
    assert told in err and err.count("\n") == 1


def test_a_program_asks_by_the_same_names(write_run) -> None:
    found = navbench.check(str(write_run("a")), str(write_run("b", change=injured(60.0))))
    assert (found.verdict, found.is_interrupted, found.has_errors) == ("worse", False, False)
    assert found.as_json()["within_usd"] == 1.0


@pytest.mark.parametrize(
    ("useless", "told"),
    [({"seed": 3, "pedestrians": 2}, "seed, pedestrians"), ({"out": Path("new")}, "out")],
)
def test_a_program_asks_nothing_of_finished_runs_that_they_cannot_tell(
    write_run, useless: dict[str, object], told: str
) -> None:
    runs = [str(write_run(name)) for name in ("a", "b")]
    with pytest.raises(InputError, match=f"not driven again; leave out {told}$"):
        navbench.check(*runs, **useless)


@pytest.fixture
def short(tmp_path: Path, hall: Path, in_process: None) -> list[str]:
    """Options of deliveries of two seconds, and files that differ in one value."""
    (tmp_path / "short.yaml").write_text(RULES)
    (tmp_path / "old.yaml").write_text(STOCK)
    (tmp_path / "new.yaml").write_text(STOCK.replace("max_vel_x: ", "max_vel_x: 0.2  # was "))
    conditions = ["--rules", str(tmp_path / "short.yaml"), "--map", str(hall)]
    return [*conditions, "--pedestrians", "2", "--workers", "1"]


def in_folder(text: str, folder: Path, other: Path) -> object:
    """A document as it would be of another run folder."""
    return json.loads(text.replace(str(folder), str(other)))


@pytest.mark.slow
def test_an_interrupt_prints_the_bound_so_far_and_the_check_goes_on(
    tmp_path: Path,
    navbench,
    short: list[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stop_after = 2

    def interrupted(looks: Looks, difference: float) -> None:
        original(looks, difference)
        if looks.missions == stop_after:
            raise KeyboardInterrupt

    original = api.Looks.add
    monkeypatch.setattr(api.Looks, "add", interrupted)
    out, files = tmp_path / "out", [tmp_path / "old.yaml", tmp_path / "new.yaml"]
    # [USD]: 4 missions that hardly differ
    words = ["check", *files, *short, "--within", "80", "--estimator", "deliveries"]
    status, text, said = navbench(*words, "--out", out, "--fail-if", "worse")
    assert status == 130 and "interrupted after 2 missions" in said
    assert text.splitlines()[0].startswith(f"NEW {files[1]} against OLD {files[0]}, robot ")
    assert "over 2 missions; fewer than 6 missions decide nothing" in text
    assert (out / JOURNAL).is_file()

    stop_after = 3
    status, text, said = navbench("check", "--resume", out, "--workers", "1", "--json")
    document = json.loads(text)
    assert status == 130 and "going on after 2 missions" in said
    assert (document["verdict"], document["margin_difference"]["n"]) == ("undecided", 3)
    assert document["old"]["given"] == str(files[0]) and document["new"]["stack"] == "new"
    status, _, said = navbench("run", "--resume", out)
    assert status == 1 and f"go on with navbench check --resume {out}" in said
    status, _, said = navbench(*words, "--out", out)
    assert status == 1 and f"--resume {out}" in said

    monkeypatch.setattr(api.Looks, "add", original)
    status, text, said = navbench("check", "--resume", out, "--workers", "1", "--json")
    assert status == 0 and "going on after 3 missions" in said
    assert navbench("verify", out, "--sample", "0")[0] == 0
    whole = navbench(*words, "--out", tmp_path / "whole", "--json")
    assert (whole[0], json.loads(whole[1])) == (0, in_folder(text, out, tmp_path / "whole"))
    assert json.loads(text)["verdict"] == "alike"


@pytest.mark.slow
def test_missions_after_the_last_look_wait_for_the_next(
    tmp_path: Path, navbench, short: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """So a longer budget ends in the same numbers, however soon a shorter one was over."""

    def interrupted(looks: Looks, difference: float) -> None:
        original(looks, difference)
        if looks.missions == 3:
            raise KeyboardInterrupt

    original = api.Looks.add
    monkeypatch.setattr(api.Looks, "add", interrupted)
    monkeypatch.setattr(analysis, "LOOKS", 1)  # after 1, 2, 4 missions
    files = [tmp_path / "old.yaml", tmp_path / "new.yaml"]
    words = ["check", *files, *short, "--estimator", "deliveries", "--out", tmp_path / "out"]
    status, text, said = navbench(*words, "--within", "80", "--json")
    assert status == 130 and "interrupted after 3 missions" in said
    assert json.loads(text)["margin_difference"]["n"] == 2


@pytest.mark.slow
def test_the_budget_ends_a_check_with_what_is_finished(
    tmp_path: Path,
    navbench,
    short: list[str],
) -> None:
    files = [tmp_path / "old.yaml", tmp_path / "new.yaml"]
    words = ("check", *files, *short, "--out", tmp_path / "out", "--estimator", "deliveries")
    words = (*words, "--budget", "0.01s")
    status, text, _ = navbench(*words)
    assert status == 0 and "not decided: no mission is finished" in text
    assert text.splitlines()[-1].startswith("next: navbench check --resume")


@pytest.mark.parametrize("estimator", ["deliveries", "meetings"])
def test_files_that_say_the_same_are_alike_without_a_delivery(
    tmp_path: Path, navbench, short: list[str], estimator: str
) -> None:
    (tmp_path / "new.yaml").write_text(f"# a comment\n{STOCK}")
    files = [tmp_path / "old.yaml", tmp_path / "new.yaml"]
    options = ("--estimator", estimator, "--out", tmp_path / "out", "--json")
    status, text, _ = navbench("check", *files, *short, *options)
    document = json.loads(text)
    assert (status, document["verdict"], document["margin_difference"]["n"]) == (0, "alike", 0)
    assert document["estimator"] == estimator
    assert not (tmp_path / "out").exists()
