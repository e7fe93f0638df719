"""Parameters of the critics that price contacts with people (this project's own, for DWB and MPPI)."""

from dataclasses import dataclass

from navstack.params.checks import (
    NotNegative,
    NotNegativeInt,
    Positive,
    PositiveInt,
    check,
    require,
)


@dataclass(frozen=True, slots=True)
class ContactPrices:
    """What a contact costs and how sure predictions are; as in ``ExpectedCostParams``."""

    # [USD] at a closing speed of 0, 1, .. m/s
    contact_usd: tuple[float, ...] = (31.3, 31.3, 37.0, 44.1, 52.9, 64.1)
    counted_speed: NotNegative = 1.0  # [m/s] closing speed from which on a contact counts
    speed_std: Positive = 0.2  # [m/s] of the predicted closing speed
    touch_usd: NotNegative = 15.0  # [USD] what follows a touch of any kind
    position_std: Positive = 0.1  # [m] of a person's predicted place, beside the track's covariance
    drift_std: NotNegative = 0.1  # [m/s] by which that grows
    max_tracks: NotNegativeInt = 5  # people that are looked at, the nearest
    range: NotNegative = 8.0  # [m] up to which they are looked at

    def __post_init__(self) -> None:
        check(self, "expected contacts", finite=True)
        priced = len(self.contact_usd) >= 2 and min(self.contact_usd) >= 0.0
        require(self, "contact_usd", priced, "two prices or more", "expected contacts")


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
