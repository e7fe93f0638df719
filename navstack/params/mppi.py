"""Parameters of model predictive path integral control: names and defaults are those of Nav2 Jazzy.

Each critic has its own dataclass; :class:`MppiParams` holds them under the critic's name, as
``FollowPath.<Critic>.*``.
"""

from dataclasses import dataclass, field, fields
from typing import Annotated

from navstack.errors import ParameterError, did_you_mean
from navstack.params.expected_contact import MppiContactParams
from navstack.params.local_costs import LocalCosts
from navstack.params.mppi_critics import (
    ConstraintParams,
    CostParams,
    GoalAngleParams,
    GoalParams,
    MppiPreferForwardParams,
    MppiTwirlingParams,
    ObstaclesParams,
    PathAlignParams,
    PathAngleParams,
    PathFollowParams,
    VelocityDeadbandParams,
)
from navstack.ranges import Allowed, Parameters, one_of, within

OMNI = "Omni"  # drives sideways
MOTION_MODELS = ("DiffDrive", "Ackermann", OMNI)
MOST_POSES = 4_000_000  # of all trajectories in a cycle; Nav2's defaults make 56,000

# Least and most of each parameter, far beyond any sensible value: outside, float32 costs over- or
# underflow, the robot cannot move or brake, or a cycle does not end.
LEAST_STD = 1e-3  # of noise that makes samples differ
Acceleration = Annotated[float, within(1e-3, 1e3)]
Braking = Annotated[
    float, Allowed("0.001 to 1000, either sign", lambda value: 1e-3 <= abs(value) <= 1e3)
]
# 0: of a robot that cannot drive sideways
Sideways = Annotated[float, within(-1e3, 1e3)]


@dataclass(frozen=True, slots=True)
class AckermannParams(Parameters):
    """``AckermannConstraints``."""

    min_turning_r: Annotated[float, within(0.0, 1e4)] = 0.2  # [m] least radius of a curve


@dataclass(frozen=True, slots=True)
class MppiParams(Parameters):
    """``nav2_mppi_controller::MPPIController``."""

    # at least one; with none, as Nav2 allows, nothing is preferred to anything
    critics: tuple[str, ...] = ()
    motion_model: Annotated[str, one_of(MOTION_MODELS)] = "DiffDrive"  # or Ackermann, Omni
    batch_size: Annotated[int, within(1, MOST_POSES)] = 1000  # trajectories compared
    time_steps: Annotated[int, within(2, MOST_POSES)] = 56  # poses of a trajectory
    # [s] between poses; not less than a control period
    model_dt: Annotated[float, within(1e-3, 1.0)] = 0.05
    iteration_count: Annotated[int, within(1, 1000)] = 1  # updates of the sequence per cycle
    vx_std: Annotated[float, within(LEAST_STD, 1e3)] = 0.2  # [m/s] of the noise
    vy_std: Annotated[float, within(0.0, 1e3)] = 0.2  # [m/s] of a robot that drives sideways
    wz_std: Annotated[float, within(LEAST_STD, 1e3)] = 0.4  # [rad/s] of the noise
    vx_max: Annotated[float, within(1e-3, 100.0)] = 0.5  # [m/s]
    # [m/s] negative: it may drive backwards; above vx_max that counts (Nav2's utils::clamp)
    vx_min: Annotated[float, within(-100.0, 100.0)] = -0.35
    # [m/s] of a robot that drives sideways; ConstraintCritic adds it for every robot
    vy_max: Annotated[float, within(0.0, 100.0)] = 0.5
    wz_max: Annotated[float, within(1e-3, 100.0)] = 1.9  # [rad/s]
    ax_max: Acceleration = 3.0  # [m/s2] speeding up
    ax_min: Braking = -3.0  # [m/s2] slowing down; a positive value is taken as a negative one
    ay_max: Sideways = 3.0  # [m/s2] to the left
    ay_min: Sideways = -3.0  # [m/s2] to the right; a positive value is taken as a negative one
    az_max: Acceleration = 3.5  # [rad/s2]
    # [-] small: the cheapest trajectory alone counts; large: all count alike
    temperature: Annotated[float, within(1e-6, 1e6)] = 0.3
    # [-] how much a sample's distance from the last sequence costs
    gamma: Annotated[float, within(0.0, 1e3)] = 0.015
    # more attempts with a forgotten sequence and new noise where all trajectories collide
    retry_attempt_limit: Annotated[int, within(0, 100)] = 1
    # new noise for every update; False: the same from reset to reset
    regenerate_noises: bool = False
    # [s] without a cycle, after which the sequence is forgotten, as in Humble; absent: never
    reset_period: Annotated[float | None, within(0.0, 1e6)] = None

    # [m] of the path ahead that the critics see
    prune_distance: Annotated[float, within(0.01, 1e4)] = 1.5
    # [m] along the path in which the robot is looked for; absent: half the local costmap's longer
    # side
    max_robot_pose_search_dist: Annotated[float | None, within(-1e6, 1e6)] = None
    enforce_path_inversion: bool = False  # show the critics the path up to its next cusp only
    # [m] to the cusp, within which it is passed
    inversion_xy_tolerance: Annotated[float, within(0.0, 1e4)] = 0.2
    inversion_yaw_tolerance: Annotated[float, within(0.0, 1e4)] = 0.4  # [rad]

    AckermannConstraints: AckermannParams = field(default_factory=AckermannParams)
    ConstraintCritic: ConstraintParams = field(default_factory=ConstraintParams)
    CostCritic: CostParams = field(default_factory=CostParams)
    GoalAngleCritic: GoalAngleParams = field(default_factory=GoalAngleParams)
    GoalCritic: GoalParams = field(default_factory=GoalParams)
    ObstaclesCritic: ObstaclesParams = field(default_factory=ObstaclesParams)
    PathAlignCritic: PathAlignParams = field(default_factory=PathAlignParams)
    PathAngleCritic: PathAngleParams = field(default_factory=PathAngleParams)
    PathFollowCritic: PathFollowParams = field(default_factory=PathFollowParams)
    PreferForwardCritic: MppiPreferForwardParams = field(default_factory=MppiPreferForwardParams)
    TwirlingCritic: MppiTwirlingParams = field(default_factory=MppiTwirlingParams)
    VelocityDeadbandCritic: VelocityDeadbandParams = field(default_factory=VelocityDeadbandParams)
    # this program's own
    ExpectedContactCritic: MppiContactParams = field(default_factory=MppiContactParams)
    # read from the local costmap's section
    local_costs: LocalCosts = field(default_factory=LocalCosts)

    def _check_together(self) -> None:
        varies = self.motion_model != OMNI or self.vy_std >= LEAST_STD
        self._require("vy_std", varies, f"{LEAST_STD:g} or more with {OMNI}")
        poses = self.batch_size * self.time_steps * self.iteration_count
        if poses > MOST_POSES:
            raise ParameterError(
                f"batch_size {self.batch_size:,} x time_steps {self.time_steps:,} x "
                f"iteration_count {self.iteration_count:,} are {poses:,} poses; "
                f"at most {MOST_POSES:,} are allowed"
            )
        if not self.critics:
            raise ParameterError(f"critics is empty; name at least one of {', '.join(CRITICS)}")
        for i, name in enumerate(self.critics):
            if name not in CRITICS:
                raise ParameterError(
                    f"critics: '{name}' is not available here{did_you_mean(name, CRITICS)}"
                )
            if name in self.critics[:i]:
                raise ParameterError(
                    f"critics: '{name}' stands there twice; name it once and raise its cost_weight"
                )


CRITICS = tuple(each.name for each in fields(MppiParams) if each.name.endswith("Critic"))
