"""ISO/TS 15066 as a check: at which closing speed a contact with a person goes beyond its limit.

Force that a body region bears in an impact: F = 2 x 130 N for the lower leg, which a sidewalk robot
meets first (annex A, table A.2: 130 N when clamped, twice as much in transient contact). Its
stiffness is 60 N/mm, its effective mass 75 kg (table A.3), and the limit is v = F / sqrt(mu k),
with the reduced mass mu of the person and the whole robot (annex A.4). The limits say where pain
may begin, in a workplace with adults; they price nothing.
"""

import math
from collections.abc import Sequence

from harness.economics.accountings import EVENT, contacts_of
from harness.economics.prices import Prices
from harness.metrics.columns import Row
from harness.statistics.interval import Interval, wilson_interval

FORCE = 2.0 * 130.0  # [N]
STIFFNESS = 60_000.0  # [N/m]
BODY_MASS = 75.0  # [kg]


def limit_speed(prices: Prices) -> float:
    """Closing speed [m/s] up to which a contact with a lower leg is within the limit."""
    robot = prices.robot_mass.value
    return FORCE / math.sqrt(STIFFNESS * robot * BODY_MASS / (robot + BODY_MASS))


def beyond_limit(rows: Sequence[Row], events: Sequence[Row], prices: Prices) -> Interval:
    """Share of contacts with people that close faster than the limit, with Wilson's interval."""
    contacts = contacts_of(rows, events, EVENT)
    closing = (contacts.robot_speeds + contacts.partner_speeds)[contacts.with_people]
    return wilson_interval(int((closing > limit_speed(prices)).sum()), closing.size)
