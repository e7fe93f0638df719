"""Parameters of the behavior server and its plugins: names and defaults are those of Nav2 Jazzy."""

from dataclasses import dataclass

from navstack.errors import ParameterError


@dataclass(frozen=True, slots=True)
class BehaviorServerParams:
    """``behavior_server``; as in Nav2, what spinning and looking ahead need stands beside the plugins, not in them."""

    cycle_frequency: float = 10.0  # [Hz]
    behavior_plugins: tuple[str, ...] = ("spin", "backup", "drive_on_heading", "wait")
    simulate_ahead_time: float = 2.0  # [s] for which the motion must be free of collisions
    max_rotational_vel: float = 1.0  # [rad/s]
    min_rotational_vel: float = 0.4  # [rad/s]; as in Nav2 negative ones slow nothing down
    rotational_acc_lim: float = 3.2  # [rad/s2]

    def __post_init__(self) -> None:
        if not self.cycle_frequency > 0.0:
            raise ParameterError(f"cycle_frequency {self.cycle_frequency} Hz is not positive")
        for name in ("simulate_ahead_time", "max_rotational_vel", "rotational_acc_lim"):
            if getattr(self, name) < 0.0:
                raise ParameterError(f"{name} {getattr(self, name)} is negative; give 0 or more")


@dataclass(frozen=True, slots=True)
class DriveParams:
    """``nav2_behaviors::DriveOnHeading`` and ``nav2_behaviors::BackUp`` (``drive_on_heading.hpp``)."""

    acceleration_limit: float = 0.0  # [m/s2]; 0 here or below: the commanded speed at once
    deceleration_limit: float = 0.0  # [m/s2] negative
    minimum_speed: float = 0.0  # [m/s]

    def __post_init__(self) -> None:
        if self.acceleration_limit < 0.0 or self.deceleration_limit > 0.0:
            raise ParameterError(
                f"acceleration_limit {self.acceleration_limit} must be 0 or more and "
                f"deceleration_limit {self.deceleration_limit} 0 or less"
            )
