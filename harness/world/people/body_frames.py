"""People's bodies as a renderer moves them: once per frame, while the physics takes several steps.

A body that is moved in a scene becomes a kinematic target of PhysX, reached within the next physics
step: it makes a frame's way in the frame's first step, with as many times its walking speed as the
frame has steps, and then stands.

Bodies meet by the rules of PhysX's contacts (``DyContactPrepShared.h``; constraint of a point
between two bodies along its normal): those apart may close no faster than they come to touch at the
step's end; those that overlap part with 0.8 of the overlap per step, at most with
``maxDepenetrationVelocity``. Bullet finds two compound bodies only once they overlap. So a body
that the robot may reach in the coming step is put in touch with it, and what it was moved by is
taken from its velocity: the same constraint.
"""

import math

from harness.world.people.body_params import PedestrianBodyParams
from harness.world.people.person_bodies import put_person
from harness.world.physics.contacts import Vector
from harness.world.physics.engine import bullet

LEAP = 1.0  # [m] in a frame: who goes farther appears at another place
_TOUCH = 1e-4  # [m] by which bodies overlap that are put in touch, so that Bullet finds them
_UNDONE = 0.8  # [-] share of an overlap that PhysX removes per step
_SURPLUS = 0.1  # [m/s] by which forces may change a velocity within a step


class BodyFrames:
    """Moves kinematic bodies frame by frame."""

    def __init__(self, client: int, params: PedestrianBodyParams, rate: float) -> None:
        """Begin without bodies; ``rate`` [Hz] is that of the physics."""
        self._client = client
        self._steps = params.frame_steps
        self._rate = rate
        self._parting = params.max_depenetration_speed
        self._shown: dict[int, tuple[float, float]] = {}  # body -> where the last frame put it, [m]
        # body -> with which it moves in the coming step, [m/s]
        self._speeds: dict[int, tuple[float, float]] = {}
        # body -> distance [m] from the robot before it was put in touch
        self.gaps: dict[int, float] = {}

    def add(self, body: int, x: float, y: float) -> None:
        """Begin with a body at (x, y) [m]."""
        self._shown[body] = x, y

    def remove(self, body: int) -> None:
        """Forget a body."""
        for each in (self._shown, self._speeds, self.gaps):
            each.pop(body, None)

    def show(self, body: int, x: float, y: float, step: int) -> tuple[float, float]:
        """Prepare a body for physics step ``step``, whose person is at (x, y) [m].

        Returns:
            Where it is before the step.
        """
        vx = vy = 0.0
        if step % self._steps == 0:
            before_x, before_y = self._shown[body]
            self._shown[body] = x, y
            if math.hypot(x - before_x, y - before_y) < LEAP:
                vx, vy = (x - before_x) * self._rate, (y - before_y) * self._rate
                x, y = before_x, before_y
        else:
            x, y = self._shown[body]
        self._speeds[body] = vx, vy
        self.gaps.pop(body, None)
        put_person(self._client, body, (x, y, 0.0), (vx, vy, 0.0))
        return x, y

    def meet(self, body: int, robot: int) -> None:
        """Let a prepared body meet the robot as in PhysX."""
        client, (vx, vy) = self._client, self._speeds[body]
        (ux, uy, uz), spin = bullet.getBaseVelocity(robot, client)
        # spin: within 1 m
        fastest = math.hypot(vx, vy) + math.hypot(ux, uy, uz) + math.hypot(*spin) + _SURPLUS
        points = bullet.getClosestPoints(robot, body, fastest / self._rate, physicsClientId=client)
        if not points:
            return
        nearest = min(points, key=lambda point: float(point[8]))
        normal, gap = nearest[7], float(nearest[8])  # from the person to the robot
        if gap < 0.0 and not self._parting:
            return
        change = -gap * self._rate
        if gap < 0.0:
            change = min(_UNDONE * change, self._parting)
        self.gaps[body] = gap
        (x, y, z), _ = bullet.getBasePositionAndOrientation(body, client)
        shift = gap + _TOUCH
        nx, ny, nz = normal
        position: Vector = (x + shift * nx, y + shift * ny, z + shift * nz)
        put_person(client, body, position, (vx + change * nx, vy + change * ny, change * nz))
