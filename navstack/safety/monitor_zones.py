"""The zones of the collision monitor: polygons, circles, polygons that depend on the velocity."""

import numpy as np

from navstack.params.collision_monitor import PolygonParams, parse_polygon
from navstack.safety.monitor_kernels import NO_COLLISION, are_inside, collision_time
from navstack.types import FloatArray, Twist2D

_NO_VERTICES: FloatArray = np.empty((0, 2))


class MonitorZone:
    """An area about the robot, in the base frame, that obstacles should not enter."""

    def __init__(
        self, name: str, params: PolygonParams, vertices: FloatArray, radius: float = 0.0
    ) -> None:
        """``vertices`` (V, 2) in [m]; none: a circle of ``radius`` [m]."""
        self.name = name
        self.params = params
        self.trigger_count = params.trigger_count
        self._vertices = vertices
        self._radius = radius

    def reset(self) -> None:
        """Forget earlier velocities."""

    def select(self, command: Twist2D) -> bool:
        """Take the shape that belongs to a velocity; whether there is one."""
        return True

    def is_triggered(self, points: FloatArray) -> bool:
        """Whether enough points (n, 2) lie inside."""
        return bool(
            are_inside(
                points, len(points), 0.0, 0.0, 0.0, self._vertices, self._radius, self.trigger_count
            )
        )

    def collision_time(self, points: FloatArray, command: Twist2D) -> float | None:
        """Time in [s] until enough points (n, 2) lie inside, driving as commanded; None: never."""
        time = collision_time(
            points,
            self._vertices,
            self._radius,
            self.trigger_count,
            command.linear_x,
            command.linear_y,
            command.angular_z,
            self.params.time_before_collision,
            self.params.simulation_time_step,
        )
        if time == NO_COLLISION:
            return None
        return float(time)


class VelocityZone(MonitorZone):
    """A polygon for each range of velocities.

    One that no range covers keeps the last polygon (``VelocityPolygon``).
    """

    def __init__(self, name: str, params: PolygonParams) -> None:
        super().__init__(name, params, _NO_VERTICES)
        shapes = [params.shapes[each] for each in params.velocity_polygons]
        self._shapes = [(shape, parse_polygon(shape.points)) for shape in shapes]

    def reset(self) -> None:
        """See the base class."""
        self._vertices = _NO_VERTICES

    def select(self, command: Twist2D) -> bool:
        """See the base class; there is none until a velocity was covered."""
        for shape, vertices in self._shapes:
            if shape.covers(
                command.linear_x, command.linear_y, command.angular_z, self.params.holonomic
            ):
                self._vertices = vertices
                break
        return len(self._vertices) > 0


def make_zone(name: str, params: PolygonParams, footprint: FloatArray) -> MonitorZone:
    """The zone that a polygon's parameters describe.

    ``footprint`` (V, 2) in [m] stands in where they give no shape.
    """
    if params.type == "velocity_polygon":
        return VelocityZone(name, params)
    if params.type == "circle" and params.radius is not None:
        return MonitorZone(name, params, _NO_VERTICES, abs(params.radius))
    if params.points is not None:
        footprint = parse_polygon(params.points)
    return MonitorZone(name, params, footprint)
