"""Run folders keep what is finished, for whoever goes on with it."""

import contextlib
import errno
import json
import os
import time
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from harness.storage.checksums import CHECKSUMS
from harness.storage.documents import write_document, write_file
from harness.storage.files import (
    LOCK,
    locked,
    nearby,
    replacing,
    require_folder,
    require_writable,
    write_text,
)
from harness.storage.journal import line_of, record_of
from harness.storage.new_run import MANIFEST, create_run, output_folder
from harness.storage.run_folder import JOURNAL, RunFolder, count_finished
from navstack.errors import InputError

TABLES = {
    "episodes": {
        **{"stack": "string", "stack_number": "int64", "episode": "int64"},
        **{"outcome": "string", "distance_m": "double"},
    },
    "events": {"episode": "int64", "impulse_ns": "double"},
    "timings": {"episode": "int64", "wall_s": "double"},
}
ORDER = [(0, 0), (0, 1), (1, 0), (1, 1)]


def record(stack: int, episode: int) -> dict[str, Any]:
    row = {"stack": f"stack{stack}", "stack_number": stack, "episode": episode, "outcome": "sla"}
    row["distance_m"] = 10.0 * stack + episode / 3.0
    events = [{"episode": episode, "impulse_ns": 50.0}] if episode else []
    return {"row": row, "events": events, "timing": {"episode": episode, "wall_s": 0.1}}


def write_run(path: Path, order: list[tuple[int, int]]) -> None:
    create_run(path, {"command": ["x"]}, {"a.yaml": "x: 1\n"})
    go_on(path, order)


def go_on(path: Path, order: list[tuple[int, int]]) -> None:
    with RunFolder(path, TABLES, len(ORDER)) as folder:
        for stack, episode in order:
            folder.add(record(stack, episode))


def tables(path: Path) -> dict[str, bytes]:
    return {name: (path / f"{name}.parquet").read_bytes() for name in TABLES}


def test_tables_do_not_depend_on_the_order_of_work(tmp_path: Path) -> None:
    write_run(tmp_path / "a", ORDER)
    write_run(tmp_path / "b", ORDER[::-1])
    assert tables(tmp_path / "a") == tables(tmp_path / "b")
    distances = pq.read_table(tmp_path / "a" / "episodes.parquet")["distance_m"].to_pylist()
    assert distances == [0.0, 1 / 3, 10.0, 10.0 + 1 / 3]
    assert sorted(file.name for file in (tmp_path / "a").iterdir()) == sorted(
        [*(f"{name}.parquet" for name in TABLES), "params", CHECKSUMS, MANIFEST]
    )


def test_a_finished_episode_is_on_disk_before_the_next(tmp_path: Path) -> None:
    create_run(tmp_path / "run", {}, {})
    folder = RunFolder(tmp_path / "run", TABLES, 4)
    folder.add(record(0, 0))
    lines = (tmp_path / "run" / JOURNAL).read_text().splitlines()
    assert [json.loads(line)["row"]["episode"] for line in lines] == [0]
    assert count_finished(tmp_path / "run") == 1
    folder.close()


def test_an_interrupt_keeps_the_finished_rows(tmp_path: Path) -> None:
    create_run(tmp_path / "run", {}, {})
    with pytest.raises(KeyboardInterrupt), RunFolder(tmp_path / "run", TABLES, 4) as folder:
        folder.add(record(0, 0))
        raise KeyboardInterrupt
    assert pq.read_table(tmp_path / "run" / "episodes.parquet").num_rows == 1
    assert (tmp_path / "run" / JOURNAL).exists()


def test_an_interrupt_while_the_disk_works_loses_and_forgets_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    create_run(tmp_path / "run", {}, {})

    def interrupted(descriptor: int) -> None:
        raise KeyboardInterrupt

    with (
        pytest.raises(KeyboardInterrupt),
        RunFolder(tmp_path / "run", TABLES, 4) as folder,
        monkeypatch.context() as m,
    ):
        m.setattr("harness.storage.run_folder.os.fsync", interrupted)
        folder.add(record(0, 0))
    assert len(folder.rows) == count_finished(tmp_path / "run") == 1
    assert pq.read_table(tmp_path / "run" / "episodes.parquet").num_rows == 1


@pytest.mark.parametrize("cut", range(5))
@pytest.mark.parametrize("tail", [b"", b'{"row": {"stack_num', b'{"row": {}}\n', b"\x00" * 64])
def test_a_run_cut_off_anywhere_goes_on_to_the_same_tables(
    tmp_path: Path,
    cut: int,
    tail: bytes,
) -> None:
    write_run(tmp_path / "whole", ORDER)
    create_run(tmp_path / "cut", {"command": ["x"]}, {"a.yaml": "x: 1\n"})
    lines = b"".join(json.dumps(record(*key)).encode() + b"\n" for key in ORDER[:cut])
    (tmp_path / "cut" / JOURNAL).write_bytes(lines + tail)  # as kill -9 or a power cut leaves it
    with RunFolder(tmp_path / "cut", TABLES, 4) as folder:
        assert folder.finished == set(ORDER[:cut])
        for key in ORDER[cut:]:
            folder.add(record(*key))
    assert tables(tmp_path / "cut") == tables(tmp_path / "whole")
    assert not (tmp_path / "cut" / JOURNAL).exists()


def test_a_finished_run_is_read_and_left_as_it_is(tmp_path: Path) -> None:
    write_run(tmp_path / "run", ORDER)
    before = {file: file.stat().st_mtime_ns for file in (tmp_path / "run").rglob("*")}
    with RunFolder(tmp_path / "run", TABLES, 4) as folder:
        assert folder.is_complete and folder.is_closed
        assert list(folder.rows) == [record(*key)["row"] for key in ORDER]
        with pytest.raises(ValueError, match="closed"):
            folder.add(record(0, 0))
    assert {file: file.stat().st_mtime_ns for file in (tmp_path / "run").rglob("*")} == before
    assert count_finished(tmp_path / "run") == 4


@pytest.mark.parametrize("damaged", ["nonsense\n", '{"row": {}}\n', None])
def test_a_damaged_line_costs_its_delivery_only(tmp_path: Path, damaged: str | None) -> None:
    write_run(tmp_path / "whole", ORDER)
    create_run(tmp_path / "run", {}, {})
    lines = [line_of(record(*key)) for key in ORDER[:3]]
    lines[1] = lines[0] if damaged is None else damaged.encode()  # None: a delivery is there twice
    (tmp_path / "run" / JOURNAL).write_bytes(b"".join(lines))
    with RunFolder(tmp_path / "run", TABLES, len(ORDER)) as folder:
        (note,) = folder.notes
        assert "journal.jsonl: line 2 is damaged" in note and note.endswith(
            "; what they told of is driven again"
        )
        assert folder.finished == {ORDER[0], ORDER[2]}
        folder.add(record(*ORDER[1]))
        folder.add(record(*ORDER[3]))
    assert tables(tmp_path / "run") == tables(tmp_path / "whole")


def test_a_sealed_line_is_told_from_a_changed_one() -> None:
    line = line_of(record(0, 1))
    assert record_of(line) == record(0, 1)
    assert record_of(json.dumps(record(0, 1)).encode() + b"\n") == record(0, 1), (
        "as earlier versions wrote them"
    )
    for place in range(len(line) - 1):
        for bit in (0, 3, 6):
            changed = bytearray(line)
            changed[place] ^= 1 << bit
            assert record_of(bytes(changed)) is None, (place, bit)


def test_two_programs_cannot_write_one_folder(tmp_path: Path) -> None:
    create_run(tmp_path / "run", {}, {})
    with RunFolder(tmp_path / "run", TABLES, 4), pytest.raises(InputError, match="another run"):
        RunFolder(tmp_path / "run", TABLES, 4)
    assert not (tmp_path / "run" / LOCK).exists()
    go_on(tmp_path / "run", ORDER)


def test_a_lock_whose_holder_died_does_not_hold(tmp_path: Path) -> None:
    create_run(tmp_path / "run", {}, {})
    child = os.fork()
    if child == 0:
        with locked(tmp_path / "run"):
            os._exit(0)  # without removing the file
    os.waitpid(child, 0)
    assert (tmp_path / "run" / LOCK).exists()
    go_on(tmp_path / "run", ORDER)


def test_a_full_disk_ends_in_one_clear_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(descriptor: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    create_run(tmp_path / "run", {}, {})
    with monkeypatch.context() as patch, pytest.raises(InputError) as complaint:
        with RunFolder(tmp_path / "run", TABLES, 4) as folder:
            folder.add(record(0, 0))
            patch.setattr(os, "fsync", full)
            folder.add(record(0, 1))
    line = str(complaint.value)
    assert (
        "No space left" in line and "1 finished" in line and "--resume" in line and "\n" not in line
    )
    with RunFolder(tmp_path / "run", TABLES, 4) as folder:
        assert (0, 0) in folder.finished
    assert not list((tmp_path / "run").glob("*.partial"))


def test_a_file_that_is_being_replaced_is_the_old_one_until_the_new_one_is_whole(
    tmp_path: Path,
) -> None:
    path = tmp_path / "file"
    path.write_bytes(b"old")
    with pytest.raises(KeyboardInterrupt), replacing(path) as stream:
        stream.write(b"half of the new")
        raise KeyboardInterrupt
    assert path.read_bytes() == b"old"
    with replacing(path) as stream:
        stream.write(b"new")
    assert path.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [path]


def test_a_file_can_be_written_where_its_folder_exists(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for file in (tmp_path / "page.html", Path("page.html"), tmp_path / "PAGE.HTML"):
        require_writable("page", file, (".html", ".md"))
    (tmp_path / "folder.md").mkdir()
    for name, why in (
        ("no/page.md", "its folder does not exist"),
        ("folder.md", "it is a folder"),
        ("page", "ends"),
    ):
        with pytest.raises(InputError, match=why):
            require_writable("page", tmp_path / name, (".html", ".md"))


def test_no_episodes_still_gives_readable_tables(tmp_path: Path) -> None:
    write_run(tmp_path / "run", [])
    assert pq.read_table(tmp_path / "run" / "events.parquet").column_names == [
        "episode",
        "impulse_ns",
    ]


def test_a_folder_in_use_is_refused(tmp_path: Path) -> None:
    write_run(tmp_path / "run", [])
    with pytest.raises(InputError, match="not empty"):
        write_run(tmp_path / "run", [])


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        write_run(tmp_path / "file" / "run", [])


def test_latest_points_to_the_newest_run(tmp_path: Path) -> None:
    write_run(tmp_path / "results" / "one", ORDER[:1])
    write_run(tmp_path / "results" / "two", ORDER[:2])
    latest = tmp_path / "results" / "latest"
    assert pq.read_table(latest / "episodes.parquet").num_rows == 2
    go_on(latest, ORDER[2:])  # by its other name
    assert pq.read_table(latest / "episodes.parquet").num_rows == 4


def test_latest_is_there_from_the_beginning(tmp_path: Path) -> None:
    create_run(tmp_path / "results" / "one", {}, {})
    assert (tmp_path / "results" / "latest" / MANIFEST).is_file(), (
        "a killed run is resumed from there"
    )


@pytest.mark.parametrize("killed_at", ["a.yaml", "b.yaml", MANIFEST])
def test_a_program_that_is_killed_while_it_makes_a_folder_leaves_one_to_use(
    killed_at: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def killed(path: Path, text: str) -> None:
        if path.name == killed_at:
            raise SystemExit
        write_text(path, text)

    with monkeypatch.context() as patched, pytest.raises(SystemExit):
        patched.setattr("harness.storage.new_run.write_text", killed)
        create_run(tmp_path / "run", {"command": ["x"]}, {"a.yaml": "x: 1\n", "b.yaml": "y: 1\n"})
    create_run(tmp_path / "run", {"command": ["x"]}, {"a.yaml": "x: 2\n"})
    files = sorted(
        str(file.relative_to(tmp_path / "run")) for file in (tmp_path / "run").rglob("*")
    )
    assert files == [CHECKSUMS, "params", "params/a.yaml", MANIFEST]
    with pytest.raises(InputError, match="not empty"):
        create_run(tmp_path / "run", {}, {})


def test_a_folder_of_parameters_is_not_taken_for_what_is_left_of_a_run(tmp_path: Path) -> None:
    (tmp_path / "params").mkdir()
    (tmp_path / "params" / "mine.yaml").write_text("a: 1\n")
    with pytest.raises(InputError, match="not empty"):
        create_run(tmp_path, {}, {})
    assert (tmp_path / "params" / "mine.yaml").exists()


def test_a_folder_can_be_made_in_folders_only(tmp_path: Path) -> None:
    require_folder(tmp_path)
    require_folder(tmp_path / "new" / "er")
    (tmp_path / "file").write_text("")
    for place in (tmp_path / "file", tmp_path / "file" / "new"):
        with pytest.raises(InputError, match="cannot be written; choose another"):
            require_folder(place)


def test_a_document_makes_the_folders_that_it_lies_in(tmp_path: Path) -> None:
    path = tmp_path / "one" / "two" / "a.json"
    write_document(path, {"b": 1, "a": [None]})
    assert path.read_text() == '{\n  "a": [\n    null\n  ],\n  "b": 1\n}\n'
    write_file(path, "again")
    assert path.read_text() == "again"


def test_a_path_is_told_as_from_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "here").mkdir()
    monkeypatch.chdir(tmp_path / "here")
    assert nearby(tmp_path / "here" / "results" / "one") == Path("results/one")
    assert nearby(tmp_path / "there") == tmp_path / "there"


def test_a_file_arrives_where_folders_cannot_be_synced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As on some shared folders; another trouble is told."""
    sync = os.fsync

    def of_files(descriptor: int) -> None:
        if os.path.isdir(f"/proc/self/fd/{descriptor}"):
            raise OSError(trouble, os.strerror(trouble))
        sync(descriptor)

    monkeypatch.setattr(os, "fsync", of_files)
    trouble = errno.EINVAL
    write_text(tmp_path / "file", "text")
    assert (tmp_path / "file").read_text() == "text"
    trouble = errno.EIO
    with pytest.raises(OSError, match=os.strerror(errno.EIO)):
        write_text(tmp_path / "file", "text")


def test_runs_of_one_second_get_folders_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(time, "strftime", lambda form: "20260101-000000")
    with contextlib.ExitStack() as begun:
        for name in ("mine", "mine-2", "mine-3"):
            folder = begun.enter_context(output_folder(None, "mine"))
            assert folder == Path(f"results/20260101-000000-{name}")
            create_run(folder, {"command": ["x"]}, {})
    assert len(list(Path("results").glob("*-mine*"))) == 3


def test_a_refused_run_leaves_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="no such map"), output_folder(None, "mine"):
        raise InputError("no such map")
    assert list(tmp_path.iterdir()) == []
