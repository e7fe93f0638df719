"""Parameters of the behavior server and its plugins: names and defaults are those of Nav2 Jazzy."""

from dataclasses import dataclass

from navstack.params.checks import NotNegative, Positive, check, require


@dataclass(frozen=True, slots=True)
class BehaviorServerParams:
    """``behavior_server``.

    As in Nav2, what spinning and looking ahead need stands beside the plugins, not in them.
    """

    cycle_frequency: Positive = 10.0  # [Hz]
    behavior_plugins: tuple[str, ...] = ("spin", "backup", "drive_on_heading", "wait")
    simulate_ahead_time: NotNegative = 2.0  # [s] for which the motion must be free of collisions
    max_rotational_vel: NotNegative = 1.0  # [rad/s]
    min_rotational_vel: float = 0.4  # [rad/s]; as in Nav2 negative ones slow nothing down
    rotational_acc_lim: NotNegative = 3.2  # [rad/s2]

    def __post_init__(self) -> None:
        check(self)


@dataclass(frozen=True, slots=True)
class DriveParams:
    """``nav2_behaviors::DriveOnHeading`` and ``nav2_behaviors::BackUp`` (``drive_on_heading.hpp``)."""

    acceleration_limit: NotNegative = 0.0  # [m/s2]; 0 here or below: the commanded speed at once
    deceleration_limit: float = 0.0  # [m/s2] negative
    minimum_speed: float = 0.0  # [m/s]

    def __post_init__(self) -> None:
        check(self)
        require(self, "deceleration_limit", self.deceleration_limit <= 0.0, "0 or less")
