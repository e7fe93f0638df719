"""Parameters of the critics that price contacts with people (this project's own, for DWB and MPPI)."""

import math
from dataclasses import dataclass, fields

from navstack.errors import ParameterError


@dataclass(frozen=True, slots=True)
class ContactPrices:
    """What a contact costs and how sure predictions are; as in ``ExpectedCostParams``."""

    contact_usd: tuple[float, ...] = (31.3, 31.3, 37.0, 44.1, 52.9, 64.1)  # [USD] at a closing speed of 0, 1, .. m/s
    counted_speed: float = 1.0  # [m/s] closing speed from which on a contact counts
    speed_std: float = 0.2  # [m/s] of the predicted closing speed
    touch_usd: float = 15.0  # [USD] what follows a touch of any kind
    position_std: float = 0.1  # [m] of a person's predicted place, beside the track's covariance
    drift_std: float = 0.1  # [m/s] by which that grows
    max_tracks: int = 5  # people that are looked at, the nearest
    range: float = 8.0  # [m] up to which they are looked at

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, float | int) and not (math.isfinite(value) and value >= 0.0):
                raise ParameterError(f"expected contacts: {field.name} {value} must be a number, 0 or more")
        if self.speed_std == 0.0 or self.position_std == 0.0:
            raise ParameterError("expected contacts: speed_std and position_std must be more than 0")
        if len(self.contact_usd) < 2 or min(self.contact_usd) < 0.0:
            raise ParameterError(f"expected contacts: contact_usd {self.contact_usd} must be two prices or more")


@dataclass(frozen=True, slots=True)
class DwbContactParams(ContactPrices):
    """``ExpectedContact`` of DWB."""

    scale: float = 1.0  # [1/USD] weight of the expected cost


@dataclass(frozen=True, slots=True)
class MppiContactParams(ContactPrices):
    """``ExpectedContactCritic`` of MPPI."""

    enabled: bool = True
    cost_power: int = 1
    cost_weight: float = 1.0  # [1/USD] of the expected cost
    trajectory_point_step: int = 4  # every how many poses are looked at

    def __post_init__(self) -> None:
        ContactPrices.__post_init__(self)
        if self.trajectory_point_step < 1:
            raise ParameterError(f"trajectory_point_step {self.trajectory_point_step} must be 1 or more")
