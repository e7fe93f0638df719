"""A picture of where on a district's streets money was lost."""

from pathlib import Path

import numpy as np

from harness.analysis.street_losses import StreetLosses, square_of
from harness.report.figures import own_settings, save_picture
from harness.street.route_graph import RouteGraph

_INCHES = 7.0


@own_settings()
def draw_losses(losses: StreetLosses, graph: RouteGraph, path: Path) -> None:
    """Colour the ways that were driven by dollars lost per metre; the others are grey.

    Raises:
        InputError: the picture cannot be written.
    """
    from matplotlib.collections import LineCollection
    from matplotlib.figure import Figure

    lines = graph.points[graph.pairs]
    squares = [square_of(*place) for place in lines.mean(axis=1)]
    is_driven = np.array([losses.driven.get(each, 0.0) > 0.0 for each in squares])
    figure = Figure(figsize=(_INCHES, _INCHES), dpi=200)
    axes = figure.add_subplot()
    axes.add_collection(LineCollection(list(lines[~is_driven]), colors="#cccccc", linewidths=0.5))
    amounts = np.array([losses.per_metre(each) or 0.0 for each in squares])[is_driven]
    driven = LineCollection(list(lines[is_driven]), array=amounts, cmap="plasma_r", linewidths=2.0)
    axes.add_collection(driven)
    axes.autoscale()
    axes.set_aspect("equal")
    axes.set_xlabel("x (east) [m]")
    axes.set_ylabel("y (north) [m]")
    figure.colorbar(driven, ax=axes, label="lost [USD/m driven]", shrink=0.7)
    figure.text(0.99, 0.01, graph.credit, fontsize=6, ha="right")
    save_picture(figure, path)
