"""Parameters of model predictive path integral control: names and defaults are those of Nav2 Jazzy.

Each critic has its own dataclass; :class:`MppiParams` holds them under the critic's name, as ``FollowPath.<Critic>.*``.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

from navstack.errors import ParameterError, did_you_mean
from navstack.params.costmap import InflationLayerParams
from navstack.params.mppi_critics import (
    ConstraintParams,
    CostParams,
    GoalAngleParams,
    GoalParams,
    ObstaclesParams,
    PathAlignParams,
    PathAngleParams,
    PathFollowParams,
    PreferForwardParams,
    TwirlingParams,
    VelocityDeadbandParams,
)

CRITICS = (
    *("ConstraintCritic", "CostCritic", "GoalAngleCritic", "GoalCritic", "ObstaclesCritic", "PathAlignCritic"),
    *("PathAngleCritic", "PathFollowCritic", "PreferForwardCritic", "TwirlingCritic", "VelocityDeadbandCritic"),
)
MOTION_MODELS = ("DiffDrive", "Ackermann")  # those that run here
MOST_POSES = 4_000_000  # of all trajectories in a cycle; Nav2's defaults make 56,000

_POSITIVE = (
    "batch_size",
    "model_dt",
    "iteration_count",
    "vx_std",
    "wz_std",
    "temperature",
    "ax_max",
    "az_max",
    "wz_max",
)
_NOT_NEGATIVE = ("vy_std", "vy_max", "gamma", "retry_attempt_limit", "reset_period", "prune_distance")


@dataclass(frozen=True, slots=True)
class AckermannParams:
    """``AckermannConstraints``."""

    min_turning_r: float = 0.2  # [m] least radius of a curve

    def __post_init__(self) -> None:
        if self.min_turning_r < 0.0:
            raise ParameterError(f"min_turning_r {self.min_turning_r} must be 0 or more")


@dataclass(frozen=True, slots=True)
class LocalCosts:
    """What the obstacle critics know of how the local costmap is made."""

    inflation_layers: Mapping[str, InflationLayerParams] = field(default_factory=dict)  # by name, in their order
    tracks_unknown: bool = False  # unknown cells are no obstacles
    is_round: bool = False  # the robot is given by its radius
    ends_inflated: bool = False  # nothing marks cells after the inflation layer

    def inflation(self, name: str) -> InflationLayerParams | None:
        """The inflation layer of a name, for an empty one the last; None: there is none."""
        last = list(self.inflation_layers.values())[-1:]
        return self.inflation_layers.get(name) if name else (last[0] if last else None)


@dataclass(frozen=True, slots=True)
class MppiParams:
    """``nav2_mppi_controller::MPPIController`` (``optimizer.cpp``, ``path_handler.cpp``, ``controller.cpp``)."""

    critics: tuple[str, ...] = ()  # none: as in Nav2, nothing is preferred to anything
    motion_model: str = "DiffDrive"  # or Ackermann
    batch_size: int = 1000  # trajectories compared
    time_steps: int = 56  # poses of a trajectory
    model_dt: float = 0.05  # [s] between poses; not less than a control period
    iteration_count: int = 1  # updates of the sequence per cycle
    vx_std: float = 0.2  # [m/s] of the noise
    vy_std: float = 0.2  # [m/s] of a robot that drives sideways
    wz_std: float = 0.4  # [rad/s] of the noise
    vx_max: float = 0.5  # [m/s]
    vx_min: float = -0.35  # [m/s] negative: it may drive backwards
    vy_max: float = 0.5  # [m/s] of a robot that drives sideways; ConstraintCritic adds it for every robot
    wz_max: float = 1.9  # [rad/s]
    ax_max: float = 3.0  # [m/s2] speeding up
    ax_min: float = -3.0  # [m/s2] slowing down; a positive value is taken as a negative one
    az_max: float = 3.5  # [rad/s2]
    temperature: float = 0.3  # [-] small: the cheapest trajectory alone counts; large: all count alike
    gamma: float = 0.015  # [-] how much a sample's distance from the last sequence costs
    retry_attempt_limit: int = 1  # more attempts with a forgotten sequence and new noise where all trajectories collide
    regenerate_noises: bool = False  # new noise for every update; False: the same from reset to reset
    reset_period: float = 1.0  # [s] without a cycle, after which the sequence is forgotten

    prune_distance: float = 1.5  # [m] of the path ahead that the critics see
    max_robot_pose_search_dist: float | None = None  # [m] along the path in which the robot is looked for
    # (absent: half the local costmap's longer side)
    enforce_path_inversion: bool = False  # show the critics the path up to its next cusp only
    inversion_xy_tolerance: float = 0.2  # [m] to the cusp, within which it is passed
    inversion_yaw_tolerance: float = 0.4  # [rad]

    AckermannConstraints: AckermannParams = field(default_factory=AckermannParams)
    ConstraintCritic: ConstraintParams = field(default_factory=ConstraintParams)
    CostCritic: CostParams = field(default_factory=CostParams)
    GoalAngleCritic: GoalAngleParams = field(default_factory=GoalAngleParams)
    GoalCritic: GoalParams = field(default_factory=GoalParams)
    ObstaclesCritic: ObstaclesParams = field(default_factory=ObstaclesParams)
    PathAlignCritic: PathAlignParams = field(default_factory=PathAlignParams)
    PathAngleCritic: PathAngleParams = field(default_factory=PathAngleParams)
    PathFollowCritic: PathFollowParams = field(default_factory=PathFollowParams)
    PreferForwardCritic: PreferForwardParams = field(default_factory=PreferForwardParams)
    TwirlingCritic: TwirlingParams = field(default_factory=TwirlingParams)
    VelocityDeadbandCritic: VelocityDeadbandParams = field(default_factory=VelocityDeadbandParams)
    local_costs: LocalCosts = field(default_factory=LocalCosts)  # read from the local costmap's section

    def __post_init__(self) -> None:
        for name in _POSITIVE:
            self._require(name, getattr(self, name) > 0, "more than 0")
        for name in _NOT_NEGATIVE:
            self._require(name, getattr(self, name) >= 0, "0 or more")
        self._require("time_steps", self.time_steps >= 2, "2 or more")
        self._require("vx_max", self.vx_max > max(0.0, self.vx_min), f"more than 0 and vx_min ({self.vx_min})")
        self._require("motion_model", self.motion_model in MOTION_MODELS, f"one of {', '.join(MOTION_MODELS)} here")
        if self.batch_size * self.time_steps > MOST_POSES:
            raise ParameterError(
                f"batch_size {self.batch_size:,} x time_steps {self.time_steps:,} are "
                f"{self.batch_size * self.time_steps:,} poses; at most {MOST_POSES:,} are allowed"
            )
        for name in self.critics:
            if name not in CRITICS:
                raise ParameterError(f"critics: '{name}' is not available here{did_you_mean(name, CRITICS)}")

    def _require(self, name: str, is_right: bool, allowed: str) -> None:
        if not is_right:
            raise ParameterError(f"{name} {getattr(self, name)} must be {allowed}")
