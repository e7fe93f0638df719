"""Inflation by the rules of Nav2 Jazzy and main, and the obstacle layer in sequences."""

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.ndimage import distance_transform_edt

from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE, NO_INFORMATION
from navstack.costmap.inflation import Inflation, cell_distance, inflation_cost
from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.costmap.observations import ObservationBuffer, PointObservation
from navstack.costmap.obstacle_cells import ObstacleCells
from navstack.costmap.window import Window
from navstack.geometry import footprint_radii, pad_footprint, transform_points
from navstack.params.costmap import (
    CostmapParams,
    InflationLayerParams,
    LayerParams,
    ObservationSourceParams,
    ObstacleLayerParams,
    robot_footprint,
)
from navstack.types import BoolArray, ByteArray, FloatArray, Pose2D
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
    "inflation radius; navstack inflates "
    "them, as the same source does with exact ones"
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


SUFFIXES = (
    "points",
    "sensor_origin",
    "robot_pose",
    "map_origin",
    "obst_grid",
    "master",
    "bounds_x0_xn_y0_yn",
)


def find_layers(file: GoldenFile) -> Iterator[Case]:
    """Sequences ``<case>_s<k>_points`` and so on, k from 0."""
    for name in file.bases("_s0_points"):
        facts = file.facts(name)
        if "nsteps" in facts:
            steps = range(facts["nsteps"])
            yield Case(
                name,
                file,
                existing(file, (f"{name}_s{k}_{suffix}" for k in steps for suffix in SUFFIXES)),
            )


def check_layers(case: Case, comparison: Comparison) -> None:
    """The whole costmap, step by step; then the list of marked cells, which must hold the same."""
    params = _layer_params(case.facts)
    _check_costmap(case, comparison, params)
    if not case.facts["track_unknown"]:
        _check_cells(case, comparison, params)


def _check_costmap(case: Case, comparison: Comparison, params: CostmapParams) -> None:
    costmap = LayeredCostmap(params)
    for k in range(case.facts["nsteps"]):
        origin = case[f"s{k}_sensor_origin"]
        costmap.observe_points(case[f"s{k}_points"], float(origin[0]), float(origin[1]), float(k))
        costmap.update(Pose2D(*case[f"s{k}_robot_pose"].tolist()), None, float(k))
        master = costmap.master
        comparison.near(
            f"step {k}: origin", (master.origin_x, master.origin_y), case[f"s{k}_map_origin"], 1e-9
        )
        obstacles = costmap.obstacle_costs[0]
        comparison.equal(f"step {k}: obstacle grid", obstacles, case[f"s{k}_obst_grid"])
        comparison.equal(f"step {k}: bounds", costmap.region, case[f"s{k}_bounds_x0_xn_y0_yn"])
        if not case.facts["inflation"]:
            comparison.equal(f"step {k}: master", master.data, case[f"s{k}_master"])
            continue
        layer = params.layers["inflation_layer"]
        assert isinstance(layer, InflationLayerParams)
        border = at_radius(
            master.data, cell_distance(layer.inflation_radius, params.resolution), layer
        )
        compare_but_at_radius(
            comparison, f"step {k}: master", master.data, case[f"s{k}_master"], border
        )


def _check_cells(case: Case, comparison: Comparison, params: CostmapParams) -> None:
    layer = params.layers["obstacle_layer"]
    assert isinstance(layer, ObstacleLayerParams)
    footprint = LayeredCostmap(params).footprint
    buffer = ObservationBuffer(layer.active_sources[0])
    window = Window(params.origin_x, params.origin_y, params.resolution, *case.facts["size"])
    cells = ObstacleCells(layer, [buffer], window)
    for k in range(case.facts["nsteps"]):
        pose = Pose2D(*case[f"s{k}_robot_pose"].tolist())
        if params.rolling_window:
            window.centre_on(pose.x, pose.y)
            cells.follow(window)
        points = case[f"s{k}_points"].astype(np.float64)
        marking = (points[:, 2] >= layer.min_obstacle_height) & (
            points[:, 2] <= layer.max_obstacle_height
        )
        origin = case[f"s{k}_sensor_origin"]
        flat = np.ascontiguousarray(points[:, :2])
        buffer.add(
            PointObservation(float(k), float(origin[0]), float(origin[1]), flat.copy, flat[marking])
        )
        cells.update(window, transform_points(pose, footprint))
        comparison.equal(f"step {k}: list of cells", cells.as_grid(window), case[f"s{k}_obst_grid"])


def _layer_params(facts: dict[str, Any]) -> CostmapParams:
    given = facts["params"]
    source = ObservationSourceParams(
        marking=True,
        clearing=True,
        obstacle_min_range=facts["obstacle_range"][0],
        obstacle_max_range=facts["obstacle_range"][1],
        raytrace_min_range=facts["raytrace_range"][0],
        raytrace_max_range=facts["raytrace_range"][1],
    )
    names = (
        "footprint_clearing_enabled",
        "min_obstacle_height",
        "max_obstacle_height",
        "combination_method",
    )
    own = {name: given[f"obstacle_layer.{name}"] for name in names}
    obstacles = ObstacleLayerParams(**own, observation_sources=("scan",), sources={"scan": source})
    layers: dict[str, LayerParams] = {"obstacle_layer": obstacles}
    if facts["inflation"]:
        inflation = {
            name: given[f"inflation_layer.{name}"]
            for name in ("inflation_radius", "cost_scaling_factor")
        }
        layers["inflation_layer"] = InflationLayerParams(**inflation, distance_steps=MAIN_STEPS)
    origin_x, origin_y = facts.get("origin", (0.0, 0.0))
    return CostmapParams(
        width=facts["size"][0] * facts["resolution"],
        height=facts["size"][1] * facts["resolution"],
        resolution=facts["resolution"],
        origin_x=float(origin_x),
        origin_y=float(origin_y),
        rolling_window=facts["rolling"],
        track_unknown_space=facts["track_unknown"],
        footprint=facts["footprint"],
        footprint_padding=facts["footprint_padding"],
        plugins=tuple(layers),
        layers=layers,
    )
