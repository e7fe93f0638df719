"""A run folder that others made or damaged ends in one clear line, and writes nothing elsewhere."""

import copy
import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from harness.storage.journal import record_of, trouble_with
from harness.storage.manifest_file import extend_run
from harness.storage.new_run import create_run
from harness.storage.run_folder import JOURNAL, RunFolder, count_finished
from harness.storage.shipped import DEFAULT_WORLD
from harness.storage.tables import is_of_kind
from harness.study.drive import TABLES
from navstack.errors import InputError

CELL = f"hall-{DEFAULT_WORLD}-seed0-mine"  # of a suite
TOTAL = 3  # deliveries of a run, of which two are finished
Record = dict[str, Any]


def record(episode: int) -> Record:
    row = {
        "stack": "mine",
        "stack_number": 0,
        "seed": 0,
        "episode": episode,
        "map": "hall",
        "outcome": "sla",
    }
    row |= {"distance_m": 10.0, "duration_s": 8.0, "average_speed_mps": 1.25}
    event = {"stack": "mine", "episode": episode, "type": "contact_event", "impulse_ns": 3.0}
    timing = {"stack": "mine", "episode": episode, "wall_s": 0.5, "real_time_factor": 16.0}
    return {"row": row, "events": [event], "timing": timing}


def begun(path: Path, *records: Record, tail: str = "") -> Path:
    create_run(path, {"command": ["x"]}, {})
    (path / JOURNAL).write_text("".join(json.dumps(each) + "\n" for each in records) + tail)
    return path


def complaint(path: Path, total: int = TOTAL) -> str:
    with pytest.raises(InputError) as raised:
        RunFolder(path, TABLES, total)
    assert "\n" not in str(raised.value) and len(str(raised.value)) < 600
    return str(raised.value)


def with_value(part: str, key: str, value: object) -> Record:
    changed = copy.deepcopy(record(0))
    (changed["events"][0] if part == "events" else changed[part])[key] = value
    return changed


@pytest.mark.parametrize(
    ("first", "says"),
    [
        (record(0) | {"events": [1]}, "event: int in place of a row"),
        (record(0) | {"events": [{"stack": [[]]}]}, "event: stack is a list"),
        (record(0) | {"timing": {}}, "timing: wall_s is missing"),
        (with_value("events", "impulse_ns", "hard"), "event: impulse_ns 'hard'"),
        (with_value("events", "surprise", 1.0), "event: surprise"),
        (with_value("events", "x_m", float("nan")), "event: x_m nan"),
        (with_value("timing", "wall_s", "long"), "timing: wall_s 'long'"),
        (with_value("timing", "real_time_factor", None), "timing: real_time_factor is missing"),
        (with_value("timing", "setup_s", float("inf")), "timing: setup_s inf"),
        (with_value("row", "distance_m", None), "episode: distance_m is missing"),
        (with_value("row", "seed", None), "episode: seed is missing"),
        (with_value("row", "distance_m", 10**20), "episode: distance_m 1000"),
        (with_value("row", "distance_m", "x" * 10_000), "episode: distance_m 'xxx"),
    ],
)
def test_a_line_with_wrong_values_is_passed_over_wherever_it_stands(
    tmp_path: Path,
    first: Record,
    says: str,
) -> None:
    for name, lines in (("first", (first, record(1))), ("last", (record(1), first))):
        with RunFolder(begun(tmp_path / name, *lines), TABLES, TOTAL) as folder:
            (note,) = folder.notes
            assert (
                f"line {1 + (name == 'last')} is damaged: {says}" in note
                and "\n" not in note
                and len(note) < 600
            )
            assert folder.finished == {(0, 1)}


ODD_TEXTS = {
    "a name that is not UTF-8": ("weights-\udcff.bin", r"weights-\udcff.bin"),
    "a lone surrogate": ("\ud800", r"\ud800"),
    "a text without end": ("é" * 100_000, "é" * 1000),
}


@pytest.mark.parametrize(("text", "kept"), ODD_TEXTS.values(), ids=ODD_TEXTS)
def test_a_text_that_no_table_takes_is_cleaned_when_the_journal_is_read(
    tmp_path: Path,
    text: str,
    kept: str,
) -> None:
    lost = {"stack": text, "stack_number": 0, "seed": 0, "episode": 1, "error": text}
    failed = {"row": lost, "events": [], "timing": {"stack": text, "episode": 1}}
    path = begun(tmp_path / "run", with_value("events", "kind", text), failed)
    with RunFolder(path, TABLES, 2) as folder:
        assert not folder.notes and folder.rows.values("error") == [None, kept]
    assert pq.read_table(path / "episodes.parquet")["error"].to_pylist() == [None, kept]
    assert pq.read_table(path / "events.parquet")["kind"].to_pylist() == [kept]
    assert pq.read_table(path / "timings.parquet")["stack"].to_pylist() == ["mine", kept]


@pytest.mark.parametrize(
    ("kind", "right", "wrong"),
    [
        (
            "double",
            (-1e300, 0, 2.5),
            (-math.inf, math.inf, math.nan, 1.01e300, -(10**301), True, "1.0"),
        ),
        ("int64", (1 - 2**63, 0, 2**63 - 1), (2**63, -(2**64), 1.0, False, "1")),
        ("string", ("", "1"), (1, True)),
        ("bool", (True, False), (0, "true")),
    ],
)
def test_a_column_takes_values_of_its_kind_only(
    kind: str,
    right: tuple[object, ...],
    wrong: tuple[object, ...],
) -> None:
    assert all(is_of_kind(value, kind) for value in right)
    assert not any(is_of_kind(value, kind) for value in wrong)


@pytest.mark.parametrize(
    ("value", "is_odd"),
    [(1e12, False), (-1e12, False), (1.001e12, True), (-1.001e12, True), (10**13, True)],
)
def test_numbers_up_to_a_million_millions_are_measurements(value: float, is_odd: bool) -> None:
    said = f"x_m {value!r} is no measurement" if is_odd else ""
    assert trouble_with({"x_m": value}, {"x_m": "double"}) == said
    assert trouble_with({"n": int(value)}, {"n": "int64"}) == "", "a whole number counts"


@pytest.mark.parametrize(
    "tail", ['{"row": {"stack_num', "\x00" * 9, json.dumps(record(1)), '{"row": {}}\n']
)
def test_a_last_line_that_was_cut_off_goes_away(tmp_path: Path, tail: str) -> None:
    path = begun(tmp_path / "run", record(0), tail=tail)
    with RunFolder(path, TABLES, TOTAL) as folder:
        assert folder.finished == {(0, 0)}
        folder.add(record(1))
    assert [
        record_of(line) for line in (path / JOURNAL).read_bytes().splitlines(keepends=True)
    ] == [
        record(0),
        record(1),
    ]
    assert pq.read_table(path / "events.parquet").num_rows == 2


def test_what_a_row_lacks_is_null_and_an_error_needs_no_time(tmp_path: Path) -> None:
    lost = {"stack": "mine", "stack_number": 0, "seed": 0, "episode": 1, "error": "lost"}
    path = begun(
        tmp_path / "run",
        record(0),
        {"row": lost, "events": [], "timing": {"stack": "mine", "episode": 1}},
    )
    with RunFolder(path, TABLES, TOTAL) as folder:
        assert folder.rows.values("error") == [None, "lost"]
        assert set(folder.rows[1]) == set(TABLES["episodes"])


@pytest.fixture
def finished(tmp_path: Path) -> Path:
    """A run of which all deliveries that were asked for are finished."""
    path = begun(tmp_path / "run", record(0), record(1))
    with RunFolder(path, TABLES, 2):
        pass
    assert not (path / JOURNAL).exists()
    return path


def replace(path: Path, column: str, value: object) -> None:
    table = pq.read_table(path)
    place = table.schema.get_field_index(column)
    values = pa.array([value] * len(table), table.schema.field(column).type)
    pq.write_table(table.set_column(place, column, values), path)


@pytest.mark.parametrize(
    ("table", "column", "value"),
    [
        ("timings", "real_time_factor", None),
        ("timings", "wall_s", float("nan")),
        ("episodes", "stack_number", None),
        ("episodes", "seed", None),
        ("episodes", "average_speed_mps", None),
    ],
)
def test_tables_that_lack_a_value_are_refused(
    finished: Path,
    table: str,
    column: str,
    value: object,
) -> None:
    replace(finished / f"{table}.parquet", column, value)
    line = complaint(finished, 2)
    assert "damaged tables: row 1" in line and column in line


def test_events_that_are_no_numbers_are_refused_when_a_run_goes_on(finished: Path) -> None:
    replace(finished / "events.parquet", "impulse_ns", float("nan"))
    with RunFolder(finished, TABLES, 2) as folder:
        assert folder.is_closed
    assert "events.parquet: is damaged: row 1: impulse_ns nan" in complaint(finished)


def test_the_deliveries_of_a_damaged_table_cannot_be_counted(finished: Path) -> None:
    assert count_finished(finished) == 2
    table = finished / "episodes.parquet"
    table.write_bytes(table.read_bytes()[:300])
    with pytest.raises(InputError, match=r"episodes\.parquet: is damaged"):
        count_finished(finished)


def contents(folder: Path) -> dict[Path, bytes]:
    return {file: file.read_bytes() for file in folder.rglob("*") if file.is_file()}


@pytest.mark.parametrize("name", ["recordings", "front", "figures"])
def test_a_folder_in_a_run_that_is_a_link_is_refused(tmp_path: Path, name: str) -> None:
    path = begun(tmp_path / "run", record(0))
    (tmp_path / "elsewhere").mkdir()
    (path / name).symlink_to(tmp_path / "elsewhere")
    line = complaint(path)
    assert (
        f"'{path / name}' is a symbolic link" in line and "put a real folder in its place" in line
    )
    assert not list((tmp_path / "elsewhere").iterdir())
    (path / name).unlink()
    (path / name).symlink_to(tmp_path / "nowhere")
    assert "is a symbolic link" in complaint(path)


def test_a_run_may_be_given_by_a_link_and_have_folders_of_its_own(tmp_path: Path) -> None:
    begun(tmp_path / "run", record(0))
    (tmp_path / "link").symlink_to("run")
    with RunFolder(tmp_path / "link", TABLES, TOTAL) as folder:
        folder.add_table("mine-1", TABLES["events"], [])
    with RunFolder(tmp_path / "link", TABLES, TOTAL) as folder:
        folder.add_table("mine-2", TABLES["events"], [])
    assert len(list((tmp_path / "run" / "recordings").iterdir())) == 2


@pytest.mark.parametrize(
    "write", [lambda path: extend_run(path, 5), lambda path: RunFolder(path, TABLES, TOTAL)]
)
@pytest.mark.parametrize("name", [CELL, "figures"])
def test_a_folder_of_a_suite_that_is_a_link_is_refused(
    tmp_path: Path,
    write: Callable[[Path], object],
    name: str,
) -> None:
    suite, target = tmp_path / "suite", begun(tmp_path / "elsewhere", record(0))
    suite.mkdir()
    (suite / "suite.yaml").write_text("title: x\n")
    if name == "figures":
        begun(suite / CELL, record(0))
    (suite / name).symlink_to(target)
    before = contents(target)
    with pytest.raises(InputError, match=f"{name}' is a symbolic link"):
        write(suite / CELL)
    assert contents(target) == before


def test_a_cell_is_not_begun_through_a_link(tmp_path: Path) -> None:
    (tmp_path / "suite.yaml").write_text("title: x\n")
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / CELL).symlink_to("elsewhere")
    with pytest.raises(InputError, match=f"{CELL}' is a symbolic link"):
        create_run(tmp_path / CELL, {}, {})
    assert not list((tmp_path / "elsewhere").iterdir())


def test_a_run_beside_a_suites_file_is_none_of_its_cells(tmp_path: Path) -> None:
    (tmp_path / "suite.yaml").write_text("title: x\n")
    for name in ("elsewhere", "pictures"):
        (tmp_path / name).mkdir()
    (tmp_path / "figures").symlink_to("pictures")
    (tmp_path / "mine").symlink_to("elsewhere")
    create_run(tmp_path / "mine", {}, {})
    assert (tmp_path / "elsewhere" / "run.json").is_file()


@pytest.mark.parametrize(
    "journal",
    [bytes(range(256)) * 9, b'{"a": 1}\n{"b": 2}\n', b"[" * 100_000 + b"\n{}\n", b"\n" * 50],
)
def test_a_journal_that_is_none_has_no_deliveries_and_one_note(
    tmp_path: Path, journal: bytes
) -> None:
    path = begun(tmp_path / "run")
    (path / JOURNAL).write_bytes(journal)
    with RunFolder(path, TABLES, TOTAL) as folder:
        assert not folder.finished and len(folder.notes) == 1 and len(folder.notes[0]) < 600
        folder.add(record(0))
    with RunFolder(path, TABLES, TOTAL) as folder:
        assert folder.finished == {(0, 0)} and not folder.notes, "nothing of it is left"
