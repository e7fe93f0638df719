"""What happens in a scenario: people who walk by a script."""

import math
from collections.abc import Sequence

import numpy as np

from harness.scenarios.scenario import PersonScript
from harness.world.people.pedestrians import ABSENT, PedestrianModel
from harness.world.physics.body_state import BodyState
from navstack.types import FloatArray, Pose2D


class ScriptedPedestrians(PedestrianModel):
    """Everybody waits at the first waypoint, sets out when it is time, and walks to the last one.

    It is time at a given moment or when the robot is near. They walk straight from waypoint to
    waypoint at constant speed and see nothing.
    """

    def __init__(self, scripts: Sequence[PersonScript]) -> None:
        self._scripts = scripts
        self._waypoints = [np.array(script.waypoints) for script in scripts]
        lengths = [np.hypot(*np.diff(points, axis=0).T) for points in self._waypoints]
        # [m] along the way
        self._distances = [np.concatenate(([0.0], np.cumsum(steps))) for steps in lengths]
        self._restart(Pose2D())

    def reset(self, rng: np.random.Generator, robot: Pose2D) -> None:
        """See :class:`PedestrianModel`; nothing is left to chance."""
        self._restart(robot)

    def _restart(self, robot: Pose2D) -> None:
        self._time = 0.0  # [s]
        self._robot = (robot.x, robot.y)
        self._walked = np.zeros(len(self._scripts))  # [m]
        self._under_way = np.zeros(len(self._scripts), dtype=bool)
        self._show()

    def see_robot(self, robot: BodyState) -> None:
        """See :class:`PedestrianModel`; it may be near enough for somebody to set out."""
        self._robot = (robot.x, robot.y)

    def step(self, dt: float) -> None:
        """See :class:`PedestrianModel`."""
        self._time += dt
        for i, script in enumerate(self._scripts):
            self._under_way[i] = self._under_way[i] or self._sets_out(script)
            if self._under_way[i]:
                self._walked[i] += script.speed * dt
        self._show()

    @property
    def states(self) -> FloatArray:
        """See :class:`PedestrianModel`."""
        return self._states

    def _sets_out(self, script: PersonScript) -> bool:
        (x, y), near = script.waypoints[0], script.starts_near
        is_near = near is None or math.hypot(self._robot[0] - x, self._robot[1] - y) <= near
        return is_near and self._time >= script.starts_at

    def _show(self) -> None:
        self._states = np.array([self._state(i) for i in range(len(self._scripts))]).reshape(-1, 4)

    def _state(self, i: int) -> tuple[float, float, float, float]:
        """Position [m] and velocity [m/s] of person ``i`` now."""
        script, points, distances = self._scripts[i], self._waypoints[i], self._distances[i]
        walked = self._walked[i]
        if walked >= distances[-1]:
            if script.leaves and self._under_way[i]:
                return ABSENT
            x, y = points[-1].tolist()
            return x, y, 0.0, 0.0
        leg = int(np.searchsorted(distances, walked, side="right")) - 1
        direction = (points[leg + 1] - points[leg]) / (distances[leg + 1] - distances[leg])
        x, y = (points[leg] + direction * (walked - distances[leg])).tolist()
        if not self._under_way[i]:
            return x, y, 0.0, 0.0
        vx, vy = (direction * script.speed).tolist()
        return x, y, vx, vy
