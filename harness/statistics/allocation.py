"""How many deliveries each of two arms needs for a difference of their means."""

import math
from dataclasses import dataclass

from harness.statistics.paired import z_of_power

MISSED = 0.05  # probability with which the true rate of hits is above the bound for none seen


@dataclass(frozen=True, slots=True)
class Sample:
    """What is known of an arm."""

    sd: float  # [USD] of a delivery's margin
    cost: float  # [s] of a worker for a delivery
    n: int  # deliveries that this is known from
    hits: int  # of these in which somebody was hit

    def floored(self, loss: float) -> float:
        """Standard deviation [USD], where no hit was seen with those that may be missing.

        Their rate is at most 1 - 0.05^(1 / n) (Clopper and Pearson 1934; about 3 / n).

        Args:
            loss: [USD] that a hit costs.
        """
        if self.hits:
            return self.sd
        rate = 1.0 - MISSED ** (1.0 / self.n)
        return math.sqrt(self.sd**2 + loss**2 * rate * (1.0 - rate))


@dataclass(frozen=True, slots=True)
class Design:
    """Deliveries that find a difference with a power of 0.8 at 5 %."""

    first: int
    second: int
    seconds: float  # of a worker
    is_paired: bool  # both drive the same missions


def cheaper_design(
    first: Sample, second: Sample, correlation: float, difference: float, loss: float
) -> Design:
    """The cheaper of pairs and of arms of unequal size.

    Apart, each arm's number is in proportion to sd / sqrt(cost), which takes the least time for a
    variance of the difference (Cochran 1977, Sampling Techniques, section 5.5):
    n_i = (sd_i / sqrt(cost_i)) (sd_1 sqrt(cost_1) + sd_2 sqrt(cost_2)) / variance.

    Args:
        first: arm.
        second: arm.
        correlation: of both margins over missions.
        difference: [USD] to be found.
        loss: [USD] of a hit, for an arm without any.

    Raises:
        ValueError: a difference or a cost that is not above 0.
    """
    if min(difference, first.cost, second.cost) <= 0.0:
        raise ValueError("a difference and costs must be above 0")
    variance = (difference / z_of_power()) ** 2
    one, two = first.floored(loss), second.floored(loss)
    root_one, root_two = math.sqrt(first.cost), math.sqrt(second.cost)
    shared = (one * root_one + two * root_two) / variance
    apart = max(1, math.ceil(shared * one / root_one)), max(1, math.ceil(shared * two / root_two))
    pairs = (one**2 + two**2 - 2.0 * correlation * one * two) / variance
    paired = max(1, math.ceil(pairs))
    designs = [
        Design(paired, paired, paired * (first.cost + second.cost), True),
        Design(*apart, apart[0] * first.cost + apart[1] * second.cost, False),
    ]
    return min(designs, key=lambda design: design.seconds)
