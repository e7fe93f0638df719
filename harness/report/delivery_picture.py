"""A picture of one recorded delivery: where the robot drove, where people walked, what it touched.

Usage: python -m harness.report.delivery_picture RUN STACK EPISODE PICTURE
(RUN made by ``navbench run --record full``).
"""

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from harness.report.figures import save_picture
from harness.report.map_picture import draw_scene
from harness.world.scene_io import load_scene
from harness.world.shapes import Rect
from navstack.errors import InputError
from navstack.types import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MARGIN = 6.0  # [m] around the trajectory
ASPECT = (0.42, 0.75)  # height over width of the picture, at the least and at the most
NEAR = 15.0  # [m] from the robot within which a person's steps are drawn
WIDTH_INCH, DPI = 9.0, 180
STRIP_INCH = 0.36  # above the map for the title, below it for the legend
OUTCOMES = {"sla": "delivered intact", "spoiled": "delivered, food spoiled"}
ROBOT, PEOPLE, GOAL, CONTACT = "#0b6e4f", "#7b3fa0", "#0b6e4f", "#d1242f"


def draw_delivery(run: Path, stack: str, episode: int, picture: Path) -> None:
    """Draw one delivery of a run folder into a PNG.

    Raises:
        InputError: the run has no recording of this delivery.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    recording = run / "recordings" / f"{stack}-{episode}.npz"
    if not recording.is_file():
        raise InputError(
            f"{recording} does not exist; make the run with --record full and give a stack and episode of it"
        )
    with np.load(recording, allow_pickle=False) as arrays:
        trace, crowd = arrays["trace"], arrays["crowd"]
    row, events = _rows(run, stack, episode)
    scene = load_scene(json.loads((run / "run.json").read_text(encoding="utf-8"))["map_name"])
    bounds = _bounds(trace, row)
    height = WIDTH_INCH * bounds.depth / bounds.width
    total = height + 2 * STRIP_INCH
    figure = Figure(figsize=(WIDTH_INCH, total), dpi=DPI)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.0, STRIP_INCH / total, 1.0, height / total))
    draw_scene(axes, scene, bounds)
    _draw_people(axes, trace, crowd)
    _draw_robot(figure, axes, trace, row, STRIP_INCH / total)
    _draw_contacts(axes, events)
    axes.set_xticks([])
    axes.set_yticks([])
    axes.set(xlabel="", ylabel="")
    figure.legend(
        *axes.get_legend_handles_labels(),
        loc="lower left",
        bbox_to_anchor=(0.0, 0.0),
        ncols=4,
        fontsize=8,
        frameon=False,
    )
    figure.suptitle(_title(row), fontsize=10, y=1.0 - 0.3 * STRIP_INCH / total)
    save_picture(figure, picture)


def _rows(run: Path, stack: str, episode: int) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    import pyarrow.parquet as pq

    def wanted(table: str) -> list[dict[str, Any]]:
        rows: list[dict[str, Any]] = pq.read_table(run / f"{table}.parquet").to_pylist()
        return [row for row in rows if row["stack"] == stack and row["episode"] == episode]

    return wanted("episodes")[0], wanted("events")


def _bounds(trace: FloatArray, row: dict[str, Any]) -> Rect:
    """What the picture shows: the trajectory with a margin, in a pleasant shape."""
    points = np.vstack((trace[:, 1:3], [[row["goal_x_m"], row["goal_y_m"]]]))
    low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    width, depth = high - low
    more = np.array((max(depth / ASPECT[1] - width, 0.0), max(ASPECT[0] * width - depth, 0.0))) / 2
    return Rect(*(low - more).tolist(), *(high + more).tolist())


def _draw_people(axes: "Axes", trace: FloatArray, crowd: FloatArray) -> None:
    label: str | None = "people near the robot"
    for person in range(crowd.shape[1]):
        steps = crowd[:, person]
        far = np.hypot(*(steps - trace[:, 1:3]).T) > NEAR
        axes.plot(
            *np.where(far[:, None], np.nan, steps).T, color=PEOPLE, lw=1.0, alpha=0.75, ls=(0, (1, 1.2)), label=label
        )
        label = None


def _draw_robot(figure: Any, axes: "Axes", trace: FloatArray, row: dict[str, Any], strip: float) -> None:
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Circle

    points = trace[:, 1:3]
    segments = np.stack((points[:-1], points[1:]), axis=1)
    lines = LineCollection(list(segments), array=trace[:-1, 4], cmap="viridis", lw=2.6, clim=(0.0, 2.0), zorder=5)
    axes.add_collection(lines)
    axes.plot(*points[0], marker="o", ms=8, color=ROBOT, mec="white", zorder=6, ls="none", label="start")
    goal = (row["goal_x_m"], row["goal_y_m"])
    axes.plot(*goal, marker="*", ms=14, color=GOAL, mec="white", zorder=6, ls="none", label="goal, 2 m around it")
    axes.add_patch(Circle(goal, 2.0, fill=False, ec=GOAL, lw=1.2, zorder=6))
    bar = figure.colorbar(lines, cax=figure.add_axes((0.66, 0.55 * strip, 0.2, 0.3 * strip)), orientation="horizontal")
    bar.ax.tick_params(labelsize=7, length=2, pad=1)
    figure.text(0.87, 0.55 * strip, "speed [m/s]", fontsize=8)


def _draw_contacts(axes: "Axes", events: list[dict[str, Any]]) -> None:
    places = [(e["x_m"], e["y_m"]) for e in events if e["type"] == "contact_event"]
    if places:
        axes.plot(
            *np.array(places).T, marker="X", ms=10, color=CONTACT, mec="white", ls="none", zorder=7, label="contact"
        )


def _title(row: dict[str, Any]) -> str:
    lost = "" if row["pieces_lost"] is None else f", {row['pieces_lost']} of {row['pieces_at_start']} pieces lost"
    outcome = OUTCOMES.get(row["outcome"], row["outcome"].replace("_", " "))
    name = f"{row['stack']}, seed {row['seed']}, episode {row['episode']}"
    return f"{name}: {outcome} after {row['duration_s']:.0f} s and {row['distance_m']:.0f} m{lost}"


if __name__ == "__main__":
    try:
        draw_delivery(Path(sys.argv[1]), sys.argv[2], int(sys.argv[3]), Path(sys.argv[4]))
    except (InputError, IndexError, ValueError) as error:
        sys.exit(str(error) if isinstance(error, InputError) else (__doc__ or "").strip())
