"""Whatever moment a program is interrupted at, the next one goes on with a folder that is whole."""

import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from harness.execution.executors import WorkerProcess
from harness.execution.workers import Workers
from harness.meetings.kept import FILE, kept_missions
from harness.storage import manifest_file
from harness.storage.checksums import changed_files, write_checksums
from harness.storage.documents import json_text
from harness.storage.files import arriving_together, nearby, replacing, write_text
from harness.storage.manifest_file import NEXT, extend_run, read_manifest, require_unchanged
from harness.storage.new_run import MANIFEST, create_run
from harness.storage.run_folder import RunFolder
from navstack.errors import InputError

from .test_runs import ORDER, TABLES, record


@pytest.fixture
def run(tmp_path: Path) -> Path:
    create_run(tmp_path / "run", {"episodes": 2, "stacks": [{}]}, {"a.yaml": "x: 1\n"})
    return tmp_path / "run"


def test_an_extension_on_a_full_disk_changes_nothing(
    run: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(folder: Path, coming: object) -> None:
        raise OSError(27, "File too large")

    before = (run / MANIFEST).read_bytes()
    with monkeypatch.context() as patch, pytest.raises(InputError, match="File too large"):
        patch.setattr(manifest_file, "write_checksums", full)
        extend_run(run, 5, seen=0)
    assert (run / MANIFEST).read_bytes() == before and not (run / NEXT).exists()
    require_unchanged(run)
    extend_run(run, 5, seen=0)
    assert read_manifest(run)["episodes"] == 5


def test_an_extension_that_was_killed_in_the_midst_is_finished(run: Path) -> None:
    manifest = json_text({**read_manifest(run), "episodes": 5})
    write_text(run / NEXT, manifest)
    require_unchanged(run)
    assert read_manifest(run)["episodes"] == 2 and not (run / NEXT).exists()
    write_text(run / NEXT, manifest)
    write_checksums(run, {MANIFEST: manifest})
    require_unchanged(run)
    assert read_manifest(run)["episodes"] == 5 and not (run / NEXT).exists()


def test_a_summary_that_is_missing_is_written_by_the_next_program(run: Path) -> None:
    with RunFolder(run, TABLES, 1) as folder:
        folder.add(record(*ORDER[0]))
        folder.write_summary({"deliveries": 1})
    with RunFolder(run, TABLES, 2) as folder:
        folder.add(record(*ORDER[1]))
    assert not (run / "summary.json").exists(), "that of one delivery"
    with RunFolder(run, TABLES, 2) as folder:
        assert folder.is_closed and folder.lacks_summary
        folder.write_summary({"deliveries": 2})
    assert changed_files(run, is_finished=True) == []


def test_a_second_interrupt_leaves_no_worker_at_work(monkeypatch: pytest.MonkeyPatch) -> None:
    ended = []

    def interrupted(self: WorkerProcess) -> str:
        raise KeyboardInterrupt

    def kill(self: WorkerProcess) -> None:
        ended.append(self)
        original(self)

    original = WorkerProcess.kill
    with Workers(2) as workers:
        results = workers.run(time.sleep, [60.0, 60.0, 0.0])
        monkeypatch.setattr(WorkerProcess, "kill", kill)
        with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
            patch.setattr(WorkerProcess, "ending", property(interrupted))
            patch.setattr(Workers, "_ended", lambda self, running: _interrupt())
            next(results)
        assert len({*ended}) == 2


def _interrupt() -> None:
    raise KeyboardInterrupt


def test_a_damaged_mission_is_told_and_a_cut_one_left_out(tmp_path: Path) -> None:
    kept = kept_missions(tmp_path)
    for _ in range(4):
        kept.add(None)
    file = tmp_path / FILE
    whole = file.read_bytes()
    file.write_bytes(whole[:-5])
    assert kept_missions(tmp_path, is_ours=True).number == 3
    file.write_bytes(whole.replace(b"mission", b"miszion", 1))
    with pytest.raises(InputError, match="line 1 of 4 is damaged; restore the file"):
        kept_missions(tmp_path, is_ours=True)
    assert file.read_bytes().count(b"\n") == 4


def test_two_writers_of_a_file_write_it_whole(tmp_path: Path) -> None:
    def write(text: bytes) -> None:
        with replacing(tmp_path / "file") as stream:
            stream.write(text)
            both.wait()

    both = threading.Barrier(2, timeout=10.0)
    threads = [threading.Thread(target=write, args=(each * 9000,)) for each in (b"x", b"y")]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (tmp_path / "file").read_bytes() in (b"x" * 9000, b"y" * 9000)
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_two_makers_of_a_map_keep_their_files_apart(tmp_path: Path) -> None:
    with (
        arriving_together(tmp_path, "town") as first,
        arriving_together(tmp_path, "town") as second,
    ):
        (first / "town.yaml").write_text("one")
        (second / "town.yaml").write_text("two")
    assert (tmp_path / "town.yaml").read_text() == "one", "which came last"
    assert [path.name for path in tmp_path.iterdir()] == ["town.yaml"]


def test_a_folder_that_is_gone_is_no_reason_to_stop(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    assert nearby(tmp_path / "run") == tmp_path / "run"
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("closed", ["<&- >&-", "<&- 2>&-", "<&- >&- 2>&-"])
def test_streams_that_are_closed_are_replaced(closed: str) -> None:
    lines = "from navbench.cli.streams import provide_streams; provide_streams()"
    lines += "; import harness.world.physics.engine"
    command = f'"{sys.executable}" -c "{lines}" {closed}'
    assert subprocess.run(["bash", "-c", command], timeout=60, check=False).returncode == 0
