"""Global plans on the shipped sidewalk map, smoothing, and the collision monitor's look ahead."""

from collections.abc import Iterator, Sequence
from functools import lru_cache, partial
from itertools import cycle, islice

import numpy as np

from navstack.costmap.costmap import FREE_SPACE, LETHAL_OBSTACLE, Costmap
from navstack.costmap.inflation import Inflation
from navstack.errors import PlanningError
from navstack.params.collision_monitor import PolygonParams
from navstack.params.costmap import InflationLayerParams
from navstack.params.planners import IncrementalNavfnParams, NavfnParams, SimpleSmootherParams
from navstack.params.strict import from_mapping
from navstack.planning.incremental_navfn import IncrementalNavfn
from navstack.planning.navfn import NavfnPlanner
from navstack.planning.navfn_kernels import cost_tables
from navstack.planning.planner import Planner
from navstack.planning.polyline_kernels import polyline_cost
from navstack.planning.simple_smoother import SimpleSmoother
from navstack.safety.monitor_zones import MonitorZone
from navstack.types import FloatArray, Path, Pose2D, Twist2D
from tools.bench import twins
from tools.bench.component import (
    Component,
    Prepared,
    TwinError,
    golden,
    require_agreement,
    shipped_map,
)

# as published, global costmap
INFLATION = InflationLayerParams(inflation_radius=1.0, cost_scaling_factor=0.3)
INSCRIBED = 0.39  # [m] of the padded footprint there
MISSIONS = 12
LONGEST = 12  # plans of a drive
STRIDE = 60  # path points between two plans: 1.5 m
PEDESTRIANS = 3  # who are somewhere else at each plan, within 10 m of the robot
FIELD = 120  # [cells] of the map on which the wave is compared with its twin

Query = tuple[Pose2D, Pose2D]


@lru_cache(maxsize=1)
def sidewalk() -> tuple[Costmap, Inflation]:
    """The inflated map of walkable ground, and what inflates it."""
    grid = shipped_map("sidewalk_walkable")
    costs = np.where(grid.data == 0, FREE_SPACE, LETHAL_OBSTACLE).astype(np.uint8)
    inflation = Inflation(INFLATION, grid.resolution, INSCRIBED)
    inflation.apply(costs, 0, grid.width, 0, grid.height)
    return Costmap(costs, grid.resolution, grid.origin.x, grid.origin.y), inflation


@lru_cache(maxsize=1)
def missions() -> list[Query]:
    """Pairs of clear points 40 to 110 m apart which a path connects."""
    costmap, planner = sidewalk()[0], NavfnPlanner(NavfnParams())
    rng = np.random.default_rng(0)
    rows, columns = np.nonzero(costmap.data < 150)
    found: list[Query] = []
    while len(found) < MISSIONS:
        start, goal = (
            Pose2D(*costmap.map_to_world(columns[k], rows[k]))
            for k in rng.integers(len(rows), size=2)
        )
        if 40.0 < np.hypot(start.x - goal.x, start.y - goal.y) < 110.0 and _connects(
            planner, start, goal, costmap
        ):
            found.append((start, goal))
    return found


def _connects(planner: Planner, start: Pose2D, goal: Pose2D, costmap: Costmap) -> bool:
    try:
        planner.plan(start, goal, costmap)
    except PlanningError:
        return False
    return True


def plans(use_astar: bool) -> Prepared:
    """One mission after the other with NavFn."""
    costmap, planner = sidewalk()[0], NavfnPlanner(NavfnParams(use_astar=use_astar))
    coming = cycle(missions())

    def ours() -> None:
        planner.plan(*next(coming), costmap)

    for _ in missions():
        ours()
    return Prepared(ours)


def small_wave() -> Prepared:
    """NavFn on a small map with hills and walls.

    The twin's potential at the goal must be that of the plan.
    """
    rng = np.random.default_rng(4)
    costs = np.kron(
        rng.choice(np.array((0, 0, 40, 120), dtype=np.uint8), (FIELD // 8, FIELD // 8)),
        np.ones((8, 8)),
    )
    costs = costs.astype(np.uint8)
    costs[30, :90] = costs[70, 30:] = LETHAL_OBSTACLE
    costmap, start, goal = Costmap(costs, 0.05, 0.0, 0.0), Pose2D(0.5, 0.5), Pose2D(5.0, 5.2)
    planner = NavfnPlanner(NavfnParams(tolerance=0.0))
    entry, _ = cost_tables(True)
    crossing = entry[costs].astype(np.float64)
    crossing[entry[costs] >= 254.0] = np.inf
    crossing[0], crossing[-1], crossing[:, 0], crossing[:, -1] = (np.inf,) * 4
    twin = partial(twins.planar_wave, crossing, (10, 10))
    planner.plan(start, goal, costmap)
    require_agreement("NavFn", planner.potential[104, 100:101], twin()[104, 100:101], 1e-2)
    return Prepared(lambda: planner.plan(start, goal, costmap), twin)


def drive(route: FloatArray) -> Iterator[tuple[Pose2D, Costmap]]:
    """Poses along a route, each with a costmap in which people stand near it.

    The empty map is its floor.
    """
    costmap, inflation = sidewalk()
    rng = np.random.default_rng(1)
    for x, y, _ in route[:-STRIDE:STRIDE]:
        data = costmap.data.copy()
        mx, my = costmap.world_to_map(x, y)
        for dx, dy in rng.integers(-200, 200, (PEDESTRIANS, 2)):
            column, row = mx + dx, my + dy
            inside = 40 < column < costmap.size_x - 40 and 40 < row < costmap.size_y - 40
            if inside and np.hypot(dx, dy) > 30:
                data[row - 6 : row + 6, column - 6 : column + 6] = LETHAL_OBSTACLE
                inflation.apply(data, column - 40, column + 40, row - 40, row + 40)
        yield (
            Pose2D(x, y),
            Costmap(data, costmap.resolution, costmap.origin_x, costmap.origin_y, costmap.data),
        )


def _cost(path: Path, costmap: Costmap) -> float:
    """Length [m], each piece times 1 + 4 cost / 252."""
    points = (path.poses[:, :2] - (costmap.origin_x, costmap.origin_y)) / costmap.resolution
    return float(polyline_cost(costmap.data, points, 4.0)) * costmap.resolution


def replanning() -> Prepared:
    """Plans to one goal from along the way, every 1.5 m, past other people each time.

    Every plan costs what the exact NavFn's does, but for the corners that either cuts. The costmaps
    are made before any time is taken.
    """
    planner, exact = IncrementalNavfn(IncrementalNavfnParams()), NavfnPlanner(NavfnParams())
    start, goal = missions()[0]
    route = exact.plan(start, goal, sidewalk()[0]).poses
    scenes = list(islice(drive(route), LONGEST))
    for pose, costmap in scenes:
        ours, twin = (_cost(each.plan(pose, goal, costmap), costmap) for each in (planner, exact))
        if ours > 1.02 * twin:
            raise TwinError(
                f"IncrementalNavfn: a path that costs {ours:g} m where NavFn's costs {twin:g} m"
            )
    coming = cycle([*scenes, *scenes[-2:0:-1]])

    def ours_next() -> None:
        pose, costmap = next(coming)
        planner.plan(pose, goal, costmap)

    return Prepared(ours_next)


def smoothing() -> Prepared:
    """The path on which the C++ was timed."""
    vectors = golden("smoother_velocity_collision_shim")
    facts = vectors.facts("smoother", "walls3x_infl")
    params = from_mapping(SimpleSmootherParams, facts["params"], "walls3x_infl")
    costmap = Costmap(
        vectors["sm_walls3x_infl_costmap"],
        facts["resolution"],
        float(facts["origin"][0]),
        float(facts["origin"][1]),
    )
    smoother, path = SimpleSmoother(params), Path(vectors["sm_walls3x_infl_in"])

    def twin() -> FloatArray:
        given = path.poses[:, :2]
        for _ in range(1 + (params.refinement_num if params.do_refinement else 0)):
            given = twins.relax(
                given, params.w_data, params.w_smooth, params.tolerance, params.max_its
            )
        return given

    require_agreement("simple smoother", smoother.smooth(path, costmap).poses[:, :2], twin(), 1e-9)
    return Prepared(lambda: smoother.smooth(path, costmap), twin)


def approach() -> Prepared:
    """Walls of points on both sides of a robot that drives a curve."""
    vectors = golden("smoother_velocity_collision_shim")
    polygon = vectors["cm_polygon"].astype(np.float64)
    params = PolygonParams(type="polygon", action_type="approach", min_points=4)
    zone, velocity = MonitorZone("approach", params, polygon), (0.8, 0.0, 0.3)
    along = np.linspace(-4.0, 4.0, 180)
    points = np.concatenate([np.column_stack((along, np.full(180, side))) for side in (-1.2, 1.3)])
    given = (
        params.trigger_count,
        velocity,
        params.time_before_collision,
        params.simulation_time_step,
    )
    twin = partial(twins.time_to_collision, points, polygon, *given)
    command = Twist2D(*velocity)
    found = zone.collision_time(points, command)
    require_agreement(
        "collision monitor",
        np.array((-1.0 if found is None else found,)),
        np.array((twin(),)),
        1e-9,
    )
    return Prepared(lambda: zone.collision_time(points, command), twin)


COMPONENTS: Sequence[Component] = (
    Component("NavFn Dijkstra, 4000 x 4000", partial(plans, False), 120.0, 0.3),
    Component("NavFn A*, 4000 x 4000", partial(plans, True), 110.0),
    Component("NavFn Dijkstra, 120 x 120", small_wave),
    Component("IncrementalNavfn replan, 4000 x 4000", replanning, 120.0, 0.01),
    Component("simple smoother, 1172 poses", smoothing, 2.2, 1.0),
    Component("collision monitor, approach, 360 points", approach, 0.05),
)
