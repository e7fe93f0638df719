"""Parameters of nav2_smac_planner's three planners: names and defaults are those of Nav2 Jazzy.

``max_planning_time`` counts as iterations, :data:`ITERATIONS_PER_SECOND` of a search over poses:
plans must not depend on the machine. On the grid a million iterations take a fifth of a second, and
``max_iterations`` alone counts.
"""

from dataclasses import asdict, dataclass, field
from typing import Annotated

from navstack.params.planners import (
    Refinements,
    SimpleSmootherParams,
    SmootherIterations,
    TurningRadius,
)
from navstack.ranges import (
    Known,
    NotNegative,
    OpenQuantity,
    Parameters,
    Positive,
    Quantity,
    Replaced,
    within,
)

DUBIN, REEDS_SHEPP = "DUBIN", "REEDS_SHEPP"
MODELS = (DUBIN, REEDS_SHEPP)
UNLIMITED = 2**31 - 1
Iterations = Annotated[int, Replaced(range(1, UNLIMITED), UNLIMITED)]  # 0 or less: no limit
ITERATIONS_PER_SECOND = 500_000  # about what one core of an AMD EPYC does: 200,000 in 0.39 s
# Headings of a search: with fewer no arc leads from one to the next, and each has a table of
# motions; 720 are half a degree each.
Bins = Annotated[int, within(4, 720)]
Downsampling = Annotated[int, within(1, 100)]  # cells along an edge of a coarse one


@dataclass(frozen=True, slots=True)
class SmacSmootherParams(Parameters):
    """The ``smoother`` group of all three."""

    max_iterations: SmootherIterations = 1000
    w_smooth: NotNegative = 0.3
    w_data: NotNegative = 0.2
    tolerance: NotNegative = 1e-10  # [m]
    do_refinement: bool = True
    refinement_num: Refinements = 2

    @property
    def as_simple(self) -> SimpleSmootherParams:
        """The same for Nav2's simple smoother, which relaxes alike."""
        shared = {name: value for name, value in asdict(self).items() if name != "max_iterations"}
        return SimpleSmootherParams(max_its=self.max_iterations, **shared)


@dataclass(frozen=True, slots=True)
class Smac2DParams(Parameters):
    """nav2_smac_planner::SmacPlanner2D."""

    tolerance: NotNegative = 0.125  # [m] of a goal that cannot be reached itself
    downsample_costmap: bool = False
    downsampling_factor: Downsampling = 1
    cost_travel_multiplier: NotNegative = 1.0  # a step costs 1 + this * cost / 252 times its length
    allow_unknown: bool = True
    max_iterations: Iterations = 1_000_000
    # after a cell within the tolerance was found
    max_on_approach_iterations: Iterations = 1000
    use_final_approach_orientation: bool = False  # the last pose looks along the path
    smooth_path: bool = True
    smoother: SmacSmootherParams = field(default_factory=SmacSmootherParams)


@dataclass(frozen=True, slots=True)
class SmacHybridParams(Parameters):
    """nav2_smac_planner::SmacPlannerHybrid."""

    tolerance: NotNegative = 0.25  # [m]
    downsample_costmap: bool = False
    downsampling_factor: Downsampling = 1
    angle_quantization_bins: Bins = 72
    motion_model_for_search: Annotated[str, Known("motion_model_for_search", MODELS)] = DUBIN
    minimum_turning_radius: TurningRadius = 0.4  # [m]
    allow_unknown: bool = True
    max_iterations: Iterations = 1_000_000
    max_on_approach_iterations: Iterations = 1000
    max_planning_time: OpenQuantity = 5.0  # [s] see above; 0 or less: no limit
    reverse_penalty: Quantity = 2.0
    change_penalty: Quantity = 0.0
    non_straight_penalty: Quantity = 1.2
    cost_penalty: NotNegative = 2.0
    retrospective_penalty: Quantity = 0.015
    analytic_expansion_ratio: Positive = 3.5
    analytic_expansion_max_length: Quantity = 3.0  # [m]
    analytic_expansion_max_cost: Quantity = 200.0
    # [m] of the square about the goal in which Dubins' curves bound the way
    lookup_table_size: Quantity = 20.0
    downsample_obstacle_heuristic: bool = True
    smooth_path: bool = True
    smoother: SmacSmootherParams = field(default_factory=SmacSmootherParams)

    @property
    def rotation_penalty(self) -> float:
        """No motion turns on the spot."""
        return 0.0


@dataclass(frozen=True, slots=True)
class SmacLatticeParams(Parameters):
    """nav2_smac_planner::SmacPlannerLattice."""

    tolerance: NotNegative = 0.25  # [m]
    # Nav2's JSON file; empty or absent: a lattice of 0.5 m of turning radius is made
    lattice_filepath: str = ""
    allow_unknown: bool = True
    max_iterations: Iterations = 1_000_000
    max_on_approach_iterations: Iterations = 1000
    max_planning_time: OpenQuantity = 5.0  # [s] see above; 0 or less: no limit
    reverse_penalty: Quantity = 2.0
    change_penalty: Quantity = 0.05
    non_straight_penalty: Quantity = 1.05
    cost_penalty: NotNegative = 2.0
    rotation_penalty: Quantity = 5.0
    retrospective_penalty: Quantity = 0.015
    analytic_expansion_ratio: Positive = 3.5
    analytic_expansion_max_length: Quantity = 3.0  # [m]
    analytic_expansion_max_cost: Quantity = 200.0
    lookup_table_size: Quantity = 20.0  # [m]
    downsample_obstacle_heuristic: bool = True
    smooth_path: bool = True
    smoother: SmacSmootherParams = field(default_factory=SmacSmootherParams)


def iterations_of(params: SmacHybridParams | SmacLatticeParams) -> int:
    """How many iterations a search over poses may take."""
    seconds = params.max_planning_time
    if seconds <= 0.0:
        return params.max_iterations
    return int(min(params.max_iterations, seconds * ITERATIONS_PER_SECOND))
