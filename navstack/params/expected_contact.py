"""Parameters of the critics of DWB and MPPI that price contacts with people: our own."""

from dataclasses import dataclass
from typing import Annotated

from navstack.ranges import (
    Allowed,
    NotNegative,
    NotNegativeInt,
    Parameters,
    Positive,
    PositiveInt,
)

SpeedPrices = Annotated[
    tuple[float, ...],  # [USD] at a closing speed of 0, 1, .. m/s
    Allowed("a list of two prices or more", lambda prices: len(prices) >= 2),
    Allowed("0 or more each", lambda prices: min(prices) >= 0.0),
]


@dataclass(frozen=True, slots=True)
class ContactPrices(Parameters, whose="expected contacts", finite=True):
    """What a contact costs, as in ``ExpectedCostParams``, and how sure predictions are.

    Unlike there, people's places are one normal distribution: ``contact_risk.spread_at``.
    """

    # [USD] at a closing speed of 0, 1, .. m/s
    contact_usd: SpeedPrices = (31.3, 31.3, 37.0, 44.1, 52.9, 64.1)
    counted_speed: NotNegative = 1.0  # [m/s] closing speed from which on a contact counts
    speed_std: Positive = 0.2  # [m/s] of the predicted closing speed
    touch_usd: NotNegative = 15.0  # [USD] what follows a touch of any kind
    position_std: Positive = 0.1  # [m] of a person's predicted place, beside the track's covariance
    drift_std: NotNegative = 0.1  # [m/s] by which that grows
    max_tracks: NotNegativeInt = 5  # people that are looked at, the nearest
    range: NotNegative = 8.0  # [m] up to which they are looked at


@dataclass(frozen=True, slots=True)
class DwbContactParams(ContactPrices):
    """``ExpectedContact`` of DWB."""

    scale: NotNegative = 1.0  # [1/USD] weight of the expected cost


@dataclass(frozen=True, slots=True)
class MppiContactParams(ContactPrices):
    """``ExpectedContactCritic`` of MPPI."""

    enabled: bool = True
    cost_power: NotNegativeInt = 1
    cost_weight: NotNegative = 1.0  # [1/USD] of the expected cost
    trajectory_point_step: PositiveInt = 4  # every how many poses are looked at
