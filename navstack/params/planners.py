"""Parameters of global planners and the path smoother, under Nav2's names where Nav2 has them."""

from dataclasses import dataclass
from typing import Annotated

from navstack.errors import ParameterError
from navstack.ranges import (
    Known,
    NotNegative,
    NotNegativeInt,
    Parameters,
    Positive,
    PositiveInt,
    Replaced,
    up_to,
    within,
)

OMPL_ALGORITHMS = ("BITstar", "FMT", "InformedRRTstar", "PRMstar", "RRTConnect", "RRTstar")
STATE_SPACES = ("R2", "SE2")
MOST_ITERATIONS = 10_000_000  # of a search; they take minutes
# the others take it that a way back is as long as the way there
SE2_ALGORITHMS = ("RRTConnect", "RRTstar")


# [m] of a goal; NavFn looks at every cell of the square, others at every cell of the circle
Tolerance = Annotated[float, within(0.0, 100.0)]
TurningRadius = Annotated[float, up_to(100.0)]  # [m]; wider curves are straight on a map
# of a path's smoothing; after some hundreds nothing moves any more
SmootherIterations = Annotated[int, within(0, 100_000)]
Refinements = Annotated[int, within(0, 100)]


@dataclass(frozen=True, slots=True)
class NavfnParams(Parameters):
    """nav2_navfn_planner::NavfnPlanner; the defaults are Nav2's."""

    # [m] an unreachable goal may be replaced by a reachable point this near (per axis)
    tolerance: Tolerance = 0.5
    use_astar: bool = False  # A* explores less and is not optimal; False: Dijkstra
    allow_unknown: bool = True  # plan through unknown cells, at the highest cost
    # the last pose looks along the path instead of along the goal
    use_final_approach_orientation: bool = False
    # points of a path per row or column of the map (the more of the two), beyond which Nav2 gives
    # up, as it does where the gradient is zero (4 in Nav2 main and, fixed, in Jazzy); 0: never
    max_cycles_factor: Annotated[int, within(0, 1000)] = 0


@dataclass(frozen=True, slots=True)
class IncrementalNavfnParams(Parameters):
    """navstack::IncrementalNavfn: NavFn's field, kept between plans to the same goal."""

    tolerance: Tolerance = 0.5  # [m] as in NavfnParams
    allow_unknown: bool = True  # as in NavfnParams
    use_final_approach_orientation: bool = False  # as in NavfnParams
    # [m] about the robot, per axis, where the costmap may change between two plans
    change_radius: NotNegative = 20.0


@dataclass(frozen=True, slots=True)
class ThetaStarParams(Parameters):
    """nav2_theta_star_planner::ThetaStarPlanner; the defaults are Nav2's."""

    how_many_corners: Annotated[int, Replaced((4, 8), 8)] = 8  # neighbours of a cell
    w_euc_cost: NotNegative = 1.0  # weight of a way's length [cells]
    w_traversal_cost: NotNegative = 2.0  # weight of the costs on it
    # weight of the straight way to the goal; Nav2 takes the lesser of w_euc_cost and 1
    w_heuristic_cost: NotNegative = 1.0
    allow_unknown: bool = True  # plan through unknown cells, at a cost of 253
    use_final_approach_orientation: bool = False  # as in NavfnParams


@dataclass(frozen=True, slots=True)
class OmplParams(Parameters):
    """navstack::OmplPlanner: a sampling-based planner of the Open Motion Planning Library."""

    algorithm: Annotated[str, Known("OMPL algorithm", OMPL_ALGORITHMS)] = "BITstar"
    # checks of the termination condition; a count, not a time, keeps plans repeatable
    max_iterations: PositiveInt = 20000
    # [s] of wall time that ends a search; 0: none, else plans depend on the machine
    max_planning_time: NotNegative = 0.0
    # iterations in which the best path gets no 0.1 % better, after which a search ends; 0: never
    patience: NotNegativeInt = 1000
    # R2: points, turning on the spot; SE2: poses on Dubins curves, see SE2_ALGORITHMS
    state_space: Annotated[str, Known("state space", STATE_SPACES)] = "R2"
    minimum_turning_radius: TurningRadius = 0.5  # [m] of those curves
    # [m] an occupied start or goal is replaced by the nearest free cell this near
    tolerance: Tolerance = 0.5
    allow_unknown: bool = True  # plan through unknown cells
    # highest costmap cost the path may touch; 253 and above are contact
    max_allowed_cost: Annotated[int, within(0, 252)] = 252
    # length of a path counts 1 + cost_weight * cost / 252; 0: shortest path, along walls
    cost_weight: NotNegative = 1.0
    range: Positive = 30.0  # [m] longest extension of the tree in one step
    simplify: bool = True  # take short cuts along the path found (R2)
    # go on along the last path to the same goal while it is free, near and the cheapest
    keep_valid_path: bool = True
    # in a row that find nothing cheaper, after which a kept path is taken without a search
    fruitless_searches: NotNegativeInt = 5
    smooth: bool = True  # round the corners of the path, where there is room (R2)

    def _check_together(self) -> None:
        ends = self.max_planning_time > 0.0 or self.max_iterations <= MOST_ITERATIONS
        allowed = f"at most {MOST_ITERATIONS:,} without a max_planning_time"
        self._require("max_iterations", ends, allowed)
        if self.state_space == "SE2" and self.algorithm not in SE2_ALGORITHMS:
            raise ParameterError(
                f"{self.algorithm} cannot plan in SE2, where a way back is not as long as the way "
                f"there; take {' or '.join(SE2_ALGORITHMS)}, or R2"
            )


@dataclass(frozen=True, slots=True)
class SimpleSmootherParams(Parameters):
    """nav2_smoother::SimpleSmoother; the defaults are Nav2's."""

    # [m] it ends once all poses together move less than this in one iteration
    tolerance: NotNegative = 1e-10
    max_its: SmootherIterations = 1000  # iterations, after which the last but one is taken
    w_data: NotNegative = 0.2  # pull towards the given path
    w_smooth: NotNegative = 0.3  # pull towards the middle of the neighbours
    do_refinement: bool = True  # smooth the smoothed path again
    refinement_num: Refinements = 2  # so many times
    enforce_path_inversion: bool = True  # smooth the stretches between cusps apart
