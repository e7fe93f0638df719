"""The ground under the robot: one endless plane, and near steps the slabs whose edges they are."""

import math

import numpy as np

from harness.world.physics.bodies import fixed_body, is_rectangle, make_prism
from harness.world.physics.elevation import Elevation
from harness.world.physics.engine import bullet
from navstack.types import FloatArray

_DEPTH = 0.5  # [m] of a slab below the lower ground, so that nothing gets stuck inside
_MARGIN = 0.001  # [m] that PyBullet adds around a convex mesh


class Ground:
    """Bodies without friction, because the drive makes the friction of the wheels.

    Far from steps (nearly always) it is a plane at the height of the place. Near one the plane lies
    at the lowest height around, and what is higher is slabs; PyBullet then finds which foot stands
    on what.
    """

    # [m] the robot moves before the distance to the next step is looked up anew
    REFRESH_DISTANCE = 1.0
    WINDOW = 2.0  # [m] half the side of the square that is laid out in slabs, or more:
    BEYOND_REACH = 1.2  # [m] around any robot
    SLAB_DISTANCE = 1.0  # [m] the robot moves before they are laid out anew

    def __init__(self, client: int, elevation: Elevation, x: float, y: float, reach: float) -> None:
        """Lay the ground around (x, y) [m] for a robot that reaches so far [m] from there."""
        self._window = max(self.WINDOW, reach + self.BEYOND_REACH)
        self._client = client
        self._elevation = elevation
        plane = bullet.createCollisionShape(bullet.GEOM_PLANE, physicsClientId=client)
        self._plane = fixed_body(client, plane, (0.0, 0.0, 0.0), 0.0)
        self._slabs: list[int] = []
        self._slab_center = (math.inf, math.inf)  # [m] where they were laid out
        self.level = 0.0  # [m] height of the plane
        self.bodies = {self._plane}
        self._renew(x, y)

    def follow(self, x: float, y: float, reach: float) -> float:
        """Prepare the ground for a robot at (x, y); of use where there are steps at all.

        Returns:
            How far [m] it may go until that is to be done again; negative: a step can be within
            ``reach`` [m] of it.
        """
        moved = math.hypot(x - self._center[0], y - self._center[1])
        if moved > self.REFRESH_DISTANCE:
            self._renew(x, y)
            moved = 0.0
        if self._clearance - moved >= reach:
            if self._slabs:
                self._renew(x, y)
                self._clear()
                self._put_plane(self._elevation.level(x, y))
                moved = 0.0
            return max(min(self._clearance - moved - reach, self.REFRESH_DISTANCE - moved), 0.0)
        if math.hypot(x - self._slab_center[0], y - self._slab_center[1]) > self.SLAB_DISTANCE:
            self._lay_out(x, y)
        return -1.0

    def _renew(self, x: float, y: float) -> None:
        self._center, self._clearance = (x, y), self._elevation.clearance(x, y)
        if not self._slabs:
            self._put_plane(self._elevation.level(x, y))

    def _put_plane(self, level: float) -> None:
        if level != self.level:
            bullet.resetBasePositionAndOrientation(
                self._plane, (0.0, 0.0, level), (0.0, 0.0, 0.0, 1.0), physicsClientId=self._client
            )
            self.level = level

    def _clear(self) -> None:
        for slab in self._slabs:
            bullet.removeBody(slab, physicsClientId=self._client)
        self._slabs = []
        self._slab_center = (math.inf, math.inf)
        self.bodies = {self._plane}

    def _lay_out(self, x: float, y: float) -> None:
        self._clear()
        pieces = self._elevation.around(x, y, self._window)
        low = min(pieces)
        self._put_plane(low)
        for height, polygons in pieces.items():
            if height > low:
                self._slabs += [self._slab(polygon, low - _DEPTH, height) for polygon in polygons]
        self._slab_center = (x, y)
        self.bodies = {self._plane, *self._slabs}

    def _slab(self, polygon: FloatArray, bottom: float, top: float) -> int:
        """A body that fills the space above a convex polygon (N, 2) between two heights [m]."""
        client = self._client
        if is_rectangle(polygon):
            prism = make_prism(client, polygon, top - bottom)
            x, y, z = prism.center
            return self._fix(prism.shape, (x, y, z + bottom))
        center = polygon.mean(axis=0)
        flat = polygon - center
        corners = [(x, y, z) for z in (0.0, top - bottom - _MARGIN) for x, y in flat.tolist()]
        shape = bullet.createCollisionShape(
            bullet.GEOM_MESH, vertices=corners, physicsClientId=client
        )
        x, y = np.asarray(center).tolist()
        return self._fix(shape, (x, y, bottom))

    def _fix(self, shape: int, position: tuple[float, float, float]) -> int:
        """A slab that touches only what has reached it.

        A foot ahead of a seam must not stumble over it.
        """
        body = fixed_body(self._client, shape, position, 0.0)
        bullet.changeDynamics(
            body, -1, contactProcessingThreshold=0.0, physicsClientId=self._client
        )
        return body
