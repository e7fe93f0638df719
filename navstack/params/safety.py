"""Parameters of what stands between the controller and the wheels: names and defaults are those of Nav2 Jazzy."""

from dataclasses import dataclass

from navstack.errors import ParameterError

Triple = tuple[float, float, float]  # along x, along y, about z


@dataclass(frozen=True, slots=True)
class VelocitySmootherParams:
    """``velocity_smoother`` (``velocity_smoother.cpp``)."""

    smoothing_frequency: float = 20.0  # [Hz]
    scale_velocities: bool = False  # scale all axes alike, so that the direction of the change is kept
    feedback: str = "OPEN_LOOP"  # start from the last command; CLOSED_LOOP: from the measured velocity
    max_velocity: Triple = (0.5, 0.0, 2.5)  # [m/s, m/s, rad/s]
    min_velocity: Triple = (-0.5, 0.0, -2.5)  # [m/s, m/s, rad/s]
    max_accel: Triple = (2.5, 0.0, 3.2)  # [m/s2, m/s2, rad/s2] while the speed grows
    max_decel: Triple = (-2.5, 0.0, -3.2)  # [m/s2, m/s2, rad/s2] while it falls
    deadband_velocity: Triple = (0.0, 0.0, 0.0)  # [m/s, m/s, rad/s] slower outputs are sent as 0
    velocity_timeout: float = 1.0  # [s] without a command, after which the robot is brought to a stop

    def __post_init__(self) -> None:
        if not self.smoothing_frequency > 0.0:
            raise ParameterError(f"smoothing_frequency {self.smoothing_frequency} Hz is not positive")
        if self.feedback not in ("OPEN_LOOP", "CLOSED_LOOP"):
            raise ParameterError(f"feedback '{self.feedback}' is neither OPEN_LOOP nor CLOSED_LOOP")
        for name in ("max_velocity", "max_accel"):
            self._require(name, all(value >= 0.0 for value in getattr(self, name)), "0 or more")
        for name in ("min_velocity", "max_decel"):
            self._require(name, all(value <= 0.0 for value in getattr(self, name)), "0 or less")

    def _require(self, name: str, is_right: bool, allowed: str) -> None:
        if not is_right:
            raise ParameterError(
                f"velocity smoother: {name} {list(getattr(self, name))} must be {allowed} on every axis"
            )
