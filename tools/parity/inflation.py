"""Inflation by the rules of Nav2 Jazzy and main."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.ndimage import distance_transform_edt

from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE, NO_INFORMATION
from navstack.costmap.inflation import Inflation, cell_distance, inflation_cost
from navstack.geometry import footprint_radii, pad_footprint
from navstack.params.costmap import CostmapParams, InflationLayerParams, robot_footprint
from navstack.types import BoolArray, ByteArray, FloatArray
from tools.parity.comparison import Comparison
from tools.parity.golden import GoldenFile
from tools.parity.part import Case, Shape, existing

MAIN_STEPS = 100  # [1/cell] of Nav2 main's table of costs
# of a grid's cells that a breadth-first search may give to a source that is not the nearest
MISSED_SHARE = 1e-3

NOT_NEAREST = (
    "Jazzy's breadth-first search does not find the nearest source of a few cells, which then "
    "cost too little there"
)
MISSED_AT_RADIUS = (
    "recorded with approximate square roots, which leave out cells exactly at the "
    "inflation radius; navstack inflates them, as the same source does with exact ones"
)
ROUNDED = (
    "the cost before it is cut to an integer is one but for rounding, and is cut to the next "
    "lower one"
)
CLOSE = 1e-4  # of an integer, within which single precision may cut to the one below

GRIDS = Shape(("{}_out_legacy", "{}_in"))  # inflated by Jazzy


def find_curves(file: GoldenFile) -> Iterator[Case]:
    """Curves of cost against distance in metres (``_dist_m``) and in cells (``_cells``)."""
    for name in file.bases("_dist_m"):
        if f"{name}_cost" in file and file.facts(name):
            footprint = "footprint_" + name.removeprefix("curve_")
            suffixes = ("dist_m", "cost", "cells", "cost_cells")
            yield Case(
                name,
                file,
                existing(file, [footprint, *(f"{name}_{suffix}" for suffix in suffixes)]),
            )


def check_curve(case: Case, comparison: Comparison) -> None:
    """Costs along a curve, and the radii of the padded footprint that they rest on."""
    facts = case.facts
    unpadded = robot_footprint(CostmapParams(footprint=facts["footprint"]))
    padded = pad_footprint(unpadded, facts["footprint_padding"])
    radii = footprint_radii(padded)
    comparison.near(
        "inscribed and circumscribed radius", radii, facts["inscribed_circumscribed"], 1e-12
    )
    footprint = "footprint_" + case.name.removeprefix("curve_")
    if footprint in case.file:
        comparison.near("padded footprint", padded, case.file[footprint], 1e-12)
    scaling, resolution = facts["cost_scaling_factor"], facts["resolution"]
    costs = [inflation_cost(float(distance), radii[0], scaling) for distance in case["dist_m"]]
    comparison.equal("cost by metres", costs, case["cost"])
    if "cells" in case:
        costs = [
            inflation_cost(float(cells) * resolution, radii[0], scaling) for cells in case["cells"]
        ]
        comparison.equal("cost by cells", costs, case["cost_cells"])


def check_grid(case: Case, comparison: Comparison) -> None:
    """A whole grid by Jazzy's rule; it knows no custom inscribed radius."""
    grid, target = case["in"], case["out_legacy"]
    params = _params(case, steps=0)
    inscribed = case.facts["inscribed_circumscribed"][0]
    ours = _inflated(grid, params, case, inscribed)
    _check_smaller_radius(case, comparison, params, ours)
    wrong = ours != target
    if wrong.any() and wrong.mean() <= MISSED_SHARE:
        costs = _costs_of_sources(grid, wrong, params, case)
        is_nearest = (ours[wrong] == [max(each) for each in costs]).all()
        is_of_another = all(
            cost in each for cost, each in zip(target[wrong].tolist(), costs, strict=True)
        )
        if is_nearest and is_of_another and (ours[wrong] > target[wrong]).all():
            comparison.allow(f"{int(wrong.sum())} of {wrong.size} cells: {NOT_NEAREST}")
            return
    rounded = wrong & _on_an_integer(
        _distances(grid, params.inflate_around_unknown), params, case, inscribed
    )
    if rounded.any() and (np.abs(ours.astype(float) - target)[rounded] == 1).all():
        comparison.allow(f"{int(rounded.sum())} of {wrong.size} cells: {ROUNDED}")
        ours = np.where(rounded, target, ours)
    comparison.equal("inflated grid", ours, target)


def _check_smaller_radius(
    case: Case,
    comparison: Comparison,
    params: InflationLayerParams,
    whole_grid: ByteArray,
) -> None:
    """Half the radius and a fifth of a cell: a part of a cell counts as one.

    Up to there costs are the whole grid's.

    Recordings have whole cells, or half ones, which rounding up and rounding to the nearest make
    the same of.
    """
    resolution = case.facts["resolution"]
    whole = cell_distance(params.inflation_radius, resolution) // 2
    if params.inflate_around_unknown or "window" in case.facts or whole < 1:
        return
    smaller = replace(params, inflation_radius=(whole + 0.2) * resolution)
    ours = _inflated(case["in"], smaller, case, case.facts["inscribed_circumscribed"][0])
    expected = np.where(
        _distances(case["in"], around_unknown=False) <= whole + 1, whole_grid, case["in"]
    )
    comparison.equal(f"inflated grid, radius {whole}.2 cells", ours, expected)


def find_main_grids(file: GoldenFile) -> Iterator[Case]:
    """Grids inflated by Nav2 main: ``_in`` with ``_out``, better ``_out_exact_sqrt``."""
    for name in sorted({*file.bases("_out"), *file.bases("_out_exact_sqrt")}):
        facts = file.facts(name)
        if f"{name}_in" in file and "inflation_radius" in facts:
            yield Case(
                name,
                file,
                existing(file, (f"{name}_{part}" for part in ("in", "out", "out_exact_sqrt"))),
            )


def check_main_grid(case: Case, comparison: Comparison) -> None:
    """A whole grid by Nav2 main's rule, which rounds distances to hundredths of a cell."""
    grid = case["in"]
    params = _params(case, steps=MAIN_STEPS)
    inscribed = (
        case.facts.get("custom_inscribed_radius") or case.facts["inscribed_circumscribed"][0]
    )
    ours = _inflated(grid, params, case, inscribed)
    if "out_exact_sqrt" in case:
        comparison.equal("inflated grid", ours, case["out_exact_sqrt"])
    if "out" not in case:
        return
    target = case["out"]
    radius = cell_distance(params.inflation_radius, case.facts["resolution"])
    compare_but_at_radius(
        comparison, "inflated grid", ours, target, at_radius(grid, radius, params)
    )


def compare_but_at_radius(
    comparison: Comparison,
    what: str,
    ours: ByteArray,
    target: ByteArray,
    at_the_radius: BoolArray,
) -> None:
    """Costs by Nav2 main's rule must be equal, but for cells at the radius.

    The recording leaves those as they were.
    """
    missed = (ours != target) & at_the_radius & (ours > target)
    if missed.any():
        comparison.allow(MISSED_AT_RADIUS)
    comparison.equal(what, np.where(missed, target, ours), target)


def at_radius(grid: ByteArray, radius: int, params: InflationLayerParams) -> BoolArray:
    """Which cells of a grid are exactly ``radius`` cells from their nearest source."""
    found: BoolArray = np.round(_distances(grid, params.inflate_around_unknown) ** 2) == radius**2
    return found


def _on_an_integer(
    distances: FloatArray,
    params: InflationLayerParams,
    case: Case,
    inscribed: float,
) -> BoolArray:
    """Where the cost at a distance [cells] is an integer, but for rounding."""
    beyond = distances * case.facts["resolution"] - inscribed
    exact = (INSCRIBED_INFLATED_OBSTACLE - 1) * np.exp(-params.cost_scaling_factor * beyond)
    close: BoolArray = np.abs(exact - np.round(exact)) < CLOSE
    return close


def _costs_of_sources(
    grid: ByteArray,
    cells: BoolArray,
    params: InflationLayerParams,
    case: Case,
) -> list[set[int]]:
    """What each of the cells would cost if this or that source were its nearest one."""
    resolution, inscribed = case.facts["resolution"], case.facts["inscribed_circumscribed"][0]
    sources = np.argwhere(_is_source(grid, params.inflate_around_unknown))
    found = []
    for cell in np.argwhere(cells):
        metres = np.hypot(*(sources - cell).T) * resolution
        near = np.unique(metres[metres <= params.inflation_radius + resolution])
        scaling = params.cost_scaling_factor
        found.append({0, *(inflation_cost(each, inscribed, scaling) for each in near.tolist())})
    return found


def _is_source(grid: ByteArray, around_unknown: bool) -> BoolArray:
    """Cells from which costs spread."""
    sources: BoolArray = grid == LETHAL_OBSTACLE
    if around_unknown:
        sources = sources | (grid == NO_INFORMATION)
    return sources


def _distances(grid: ByteArray, around_unknown: bool) -> FloatArray:
    """Exact distance [cells] of each cell to its nearest source; inf where there is none."""
    sources = _is_source(grid, around_unknown)
    if not sources.any():
        return np.full(grid.shape, math.inf)
    distances: FloatArray = distance_transform_edt(~sources)
    return distances


def _params(case: Case, steps: int) -> InflationLayerParams:
    names = ("inflation_radius", "cost_scaling_factor", "inflate_unknown", "inflate_around_unknown")
    given = {name: case.facts[name] for name in names if name in case.facts}
    return InflationLayerParams(**given, distance_steps=steps)


def _inflated(
    grid: ByteArray,
    params: InflationLayerParams,
    case: Case,
    inscribed: float,
) -> ByteArray:
    """The grid inflated within the ``window`` x0, y0, xn, yn (ends exclusive) of the case.

    Without one, all of it.
    """
    costs = grid.copy()
    x0, y0, xn, yn = case.facts.get("window", (0, 0, costs.shape[1], costs.shape[0]))
    Inflation(params, case.facts["resolution"], inscribed).apply(costs, x0, xn, y0, yn)
    return costs
