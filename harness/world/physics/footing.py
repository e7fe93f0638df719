"""How the wheels grip the ground, and how the body scrapes over it."""

import math
from dataclasses import dataclass
from typing import Any

from harness.world.physics.contacts import Motion, Vector
from harness.world.physics.drive_kernels import LEVEL
from harness.world.physics.engine import bullet
from harness.world.physics.robot import SKID, RobotParams

_TOUCH = 1e-3  # [m] above the ground, below which a tread stands on it
_SLACK = 0.01  # [m] around a tread's sphere that still counts as the foot


@dataclass(frozen=True, slots=True)
class Scrape:
    """The body's own contact with the ground at one point."""

    position: Vector  # [m] map frame
    load: float  # [N]


@dataclass(frozen=True, slots=True)
class Footing:
    """How the robot stands after a physics step."""

    # [N] that the left driven wheel grips with; LEVEL: as :func:`drive_forces` assumes
    left_load: float
    right_load: float  # [N]
    scrapes: tuple[Scrape, ...] = ()  # of neither wheel nor caster
    is_whole: bool = True  # both driven wheels stand on the ground, and the body does not

    def friction(
        self,
        motion: Motion,
        coefficient: float,
        stopping: float,
    ) -> list[tuple[Vector, Vector]]:
        """Coulomb friction of the scraping body: places [m] and forces [N], map frame.

        Args:
            motion: of the body.
            coefficient: [-] of friction.
            stopping: [N s/m] force over speed that stops the whole body within a step; more would
                turn it round.
        """
        forces: list[tuple[Vector, Vector]] = []
        for scrape in self.scrapes:
            x = motion.along((1.0, 0.0, 0.0), scrape.position)
            y = motion.along((0.0, 1.0, 0.0), scrape.position)
            speed = math.hypot(x, y)
            if speed > 0.0:
                slow = min(coefficient * scrape.load / speed, stopping / len(self.scrapes))
                forces.append((scrape.position, (-slow * x, -slow * y, 0.0)))
        return forces


ON_LEVEL_GROUND = Footing(LEVEL, LEVEL)


class Feet:
    """Finds how the robot stands.

    Four feet carry a rigid body in more ways than one, and the solver's choice among them is not
    that of a real frame. So the loads of the wheels are measured only where nothing else gives
    them.
    """

    def __init__(self, robot: RobotParams, gravity: float) -> None:
        """Prepare for a robot under ``gravity`` [m/s2]."""
        x, y, z = robot.center_of_mass
        # from the centre of mass, body frame
        self._feet = [(fx - x, fy - y) for fx, fy in robot.feet]
        # numbers of the driven wheels on the left and on the right
        self._driven = ((0, 2), (1, 3)) if robot.steering == SKID else ((0,), (1,))
        self._ground = -z  # [m] of the treads, likewise
        self._radius = robot.foot_radius + _SLACK
        load = 0.5 * robot.axle_share * robot.mass * gravity
        self._touched = Footing(load, load)

    def level_footing(self, is_touched: bool) -> Footing:
        """How it stands on level ground.

        Touched by something, its wheels grip with what the axle carries at rest: pushed sideways,
        the casters swivel.
        """
        if is_touched:
            return self._touched
        return ON_LEVEL_GROUND

    def footing(self, contacts: list[Any], position: Vector, orientation: Any) -> Footing:
        """Sort the robot's contacts with the ground.

        Args:
            contacts: as PyBullet lists them, robot first.
            position: [m] of the centre of mass.
            orientation: quaternion of the body.
        """
        loads = [0.0, 0.0, 0.0, 0.0]
        stands = [False, False, False, False]
        scrapes: list[Scrape] = []
        inverse = bullet.invertTransform((0.0, 0.0, 0.0), orientation)[1]
        for contact in contacts:
            point, distance, load = contact[5], contact[8], contact[9]
            offset = (point[0] - position[0], point[1] - position[1], point[2] - position[2])
            foot = self._foot(*bullet.rotateVector(inverse, offset))
            if foot is not None:
                loads[foot] += load
                stands[foot] = stands[foot] or distance < _TOUCH
            elif load > 0.0:
                scrapes.append(Scrape(point, load))
        left, right = (sum(loads[number] for number in side) for side in self._driven)
        is_whole = all(stands[number] for side in self._driven for number in side) and not scrapes
        return Footing(left, right, tuple(scrapes), is_whole)

    def _foot(self, x: float, y: float, z: float) -> int | None:
        if z > self._ground + self._radius:
            return None
        for number, (fx, fy) in enumerate(self._feet):
            if math.hypot(x - fx, y - fy) < self._radius:
                return number
        return None
