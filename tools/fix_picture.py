"""A picture of satellite fixes along one recorded delivery.

Where they lie, and how far from the truth.

Usage: python -m tools.fix_picture RUN STACK EPISODE PICTURE [PRESET ...] (RUN made by
``navbench run --record full``; PRESET a name of ``params/sensors``, by default rtk_urban
consumer_gps).
"""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from harness.report.figures import FONT, own_settings, save_picture
from harness.report.map_picture import draw_scene
from harness.storage.shipped import resolve, shipped
from harness.task.study import RandomStreams
from harness.world.map.scene import Scene
from harness.world.map.scene_io import load_scene
from harness.world.map.shapes import Rect
from harness.world.physics.body_state import BodyState
from harness.world.sensors.gps_receiver import GpsReceiver
from harness.world.sensors.suite import SensorParams, sky_of
from navstack.errors import InputError
from navstack.params.strict import load_dataclass
from navstack.types import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PRESETS = ("rtk_urban", "consumer_gps")
MARGIN = 8.0  # [m] around the way
COLOURS = ("#1f77b4", "#d1242f", "#7b3fa0", "#b8860b")
TRUTH, HIDDEN = "#111111", "#8a8a8a"
WIDTH_INCH, HEIGHT_INCH, DPI = 9.0, 4.4, 180
GAP = 1.0  # [s] without a fix over which no line is drawn
_LAYOUT: dict[str, Any] = {"width_ratios": (1.0, 1.7), "height_ratios": (3.0, 1.0)}


def draw_fixes(
    run: Path,
    stack: str,
    episode: int,
    picture: Path,
    presets: tuple[str, ...] = PRESETS,
) -> None:
    """Draw the fixes that receivers would have had along a delivery of a run folder into a PNG.

    Raises:
        InputError: the run has no recording of this delivery, or a preset is unknown.
    """
    from matplotlib.figure import Figure

    recording = run / "recordings" / f"{stack}-{episode}.npz"
    if not recording.is_file():
        raise InputError(
            f"{recording} does not exist; make the run with --record full and give a stack and "
            "episode of it"
        )
    with np.load(recording, allow_pickle=False) as arrays:
        way = arrays["trace"][:, :3]
    settings = json.loads((run / "run.json").read_text(encoding="utf-8"))
    scene = load_scene(settings["map_name"])
    measured = {name: fixes_along(way, scene, name, settings["seed"], episode) for name in presets}
    with own_settings(**FONT):
        figure = Figure(figsize=(WIDTH_INCH, HEIGHT_INCH), dpi=DPI, layout="constrained")
        places, errors, sky = figure.subplot_mosaic(
            [["places", "errors"], ["places", "sky"]], **_LAYOUT
        ).values()
        _draw_places(places, scene, way, measured)
        _draw_errors(errors, measured)
        _draw_sky(sky, way, scene)
        save_picture(figure, picture)


def fixes_along(way: FloatArray, scene: Scene, preset: str, seed: int, episode: int) -> FloatArray:
    """The fixes (n, 4) of a preset's receiver on a way.

    Stamp [s], error along x and y [m], stated deviation [m].

    Args:
        way: (m, >= 3) stamp [s], true x, y [m].
        scene: what hides the sky.
        preset: a name of ``params/sensors`` or a file.
        seed: of the run; the draws are those that the delivery would have had.
        episode: of the run.
    """
    file = resolve(preset, shipped("params") / "sensors", "sensor preset")
    params = load_dataclass(SensorParams, file).gps
    receiver = GpsReceiver(params, sky_of(scene))
    stamps = np.arange(way[0, 0], way[-1, 0], 1.0 / params.rate)
    xs = np.interp(stamps, way[:, 0], way[:, 1])
    ys = np.interp(stamps, way[:, 0], way[:, 2])
    receiver.reset(BodyState(xs[0], ys[0]), RandomStreams(seed, episode)["gps"])
    rows = []
    for stamp, x, y in zip(stamps, xs, ys, strict=True):
        fix = receiver.measure(BodyState(x, y), np.empty((0, 4)), stamp)
        if fix is not None:
            rows.append((stamp, fix.x - x, fix.y - y, fix.position_std))
    return np.array(rows).reshape(-1, 4)


def _draw_places(
    axes: "Axes",
    scene: Scene,
    way: FloatArray,
    measured: dict[str, FloatArray],
) -> None:
    low, high = way[:, 1:3].min(axis=0) - MARGIN, way[:, 1:3].max(axis=0) + MARGIN
    draw_scene(axes, scene, Rect(*low.tolist(), *high.tolist()))
    # The least accurate below the others.
    for (name, fixes), colour in reversed(list(zip(measured.items(), COLOURS, strict=False))):
        x, y = (np.interp(fixes[:, 0], way[:, 0], way[:, k]) + fixes[:, k] for k in (1, 2))
        axes.plot(x, y, ".", ms=3.0, color=colour, zorder=5, label=name)
    axes.plot(*way[:, 1:3].T, color=TRUTH, lw=1.0, zorder=6, label="true way")
    axes.legend(
        loc="upper center",
        bbox_to_anchor=(0.5, -0.1),
        ncols=3,
        fontsize=7,
        frameon=False,
        handletextpad=0.2,
    )


def _draw_errors(axes: "Axes", measured: dict[str, FloatArray]) -> None:
    """Distance of each fix from the truth, and the RMS that its stated deviation implies."""
    for (name, fixes), colour in zip(measured.items(), COLOURS, strict=False):
        errors = np.hypot(fixes[:, 1], fixes[:, 2])
        size = f"RMS {np.sqrt(np.mean(errors**2)):.2f} m" if len(errors) else "no fix"
        axes.plot(fixes[:, 0], errors, ".", ms=3.0, color=colour, label=f"{name}, {size}")
        stated = np.sqrt(2.0) * fixes[:, 3]
        stated[1:][np.diff(fixes[:, 0]) > GAP] = np.nan
        axes.plot(fixes[:, 0], stated, color=colour, lw=1.0, label="as the fix states it")
    axes.set_yscale("log")
    axes.set(ylabel="distance from the truth [m]", xticklabels=[])
    axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, fontsize=7, frameon=False)


def _draw_sky(axes: "Axes", way: FloatArray, scene: Scene) -> None:
    sky = sky_of(scene)
    axes.fill_between(
        way[:, 0],
        [sky.hidden(x, y) for x, y in way[:, 1:3]],
        color=HIDDEN,
        alpha=0.4,
        lw=0,
    )
    axes.set(xlabel="time [s]", ylabel="hidden sky [-]", ylim=(0.0, 1.0))


if __name__ == "__main__":
    try:
        draw_fixes(
            Path(sys.argv[1]),
            sys.argv[2],
            int(sys.argv[3]),
            Path(sys.argv[4]),
            tuple(sys.argv[5:]) or PRESETS,
        )
    except (InputError, IndexError, ValueError) as error:
        sys.exit(str(error) if isinstance(error, InputError) else (__doc__ or "").strip())
