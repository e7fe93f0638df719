"""``navbench check --estimator meetings``: what it prints, and where it cannot be."""

import contextlib
import dataclasses
import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from harness.analysis.meetings_check import MeetingsChecked
from harness.meetings import crowd, estimate, looks
from harness.meetings.kept import FILE
from harness.meetings.mission import MissionTask
from harness.report.short.meetings import meetings_markdown, quantity_text, short_meetings
from harness.statistics.interval import Interval
from harness.storage.shipped import shipped
from harness.study.places import Where
from navbench.api.check import check
from navstack.errors import InputError
from tests.rules import short_rules

STOCK = (shipped("params") / "nav2" / "stock.yaml").read_text(encoding="utf-8")


Driven = Callable[[], contextlib.AbstractContextManager[None]]


@pytest.fixture(scope="module")
def words(tmp_path_factory: pytest.TempPathFactory, hall: Path) -> list[str]:
    """Two files, and options of deliveries of two seconds."""
    folder = tmp_path_factory.mktemp("files")
    (folder / "short.yaml").write_text(short_rules(2.0))
    (folder / "old.yaml").write_text(STOCK)
    (folder / "new.yaml").write_text(STOCK.replace("max_vel_x: ", "max_vel_x: 0.2  # was "))
    files = [str(folder / name) for name in ("old.yaml", "new.yaml")]
    conditions = ["--rules", str(folder / "short.yaml"), "--map", str(hall), "--workers", "1"]
    return [*files, *conditions, "--estimator", "meetings"]


@pytest.fixture(scope="module")
def short_meetings_only(driven_in_process: Driven) -> Iterator[None]:
    """One or two meetings of a mission, from short records, driven in this process."""
    with pytest.MonkeyPatch.context() as patch, driven_in_process():
        patch.setattr(crowd, "LONG", 130.0)
        patch.setattr(estimate, "NUMBER", 1)
        patch.setattr(looks, "NUMBERS", (4, 8))
        yield


@pytest.fixture(scope="module")
def checked(
    words: list[str], short_meetings_only: None, tmp_path_factory: pytest.TempPathFactory
) -> MeetingsChecked:
    """A check of eight missions, after which it is decided."""
    old, new, *rest = words
    options = dict(zip(rest[::2], rest[1::2], strict=True))
    found = check(
        old,
        new,
        estimator="meetings",
        within=95.0,
        out=tmp_path_factory.mktemp("runs") / "run",
        rules=options["--rules"],
        map=options["--map"],
        where=Where(workers=1),
    )
    assert isinstance(found, MeetingsChecked)
    return found


def test_the_method_and_what_it_cannot_see_are_told(checked: MeetingsChecked) -> None:
    document = checked.as_json()
    assert (document["estimator"], document["verdict"]) == ("meetings", "alike")
    assert document["margin_difference"]["n"] == 8 and len(document["not_seen"]) == 3
    assert document["meetings"] == sum(each["driven"] for each in document["strata"])
    assert document["old"]["contacts_per_1000_km"]["n"] == 8
    lines = [block.text for block in short_meetings(checked)]
    assert len(lines) <= 25
    assert "world paper_loose_bucket" in lines[0]
    assert lines[1].startswith("alike within 95 USD a delivery: NEW less OLD is")
    assert any(line.startswith("estimator meetings: ") for line in lines)
    about = checked.folder / "run.json"
    typed = ["navbench", "check", "old.yaml", "new.yaml", "--out", "a", "--map", "my.yaml"]
    stored = about.read_text()
    command = [*typed, "--estimator=meetings"]
    about.write_text(json.dumps({**json.loads(stored), "command": command}))
    next_command = short_meetings(checked)[-1].text
    about.write_text(stored)
    assert (
        next_command
        == "next: navbench check old.yaml new.yaml --map my.yaml --estimator deliveries"
    )


def test_screen_and_comment_tell_what_ended_in_an_error(checked: MeetingsChecked) -> None:
    failed, told = dataclasses.replace(checked, errors=3), "3 missions left out, which ended in an"
    assert any(told in block.text for block in short_meetings(failed))
    assert told in meetings_markdown(failed) and told not in meetings_markdown(checked)


def test_a_quantity_without_bounds_ends_with_its_number() -> None:
    assert quantity_text(Interval(3.49, None, None, 1), 2) == "3.49"
    assert quantity_text(Interval(3.49, 3.0, 3.49, 9), 2) == "3.49 [3.00, 3.49]"
    assert quantity_text(Interval(None, None, None, 0), 2) == ""


def test_the_missions_that_differ_most_are_told(checked: MeetingsChecked) -> None:
    assert checked.result is not None
    margins = np.zeros((8, 2))
    margins[:, 1] = (0.0, -9.0, 2.0, 0.001, -3.0, 0.0, 0.0, 0.0)
    hits = np.tile((0.0, 0.25), (8, 1))
    result = dataclasses.replace(
        checked.result, episodes=tuple(range(10, 18)), margins=margins, hits=hits
    )
    told = dataclasses.replace(checked, result=result)
    assert [each["episode"] for each in told.as_json()["missions"]] == [11, 14, 12]
    lines = [block.text for block in short_meetings(told)]
    assert "  11: -9.00 USD; a delivery of OLD hits 0.00 people, of NEW 0.25" in lines
    row = ("11", "-9.00", "0.00", "0.25")
    cells = [line.strip("| ").split("|") for line in meetings_markdown(told).splitlines()]
    assert row in [tuple(cell.strip() for cell in line) for line in cells]


@pytest.mark.parametrize(
    ("more", "estimator", "said"),
    [
        ((), "meetings", ""),
        (("--world", "easy"), "deliveries", "note: by whole deliveries: the people of this world"),
    ],
)
def test_without_being_asked_it_goes_by_meetings_where_they_can_be_driven(
    navbench,
    words: list[str],
    short_meetings_only: None,
    tmp_path: Path,
    more: tuple[str, ...],
    estimator: str,
    said: str,
) -> None:
    options = ("--out", tmp_path / "run", "--budget", "0.01s", "--json")
    status, text, err = navbench("check", *words[:-2], *more, *options)
    assert status == 0 and said in err and ("by whole" in err) == bool(said)
    assert json.loads(text)["estimator"] == estimator


def test_a_first_side_that_plans_nothing_drives_whole_deliveries(
    navbench, words: list[str], short_meetings_only: None, tmp_path: Path
) -> None:
    options = ("--out", tmp_path / "run", "--budget", "0.01s", "--json")
    status, text, err = navbench("check", "parked", *words[1:-2], *options)
    assert status == 0 and "'old' plans no way along which people could be met" in err
    assert json.loads(text)["estimator"] == "deliveries"


def test_where_people_make_way_meetings_are_for_who_asks_for_them(
    navbench, words: list[str], short_meetings_only: None, tmp_path: Path
) -> None:
    world = tmp_path / "world.yaml"
    world.write_text("people: {model: social_force, beginning: stationary}\n")
    options = ("--world", world, "--out", tmp_path / "run", "--budget", "0.01s", "--json")
    status, text, err = navbench("check", *words[:-2], *options)
    assert status == 0 and "note: by whole deliveries: of people who make way" in err
    assert json.loads(text)["estimator"] == "deliveries"


@pytest.mark.slow
def test_a_check_that_was_cut_off_goes_on_to_the_same(
    navbench, checked: MeetingsChecked, tmp_path: Path
) -> None:
    run, comment = tmp_path / "run", tmp_path / "comment.md"
    shutil.copytree(checked.folder, run)
    missions = run / FILE
    missions.write_bytes(missions.read_bytes()[:-9])
    options = ("--workers", "1", "--json", "--markdown", comment)
    status, text, said = navbench("check", "--resume", run, *options)
    assert status == 0 and "going on after 7 missions" in said
    document = checked.as_json()
    assert json.loads(text) == {**document, "folder": str(run)}
    assert missions.read_bytes() == (checked.folder / FILE).read_bytes()
    commented = comment.read_text(encoding="utf-8")
    assert "**alike within 95 USD a delivery**: NEW less OLD is" in commented
    assert "Margin ($/delivery)" in commented and "not seen: " in commented


def test_the_budget_ends_it_and_the_next_command_goes_on(
    navbench, words: list[str], short_meetings_only: None, tmp_path: Path
) -> None:
    out = tmp_path / "run"
    status, text, _ = navbench("check", *words, "--out", out, "--budget", "0.01s")
    assert status == 0 and "not decided: no mission is finished" in text
    assert text.splitlines()[-1] == f"next: navbench check --resume {out} --budget 30m"


def fail(task: MissionTask) -> None:
    """In place of what drives a mission."""
    raise InputError("there is no way")


def test_what_fails_on_every_mission_is_not_tried_for_long(
    navbench,
    words: list[str],
    short_meetings_only: None,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(estimate, "drive_mission", fail)
    given = ("check", *words, "--out", tmp_path / "run")
    for command, number in ((given, 5), (("check", "--resume", tmp_path / "run"), 6)):
        status, _, said = navbench(*command)
        told = f"all {number} missions ended in an error, the last one in '"
        assert status == 1 and told in said
        assert said.endswith("there is no way'; --estimator deliveries drives them whole\n")


def test_missions_are_drawn_in_batches_however_a_check_goes_on() -> None:
    assert [estimate.batch_of(each) for each in (0, 3, 4, 7, 8, 15, 16)] == [
        *[(0, 4)] * 2,
        *[(4, 8)] * 2,
        *[(8, 16)] * 2,
        (16, 32),
    ]


@pytest.mark.parametrize(
    ("more", "status", "told"),
    [
        (("--world", "social_force"), 1, "stationary"),
        (("--people", "people.csv"), 1, "are a recording"),
        (("--world", "easy"), 1, "stationary"),
        (("--pedestrians", "0"), 1, "nobody to meet"),
        (("--world", "plain.yaml"), 1, "does not model the cargo"),
        (("--within", "101"), 1, "--within"),
        (("--markdown", "comment.txt"), 1, ".md"),
    ],
)
def test_where_it_cannot_be_it_is_one_line(
    navbench,
    words: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    more: tuple[str, ...],
    status: int,
    told: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("plain.yaml").write_text("cargo: {pieces: 0}\npeople: {beginning: stationary}\n")
    Path("people.csv").write_text("id,t,x,y\n1,0,0,0\n1,9,1,0\n")
    found, out, err = navbench("check", *words, *more)
    assert (found, out) == (status, "") and told in err
