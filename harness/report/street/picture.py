"""A picture of a district, with its routes' graph and OpenStreetMap's credit."""

from pathlib import Path

from harness.report.figures import own_settings, save_picture
from harness.report.map_picture import draw_legend, draw_scene
from harness.street.district import District, overview
from harness.street.route_graph import RouteGraph

_WIDTH, _LEGEND = 8.0, 2.0  # [inch] of the district and beside it
_LEFT, _BOTTOM, _TOP = 0.6, 0.5, 0.1  # [inch] of the margins
_LEAST = 3.2  # [inch] of the whole height, for the legend
_TALLEST = 2.5  # times as tall as wide


@own_settings()
def draw_district(district: District, graph: RouteGraph, path: Path) -> None:
    """Write a picture of ground, buildings, furniture and ways.

    Raises:
        InputError: the picture cannot be written.
    """
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

    area = district.ground.box
    height = _WIDTH * min(area.depth / area.width, _TALLEST)
    wide, tall = _LEFT + _WIDTH + _LEGEND, max(_BOTTOM + height + _TOP, _LEAST)
    figure = Figure(figsize=(wide, tall), dpi=200)
    lowest = tall - _TOP - height
    axes = figure.add_axes((_LEFT / wide, lowest / tall, _WIDTH / wide, height / tall))
    scene = overview(district)
    draw_scene(axes, scene, area)
    axes.add_collection(
        LineCollection(
            list(graph.points[graph.pairs]), colors="#3b6fd4", linewidths=0.5, zorder=4.0
        )
    )
    draw_legend(axes, scene, ("ways", "#3b6fd4"))
    save_picture(figure, path)
