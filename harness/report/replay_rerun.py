"""A recorded delivery in the Rerun viewer (rerun.io), which is an optional dependency."""

import os
import shutil
import subprocess
import sysconfig
import tempfile
from collections.abc import Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np
from rich.text import Text

from harness.economics.accountings import is_grave
from harness.metrics.columns import Row
from harness.metrics.replay_log import plans_of, scan_points, tracks_of
from harness.report.replay import Replay, grid_around
from navstack.costmap.occupancy_grid import SOLID_FROM, UNKNOWN, OccupancyGrid
from navstack.errors import InputError
from navstack.geometry import transform_points
from navstack.types import FloatArray, Pose2D

GREEN, PURPLE, RED, BLUE, ORANGE, AMBER = (
    0x0B6E4FFF,
    0x7B3FA0FF,
    0xD1242FFF,
    0x2F5FB3FF,
    0xC2541BFF,
    0xB4690EFF,
)
GREY = 0x808080FF
FREE_SHADE, UNKNOWN_SHADE, SOLID_SHADE = 235, 170, 70  # of the map
# [m] z of the map and of contacts, so that nothing hides what lies on it
MAP_DEPTH, TOP = -0.05, 0.1
EYE = 10.0, 25.0  # [m] of the viewer's camera behind and above the robot
TIMELINE = "delivery"
OLDEST = (0, 41)  # version of rerun-sdk


def require_rerun() -> None:
    """Check that rerun-sdk is there.

    Raises:
        InputError: it is not installed, or too old.
    """
    try:
        installed = version("rerun-sdk")
    except PackageNotFoundError:
        raise InputError(
            "--rerun needs the Rerun viewer, which is not installed; run: pip install 'navbench[rerun]'"
        ) from None
    if tuple(map(int, installed.split(".")[:2])) < OLDEST:
        oldest = ".".join(map(str, OLDEST))
        raise InputError(
            f"--rerun needs rerun-sdk {oldest} or newer, and {installed} is installed; run: pip install -U rerun-sdk"
        )


def show_in_rerun(replay: Replay, grid: OccupancyGrid | None) -> None:
    """Open the viewer with a delivery; ends when the viewer is closed.

    Args:
        replay: what to show.
        grid: the map; None, or far from the way: it is not shown.

    Raises:
        InputError: rerun-sdk is not installed or too old, or the viewer failed.
    """
    require_rerun()
    import rerun as rr

    arrays, stream = replay.arrays, rr.RecordingStream(replay.name)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "delivery.rrd"
        stream.save(path)
        stream.send_blueprint(_layout(arrays["trace"][0, 1:3].tolist()))
        part = None if grid is None else grid_around(grid, arrays["trace"])
        if part is not None:
            _log_map(rr, stream, part)
        _log_rows(rr, stream, replay)
        _log_scans(rr, stream, arrays)
        for stamp, plan in plans_of(arrays):
            stream.set_time(TIMELINE, duration=stamp)
            stream.log("plan", rr.LineStrips3D([_flat(plan)] if len(plan) else [], colors=BLUE))
        _log_contacts(rr, stream, replay.contacts, float(arrays["trace"][0, 0]))
        stream.disconnect()
        open_viewer(path)


def open_viewer(path: Path) -> None:
    """Open the viewer with a file, and wait until it is closed.

    Raises:
        InputError: it is not there, or failed.
    """
    places = os.pathsep.join((sysconfig.get_path("scripts"), os.environ.get("PATH", os.defpath)))
    program = shutil.which("rerun", path=places)
    if program is None:
        raise InputError(
            "the program rerun is not found; run: pip install --force-reinstall 'navbench[rerun]'"
        )
    command = [program, "--bind", "127.0.0.1", "--port", "auto", str(path)]
    ended = subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False)
    if ended.returncode:
        told = [line for line in Text.from_ansi(ended.stderr).plain.splitlines() if line.strip()]
        raise InputError(
            f"the Rerun viewer ended with status {ended.returncode} ({told[-1] if told else 'it said nothing'}); it "
            "needs a screen: elsewhere use --html or --mcap"
        )


def _layout(start: tuple[float, float]) -> Any:
    """The viewer's panes: the place from above, with the robot in its middle, and beside it speed and costs."""
    import rerun.blueprint as rrb

    (x, y), (back, height) = start, EYE
    eye = rrb.EyeControls3D(
        position=(x, y - back, height),
        look_target=(x, y, 0.0),
        eye_up=(0.0, 0.0, 1.0),
        tracking_entity="robot",
    )
    place = rrb.Spatial3DView(name="delivery", eye_controls=eye)
    courses = [
        rrb.TimeSeriesView(name="speed [m/s]", contents="speed"),
        rrb.TimeSeriesView(name="costs of contacts [$]", contents="cost_of_contacts"),
    ]
    return rrb.Blueprint(
        rrb.Horizontal(place, rrb.Vertical(*courses), column_shares=(3, 1)),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
    )


def _log_map(rr: Any, stream: Any, grid: OccupancyGrid) -> None:
    """The map as a picture on the ground."""
    shades = np.where(grid.data >= SOLID_FROM, SOLID_SHADE, FREE_SHADE)
    shades = np.where(grid.data == UNKNOWN, UNKNOWN_SHADE, shades).astype(np.uint8)
    corners = np.array(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)))
    size = np.array((grid.width, grid.height)) * grid.resolution
    ground = rr.Mesh3D(
        vertex_positions=_flat(corners * size + (grid.origin.x, grid.origin.y), MAP_DEPTH),
        triangle_indices=((0, 1, 2), (0, 2, 3)),
        vertex_texcoords=corners,
        albedo_texture=np.repeat(shades[:, :, np.newaxis], 3, axis=2),
    )
    stream.log("map", ground, static=True)


def _log_rows(rr: Any, stream: Any, replay: Replay) -> None:
    arrays, outline = replay.arrays, np.vstack((replay.footprint, replay.footprint[:1]))
    stream.log(
        "way",
        rr.LineStrips3D([_flat(arrays["trace"][:, 1:3])], colors=GREEN, radii=0.02),
        static=True,
    )
    for row, crowd, tracks in zip(arrays["trace"], arrays["crowd"], tracks_of(arrays), strict=True):
        stream.set_time(TIMELINE, duration=float(row[0]))
        for entity, pose, colour in (("robot", row[1:4], GREEN), ("belief", row[6:9], ORANGE)):
            if not np.isnan(pose).any():
                body = _flat(transform_points(Pose2D(*pose.tolist()), outline))
                stream.log(entity, rr.LineStrips3D([body], colors=colour, radii=0.03))
        there = crowd[np.isfinite(crowd).all(axis=1)]
        stream.log("people", rr.Points3D(_flat(there), radii=replay.person_radius, colors=PURPLE))
        arrows = rr.Arrows3D(
            origins=_flat(tracks[:, 1:3]), vectors=_flat(tracks[:, 3:5]), colors=AMBER
        )
        stream.log("tracks", arrows)
        stream.log("speed", rr.Scalars(float(row[4])))


def _log_scans(rr: Any, stream: Any, arrays: Mapping[str, Any]) -> None:
    """Where the beams ended, from where the robot really was."""
    for number, stamp in enumerate(arrays["scan_stamp"].tolist()):
        stream.set_time(TIMELINE, duration=stamp)
        stream.log("scan", rr.Points3D(_flat(scan_points(arrays, number)), radii=0.04, colors=RED))


def _log_contacts(rr: Any, stream: Any, events: Sequence[Row], first: float) -> None:
    """What was touched, from then on, and what it has cost [USD] since the first row's time [s]."""
    cost = 0.0
    stream.set_time(TIMELINE, duration=first)
    stream.log("cost_of_contacts", rr.Scalars(cost))
    for number, event in enumerate(events):
        grave = is_grave(event)
        cost += (event["cost_usd"] or 0.0) if grave else 0.0
        label = (
            f"{event['kind']}, {event['impulse_ns']:.0f} N s, {event['cost_usd'] or 0.0:.2f} $"
            if grave
            else None
        )
        place = _flat(np.array(((event["x_m"], event["y_m"]),)), TOP)
        style = {"radii": 0.2 if grave else 0.1, "colors": RED if grave else GREY, "labels": label}
        stream.set_time(TIMELINE, duration=float(event["stamp_s"]))
        stream.log(f"contacts/{number}", rr.Points3D(place, **style))
        stream.log("cost_of_contacts", rr.Scalars(cost))


def _flat(points: FloatArray, z: float = 0.0) -> FloatArray:
    """Points (n, 2) at a height [m], (n, 3)."""
    return np.column_stack((points, np.full(len(points), z)))
