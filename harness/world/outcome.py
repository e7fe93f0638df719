"""How a delivery ends: the rules of the published evaluation."""

import math
from dataclasses import dataclass, replace
from enum import Enum
from typing import Annotated

from harness.world.truth import CargoState, Truth
from navstack.ranges import Parameters, Share, up_to, within
from navstack.types import Pose2D


class Outcome(Enum):
    """The four published outcomes, and an arrival whose cargo nobody modelled."""

    SLA = "sla"
    SPOILED = "spoiled"
    TIMEOUT = "timeout"
    PHYSICAL_ASSISTANCE = "physical_assistance"
    ARRIVED = "arrived"  # at the goal, cargo not modelled: neither SLA nor spoiled is claimed


_NOTHING = 1e-9  # [s] or [N s], where nothing is left
# the published ones, in the order of tables
OUTCOMES = tuple(each.value for each in Outcome if each is not Outcome.ARRIVED)
ARRIVALS = (Outcome.SLA, Outcome.SPOILED, Outcome.ARRIVED)


@dataclass(frozen=True, slots=True)
class Verdict:
    """An outcome and what brought it about."""

    outcome: Outcome
    reason: str


@dataclass(frozen=True, slots=True)
class Rules(Parameters, whose="rules"):
    """When a delivery is over."""

    arrival_radius: Annotated[float, up_to(1000)]  # [m]
    timeout: Annotated[float, up_to(1e5)]  # [s] of wall time
    max_tilt: Annotated[float, up_to(math.pi)]  # [rad]
    impulse_health: Annotated[float, up_to(1e6)]  # [N s]
    spoiled_fraction: Share  # share of the pieces
    # [-] simulated seconds per second of wall time, by which the timeout counts
    real_time_factor: Annotated[float, within(0.1, 1)] = 1.0
    # On a district the timeout grows with the way: it holds for the paper's mean way, and each
    # further metre takes what Starship's did on average (1.6 million miles in 600,000 h).
    timeout_way: Annotated[float, up_to(1e5)] = 102.0  # [m]
    further_speed: Annotated[float, up_to(100)] = 1.19  # [m/s]
    # Signals there: a cycle of at most 90 s (NACTO, Urban Street Design Guide); people may begin
    # for 7 s (MUTCD, pedestrian intervals) and, as the Highway Capacity Manual counts, 4 s more.
    signal_cycle: Annotated[float, up_to(1000)] = 90.0  # [s]
    signal_green: Annotated[float, up_to(1000)] = 11.0  # [s]; the cycle or more: no wait
    # There, too, whoever gave a goal that the robot gives up sends it again; assumed.
    resend_after: Annotated[float, up_to(1e5)] = 10.0  # [s]
    way_back: bool = False  # whether the way back to the pick-up is driven there, too

    @property
    def time_limit(self) -> float:
        """The timeout in [s] of simulated time."""
        return self.timeout * self.real_time_factor

    def on_way(self, way: float) -> "Rules":
        """The rules for a way [m] on a district."""
        further = max(way - self.timeout_way, 0.0) / self.further_speed
        return replace(self, timeout=self.timeout + further / self.real_time_factor)

    def after(self, seconds: float, impulse: float) -> "Rules":
        """What is left of them after a time [s] and counted contacts [N s]."""
        return replace(
            self,
            timeout=max(self.timeout - seconds / self.real_time_factor, _NOTHING),
            impulse_health=max(self.impulse_health - impulse, _NOTHING),
        )

    def judge(self, truth: Truth, goal: Pose2D) -> Verdict | None:
        """The verdict on the current state; None while the delivery goes on.

        Arrival goes before a fall and used-up health in the same moment, as in the published code.
        """
        if math.hypot(truth.pose.x - goal.x, truth.pose.y - goal.y) <= self.arrival_radius:
            return self.arrival(truth.cargo)
        if truth.tilt > self.max_tilt:
            return Verdict(Outcome.PHYSICAL_ASSISTANCE, "orientation")
        counted = truth.counted_contacts
        if counted and sum(contact.impulse for contact in counted) >= self.impulse_health:
            return Verdict(Outcome.PHYSICAL_ASSISTANCE, "impulse")
        if truth.stamp >= self.time_limit:
            return Verdict(Outcome.TIMEOUT, "timeout")
        return None

    def arrival(self, cargo: CargoState | None) -> Verdict:
        """The verdict on cargo at the goal; None: it is not modelled."""
        if cargo is None:
            return Verdict(Outcome.ARRIVED, "cargo not modelled")
        if cargo.lost_fraction > self.spoiled_fraction:
            return Verdict(Outcome.SPOILED, "cargo lost")
        return Verdict(Outcome.SLA, "arrived")
