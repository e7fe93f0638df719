"""Parameters of the jerk-limited model predictive controller (this project's own plugin)."""

from dataclasses import dataclass
from typing import Annotated

from navstack.ranges import Allowed, NotNegative, Parameters, Positive, within

SOLVER = "casadi"  # the only one: Gauss-Newton SQP with HPIPM
Solver = Annotated[
    str, Allowed("casadi, the only solver; set it so, or leave it out", SOLVER.__eq__)
]


@dataclass(frozen=True, slots=True)
class MpcParams(Parameters, whose="jerk-limited MPC"):
    """``navstack::JerkLimitedMPC``; docs/mpc.md has the formulas.

    The bucket's popcorn stays at rest below 4.5 m/s2 as the simulated world has it; the limits keep
    braking and turning together well below that. Automatic braking of road vehicles at less than 5
    m/s is bounded by 5 m/s2 and 5 m/s3 (ISO 15622:2018, operational limits of adaptive cruise
    control); passengers find acceleration, not jerk, uncomfortable (de Winkel et al., Applied
    Ergonomics 2023): the jerk limit is the standard's, acceleration lower.
    """

    max_speed: Positive = 2.0  # [m/s] a runner's pace, as for regulated pure pursuit
    max_yaw_rate: Positive = 1.2  # [rad/s] as for DWB
    max_acceleration: Positive = 1.5  # [m/s2] speeding up
    max_deceleration: Positive = 2.5  # [m/s2] slowing down: Nav2's velocity smoother passes no more
    max_yaw_acceleration: Positive = 2.5  # [rad/s2] as for DWB's turns
    max_jerk: Positive = 5.0  # [m/s3]
    max_yaw_jerk: Positive = 10.0  # [rad/s3] full yaw acceleration within 0.25 s
    max_lateral_acceleration: Positive = 1.3  # [m/s2] speed times yaw rate

    solver: Solver = SOLVER
    # casadi: compile generated C where there is a compiler; False: CasADi's own machine
    generated_code: bool = True
    # steps; the first lasts one control period, each of the others ``step``
    horizon: Annotated[int, within(2, 100)] = 30
    step: Positive = 0.1  # [s]
    max_tracks: Annotated[int, within(1, 50)] = 8  # people that are looked at, the nearest
    footprint_circles: Annotated[int, within(1, 10)] = 3  # that cover the footprint

    obstacle_margin: NotNegative = 0.25  # [m] to static obstacles that costs nothing
    person_margin: NotNegative = 0.3  # [m] to people that costs nothing
    # [-] standard deviations of the prediction by which people grow
    uncertainty_gain: NotNegative = 1.0
    max_uncertainty: NotNegative = 0.3  # [m] by which they grow at most
    # [1/m] that of the local inflation layer: turns costs into distances
    inflation_cost_scaling_factor: Positive = 3.0
    # [m] by which people are predicted farther where they cross to, else farther left
    passing_bias: NotNegative = 0.1
    # [m] by which the wanted progress may pull ahead of the predicted one
    max_lag: NotNegative = 2.0
    # [rad] off the path's direction from which on it turns on the spot
    turn_threshold: NotNegative = 0.8
    # [m/s] or [rad/s] between command and odometry from which on odometry counts
    velocity_mismatch: NotNegative = 0.6

    contour_weight: NotNegative = 1.0  # [1/m2] distance beside the path
    lag_weight: NotNegative = 4.0  # [1/m2] behind the wanted progress
    heading_weight: NotNegative = 1.0  # [1/rad2] off the path's direction
    speed_weight: NotNegative = 0.5  # [s2/m2] off the wanted speed
    yaw_acceleration_weight: NotNegative = 0.05  # [s4/rad2]
    # [s4/m2] above the lateral limit; the output keeps it strictly
    lateral_weight: NotNegative = 100.0
    obstacle_weight: NotNegative = 200.0  # [1/m2] into the margin of static obstacles
    person_weight: NotNegative = 100.0  # [1/m2] into the margin of people
    jerk_weight: NotNegative = 0.01  # [s6/m2] off the jerk of the wanted progress
    yaw_jerk_weight: NotNegative = 0.002  # [s6/rad2]
