"""Pictures of a world: ground by use, buildings, street furniture by type, scale bar and legend."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from harness.report.figures import own_settings, save_picture
from harness.report.texts import read_data
from harness.world.map.scene import Obstacle, Scene, Zone
from harness.world.map.shapes import Rect
from navstack.costmap.occupancy_grid import FREE
from navstack.types import BoolArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, slots=True)
class Colours:
    """Content of ``map_colours.toml``; pairs are face and edge."""

    bare: str  # where a zone says nothing
    building: tuple[str, str]
    unknown: tuple[str, str]
    other_furniture: str
    ground: dict[str, str]  # by kind of a zone
    furniture: dict[str, str]  # by kind of an obstacle


COLOURS = read_data(Colours, "map_colours.toml")
# [m] lengths of a scale bar
_STEPS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500)


# What a picture shows besides zones and obstacles: title, colour of the cells, and which cells.
VIEWS: dict[str, tuple[str, str, Callable[[Scene], BoolArray]] | None] = {
    "zones": None,
    "navmesh": ("navigation mesh", "#5b8def", lambda scene: scene.navigation_mesh.data == FREE),
    "keepout": ("keepout", "#e05252", lambda scene: scene.walkable.data != FREE),
}


@own_settings()
def draw_map(scene: Scene, path: Path, width_px: int = 1600, view: str = "zones") -> None:
    """Write a picture of a scene as PNG (or PDF, SVG by the suffix), ``width_px`` wide.

    Args:
        scene: what to draw.
        path: where to; its suffix says the format.
        width_px: width of a PNG.
        view: a name of ``VIEWS``.

    Raises:
        InputError: the picture cannot be written.
    """
    from matplotlib.figure import Figure

    extent = _extent(scene)
    width, left, bottom = 8.0, 0.6, 0.5  # [inch]
    inner = 5.85  # [inch] width of the map; the legend takes the rest
    height = inner * min(extent.depth / extent.width, 3.0)
    total = max(height + bottom + 0.15, 3.2)
    figure = Figure(figsize=(width, total), dpi=width_px / width)
    axes = figure.add_axes(
        (left / width, 1.0 - (height + 0.15) / total, inner / width, height / total)
    )
    draw_scene(axes, scene)
    shown = VIEWS[view]
    if shown is not None:
        title, colour, cells = shown
        _draw_cells(axes, cells(scene), extent, ("none", colour), 0.45)
    draw_legend(axes, scene, None if shown is None else (title, colour))
    save_picture(figure, path)


def draw_scene(axes: "Axes", scene: Scene, bounds: Rect | None = None) -> None:
    """Draw a scene on axes in metres, map frame; overlays belong above z-order 4.

    Args:
        axes: matplotlib axes.
        scene: what to draw; a map without zones shows its walkable cells instead.
        bounds: the part to show; None: everything.
    """
    area = bounds or _extent(scene)
    axes.set_facecolor(COLOURS.bare)
    if scene.zones:
        _draw_zones(axes, scene.zones)
    else:
        colours = (COLOURS.ground["road"], COLOURS.ground["sidewalk"])
        _draw_cells(axes, scene.walkable.data == FREE, _extent(scene), colours)
    _draw_obstacles(axes, scene.obstacles, area)
    axes.set_xlim(area.x0, area.x1)
    axes.set_ylim(area.y0, area.y1)
    axes.set_aspect("equal")
    axes.set_xlabel("x (east) [m]", fontsize=8)
    axes.set_ylabel("y (north) [m]", fontsize=8)
    axes.tick_params(labelsize=7, length=2.5)
    for spine in axes.spines.values():
        spine.set_linewidth(0.6)
    draw_scale_bar(axes, area)
    corner = axes.transAxes
    credit = scene.credit.replace(", ", ",\n", 1)  # a narrow picture has no room for one line
    axes.text(0.995, 0.006, credit, fontsize=6, ha="right", va="bottom", transform=corner)


def draw_legend(axes: "Axes", scene: Scene, more: tuple[str, str] | None = None) -> None:
    """What the colours mean, with the number of pieces, right of the axes.

    ``more``: a further name and colour.
    """
    from matplotlib.patches import Patch

    zones = {zone.kind for zone in scene.zones}
    counts = Counter(obstacle.kind for obstacle in scene.obstacles)
    handles = [
        Patch(facecolor=colour, edgecolor="#9a9a9a", linewidth=0.4, label=_label(kind))
        for kind, colour in COLOURS.ground.items()
        if kind in zones
    ]
    for kind in sorted(counts, key=lambda name: (_is_furniture(name), -counts[name])):
        face, edge = _colours(kind)
        handles.append(
            Patch(
                facecolor=face,
                edgecolor=edge,
                linewidth=0.4,
                label=f"{_label(kind)} ({counts[kind]})",
            )
        )
    if more is not None:
        handles.append(Patch(facecolor=more[1], alpha=0.45, label=more[0]))
    axes.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(1.01, 1.0),
        fontsize=7.5,
        frameon=False,
        handlelength=1.3,
        borderaxespad=0.0,
    )


def _draw_zones(axes: "Axes", zones: Sequence[Zone]) -> None:
    from matplotlib.collections import PolyCollection

    for kind in dict.fromkeys(zone.kind for zone in zones):
        polygons = [zone.polygon for zone in zones if zone.kind == kind]
        is_site = kind in ("construction", "work_area")
        axes.add_collection(
            PolyCollection(
                polygons,
                facecolors=COLOURS.ground.get(kind, COLOURS.bare),
                edgecolors="#b98f4f" if is_site else "#c3c0b6",
                linewidths=0.3,
                hatch="////" if is_site else None,
                zorder=1.0,
            )
        )
        if kind == "crosswalk":
            axes.add_collection(
                PolyCollection(_stripes(polygons), facecolors="#b9bcc1", linewidths=0.0, zorder=1.1)
            )


def _stripes(crosswalks: Sequence[np.ndarray]) -> list[np.ndarray]:
    """The dark gaps between the bars of zebra crossings, half a metre wide."""
    stripes = []
    for polygon in crosswalks:
        (x0, y0), (x1, y1) = polygon.min(axis=0), polygon.max(axis=0)
        if x1 - x0 > y1 - y0:  # walked along x
            stripes += [
                Rect(x, y0, min(x + 0.5, x1), y1).polygon for x in np.arange(x0 + 0.5, x1, 1.0)
            ]
        else:
            stripes += [
                Rect(x0, y, x1, min(y + 0.5, y1)).polygon for y in np.arange(y0 + 0.5, y1, 1.0)
            ]
    return stripes


def _draw_cells(
    axes: "Axes",
    cells: BoolArray,
    extent: Rect,
    colours: tuple[str, str],
    alpha: float | None = None,
) -> None:
    """Colour a mask (H, W) of a map: False cells and True cells."""
    from matplotlib.colors import ListedColormap

    axes.imshow(
        cells,
        cmap=ListedColormap(colours),
        extent=(extent.x0, extent.x1, extent.y0, extent.y1),
        origin="lower",
        interpolation="nearest",
        alpha=None if alpha is None else alpha * cells,
        vmin=0,
        vmax=1,
        zorder=1.5,
    )


def _draw_obstacles(axes: "Axes", obstacles: Sequence[Obstacle], area: Rect) -> None:
    from matplotlib.collections import PolyCollection

    # [pt] so that posts of 0.3 m stay visible on a map of 200 m
    outline = 90.0 / max(area.width, area.depth)
    for kind in dict.fromkeys(obstacle.kind for obstacle in obstacles):
        face, edge = _colours(kind)
        axes.add_collection(
            PolyCollection(
                [obstacle.polygon for obstacle in obstacles if obstacle.kind == kind],
                facecolors=face,
                edgecolors=edge,
                linewidths=min(outline, 1.0) if _is_furniture(kind) else 0.4,
                joinstyle="round",
                zorder=3.0 if _is_furniture(kind) else 2.0,
            )
        )


def draw_scale_bar(axes: "Axes", area: Rect) -> None:
    """A bar of a round length in the lower left corner of an area [m]."""
    length = max((step for step in _STEPS if step <= 0.25 * area.width), default=_STEPS[0])
    x, y = area.x0 + 0.03 * area.width, area.y0 + 0.02 * area.width
    box = {"boxstyle": "round,pad=0.2", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}
    for colour, width in (("white", 5.0), ("black", 2.2)):
        axes.plot(
            (x, x + length),
            (y, y),
            color=colour,
            linewidth=width,
            solid_capstyle="butt",
            zorder=9.0,
        )
    text_x = x + length + 0.01 * area.width
    axes.text(
        text_x, y, f"{length:g} m", fontsize=7.0, ha="left", va="center", bbox=box, zorder=9.0
    )


def _extent(scene: Scene) -> Rect:
    grid = scene.geometry
    x0, y0 = grid.origin.x, grid.origin.y
    return Rect(x0, y0, x0 + grid.width * grid.resolution, y0 + grid.height * grid.resolution)


def _is_furniture(kind: str) -> bool:
    return not kind.startswith("building") and kind != "unknown"


def _colours(kind: str) -> tuple[str, str]:
    if kind == "unknown":
        return COLOURS.unknown
    if not _is_furniture(kind):
        return COLOURS.building
    colour = COLOURS.furniture.get(kind, COLOURS.other_furniture)
    return colour, colour


def _label(kind: str) -> str:
    return {"building_glass": "building", "unknown": "occupied"}.get(kind, kind.replace("_", " "))
