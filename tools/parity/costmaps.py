"""The obstacle layer in sequences: costmaps of several updates."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from navstack.costmap.inflation import cell_distance
from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.costmap.observations import ObservationBuffer, PointObservation
from navstack.costmap.obstacle_cells import ObstacleCells
from navstack.costmap.window import Window
from navstack.geometry import transform_points
from navstack.params.costmap import (
    CostmapParams,
    InflationLayerParams,
    LayerParams,
    ObservationSourceParams,
    ObstacleLayerParams,
)
from navstack.types import Pose2D
from tools.parity.comparison import Comparison
from tools.parity.golden import GoldenFile
from tools.parity.inflation import MAIN_STEPS, at_radius, compare_but_at_radius
from tools.parity.part import Case, existing

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
