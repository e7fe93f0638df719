"""A run whose folder is removed, moved or replaced while driven loses nothing that was finished."""

import os
import random
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from harness.storage import run_folder
from harness.storage.checksums import changed_files
from harness.storage.files import LOCK
from harness.storage.new_run import create_run
from harness.storage.run_folder import JOURNAL, RunFolder
from navstack.errors import InputError

from .test_runs import ORDER, TABLES, record, tables, write_run

OTHER = {"command": ["y"]}


def removed(path: Path) -> None:
    shutil.rmtree(path)


def renamed(path: Path) -> None:
    path.rename(path.with_name("elsewhere"))


def emptied(path: Path) -> None:
    removed(path)
    path.mkdir()


def without_parents(path: Path) -> None:
    shutil.rmtree(path.parent)


def copied_back(path: Path) -> None:
    renamed(path)
    shutil.copytree(path.with_name("elsewhere"), path)


def begun_anew(path: Path) -> None:
    removed(path)
    create_run(path, OTHER, {"b.yaml": "x: 2\n"})


def driven_anew(path: Path) -> None:
    begun_anew(path)
    with RunFolder(path, TABLES, 1) as other:
        other.add(record(7, 7))


def unlocked(path: Path) -> None:
    (path / LOCK).unlink()


def without_journal(path: Path) -> None:
    (path / JOURNAL).unlink()


def a_file(path: Path) -> None:
    removed(path)
    path.write_text("mine")


WAYS: tuple[Callable[[Path], None], ...] = (
    removed,
    renamed,
    emptied,
    without_parents,
    copied_back,
    begun_anew,
    driven_anew,
    unlocked,
    without_journal,
    a_file,
)
# before what of the last delivery that is driven it happens
MOMENTS = ("recording", "table", "row", "summary", "end", "tables")


def contents(path: Path) -> dict[Path, bytes]:
    return {file: file.read_bytes() for file in path.rglob("*") if file.is_file()}


@pytest.mark.parametrize("moment", MOMENTS)
@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
def test_what_is_finished_is_kept_and_what_others_put_there_stays(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    way: Callable[[Path], None],
    moment: str,
) -> None:
    path = tmp_path / "runs" / "same"
    count = random.Random(f"{way.__name__} {moment}").randint(1, len(ORDER))
    write_run(tmp_path / "whole", ORDER[:count])
    create_run(path, {"command": ["x"]}, {"a.yaml": "x: 1\n"})
    happened: list[str] = []
    theirs: dict[Path, bytes] = {}

    def now(this: str) -> None:
        if this == moment and not happened:
            happened.append(this)
            way(path)
            theirs.update(contents(path.parent))

    written = run_folder.write_table

    def write_table(file: Path, columns: object, rows: object) -> None:
        if file.name == "events.parquet":
            now("tables")
        written(file, columns, rows)  # type: ignore[arg-type]

    monkeypatch.setattr(run_folder, "write_table", write_table)
    with pytest.raises(InputError) as stopped, RunFolder(path, TABLES, count) as folder:
        folder.add_recording("first", {"x": [2.0]})
        for key in ORDER[: count - 1]:
            folder.add(record(*key))
        now("recording")
        folder.add_recording("last", {"x": [1.0]})
        now("table")
        folder.add_table("last-decisions", TABLES["events"], [])
        now("row")
        folder.add(record(*ORDER[count - 1]))
        now("summary")
        folder.write_summary({"schema": 1})
        now("end")
    line = str(stopped.value)
    assert f"run folder '{path}' was removed, moved or replaced" in line and "\n" not in line
    (kept,) = map(Path, re.findall(r"--resume (\S+)$", line))
    is_gone = not (kept / "recordings" / "first.npz").exists()
    ways = (removed, emptied, without_parents, begun_anew, driven_anew, a_file)
    assert is_gone == (way in ways)
    gone = 3 - len(list((kept / "recordings").glob("*")))
    without = f", but {gone} files of their recordings went with it" if gone else ""
    assert f"its {count} finished deliveries are kept{without}; go on" in line
    assert kept != path and kept.parent == path.parent
    with RunFolder(kept, TABLES, count) as again:
        assert again.is_closed and not again.notes, "its tables and its journal are whole"
    assert tables(kept) == tables(tmp_path / "whole")
    assert changed_files(kept, is_finished=True) == []
    assert (kept / "params" / "a.yaml").read_text() == "x: 1\n"
    if way in (driven_anew, begun_anew, a_file):
        assert theirs and {file: file.read_bytes() for file in theirs} == theirs
    if way is driven_anew:
        assert changed_files(path, is_finished=True) == []


def test_what_cannot_be_copied_of_the_recordings_stops_nothing(tmp_path: Path) -> None:
    path = tmp_path / "run"
    create_run(path, {"command": ["x"]}, {})
    (path / "recordings").mkdir()
    (path / "recordings" / "link.npz").symlink_to("gone")
    with pytest.raises(InputError) as stopped, RunFolder(path, TABLES, 2) as folder:
        folder.add_recording("one", {"x": [1.0]})
        folder.add(record(0, 0))
        renamed(path)
        folder.add(record(0, 1))
    line = str(stopped.value)
    assert "its 2 finished deliveries are kept, but 1 files of their recordings went" in line
    kept = tmp_path / "run-rescued-1"
    assert [file.name for file in (kept / "recordings").iterdir()] == ["one.npz"]
    assert line.endswith(f"--resume {kept}")


def test_a_name_that_leads_elsewhere_before_the_end_moves_nothing(tmp_path: Path) -> None:
    for name in ("one", "two"):
        create_run(tmp_path / name, {"command": ["x"]}, {})
    link = tmp_path / "latest"
    link.symlink_to("one")
    with RunFolder(link, TABLES, 1) as folder:
        link.unlink()
        link.symlink_to("two")
        folder.add(record(0, 0))
    assert (tmp_path / "one" / "episodes.parquet").is_file()
    assert not (tmp_path / "two" / "episodes.parquet").exists()


def test_where_nothing_can_be_written_beside_a_temporary_folder_is_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "runs" / "same"
    create_run(path, {"command": ["x"]}, {})
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    monkeypatch.setattr("tempfile.tempdir", None)
    with (
        pytest.raises(InputError, match="same-rescued-") as stopped,
        RunFolder(path, TABLES, 4) as folder,
    ):
        shutil.rmtree(path.parent)
        path.parent.write_text("a file")
        folder.add(record(0, 0))
    kept = Path(str(stopped.value).rpartition(" ")[2])
    assert kept.parent == tmp_path and os.listdir(kept)
