"""``navbench replay --rerun``: what the viewer is given, read back with Rerun's own reader."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

from harness.cli import main
from harness.manifest import map_digest
from harness.metrics import EPISODE_COLUMNS, EVENT_COLUMNS
from harness.report import replay_rerun
from harness.table_files import read_rows
from harness.world.scene_io import load_scene


@pytest.fixture
def folder(write_run: Callable[..., Path], record: Callable[..., None]) -> Path:
    """A run of one stack with one recorded delivery, in which people were hit."""

    def short(row: dict[str, Any]) -> None:
        row["duration_s"] = 20.0

    made = write_run("one", episodes=4, crowd=3.0, change=short, map_sha256=map_digest(load_scene("sidewalk")))
    record(made, "mine", range(1, 2))
    return made


def tables_of(path: Path) -> dict[str, pa.Table]:
    """What was logged by entity."""
    reader = pytest.importorskip("rerun.chunk", reason="rerun-sdk is not installed").RrdReader
    batches: dict[str, list[pa.RecordBatch]] = {}
    for chunk in reader(str(path)).stream():
        batches.setdefault(chunk.entity_path, []).append(chunk.to_record_batch())
    return {entity: pa.Table.from_batches(each) for entity, each in batches.items()}


def times(table: pa.Table) -> list[float]:
    return [value / 1e9 for value in table.column(replay_rerun.TIMELINE).cast(pa.int64()).to_pylist()]


def test_the_viewer_is_given_the_whole_delivery(
    folder: Path, tmp_path: Path, make_arrays: Callable[..., dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    rerun = pytest.importorskip("rerun", reason="rerun-sdk is not installed")
    path = tmp_path / "one.rrd"
    monkeypatch.setattr(rerun.RecordingStream, "spawn", lambda stream: stream.save(str(path)))
    with pytest.raises(SystemExit) as ended:
        main(["replay", str(folder), "1", "--rerun"])
    assert ended.value.code == 0

    arrays = make_arrays(read_rows(folder / "episodes.parquet", EPISODE_COLUMNS)[1], 1)
    found, trace = tables_of(path), arrays["trace"]
    for entity in ("/robot", "/belief", "/people", "/tracks", "/speed"):
        np.testing.assert_allclose(times(found[entity]), trace[:, 0], atol=1e-8)
    np.testing.assert_allclose(times(found["/scan"]), arrays["scan_stamp"], atol=1e-8)
    np.testing.assert_allclose(times(found["/plan"]), arrays["plan_stamp"], atol=1e-8)
    people = np.array(found["/people"].column("Points3D:positions").to_pylist())
    np.testing.assert_allclose(people[:, :, :2], arrays["crowd"], atol=1e-4)
    outline = np.array(found["/robot"].column("LineStrips3D:strips").to_pylist())[:, 0]
    assert np.all(np.hypot(*(outline[:, :, :2] - trace[:, None, 1:3]).T) < 1.5), "the robot is drawn where it was"
    speeds = [values[0] for values in found["/speed"].column("Scalars:scalars").to_pylist()]
    np.testing.assert_allclose(speeds, trace[:, 4])

    events = [each for each in read_rows(folder / "events.parquet", EVENT_COLUMNS) if each["episode"] == 1]
    touched = [table for entity, table in found.items() if entity.startswith("/contacts/")]
    assert sorted(time for table in touched for time in times(table)) == sorted(each["stamp_s"] for each in events)
    costs = [values[0] for values in found["/cost_of_contacts"].column("Scalars:scalars").to_pylist()]
    assert (costs[0], costs[-1]) == (0.0, pytest.approx(sum(each["cost_usd"] or 0.0 for each in events)))
    corners = np.array(found["/map"].column("Mesh3D:vertex_positions").to_pylist()[0])
    assert np.all(corners[:, :2].min(axis=0) <= trace[:, 1:3].min(axis=0))
    assert np.all(corners[:, :2].max(axis=0) >= trace[:, 1:3].max(axis=0))


def test_a_missing_viewer_is_said_in_one_line(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(replay_rerun, "find_spec", lambda name: None)
    with pytest.raises(SystemExit) as ended:
        main(["replay", str(folder), "1", "--rerun"])
    err = capsys.readouterr().err
    assert (ended.value.code, err.count("\n")) == (1, 1) and "pip install 'navbench[rerun]'" in err, err
