"""Parameters of the controller that minimises expected dollars (this project's own plugin)."""

from dataclasses import dataclass
from typing import Annotated

from navstack.params.expected_contact import SpeedPrices
from navstack.ranges import NotNegative, Parameters, Positive, Quantity, within


@dataclass(frozen=True, slots=True)
class DeliveryPrices:
    """What the robot's owner pays; fields as in :class:`ExpectedCostParams`."""

    contact_usd: tuple[float, ...]  # [USD] at a closing speed of 0, 1, .. m/s
    counted_speed: float  # [m/s]
    late_usd: float  # [USD]
    time_limit: float  # [s]


@dataclass(frozen=True, slots=True)
class ExpectedCostParams(Parameters, whose="expected-cost controller"):
    """``navstack::ExpectedCostController``; docs/expected_cost.md has the formulas.

    Prices are those of the robot's owner. Defaults are CostNav's (arXiv 2511.20216, appendix); who
    builds the controller for a simulated study hands it the prices of that study instead.
    """

    max_speed: Positive = 2.0  # [m/s] a runner's pace
    max_reverse_speed: NotNegative = 2.0  # [m/s] 0: it never reverses
    max_acceleration: Positive = 1.8  # [m/s2] speeding up
    max_deceleration: Positive = 2.5  # [m/s2] slowing down: Nav2's velocity smoother passes no more
    max_yaw_rate: Positive = 1.8  # [rad/s]
    max_yaw_acceleration: Positive = 3.2  # [rad/s2] what Nav2's velocity smoother passes
    max_lateral_acceleration: Positive = 1.5  # [m/s2] speed times yaw rate

    steps: Annotated[int, within(2, 200)] = 36  # of a motion
    step: Positive = 0.12  # [s]
    cell: Annotated[float, within(0.02, 10.0)] = 0.2  # [m] of the cost-to-go field of all the map
    turn_gain: Positive = 2.5  # [1/s] yaw rate wanted per angle off the field's descent
    max_tracks: Annotated[int, within(1, 50)] = 8  # people that are looked at, the nearest
    range: NotNegative = 12.0  # [m] up to which they are looked at
    # [-] plan over field's way from which on the field is computed again
    replan_length_ratio: Positive = 1.3
    # [-] waiting time before a detour, per second that the detour takes longer; above 0 the field
    # is also computed again as soon as the plan is shorter by the same ratio
    detour_patience: NotNegative = 0.0
    # [m2] by which a metre counts as longer per person and square metre, on average over those seen
    # and those expected; 0: people do not lengthen ways
    flow_weight: NotNegative = 0.0
    flow_memory: Positive = 60.0  # [s] over which where people walked is forgotten
    # [m] beside the planner's path within which the field leads to the goal; 0: anywhere
    corridor: NotNegative = 0.0
    clearance_period: Positive = 0.2  # [s] between two looks at the local costmap
    # [-] margin around mapped obstacles, in standard deviations of the position; local obstacles
    # within it count as mapped
    map_margin_stds: NotNegative = 0.0
    # also gives way while it stands, after arrival, and where Nav2 would recover
    evades_at_rest: bool = True

    # [USD] of a counted contact at a closing speed of 0, 1, .. m/s: injury curves of Wang 2022
    # times NHTSA's costs; below counted_speed the price at counted_speed
    contact_usd: SpeedPrices = (31.3, 31.3, 37.0, 44.1, 52.9, 64.1)
    # [m/s] closing speed from which on a contact counts: 50 N s over 50 kg
    counted_speed: NotNegative = 1.0
    speed_std: Positive = 0.2  # [m/s] of the predicted closing speed
    # [USD] what follows a touch of any kind: spilt food, a push into something
    touch_usd: NotNegative = 15.0
    squeeze_usd: NotNegative = 40.0  # [USD] what a touch costs more between a person and a wall
    squeeze_width: Positive = 0.6  # [m] to the wall at which that begins
    wall_usd: NotNegative = 60.0  # [USD] of hitting property or leaving the walkable ground
    # [USD/(m s)] of overlapping a person or an obstacle: its slope shows the way out
    inside_usd: NotNegative = 30.0
    # [USD s3/m2] of acceleration, forward and to the side: what it spills
    shake_usd: NotNegative = 0.03
    # [USD/s] of delay: as long as it is under way, people run into the robot
    second_usd: NotNegative = 0.25
    impatience_time: Positive = 20.0  # [s] without progress that double the price of a second
    late_usd: NotNegative = 6.98  # [USD] of being late: the fee not earned, and paid back
    time_limit: Positive = 241.0  # [s] after which the delivery is late
    lateness_std: Positive = 20.0  # [s] of the time that the rest of the way takes
    # [s] over which the weight of later events falls to 1/e: the robot decides again until then
    caution_time: Positive = 6.0
    # [USD] of risk from which on all motions are compared, not the few of an empty street
    alarm_usd: NotNegative = 0.03

    # [USD] by which another motion must be cheaper than the current one
    switch_usd: NotNegative = 0.03
    # [-] and by this share of what people and walls cost on the current one
    switch_share: NotNegative = 0.3

    # Of people's predicted places, fitted to where tracked people were later
    # (docs/expected_cost.md)
    position_std: Positive = 0.05  # [m] of who walks on straight, beside the track's covariance
    drift_std: NotNegative = 0.06  # [m/s] by which that grows
    deviating_weight: Annotated[float, within(0.0, 1.0)] = 0.35  # [-] of who deviates; 0: nobody
    deviating_std: NotNegative = 0.4  # [m/s] by which their place gets less sure than that
    standing_std: NotNegative = 0.3  # [m/s] the same of who stands: they may set out
    standing_speed: Quantity = 0.3  # [m/s] up to which a person stands
    # [m/s] the same from where somebody reaches the edge of the walkable ground and turns
    turning_std: NotNegative = 0.6
    # [-] of each of the two turns that are expected at a convex corner; 0: none
    corner_weight: Annotated[float, within(0.0, 0.5)] = 0.3
    # [-] how likely most people make way, before anybody was met; 0: nobody ever does
    yielding_prior: Annotated[float, within(0.0, 0.9)] = 0.0
    # [-] reduction of a person's cost if the person certainly makes way
    yielding_share: Annotated[float, within(0.0, 1.0)] = 0.97
    yielding_time: Positive = 1.0  # [s] until who makes way is out of the way
    unsure_std: Positive = 0.3  # [m] of the believed place at which the robot drives half as fast
    wall_std: Positive = 0.03  # [m] of the distance to what does not move
