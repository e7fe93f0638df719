"""NavFn (potentials, translated costs and paths of both algorithms) and the simple smoother."""

from collections.abc import Iterator

import numpy as np

from navstack.costmap.costmap import FREE_SPACE, Costmap
from navstack.errors import (
    GoalOccupiedError,
    GoalOutsideMapError,
    NoPathFoundError,
    PlanningError,
    StartOccupiedError,
    StartOutsideMapError,
)
from navstack.params.planners import NavfnParams, SimpleSmootherParams
from navstack.params.strict import from_mapping
from navstack.planning.navfn import NavfnPlanner, clamped_cell
from navstack.planning.navfn_kernels import POT_HIGH, cost_tables
from navstack.planning.simple_smoother import SimpleSmoother
from navstack.types import ByteArray, FloatArray, Path, Pose2D
from tools.parity.comparison import Comparison
from tools.parity.golden import GoldenFile
from tools.parity.part import Case, Shape, costmap_of, existing

ALGORITHMS = ("dijkstra", "astar")
SUFFIXES = ("potential", "navfn_cost", "path", "navfn_path_cells")
POTENTIAL_TOLERANCE = 1e-3  # relative
POSITION_TOLERANCE = 1e-6  # [m]
HEADING_TOLERANCE = 1e-5  # [rad]
POINT_TOLERANCE = 1e-5  # [cells] of the descent
# else defaults
PARAMETERS = {"tol": "tolerance", "unk": "allow_unknown", "fin": "use_final_approach_orientation"}
LETHAL = 254  # cost that NavFn gives to the border of the map
MAX_CYCLES_FACTOR = 4  # of all recordings: points of a path per row or column of the map

# words of the recorded error -> what navstack raises; every other error says that there is no path
REFUSALS: tuple[tuple[str, str, type[PlanningError]], ...] = (
    ("Start", "outside", StartOutsideMapError),
    ("Start", "lethal", StartOccupiedError),
    ("Goal", "outside", GoalOutsideMapError),
    ("Goal", "lethal", GoalOccupiedError),
)

NOT_PLANNED = "upstream answers without planning: its potential is uninitialised and not compared"


SMOOTHED_TOLERANCE = 1e-5  # [m, rad]
SMOOTHED = Shape(
    ("sm_{}_in", "sm_{}_out", "sm_{}_costmap"), (), ("smoother", "{}"), "params", "sm_{}"
)


def find_navfn(file: GoldenFile) -> Iterator[Case]:
    """Scenes ``<case>_costmap`` with the arrays of each algorithm; one case per algorithm."""
    for scene in file.bases("_costmap"):
        for algorithm in ALGORITHMS:
            name = f"{scene}_{algorithm}"
            if f"{name}_potential" in file and algorithm in file.facts(scene):
                outputs = (f"{name}_{suffix}" for suffix in SUFFIXES)
                yield Case(name, file, existing(file, [f"{scene}_costmap", *outputs]))


def check_navfn(case: Case, comparison: Comparison) -> None:
    """One plan, or the error that it ends in."""
    scene, _, algorithm = case.name.rpartition("_")
    facts = case.file.facts(scene)
    error = facts[algorithm]["error"]
    costmap = costmap_of(case.file[f"{scene}_costmap"], facts["resolution"], facts["origin"])
    start, goal = Pose2D(*facts["start_xyyaw"]), Pose2D(*facts["goal_xyyaw"])
    recorded = {ours: facts[theirs] for theirs, ours in PARAMETERS.items() if theirs in facts}
    params = NavfnParams(
        use_astar=algorithm == "astar",
        max_cycles_factor=MAX_CYCLES_FACTOR,
        **recorded,
    )
    planner = NavfnPlanner(params)
    result = _plan(planner, start, goal, costmap)
    refusal = next((kind for who, what, kind in REFUSALS if who in error and what in error), None)
    planned = refusal is None and (start.x, start.y) != (goal.x, goal.y)
    if planned:
        _check_field(case, comparison, planner, params, costmap, start)
    else:
        case.pass_over("potential", "navfn_cost")
        comparison.allow(NOT_PLANNED)
    if error:
        for suffix in ("path", "navfn_path_cells"):
            comparison.require(not len(case[suffix]), f"an error, and a {suffix} was recorded")
    if refusal is not None:
        comparison.require(isinstance(result, refusal), f"{_said(result)}; recorded: {error}")
    elif error:
        comparison.require(isinstance(result, NoPathFoundError), f"{_said(result)}; recorded: none")
    elif isinstance(result, Path):
        _check_path(case, comparison, result.poses, costmap)
    else:
        comparison.require(False, f"{_said(result)}; recorded: a path of {len(case['path'])} poses")


def _plan(
    planner: NavfnPlanner,
    start: Pose2D,
    goal: Pose2D,
    costmap: Costmap,
) -> Path | PlanningError:
    try:
        return planner.plan(start, goal, costmap)
    except PlanningError as error:
        return error


def _check_field(
    case: Case,
    comparison: Comparison,
    planner: NavfnPlanner,
    params: NavfnParams,
    costmap: Costmap,
    start: Pose2D,
) -> None:
    """Translated costs exactly; potentials of the reached cells, which must be the same ones."""
    if "navfn_cost" in case:
        comparison.equal(
            "translated costs",
            _translated(costmap, params.allow_unknown, start),
            case["navfn_cost"],
        )
    ours, theirs = planner.potential, case["potential"]
    comparison.equal("reached cells", ours < POT_HIGH, theirs < POT_HIGH)
    reached = (ours < POT_HIGH) & (theirs < POT_HIGH)
    comparison.near("potential", ours[reached], theirs[reached], POTENTIAL_TOLERANCE, relative=True)


def _translated(costmap: Costmap, allow_unknown: bool, start: Pose2D) -> ByteArray:
    """NavFn's own costs: the robot's cell is free, the border lethal."""
    crossing, _ = cost_tables(allow_unknown)
    costs = costmap.data.copy()
    costs.reshape(-1)[clamped_cell(start, costmap)] = FREE_SPACE
    translated = crossing[costs].astype(np.uint8)
    translated[0], translated[-1], translated[:, 0], translated[:, -1] = (
        LETHAL,
        LETHAL,
        LETHAL,
        LETHAL,
    )
    return translated


def _check_path(case: Case, comparison: Comparison, ours: FloatArray, costmap: Costmap) -> None:
    """The same poses, and the same points of the descent."""
    theirs = case["path"]
    comparison.near("positions [m]", ours[:, :2], theirs[:, :2], POSITION_TOLERANCE)
    comparison.angles("headings", ours[:, 2], theirs[:, 2], HEADING_TOLERANCE)
    if "navfn_path_cells" in case:
        points = case["navfn_path_cells"]
        descent = _descent(ours, len(points), costmap)
        comparison.near("points of the descent [cells]", descent, points, POINT_TOLERANCE)


def _descent(poses: FloatArray, count: int, costmap: Costmap) -> FloatArray:
    """The points (M, 2) in [cells], from the goal on, that poses (N, 3) were made of.

    The last pose is the goal: after the grid point at which the descent begins, or, where ``count``
    is N, in its place.
    """
    places = (poses[::-1, :2] - (costmap.origin_x, costmap.origin_y)) / costmap.resolution
    if count != len(poses):
        return places[1:]
    places[0] = np.floor(places[0] + 0.5)
    return places


def _said(result: Path | PlanningError) -> str:
    return (
        f"a path of {len(result)} poses"
        if isinstance(result, Path)
        else f"{type(result).__name__}: {result}"
    )


def check_smoother(case: Case, comparison: Comparison) -> None:
    """Every pose of the smoothed path."""
    facts = case.facts
    params = from_mapping(SimpleSmootherParams, facts["params"], case.title)
    costmap = costmap_of(case["costmap"], facts["resolution"], facts["origin"])
    ours, theirs = SimpleSmoother(params).smooth(Path(case["in"]), costmap).poses, case["out"]
    comparison.near("positions", ours[:, :2], theirs[:, :2], SMOOTHED_TOLERANCE)
    if ours.shape == theirs.shape:
        comparison.angles("headings", ours[:, 2], theirs[:, 2], SMOOTHED_TOLERANCE)
