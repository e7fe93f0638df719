"""A fleet's day as pictures: a strip for each robot, and profit over the fleet's size."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from harness.fleet.orders import SECONDS_PER_HOUR
from harness.fleet.result import FleetResult
from harness.fleet.robots import FleetRobot, State
from harness.fleet.study import CurvePoint
from harness.report.figures import WIDTH_INCH, error_bars, save_as

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FOLDER = "figures"
MOST_STRIPS = 40  # robots that the strip shows
STRIP_INCH, MARGIN_INCH, CURVE_INCH = 0.09, 1.1, 2.6
STATE_COLOURS = {
    State.READY: "#e6e6e6",
    State.CHARGING: "#b0b0b0",
    State.LOADING: "#c6dbef",
    State.OUT: "#2171b5",
    State.HANDOVER: "#c6dbef",
    State.BACK: "#6baed6",
    State.WAITING: "#fdae61",
    State.HELPED: "#fee08b",
    State.STRANDED: "#d73027",
    State.FETCHED: "#f46d43",
}
LINES = ("#2171b5", "#d73027")  # of libraries


def draw_fleet_figures(result: FleetResult, folder: Path) -> list[Path]:
    """Write the figures into ``figures``; returns their paths, the strips first.

    Raises:
        InputError: the folder cannot be written.
    """
    paths = []
    for number, found in enumerate(result.libraries):
        path = folder / FOLDER / f"robots-{number}.png"
        _draw_strip(found.study.robots, path)
        paths.append(path)
    path = folder / FOLDER / "size.png"
    save_as([path], (WIDTH_INCH, CURVE_INCH), lambda figure: _curves(figure, result))
    return [*paths, path]


def _draw_strip(robots: Sequence[FleetRobot], path: Path) -> None:
    shown = robots[:MOST_STRIPS]
    height = MARGIN_INCH + STRIP_INCH * len(shown)

    def draw(figure: "Figure") -> None:
        axes = figure.add_subplot()
        for robot in shown:
            _strip(axes, robot)
        axes.set_ylim(len(shown) - 0.4, -0.6)
        axes.set_ylabel("robot")
        axes.set_xlabel("hour of the day")
        _legend(figure)

    path.parent.mkdir(parents=True, exist_ok=True)
    save_as([path], (WIDTH_INCH, height), draw)


def _strip(axes: "Axes", robot: FleetRobot) -> None:
    bars = [
        (span.start / SECONDS_PER_HOUR, (span.end - span.start) / SECONDS_PER_HOUR)
        for span in robot.spans
    ]
    colours = [STATE_COLOURS[span.state] for span in robot.spans]
    axes.broken_barh(bars, (robot.number - 0.4, 0.8), facecolors=colours, linewidth=0)


def _legend(figure: "Figure") -> None:
    from matplotlib.patches import Patch

    handles = [
        Patch(color=colour, label=state.value)
        for state, colour in STATE_COLOURS.items()
        if state is not State.HANDOVER
    ]
    figure.legend(handles=handles, loc="outside upper center", ncols=5, frameon=False, fontsize=6)


def _curves(figure: "Figure", result: FleetResult) -> None:
    """Profit over robots, as many per operator, and over operators."""
    left, right = figure.subplots(1, 2)
    for found, colour in zip(result.libraries, LINES, strict=False):
        name = found.study.library.title
        _curve(left, found.by_robots, [point.robots for point in found.by_robots], colour, name)
        operators = [point.operators for point in found.by_operators]
        _curve(right, found.by_operators, operators, colour, name)
    left.set_xlabel(f"robots, {result.robots / result.operators:.3g} per operator")
    right.set_xlabel(f"operators of {result.robots} robots")
    left.set_ylabel("profit per robot and day [USD]")
    left.legend(frameon=False, fontsize=6)


def _curve(
    axes: "Axes", points: Sequence[CurvePoint], places: Sequence[int], colour: str, name: str
) -> None:
    profits = [point.profit_per_robot for point in points]
    values = [profit.value or 0.0 for profit in profits]
    bars = error_bars(profits)
    axes.errorbar(places, values, bars, color=colour, marker="o", markersize=3, label=name)
    axes.axhline(0.0, color="#222222", linewidth=0.6)
