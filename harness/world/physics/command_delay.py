"""The way of commands from the robot's computer to its drive."""

import math
from collections import deque


class CommandDelay:
    """Delivers each command a fixed number of physics steps after its observation."""

    def __init__(self, latency: float, dt: float) -> None:
        """Make an empty one.

        Args:
            latency: [s] from the observation to the command's arrival; rounded up to whole physics
                steps.
            dt: [s] physics step.
        """
        self._delay = math.ceil(latency / dt - 1e-6)  # [steps]
        self.reset()

    def reset(self) -> None:
        """Start an episode: the drive holds still until the first command arrives."""
        self._arrived = 0.0, 0.0
        # at which step what arrives
        self._under_way: deque[tuple[int, tuple[float, float]]] = deque()

    def send(self, speed: float, yaw_rate: float, step: int) -> None:
        """Send a command [m/s], [rad/s] that was decided on what was observed at a step."""
        self._under_way.append((step + self._delay, (speed, yaw_rate)))

    def receive(self, step: int) -> tuple[float, float]:
        """Speed [m/s] and yaw rate [rad/s] that have arrived last when a physics step begins."""
        while self._under_way and self._under_way[0][0] <= step:
            self._arrived = self._under_way.popleft()[1]
        return self._arrived
