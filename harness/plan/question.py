"""One question to several planners.

The costmap of a stack on a map, a mission, and what each planner answers.
"""

import dataclasses
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.episode.brains import planning_map
from harness.episode.factory import Parts
from harness.plan.path_check import Obstacles
from harness.storage.shipped import resolve, shipped
from harness.task.study import EpisodeTask, make_study
from harness.world.map.importer import resampled
from navstack.build import build_global_costmap, robot_shape
from navstack.costmap.costmap import Costmap
from navstack.costmap.map_io import load_map
from navstack.costmap.occupancy_grid import OCCUPIED, OccupancyGrid, align
from navstack.errors import PlanningError, UnknownNameError
from navstack.params.extensions import algorithms
from navstack.params.filters import KEEPOUT
from navstack.params.nav2_file.file import Nav2File
from navstack.params.nav2_file.views import read_costmap, read_masks, read_planners, read_smoothers
from navstack.params.planners import (
    OMPL_ALGORITHMS,
    SE2_ALGORITHMS,
    STATE_SPACES,
    OmplParams,
    SimpleSmootherParams,
)
from navstack.planning.planner import Planner, RobotShape
from navstack.planning.polyline_kernels import polyline_cost
from navstack.planning.simple_smoother import SimpleSmoother
from navstack.types import BoolArray, FloatArray, Path, Pose2D

OMPL = "navstack::OmplPlanner"
GRID = {
    "NavFn": "nav2_navfn_planner::NavfnPlanner",
    "IncrementalNavfn": "navstack::IncrementalNavfn",
    "Smac2D": "nav2_smac_planner::SmacPlanner2D",
    "SmacHybrid": "nav2_smac_planner::SmacPlannerHybrid",
    "SmacLattice": "nav2_smac_planner::SmacPlannerLattice",
    "ThetaStar": "nav2_theta_star_planner::ThetaStarPlanner",
}
NAMES = (*GRID, *OMPL_ALGORITHMS)
SMOOTHER = "SimpleSmoother"
# a path through cost 252 counts as five of its length: what NavFn makes of the costs
COST_WEIGHT = 4.0
# how often a question is asked, as long as that takes less than this [s] together
REPEATS, QUICK = 5, 0.5
UNLIMITED = 10**9  # iterations, where the time is limited
COMPILING = 2000  # iterations, on next to nothing


@dataclass(frozen=True, slots=True, eq=False)
class PlanningMap:
    """Where is planned."""

    costmap: Costmap
    shape: RobotShape
    obstacles: Obstacles
    footprint: FloatArray  # (N, 2) [m] of the robot itself


@dataclass(frozen=True, slots=True, eq=False)
class Answer:
    """What a planner made of a question."""

    planner: str
    path: Path | None
    why: str  # why there is no path; empty: there is one
    seconds: float  # of wall time, smoothing included; median where it was asked repeatedly
    clearance: float | None  # [m] of the robot's body to obstacles on the way; 0: it touches one
    cost: float | None  # [m] length, each piece times 1 + COST_WEIGHT * cost / 252
    # of the search: wall time [s] and the planner's own cost [m]
    improvement: tuple[tuple[float, float], ...]


def make_ground(task: EpisodeTask, start: Pose2D | None = None) -> PlanningMap:
    """The costmap of a task's stack, without scans, and the obstacles behind it.

    A costmap that moves with the robot is centred on ``start``, without one on the map's lower left
    corner.
    """
    parts = Parts(task)
    grid, keepout = planning_map(parts.scene, task.stack)
    layered = build_global_costmap(parts.nav2, grid, keepout)
    layered.update(start or Pose2D(grid.origin.x, grid.origin.y), None, 0.0)
    taken = grid.data == OCCUPIED
    own = _own_keepout(parts.nav2, grid)
    if own is not None:
        taken |= own
    elif keepout is not None:
        taken |= keepout
    obstacles = Obstacles(taken, grid.resolution, grid.origin.x, grid.origin.y)
    return PlanningMap(layered.master, robot_shape(layered), obstacles, parts.robot.polygon)


def _own_keepout(nav2: Nav2File, grid: OccupancyGrid) -> BoolArray | None:
    """Cells (H, W) of a map that the file's own keepout masks close; None: it names none."""
    masks = read_masks(nav2, read_costmap(nav2, "global_costmap"))
    keepouts = [mask for mask in masks.values() if mask.info.type == KEEPOUT]
    if not keepouts:
        return None
    closed = np.zeros(grid.data.shape, dtype=bool)
    for mask in keepouts:
        closed |= resampled(align(load_map(mask.path)), grid).data == OCCUPIED
    return closed


def ends_of(task: EpisodeTask) -> tuple[Pose2D, Pose2D]:
    """Start and goal: as given, where both are; else the mission of the task.

    Raises:
        InputError: one is given and cannot be used.
    """
    if task.start is not None and task.goal is not None:
        return task.start, task.goal  # whether they can be used is for the planners to say
    mission = Parts(task).mission(task.generators()["mission"])
    return mission.start, mission.goal


def compile_first(shape: RobotShape) -> None:
    """Let every planner and the smoother work once, so that no time is taken for compiling."""
    costmap = Costmap(np.zeros((60, 60), dtype=np.uint8), 0.05, 0.0, 0.0)
    for kind, entry in algorithms("planners").items():
        params = _defaults(kind)
        spaces: tuple[Any, ...] = (params,)
        if isinstance(params, OmplParams):
            quick = dataclasses.replace(
                params,
                max_iterations=COMPILING,
                tolerance=0.0,
                algorithm=SE2_ALGORITHMS[0],
            )
            spaces = tuple(dataclasses.replace(quick, state_space=space) for space in STATE_SPACES)
        for each in spaces:
            path = entry.create(each, parts={"robot_shape": shape}).plan(
                Pose2D(1.0, 1.0), Pose2D(2.2, 2.0), costmap
            )
    SimpleSmoother(SimpleSmootherParams()).smooth(path, costmap)


def make_planner(
    name: str,
    nav2: Nav2File,
    shape: RobotShape,
    seconds: float,
    **changes: Any,
) -> Planner:
    """A planner of :data:`NAMES`, with the parameters that the file has for its kind.

    Args:
        name: of a plugin or of one of OMPL's algorithms.
        nav2: the parameter file.
        shape: the robot's.
        seconds: wall time that OMPL's may take instead of their iterations; 0: as the file says.
        changes: other values for fields of ``OmplParams``.

    Raises:
        UnknownNameError: there is no such planner.
    """
    if name not in NAMES:
        raise UnknownNameError("planner", name, NAMES)
    kind = GRID.get(name, OMPL)
    given = [plugin.params for plugin in read_planners(nav2) if plugin.type == kind]
    if kind == OMPL:  # its own section goes before another algorithm's
        given.sort(key=lambda params: params.algorithm != name)
    if not given:
        given.append(_defaults(kind))
    params = given[0]
    if isinstance(params, OmplParams):
        params = dataclasses.replace(params, algorithm=name, **changes)
        if seconds > 0.0:
            params = dataclasses.replace(
                params,
                max_planning_time=seconds,
                max_iterations=UNLIMITED,
                patience=0,
            )
    planner: Planner = algorithms("planners")[kind].create(params, parts={"robot_shape": shape})
    return planner


def _defaults(planner: str) -> Any:
    """The parameters of a planner that no file gives."""
    make = algorithms("planners")[planner].params
    if make is None:
        return None
    return make()


def make_smoother(name: str, nav2: Nav2File) -> SimpleSmoother:
    """The smoother, with the parameters that the file has for it.

    Raises:
        UnknownNameError: it has another name.
    """
    if name != SMOOTHER:
        raise UnknownNameError("smoother", name, (SMOOTHER,))
    given = [plugin.params for plugin in read_smoothers(nav2)]
    return SimpleSmoother(next(iter(given), SimpleSmootherParams()))


def ask(
    name: str,
    planner: Planner,
    smoother: SimpleSmoother | None,
    ground: PlanningMap,
    ends: Sequence[Pose2D],
    seed: int,
) -> Answer:
    """Let a planner answer a question, smooth its path and measure it.

    What is quick is asked ``REPEATS`` times, with the same random numbers: the median time counts,
    as a first call pays for what the later ones find in the caches.
    """
    start, goal = ends
    taken: list[float] = []
    while not taken or (len(taken) < REPEATS and sum(taken) < QUICK):
        planner.reset(np.random.default_rng(seed))
        begin, why, path = time.perf_counter(), "", None
        try:
            path = planner.plan(start, goal, ground.costmap)
            if smoother is not None:
                path = smoother.smooth(path, ground.costmap)
        except PlanningError as error:
            why = str(error)
        taken.append(time.perf_counter() - begin)
    seconds = statistics.median(taken)
    if path is None:
        return Answer(name, None, why, seconds, None, None, planner.improvement)
    clearance = ground.obstacles.clearance(path.poses, start, goal, ground.footprint)
    return Answer(
        name,
        path,
        why,
        seconds,
        clearance,
        cost_of(path, ground.costmap),
        planner.improvement,
    )


def task_of(
    map_name: str,
    start: Sequence[float] | None,
    goal: Sequence[float] | None,
    seed: int,
    params: str | None,
    allow_unknown: bool = True,
) -> EpisodeTask:
    """The delivery whose path is asked for: that of the stack nav2-gps, or of a Nav2 file.

    Args:
        map_name: a built-in map or a map_server YAML file.
        start: x [m], y [m], yaw [rad]; None: drawn.
        goal: likewise.
        seed: of what is drawn.
        params: a Nav2 parameter file, or a name of params/nav2; None: the stack's.
        allow_unknown: whether keys unknown to Nav2 are let pass.

    Raises:
        InputError: an unknown name, or a pose that is not three numbers.
    """
    stack = "nav2-gps"
    if params is not None:
        stack = str(resolve(params, shipped("params") / "nav2", "Nav2").resolve())
    study = make_study(
        stacks=(stack,),
        episodes=1,
        seed=seed,
        map_name=map_name,
        start=start,
        goal=goal,
        workers=1,
        allow_unknown=allow_unknown,
    )
    return study.template


def ask_all(
    task: EpisodeTask,
    names: Sequence[str],
    smoother: str | None = None,
    seconds: float = 0.0,
    tell: Callable[[], None] = lambda: None,
) -> tuple[tuple[Pose2D, Pose2D], PlanningMap, list[Answer]]:
    """Ask planners for the path of a task, one after the other.

    Returns its ends, where was planned, and the answers.

    Args:
        task: of :func:`task_of`.
        names: see :func:`make_planner`.
        smoother: of every path; None: none.
        seconds: see :func:`make_planner`.
        tell: hears of each planner that has answered.

    Raises:
        InputError: an unknown name, or a pose that cannot be used.
    """
    nav2 = Parts(task).nav2
    smooth = None
    if smoother is not None:
        smooth = make_smoother(smoother, nav2)
    ends = ends_of(task)
    ground = make_ground(task, ends[0])
    planners = [make_planner(name, nav2, ground.shape, seconds) for name in names]
    compile_first(ground.shape)
    answers = []
    for name, planner in zip(names, planners, strict=True):
        answers.append(ask(name, planner, smooth, ground, ends, task.seed))
        tell()
    return ends, ground, answers


def cost_of(path: Path, costmap: Costmap) -> float:
    """Length of a path [m], each piece times 1 + ``COST_WEIGHT`` * mean cost / 252."""
    points = (path.poses[:, :2] - (costmap.origin_x, costmap.origin_y)) / costmap.resolution
    return (
        float(polyline_cost(costmap.data, np.ascontiguousarray(points), COST_WEIGHT))
        * costmap.resolution
    )
