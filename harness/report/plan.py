"""What planners made of one query.

A table, the document of ``--json``, and a picture of the paths on the costmap.
"""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from harness.plan.question import COST_WEIGHT, Answer
from harness.report.blocks import Block, Text, declared, notes_of
from harness.report.figures import own_settings, save_picture
from harness.report.map_picture import draw_scale_bar
from harness.report.numbers import number_text
from harness.world.map.shapes import Rect
from navstack.costmap.costmap import (
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    Costmap,
)
from navstack.geometry import transform_points
from navstack.types import FloatArray, IntArray, Pose2D

if TYPE_CHECKING:
    from matplotlib.axes import Axes

DECIMALS = 6  # of numbers in the document
MARGIN = 5.0  # [m] around paths and poses in the picture
WIDTH_INCH, DPI = 8.0, 110
ASPECT = (0.4, 1.0)  # height over width, at the least and at the most
ROW_INCH, LEGEND_COLUMNS = 0.19, 4  # of the legend
COLOURS = ("#1f5fa8", "#c2410c", "#0b6e4f", "#a21caf", "#d4a017", "#0f9b8e", "#4b3f72", "#7c2d12")
STYLES = ("-", (0, (5, 1.2)), (0, (2, 1)), (0, (6, 1.5, 1, 1.5)))
START, GOAL = "#0b6e4f", "#d1242f"
GROUND = {"lethal": "#4a4e57", "contact": "#9aa1ad", "unknown": "#d9cfe3"}


def plan_document(ends: Sequence[Pose2D], answers: Sequence[Answer]) -> dict[str, Any]:
    """The query and its answers as a JSON document.

    ``improvement`` is wall time [s] and the planner's own cost [m].
    """
    start, goal = ends
    return {
        "schema": 1,
        "start": start.as_array().tolist(),
        "goal": goal.as_array().tolist(),
        "planners": [_row(answer) for answer in answers],
    }


def _row(answer: Answer) -> dict[str, Any]:
    length = touches = None
    poses: list[list[float]] = []
    if answer.path is not None:
        length, touches = answer.path.length, answer.clearance == 0.0
        poses = answer.path.poses.round(DECIMALS).tolist()
    return {
        "planner": answer.planner,
        "found": answer.path is not None,
        "why": answer.why,
        "length_m": _rounded(length),
        "clearance_m": _rounded(answer.clearance),
        "touches": touches,
        "cost": _rounded(answer.cost),
        "time_ms": round(1e3 * answer.seconds, 3),
        "improvement": [
            [round(seconds, DECIMALS), round(cost, DECIMALS)]
            for seconds, cost in answer.improvement
        ],
        "path": poses,
    }


def _rounded(value: float | None) -> float | None:
    if value is None:
        return None
    return round(value, DECIMALS)


def plan_blocks(
    ends: Sequence[Pose2D],
    answers: Sequence[Answer],
    smoother: str | None,
) -> list[Block]:
    """A table, and below it why a planner found nothing."""
    start, goal = ends
    rows = [(answer.planner, *_cells(answer)) for answer in answers]
    smoothed = ""
    if smoother is not None:
        smoothed = f", paths smoothed by {smoother}"
    blocks: list[Block] = [declared("plan", rows, start=start, goal=goal, smoothed=smoothed)]
    for answer in answers:
        if answer.why:
            why = answer.why.removeprefix(f"{answer.planner}: ")
            blocks.append(Text(f"{answer.planner}: {why}", "whole"))
    below = []
    if any(answer.clearance == 0.0 for answer in answers):
        below.append("clearance 0: the robot's body touches something on the way.")
    below.append(
        f"cost: each piece of the path counts 1 + {COST_WEIGHT:g} x its costmap cost / 252."
    )
    return [*blocks, *notes_of(below)]


def _cells(answer: Answer) -> tuple[str, ...]:
    length = "none"
    if answer.path is not None:
        length = number_text(answer.path.length)
    first_cost = first_time = None
    if answer.improvement:
        seconds, first_cost = answer.improvement[0]
        first_time = 1e3 * seconds
    return (
        length,
        number_text(answer.clearance),
        number_text(answer.cost, 1),
        number_text(1e3 * answer.seconds, 1),
        number_text(first_cost),
        number_text(first_time, 1),
    )


@own_settings()
def draw_plan(
    costmap: Costmap,
    ends: Sequence[Pose2D],
    answers: Sequence[Answer],
    footprint: FloatArray,
    picture: Path,
) -> None:
    """Draw start, goal and every path found.

    Args:
        costmap: the background.
        ends: start and goal.
        answers: whose paths are drawn, in this order.
        footprint: (N, 2) polygon [m] of the robot, drawn at start and goal.
        picture: the file; its suffix says the format.

    Raises:
        InputError: the picture cannot be written.
    """
    from matplotlib.figure import Figure

    points = [np.array([(pose.x, pose.y) for pose in ends])]
    points += [answer.path.poses[:, :2] for answer in answers if answer.path is not None]
    low, high = _bounds(np.vstack(points))
    height = WIDTH_INCH * (high[1] - low[1]) / (high[0] - low[0])
    found = sum(answer.path is not None for answer in answers)
    legend = ROW_INCH * (math.ceil((found + 2) / LEGEND_COLUMNS) + 0.7)
    total = height + legend
    figure = Figure(figsize=(WIDTH_INCH, total), dpi=DPI)
    axes = figure.add_axes((0.0, legend / total, 1.0, height / total))
    _draw_costmap(axes, costmap, low, high)
    for number, answer in enumerate(answers):
        if answer.path is not None:
            label = f"{answer.planner}, {answer.path.length:.1f} m"
            colour = COLOURS[number % len(COLOURS)]
            style = STYLES[(number + number // len(COLOURS)) % len(STYLES)]
            axes.plot(
                *answer.path.poses[:, :2].T,
                color=colour,
                ls=style,
                lw=2.0,
                label=label,
                zorder=3,
            )
    _draw_ends(axes, ends, footprint)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xticks=[], yticks=[], aspect="equal")
    draw_scale_bar(axes, Rect(*low.tolist(), *high.tolist()))
    figure.legend(
        *axes.get_legend_handles_labels(),
        loc="lower left",
        ncols=LEGEND_COLUMNS,
        fontsize=8,
        frameon=False,
    )
    save_picture(figure, picture)


def _bounds(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Lower left and upper right corner [m] of what is shown, in a pleasant shape."""
    low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    width, depth = high - low
    more = (
        np.array((max(depth / ASPECT[1] - width, 0.0), max(ASPECT[0] * width - depth, 0.0))) / 2.0
    )
    return low - more, high + more


def _draw_costmap(axes: "Axes", costmap: Costmap, low: FloatArray, high: FloatArray) -> None:
    from matplotlib.colors import to_rgb

    first = _cell(costmap, low)
    last = _cell(costmap, high)
    costs = costmap.data[first[1] : last[1] + 1, first[0] : last[0] + 1]
    grey = 1.0 - 0.22 * np.clip(costs, 0, 252) / 252.0
    shades = np.repeat(grey[..., None], 3, axis=2)
    shades[costs == INSCRIBED_INFLATED_OBSTACLE] = to_rgb(GROUND["contact"])
    shades[costs == LETHAL_OBSTACLE] = to_rgb(GROUND["lethal"])
    shades[costs == NO_INFORMATION] = to_rgb(GROUND["unknown"])
    origin = np.array((costmap.origin_x, costmap.origin_y))
    x0, y0 = origin + np.array(first) * costmap.resolution
    x1, y1 = origin + (np.array(last) + 1) * costmap.resolution
    axes.imshow(shades, origin="lower", extent=(x0, x1, y0, y1), interpolation="nearest", zorder=1)
    axes.set_facecolor(GROUND["unknown"])


def _cell(costmap: Costmap, point: FloatArray) -> IntArray:
    """The cell of the map nearest to a point."""
    column, row = costmap.world_to_map(float(point[0]), float(point[1]))
    return np.array((min(max(column, 0), costmap.size_x - 1), min(max(row, 0), costmap.size_y - 1)))


def _draw_ends(axes: "Axes", ends: Sequence[Pose2D], footprint: FloatArray) -> None:
    from matplotlib.patches import Polygon

    for name, pose, colour, marker, size in zip(
        ("start", "goal"),
        ends,
        (START, GOAL),
        ("o", "*"),
        (7, 13),
        strict=True,
    ):
        axes.add_patch(
            Polygon(
                transform_points(pose, footprint),
                closed=True,
                fill=False,
                ec=colour,
                lw=1.2,
                zorder=4,
            )
        )
        axes.plot(
            pose.x,
            pose.y,
            marker=marker,
            ms=size,
            color=colour,
            mec="white",
            ls="none",
            label=name,
            zorder=5,
        )
