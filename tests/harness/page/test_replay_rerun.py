"""``navbench replay --rerun``: what the viewer is given, read back with Rerun's own reader."""

import json
import shutil
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pytest

from harness.economics.accountings import is_grave
from harness.metrics.columns import EPISODE_COLUMNS, EVENT_COLUMNS
from harness.report import replay_rerun
from harness.report.replay import contacts_shown
from harness.storage.checksums import write_checksums
from harness.storage.tables import read_rows
from harness.world.map.scene_io import load_scene
from navbench.cli.app import main
from navstack.costmap.occupancy_grid import SOLID_FROM


def tables_of(path: Path) -> dict[str, pa.Table]:
    """What was logged by entity."""
    from rerun.chunk import RrdReader

    batches: dict[str, list[pa.RecordBatch]] = {}
    for chunk in RrdReader(str(path)).stream():
        batches.setdefault(chunk.entity_path, []).append(chunk.to_record_batch())
    return {entity: pa.Table.from_batches(each) for entity, each in batches.items()}


def times(table: pa.Table) -> list[float]:
    return [
        value / 1e9 for value in table.column(replay_rerun.TIMELINE).cast(pa.int64()).to_pylist()
    ]


@pytest.fixture
def shown(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[[], dict[str, pa.Table]]:
    """Drives ``navbench replay --rerun`` on the recorded delivery; what the viewer would show."""
    pytest.importorskip("rerun", reason="rerun-sdk is not installed")
    path = tmp_path / "one.rrd"
    monkeypatch.setattr(replay_rerun, "open_viewer", lambda given: shutil.copy(given, path))

    def show() -> dict[str, pa.Table]:
        with pytest.raises(SystemExit) as ended:
            main(["replay", str(folder), "1", "--rerun"])
        assert ended.value.code == 0
        return tables_of(path)

    return show


def test_the_viewer_is_given_the_whole_delivery(
    shown: Callable[[], dict[str, pa.Table]],
    folder: Path,
    make_arrays: Callable[..., dict[str, Any]],
) -> None:
    found = shown()
    arrays = make_arrays(read_rows(folder / "episodes.parquet", EPISODE_COLUMNS)[1], 1)
    trace = arrays["trace"]
    for entity in ("/robot", "/belief", "/people", "/tracks", "/speed"):
        np.testing.assert_allclose(times(found[entity]), trace[:, 0], atol=1e-8)
    np.testing.assert_allclose(times(found["/scan"]), arrays["scan_stamp"], atol=1e-8)
    np.testing.assert_allclose(times(found["/plan"]), arrays["plan_stamp"], atol=1e-8)
    people = np.array(found["/people"].column("Points3D:positions").to_pylist())
    np.testing.assert_allclose(people[:, :, :2], arrays["crowd"], atol=1e-4)
    outline = np.array(found["/robot"].column("LineStrips3D:strips").to_pylist())[:, 0]
    assert np.all(np.hypot(*(outline[:, :, :2] - trace[:, None, 1:3]).T) < 1.5), (
        "the robot is drawn where it was"
    )
    speeds = [values[0] for values in found["/speed"].column("Scalars:scalars").to_pylist()]
    np.testing.assert_allclose(speeds, trace[:, 4])


def test_contacts_and_their_costs_are_shown(
    shown: Callable[[], dict[str, pa.Table]], folder: Path
) -> None:
    found = shown()
    rows = read_rows(folder / "events.parquet", EVENT_COLUMNS)
    expected = contacts_shown([each for each in rows if each["episode"] == 1])
    grave = [is_grave(each) for each in expected]
    assert any(grave) and sum(each["cost_usd"] or 0.0 for each in expected) > 0.0
    touched = [found[f"/contacts/{number}"] for number in range(len(expected))]
    np.testing.assert_allclose(
        [times(each)[0] for each in touched], [each["stamp_s"] for each in expected]
    )
    places = [each.column("Points3D:positions").to_pylist()[0][0][:2] for each in touched]
    np.testing.assert_allclose(places, [(each["x_m"], each["y_m"]) for each in expected], rtol=1e-5)
    colours = [each.column("Points3D:colors").to_pylist()[0][0] for each in touched]
    assert colours == [replay_rerun.RED if each else replay_rerun.GREY for each in grave]
    for each, event in zip(touched, expected, strict=True):
        if is_grave(event):
            (label,) = each.column("Points3D:labels").to_pylist()[0]
            assert (
                label
                == f"{event['kind']}, {event['impulse_ns']:.0f} N s, {event['cost_usd']:.2f} $"
            )
    costs = [
        values[0] for values in found["/cost_of_contacts"].column("Scalars:scalars").to_pylist()
    ]
    assert (costs[0], costs[-1]) == (
        0.0,
        pytest.approx(sum(each["cost_usd"] or 0.0 for each in expected)),
    )


def test_the_map_lies_where_it_is(shown: Callable[[], dict[str, pa.Table]]) -> None:
    ground = shown()["/map"]
    corners, texture_places = (
        np.array(ground.column(f"Mesh3D:{name}").to_pylist()[0])
        for name in ("vertex_positions", "vertex_texcoords")
    )
    width, height = (
        int(ground.column("Mesh3D:albedo_texture_format").to_pylist()[0][0][key])
        for key in ("width", "height")
    )
    picture = np.array(
        ground.column("Mesh3D:albedo_texture_buffer").to_pylist()[0][0], dtype=np.uint8
    )
    shades = picture.reshape(height, width, 3)[:, :, 0]
    grid = load_scene("sidewalk").geometry
    low, high = corners[0, :2], corners[2, :2]
    assert texture_places[0].tolist() == [0.0, 0.0], "a picture's first row lies at the lowest y"
    rng = np.random.default_rng(0)
    for x, y in rng.uniform(low, high, (500, 2)):
        column, row = ((np.array((x, y)) - low) / grid.resolution).astype(int)
        is_solid = grid.value_at(float(x), float(y)) >= SOLID_FROM
        assert (shades[row, column] == replay_rerun.SOLID_SHADE) == is_solid


def test_a_map_that_has_changed_is_left_out_with_a_note(
    shown: Callable[[], dict[str, pa.Table]], folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    about = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    (folder / "run.json").write_text(
        json.dumps({**about, "map_sha256": "0" * 64}), encoding="utf-8"
    )
    write_checksums(folder)
    assert "/map" not in shown()
    err = capsys.readouterr().err
    assert (
        "note: the replay has no map: map 'sidewalk' has changed since the run" in err
        and err.count("\n") == 1
    )


@pytest.mark.skipif(find_spec("rerun") is None, reason="rerun-sdk is not installed")
def test_without_a_screen_it_ends_with_one_line(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(SystemExit) as ended:
        main(["replay", str(folder), "1", "--rerun"])
    err = capsys.readouterr().err
    assert (ended.value.code, err.count("\n")) == (1, 1), err
    assert "the Rerun viewer ended with status 1" in err and "use --html or --mcap" in err


@pytest.mark.parametrize(
    ("installed", "said"),
    [
        (None, "pip install 'navbench[rerun]'"),
        ("0.22.1", "needs rerun-sdk 0.41 or newer, and 0.22.1 is installed"),
    ],
)
def test_a_missing_or_old_viewer_is_said_in_one_line(
    folder: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    installed: str | None,
    said: str,
) -> None:
    def version(name: str) -> str:
        if installed is None:
            raise PackageNotFoundError(name)
        return installed

    monkeypatch.setattr(replay_rerun, "version", version)
    with pytest.raises(SystemExit) as ended:
        main(["replay", str(folder), "1", "--rerun"])
    err = capsys.readouterr().err
    assert (ended.value.code, err.count("\n"), said in err) == (1, 1, True), err
