"""Run folders keep what is finished."""

import json
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from harness.runs import JOURNAL, RunFolder
from navstack.errors import InputError

TABLES = {
    "episodes": {"stack_number": "int64", "episode": "int64", "distance_m": "double"},
    "events": {"episode": "int64", "impulse_ns": "double"},
    "timings": {"episode": "int64", "wall_s": "double"},
}


def record(stack: int, episode: int) -> dict[str, object]:
    row = {"stack_number": stack, "episode": episode, "distance_m": 10.0 * stack + episode}
    events = [{"episode": episode, "impulse_ns": 50.0}] if episode else []
    return {"row": row, "events": events, "timing": {"episode": episode, "wall_s": 0.1}}


def write_run(path: Path, order: list[tuple[int, int]]) -> None:
    with RunFolder(path, {"command": ["x"]}, {"a.yaml": "x: 1\n"}, TABLES) as folder:
        for stack, episode in order:
            folder.add(record(stack, episode))


def test_tables_do_not_depend_on_the_order_of_work(tmp_path: Path) -> None:
    order = [(0, 0), (0, 1), (1, 0), (1, 1)]
    write_run(tmp_path / "a", order)
    write_run(tmp_path / "b", order[::-1])
    for table in TABLES:
        name = f"{table}.parquet"
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    assert pq.read_table(tmp_path / "a" / "episodes.parquet")["distance_m"].to_pylist() == [0.0, 1.0, 10.0, 11.0]


def test_a_finished_episode_is_on_disk_before_the_next(tmp_path: Path) -> None:
    folder = RunFolder(tmp_path / "run", {}, {}, TABLES)
    folder.add(record(0, 0))
    lines = (tmp_path / "run" / JOURNAL).read_text().splitlines()
    assert [json.loads(line)["row"]["episode"] for line in lines] == [0]
    folder.close()


def test_an_interrupt_keeps_the_finished_rows(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), RunFolder(tmp_path / "run", {}, {}, TABLES) as folder:
        folder.add(record(0, 0))
        raise KeyboardInterrupt
    assert pq.read_table(tmp_path / "run" / "episodes.parquet").num_rows == 1
    assert not (tmp_path / "run" / JOURNAL).exists()


def test_no_episodes_still_gives_readable_tables(tmp_path: Path) -> None:
    write_run(tmp_path / "run", [])
    assert pq.read_table(tmp_path / "run" / "events.parquet").column_names == ["episode", "impulse_ns"]


def test_a_folder_in_use_is_refused(tmp_path: Path) -> None:
    write_run(tmp_path / "run", [])
    with pytest.raises(InputError, match="not empty"):
        write_run(tmp_path / "run", [])


def test_a_folder_that_cannot_be_made_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        write_run(tmp_path / "file" / "run", [])


def test_latest_points_to_the_newest_run(tmp_path: Path) -> None:
    write_run(tmp_path / "results" / "one", [(0, 0)])
    write_run(tmp_path / "results" / "two", [(0, 0), (0, 1)])
    assert pq.read_table(tmp_path / "results" / "latest" / "episodes.parquet").num_rows == 2
