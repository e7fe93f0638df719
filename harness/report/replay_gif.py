"""A recorded delivery as an animated GIF.

The whole of it, from above, with the robot in the middle.
"""

import itertools
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from harness.economics.accountings import is_grave
from harness.metrics.replay_log import plans_of, scan_points
from harness.report.map_picture import draw_scene
from harness.report.replay import Replay
from harness.storage.files import replacing, writing
from harness.world.map.scene import Scene
from harness.world.map.shapes import Rect
from navstack.geometry import transform_points
from navstack.types import FloatArray, Pose2D

if TYPE_CHECKING:
    from matplotlib.axes import Axes

FRAMES_PER_SECOND = 10
SPEED = 4.0  # times as fast as it was
MOST_FRAMES = 240  # a longer delivery is shown faster
LAST = 15  # frames that show the end
REACH = 10.0  # [m] to the left and right of the robot
WIDTH_INCH, HEIGHT_INCH, DPI = 6.4, 5.0, 80
ROBOT, BELIEF, PERSON, SCAN, PLAN, CONTACT = (
    "#0b6e4f",
    "#c2541b",
    "#7b3fa0",
    "#d1242f",
    "#2f5fb3",
    "#d1242f",
)


def write_gif(path: Path, replay: Replay, scene: Scene | None) -> int:
    """Write a recorded delivery; returns the number of frames.

    Args:
        path: of the file.
        replay: what to show.
        scene: where it was; None: on white ground.

    Raises:
        InputError: the file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(WIDTH_INCH, HEIGHT_INCH), dpi=DPI)
    canvas: Any = FigureCanvasAgg(figure)  # matplotlib does not type what Agg adds
    picture = _Picture(figure.add_axes((0.0, 0.0, 1.0, 0.92)), replay, scene)
    told = figure.text(0.015, 0.945, "", fontsize=10, family="monospace")
    times, speed = frame_times(float(replay.arrays["trace"][-1, 0]))
    frames = []
    for number, time in enumerate(times):
        cost = picture.show(time)
        told.set_text(f"{time:5.1f} s ({speed:.3g} x)   costs of contacts {cost:.2f} $")
        if number >= len(times) - LAST:
            told.set_text(replay.ending)
        canvas.draw()
        frames.append(Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy()))
    duration = 1000 // FRAMES_PER_SECOND
    with writing(path), replacing(path) as stream:
        frames[0].save(
            stream, "GIF", save_all=True, append_images=frames[1:], duration=duration, loop=0
        )
    return len(times)


def frame_times(end: float) -> tuple[list[float], float]:
    """When each frame is [s], the last moment held for a while, and how many times as fast that plays."""
    speed = max(SPEED, end * FRAMES_PER_SECOND / MOST_FRAMES)
    times = np.arange(0.0, end, speed / FRAMES_PER_SECOND).tolist()
    return [*times, *itertools.repeat(end, LAST)], speed


class _Picture:
    """The place with what moves on it."""

    def __init__(self, axes: "Axes", replay: Replay, scene: Scene | None) -> None:
        from matplotlib.collections import EllipseCollection
        from matplotlib.patches import Polygon

        arrays, footprint = replay.arrays, replay.footprint
        self._axes, self._arrays, self._footprint = axes, arrays, footprint
        self._trace: FloatArray = arrays["trace"]
        self._plans = plans_of(arrays)
        self._grave = [each for each in replay.contacts if is_grave(each)]
        low, high = (
            self._trace[:, 1:3].min(axis=0) - 2 * REACH,
            self._trace[:, 1:3].max(axis=0) + 2 * REACH,
        )
        if scene is not None:
            draw_scene(axes, scene, Rect(*low.tolist(), *high.tolist()))
        axes.set(xticks=[], yticks=[], xlabel="", ylabel="", aspect="equal")
        (self._way,) = axes.plot([], [], color=ROBOT, lw=2.5, alpha=0.5, zorder=5)
        (self._plan,) = axes.plot([], [], "--", color=PLAN, lw=1.5, zorder=5)
        (self._scan,) = axes.plot([], [], ".", color=SCAN, ms=2.5, zorder=6)
        (self._hits,) = axes.plot([], [], "X", color=CONTACT, ms=12, mec="white", zorder=9)
        size = [2.0 * replay.person_radius] * max(arrays["crowd"].shape[1], 1)
        self._people = EllipseCollection(
            size,
            size,
            np.zeros(len(size)),
            units="xy",
            offset_transform=axes.transData,
            zorder=7,
            fc=PERSON,
            ec="white",
        )
        axes.add_collection(self._people, autolim=False)
        self._robot = Polygon(footprint, fc=ROBOT, ec="white", lw=1.0, zorder=8)
        self._belief = Polygon(footprint, fill=False, ec=BELIEF, lw=1.2, ls="--", zorder=8)
        for patch in (self._robot, self._belief):
            axes.add_patch(patch)

    def show(self, time: float) -> float:
        """Show a moment [s]; returns what contacts have cost until then [USD]."""
        place = max(int(np.searchsorted(self._trace[:, 0], time + 1e-6)) - 1, 0)
        row = self._trace[place]
        x, y = row[1:3].tolist()
        self._robot.set_xy(transform_points(Pose2D(*row[1:4].tolist()), self._footprint))
        self._belief.set_visible(bool(np.isfinite(row[6:9]).all()))
        if self._belief.get_visible():
            self._belief.set_xy(transform_points(Pose2D(*row[6:9].tolist()), self._footprint))
        self._way.set_data(self._trace[: place + 1, 1], self._trace[: place + 1, 2])
        crowd = self._arrays["crowd"][place]
        self._people.set_offsets(crowd if len(crowd) else np.full((1, 2), np.nan))
        plan = next(
            (points for stamp, points in reversed(self._plans) if stamp <= time + 1e-6),
            np.empty((0, 2)),
        )
        self._plan.set_data(plan[:, 0], plan[:, 1])
        scan = int(np.searchsorted(self._arrays["scan_stamp"], time + 1e-6)) - 1
        ends = scan_points(self._arrays, scan) if scan >= 0 else np.empty((0, 2))
        self._scan.set_data(ends[:, 0], ends[:, 1])
        hits = [each for each in self._grave if each["stamp_s"] <= time + 1e-6]
        self._hits.set_data([each["x_m"] for each in hits], [each["y_m"] for each in hits])
        height = REACH * HEIGHT_INCH * self._axes.get_position().height / WIDTH_INCH
        self._axes.set(xlim=(x - REACH, x + REACH), ylim=(y - height, y + height))
        return float(sum(each["cost_usd"] or 0.0 for each in hits))
