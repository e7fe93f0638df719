"""A suite is its cells, each a run of its own; cut off, it goes on."""

import json
import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pytest

from harness.episode.files import rules_of
from harness.storage.checksums import write_checksums
from harness.storage.run_folder import JOURNAL, RunFolder, count_finished
from harness.storage.shipped import DEFAULT_WORLD, shipped
from harness.study.drive import TABLES
from harness.study.suite import Portion, cells, load_suite
from harness.study.suite_folder import begin, declare
from navbench.cli.app import main
from navstack.costmap.map_io import save_map
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import ParameterError
from navstack.types import Pose2D
from tests import command
from tests.rules import short_rules
from tools.pack_runs import pack

Here = Callable[[], AbstractContextManager[None]]
RULES = short_rules(1.0)
SUITE = """
title: Nobody and somebody
stacks: [parked]
maps: [hall.yaml]  # beside this file
pedestrians: [0, 3]
seeds: [0, 1]
episodes: 2
rules: short.yaml  # likewise
"""

TWO_STACKS = """
title: Two that stand
stacks: [parked, standing.yaml]
maps: [hall.yaml]
seeds: [0]
episodes: 3
rules: short.yaml
"""


@pytest.fixture(autouse=True)
def quick(in_process: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """No figures are drawn: test_suite_page.py does."""
    monkeypatch.setattr("harness.report.suite.document.draw_figures", lambda results, folder: [])


def suite_file(folder: Path, text: str = SUITE) -> Path:
    cells = np.zeros((200, 300), dtype=np.int8)
    cells[[0, -1]], cells[:, [0, -1]] = 100, 100
    save_map(OccupancyGrid(cells, 0.1, Pose2D()), folder / "hall.yaml")
    (folder / "short.yaml").write_text(RULES)
    (folder / "suite.yaml").write_text(text)
    parked = (shipped("params") / "stacks" / "parked.yaml").read_text(encoding="utf-8")
    (folder / "standing.yaml").write_text(parked, encoding="utf-8")
    return folder / "suite.yaml"


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory, driven_in_process: Here) -> Path:
    """A suite of which one of two cells is driven, in one call."""
    folder = tmp_path_factory.mktemp("driven")
    with pytest.raises(SystemExit), driven_in_process():
        main(
            [
                "suite",
                str(suite_file(folder, TWO_STACKS)),
                "--out",
                str(folder / "out"),
                "--stack",
                "parked",
                "--episodes",
                "1",
                "--workers",
                "1",
            ]
        )
    return folder / "out"


def navbench(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    return command.navbench(capsys, "suite", *arguments)


def test_the_example_is_a_suite() -> None:
    suite = load_suite(shipped("params") / "suites" / "example.yaml")
    assert len(cells(suite)) == 2 * 8


def test_a_portion_takes_some_stacks_on_some_maps() -> None:
    suite = load_suite(shipped("params") / "suites" / "measured.yaml")
    portion = Portion(stacks=("paper-amcl", "paper-gps"), maps=("sidewalk_2",))
    assert [(cell.stack, cell.condition.map_name) for cell in portion.cells(suite)] == [
        ("paper-gps", "sidewalk_2"),
        ("paper-amcl", "sidewalk_2"),
    ]
    assert portion.options == " --stack paper-amcl --stack paper-gps --map sidewalk_2"
    assert Portion(stacks=("my stack.yaml",)).options == " --stack 'my stack.yaml'"


@pytest.mark.slow
def test_sensors_are_crossed_with_the_rest(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = SUITE.replace("seeds: [0, 1]", "sensors: [rtk_urban, own.yaml]\nseeds: [0]")
    file = suite_file(tmp_path, text.replace("episodes: 2", "episodes: 1"))
    own = (shipped("params") / "sensors" / "rtk_good.yaml").read_text(encoding="utf-8")
    (tmp_path / "own.yaml").write_text(own, encoding="utf-8")
    out = tmp_path / "out"
    status, document, _ = navbench(capsys, str(file), "--out", str(out), "--workers", "1", "--json")
    rows = json.loads(document)["rows"]
    assert status == 0
    assert [(row["pedestrians"], row["sensors"]) for row in rows] == [
        (0, "rtk_urban"),
        (0, "own"),
        (3, "rtk_urban"),
        (3, "own"),
    ]
    run = out / f"hall-{DEFAULT_WORLD}-people3-own-seed0-parked"
    assert (run / "params" / "parked-sensors.yaml").is_file()
    page = (out / "index.md").read_text(encoding="utf-8")
    assert "### hall, 3 people, own\n" in page and "sensors: rtk_urban, own;" in page
    text = text.replace("rtk_urban", "rtk_subs")
    status, _, said = navbench(capsys, str(suite_file(tmp_path, text)), "--out", str(out / "other"))
    assert status == 1 and said.startswith("navbench: unknown sensor") and said.count("\n") == 1


@pytest.mark.slow
def test_a_suite_is_driven_cut_off_and_driven_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    status, document, _ = navbench(
        capsys,
        str(suite_file(tmp_path)),
        "--out",
        str(out),
        "--workers",
        "1",
        "--json",
    )
    assert status == 0
    rows = json.loads(document)["rows"]
    assert [(row["stack"], row["pedestrians"], row["seeds"], row["episodes"]) for row in rows] == [
        ("parked", 0, [0, 1], 4),
        ("parked", 3, [0, 1], 4),
    ]
    assert rows[0]["outcomes"]["sla"] | {"high": None} == {
        "value": 0.0,
        "low": 0.0,
        "high": None,
        "n": 4,
    }
    assert rows[0]["economics"]["contribution_margin"] == pytest.approx(-3.49)
    runs = [cell.name for cell in cells(load_suite(out / "suite.yaml"))]
    assert [count_finished(out / name) for name in runs] == [2, 2, 2, 2]

    overview = (out / "suite.json").read_bytes()
    kept = {name: (out / name / "episodes.parquet").read_bytes() for name in runs}
    cut_off(out / runs[1])
    begun_only(out / runs[2])
    shutil.rmtree(tmp_path / "elsewhere", ignore_errors=True)
    (tmp_path / "suite.yaml").unlink()
    (tmp_path / "short.yaml").unlink()
    status, again, said = navbench(capsys, "--resume", str(out), "--workers", "1", "--json")
    assert status == 0 and "going on after 5 of 8 deliveries" in said
    assert json.loads(again) == json.loads(document)
    assert (out / "suite.json").read_bytes() == overview
    assert {name: (out / name / "episodes.parquet").read_bytes() for name in runs} == kept


def test_a_piece_of_cells_that_were_begun_whole_is_a_piece(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As after an interrupt of the whole suite."""
    file, out = suite_file(tmp_path, TWO_STACKS), tmp_path / "out"
    suite = load_suite(file)
    declare(out, suite)
    for cell in cells(suite):
        begin(out, suite, cell, suite.episodes, ["navbench"])
    _, _, said = navbench(
        capsys,
        "--resume",
        str(out),
        "--episodes",
        "1",
        "--workers",
        "1",
        "--json",
    )
    assert [count_finished(out / cell.name) for cell in cells(suite)] == [1, 1]
    _, _, said = navbench(
        capsys,
        "--resume",
        str(out),
        "--episodes",
        "2",
        "--workers",
        "1",
        "--json",
    )
    assert "going on after 2 of 4 deliveries" in said
    assert said.endswith("4 of 4 deliveries: 4 timeout\n"), "those of before as well"
    assert [count_finished(out / cell.name) for cell in cells(suite)] == [2, 2]


@pytest.mark.slow
def test_a_suite_in_pieces_has_the_rows_of_one_driven_at_once(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, whole, out = suite_file(tmp_path, TWO_STACKS), tmp_path / "whole", tmp_path / "pieces"
    at_once = ("--workers", "1", "--json")
    assert navbench(capsys, str(file), "--out", str(whole), *at_once)[0] == 0
    _, document, _ = navbench(
        capsys,
        str(file),
        "--out",
        str(out),
        "--stack",
        "parked",
        "--episodes",
        "1",
        *at_once,
    )
    assert [
        (row["stack"], row["episodes"], row["declared"]) for row in json.loads(document)["rows"]
    ] == [("parked", 1, 3)]
    page = " ".join((out / "index.md").read_text(encoding="utf-8").split())
    assert (
        "**Not complete: 1 of 6 declared deliveries are driven.**" in page
        and "1 of 2 cells have none" in page
    )
    assert "1 of 3" in page and "standing" in page and "not driven" in page
    (kept,) = out.glob("*-parked/run.json")
    assert json.loads(kept.read_text(encoding="utf-8"))["episodes"] == 1
    _, _, said = navbench(capsys, "--resume", str(out), "--episodes", "2", *at_once)
    assert "going on after 1 of 4 deliveries" in said
    assert navbench(capsys, str(file), "--out", str(out), *at_once)[0] == 0
    for cell in cells(load_suite(whole / "suite.yaml")):
        for table in ("episodes.parquet", "events.parquet", "summary.json"):
            assert (out / cell.name / table).read_bytes() == (
                whole / cell.name / table
            ).read_bytes(), table
        assert not (out / cell.name / JOURNAL).exists()
    for made in ("suite.json", "table.parquet"):
        assert (out / made).read_bytes() == (whole / made).read_bytes(), made
    assert "Complete: 6 deliveries" in (out / "index.md").read_text(encoding="utf-8")
    pieces = [
        json.loads(line) for line in (out / "pieces.jsonl").read_text(encoding="utf-8").splitlines()
    ]
    assert [piece["deliveries"] for piece in pieces] == [1, 3, 2]
    own = [
        {name.rpartition("-")[2]: count for name, count in piece["cells"].items()}
        for piece in pieces
    ]
    assert own == [{"parked": 1}, {"parked": 1, "standing": 2}, {"parked": 1, "standing": 1}]
    assert "program" in page and "(hall: parked 1)" in page


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--stack", "parkd"), ("parkd", "did you mean 'parked'")),
        (("--map", "hal"), ("hal", "did you mean 'hall'")),
        (("--episodes", "3"), ("--episodes 3", "declares 1 to 2")),
        (("--world", "esay"), ("esay", "did you mean 'easy'")),
    ],
)
def test_a_portion_that_a_suite_has_not_is_refused(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    arguments: tuple[str, ...],
    words: tuple[str, ...],
) -> None:
    out = ("--out", str(tmp_path / "out"))
    status, _, line = navbench(capsys, str(suite_file(tmp_path)), *out, *arguments)
    assert status == 1 and line.count("\n") == 1 and all(word in line for word in words), line
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_cell_that_was_driven_with_other_parameters_is_not_added_to(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = suite_file(tmp_path), tmp_path / "out"
    portion = ("--episodes", "1", "--workers", "1", "--json")
    assert navbench(capsys, str(file), "--out", str(out), *portion)[0] == 0
    (tmp_path / "short.yaml").write_text(short_rules(1.5))
    status, _, line = navbench(capsys, str(file), "--out", str(out), *portion)
    assert (
        status == 1
        and "another rules.yaml than today's; remove the folder" in line
        and line.count("\n") == 1
    )
    assert navbench(capsys, "--resume", str(out), *portion)[0] == 0


def test_a_cell_is_not_begun_in_another_world_than_its_neighbours(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, out = suite_file(tmp_path, TWO_STACKS), tmp_path / "out"
    first, at_once = ("--stack", "parked", "--episodes", "1"), ("--workers", "1", "--json")
    assert navbench(capsys, str(file), "--out", str(out), *first, *at_once)[0] == 0
    (tmp_path / "short.yaml").write_text(short_rules(1.5))
    rules_of.cache_clear()  # as in a new process
    status, _, line = navbench(capsys, "--resume", str(out), *at_once)
    assert (
        status == 1
        and "would be driven with another rules.yaml than" in line
        and line.count("\n") == 1
    )
    assert [path.parent.name.endswith("parked") for path in out.glob("*/run.json")] == [True]


def test_a_folder_keeps_its_suite(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file, out = suite_file(tmp_path, TWO_STACKS), tmp_path / "out"
    portion = ("--stack", "parked", "--episodes", "1", "--workers", "1", "--json")
    assert navbench(capsys, str(file), "--out", str(out), *portion)[0] == 0
    declared = (out / "suite.yaml").read_bytes()
    for text, words in (
        (TWO_STACKS.replace("seeds: [0]", "seeds: [5]"), "none of its runs"),
        (TWO_STACKS + "missions: uniform\n", "missions is another"),
        (TWO_STACKS + "goal: 9.0,5.0,0.0\n", "goal is another"),
    ):
        file.write_text(text)
        status, _, line = navbench(capsys, str(file), "--out", str(out), *portion)
        assert (
            status == 1 and words in line and "'Two that stand'" in line and line.count("\n") == 1
        ), line
        assert (out / "suite.yaml").read_bytes() == declared


def test_a_stored_suite_is_not_driven_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], driven: Path
) -> None:
    """Its stacks are packed together, and whoever resumes it keeps them."""
    out = tmp_path / "out"
    shutil.copytree(driven, out)
    suite = load_suite(out / "suite.yaml")
    cell = next(cell for cell in cells(suite) if cell.stack_name == "parked")
    pack([out / cell.name], out / cell.group, "")
    shutil.rmtree(out / cell.name)
    status, text, said = navbench(
        capsys, "--resume", str(out), "--stack", "parked", "--workers", "1", "--json"
    )
    assert status == 0 and "note: stored with other stacks, and left as they are: 1 cell\n" in said
    assert not (out / cell.name).exists()
    assert [row["episodes"] for row in json.loads(text)["rows"]] == [1]


@pytest.mark.parametrize("line", ['{"date": "2026-01', "[]", '{"date": 5}', "[" * 100_000])
def test_a_damaged_log_of_pieces_is_told(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    driven: Path,
    line: str,
) -> None:
    out = Path(shutil.copytree(driven, tmp_path / "out"))
    with (out / "pieces.jsonl").open("a", encoding="utf-8") as log:
        log.write(f"{line}\n")
    status, _, said = navbench(capsys, "--resume", str(out), "--workers", "1")
    (complaint,) = (each for each in said.splitlines() if each.startswith("navbench: "))
    assert status == 1 and "pieces.jsonl: line 2" in complaint


@pytest.mark.parametrize("name", ["figures", f"hall-{DEFAULT_WORLD}-seed0-standing"])
def test_a_suite_is_not_written_through_a_link(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    driven: Path,
    name: str,
) -> None:
    out, target = Path(shutil.copytree(driven, tmp_path / "out")), tmp_path / "elsewhere"
    shutil.rmtree(out / name, ignore_errors=True)
    target.mkdir()
    (out / name).symlink_to(target)
    status, _, said = navbench(capsys, "--resume", str(out), "--workers", "1")
    assert status == 1 and f"{name}' is a symbolic link" in said.splitlines()[-1]
    assert not list(target.iterdir())


def cut_off(path: Path) -> None:
    """Put a finished cell back to after its first delivery."""
    with RunFolder(path, TABLES, 2) as folder:
        record = {"row": folder.rows[0], "events": [], "timing": folder.timings[0]}
    begun_only(path)
    (path / JOURNAL).write_text(json.dumps(record) + "\n")


def begun_only(path: Path) -> None:
    for file in [*path.glob("*.parquet"), path / "summary.json"]:
        file.unlink()
    write_checksums(path)  # as it was when it had begun


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (SUITE.replace("stacks:", "stakcs:"), ("stakcs", "did you mean 'stacks'")),
        (SUITE.replace("seeds: [0, 1]", "seeds: [0, one]"), ("seeds[1]", "'one'", "whole number")),
        (SUITE.replace("seeds: [0, 1]", "seeds: []"), ("seeds", "at least one")),
        (SUITE.replace("seeds: [0, 1]", "seeds: [1, 1]"), ("two cells", "seed1")),
        (
            SUITE.replace("pedestrians: [0, 3]", f"pedestrians: {list(range(1999))}"),
            ("3998 cells", "2000"),
        ),
        (SUITE.replace("title: Nobody and somebody\n", ""), ("title", "missing")),
        ("just a text", ("not a mapping",)),
    ],
)
def test_what_is_no_suite_is_refused(tmp_path: Path, text: str, words: tuple[str, ...]) -> None:
    with pytest.raises(ParameterError) as complaint:
        load_suite(suite_file(tmp_path, text))
    assert all(word in str(complaint.value) for word in (*words, "suite.yaml")), str(
        complaint.value
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (SUITE.replace("[parked]", "[parkd]"), ("parkd", "did you mean 'parked'")),
        (SUITE.replace("short.yaml", "costnva"), ("costnva", "did you mean 'costnav'")),
        (SUITE.replace("episodes: 2", "episodes: 0"), ("--episodes 0",)),
    ],
)
def test_a_cell_that_cannot_be_run_is_refused_before_anything_starts(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    text: str,
    words: tuple[str, ...],
) -> None:
    status, out, line = navbench(
        capsys, str(suite_file(tmp_path, text)), "--out", str(tmp_path / "out")
    )
    assert status == 1 and out == "" and line.count("\n") == 1
    assert all(word in line for word in words), line
    assert not (tmp_path / "out").exists()


def test_a_folder_without_a_suite_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    status, _, line = navbench(capsys, "--resume", str(tmp_path))
    assert status == 1 and "holds no suite" in line
