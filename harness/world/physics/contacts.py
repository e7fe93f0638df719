"""What the robot touched: counted contacts as published, and contact events."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from harness.world.physics.params import ContactParams
from harness.world.truth import Contact, CountedContact, Partner

Vector = tuple[float, float, float]

_SAME_PLACE = 0.1  # [m] between a point and one of the step before, up to which the contact goes on
_IN_TOUCH = 1e-4  # [m] between bodies, up to which they touch


@dataclass(frozen=True, slots=True)
class Touched:
    """Something that the robot can touch."""

    partner: Partner
    kind: str  # 'pedestrian' or the property's type
    number: int  # of the pedestrian, or of the obstacle in the scene


@dataclass(frozen=True, slots=True)
class Motion:
    """How a rigid body moves before a physics step, map frame."""

    position: Vector  # [m] of the centre of mass
    velocity: Vector  # [m/s]
    spin: Vector = (0.0, 0.0, 0.0)  # [rad/s]

    def along(self, normal: Vector, point: Vector) -> float:
        """Velocity of the body's material at ``point`` along ``normal``, in [m/s]."""
        (px, py, pz), (x, y, z) = point, self.position
        (vx, vy, vz), (wx, wy, wz), (nx, ny, nz) = self.velocity, self.spin, normal
        rx, ry, rz = px - x, py - y, pz - z
        along_x = (vx + wy * rz - wz * ry) * nx
        along_y = (vy + wz * rx - wx * rz) * ny
        return along_x + along_y + (vz + wx * ry - wy * rx) * nz


@dataclass(frozen=True, slots=True)
class ContactPoint:
    """One contact point of one physics step."""

    touched: Touched
    position: Vector  # [m] map frame
    normal: Vector  # unit vector from the partner to the robot
    impulse: float  # [N s] along the normal in this step
    partner: Motion  # before the step
    # [m] between the bodies before the step; the engine brakes them ahead of touching
    distance: float = 0.0

    @property
    def partner_speed(self) -> float:
        """Speed [m/s] of the partner towards the robot before the step."""
        return self.partner.along(self.normal, self.position)

    def robot_speed(self, robot: Motion) -> float:
        """Speed [m/s] of a robot of this motion towards the partner before the step."""
        return -robot.along(self.normal, self.position)


@dataclass(slots=True)
class _Event:
    first: ContactPoint  # of the first step
    stamp: float  # [s] of the first touch
    last: float  # [s] of the last touch
    robot_speed: float  # [m/s] towards the partner
    partner_speed: float  # [m/s] towards the robot
    impulse: float = 0.0  # [N s] of all impacts
    impacts: int = 0
    in_impact: bool = False  # at the last touch
    peak: float = 0.0  # [N s]

    def extend(self, stamp: float, impulse: float, impact: float) -> None:
        """Take in a step's ``impulse`` [N s] and the part of it that is ``impact`` [N s]."""
        self.last = stamp
        self.peak = max(self.peak, impulse)
        self.impulse += impact
        self.impacts += impact > 0.0 and not self.in_impact
        self.in_impact = impact > 0.0

    def finished(self, step: float, robot_mass: float) -> Contact:
        """The event for the record; ``step`` [s] is the physics step, ``robot_mass`` in [kg]."""
        touched, position = self.first.touched, self.first.position
        return Contact(
            stamp=self.stamp,
            duration=self.last - self.stamp + step,
            partner=touched.partner,
            kind=touched.kind,
            partner_id=touched.number,
            x=position[0],
            y=position[1],
            impulse=self.impulse,
            impacts=self.impacts,
            delta_v=self.impulse / robot_mass,
            peak_step_impulse=self.peak,
            robot_speed=self.robot_speed,
            partner_speed=self.partner_speed,
        )


class _Phase(Enum):
    """What the impulse of a contact point does in a step."""

    # stops bodies that come together, or brakes them so that they just meet at the step's end
    MEETING = 1
    ARRIVING = 2  # stops what was braked in the step before
    PUSHING = 3  # keeps bodies apart that touch


@dataclass(slots=True)
class ContactBook:
    """Keeps the contacts of one episode; fed once per physics step with contact.

    The published rule looks at single contact points, and its least contact is that of the whole
    robot at 1 m/s. How an impact spreads over points is a matter of the engine: here a person or a
    wall touches the robot's side in two to four points at once. So the points of one partner in one
    step count as one, unless ``params.per`` asks for points.

    An event's impulse is that of its impacts: of points where the bodies come together and did not
    touch already. What the engine gives between bodies in touch is a push (a person who walks on or
    round a corner, the robot's drive); it grows with time, not with the closing speed. So halving
    the physics step does not change the impulse.
    """

    params: ContactParams
    dt: float  # [s] physics step
    robot_mass: float  # [kg]
    counted: tuple[CountedContact, ...] = ()
    finished: tuple[Contact, ...] = ()
    _cool_down: int = 0  # contact reports during which nothing counts
    _open: dict[Touched, _Event] = field(default_factory=dict)
    _before: list[tuple[ContactPoint, _Phase]] = field(default_factory=list)  # of the last step
    _recorded: float = 0.0  # [s] end of that step

    @property
    def is_waiting(self) -> bool:
        """Whether an event is open, so that :meth:`close_old` has something to do."""
        return bool(self._open)

    def record(self, stamp: float, points: list[ContactPoint], robot: Motion) -> None:
        """Take in one physics step.

        Args:
            stamp: [s] at the end of the step.
            points: the robot's contact points that touch, in the solver's order; the ground is not
                among them.
            robot: its motion before the step.
        """
        if not points:
            return
        merged = merge(points)
        if self.params.per == "partner":
            self._count(stamp, merged, robot)
        else:
            self._count(stamp, points, robot)
        impacts = self._impacts(stamp, points, robot)
        for point in merged:
            if point.impulse > 0.0:
                self._extend(stamp, point, impacts.get(point.touched, 0.0), robot)

    def _impacts(
        self,
        stamp: float,
        points: list[ContactPoint],
        robot: Motion,
    ) -> dict[Touched, float]:
        """Impulse [N s] per partner of the points where bodies meet."""
        if stamp - self._recorded > 1.5 * self.dt:
            self._before = []
        pressed = [point for point in points if point.impulse > 0.0]
        self._before = [(point, self._phase(point, robot)) for point in pressed]
        self._recorded = stamp
        impacts: dict[Touched, float] = {}
        for point, phase in self._before:
            if phase is not _Phase.PUSHING:
                impacts[point.touched] = impacts.get(point.touched, 0.0) + point.impulse
        return impacts

    def _phase(self, point: ContactPoint, robot: Motion) -> _Phase:
        for before, phase in self._before:
            if (
                point.touched == before.touched
                and math.dist(point.position, before.position) < _SAME_PLACE
            ):
                if phase is _Phase.MEETING and before.distance > _IN_TOUCH:
                    return _Phase.ARRIVING
                return _Phase.PUSHING
        closing = point.robot_speed(robot) + point.partner_speed
        if closing > self.params.impact_speed:
            return _Phase.MEETING
        return _Phase.PUSHING

    def _count(self, stamp: float, points: list[ContactPoint], robot: Motion) -> None:
        """The published count: the first contact strong enough, then a cool-down in reports."""
        if self._cool_down > 0:
            self._cool_down -= 1
            return
        for point in points:
            if point.impulse >= self.params.counted_impulse:
                touched = point.touched
                self.counted += (
                    CountedContact(
                        stamp=stamp,
                        partner=touched.partner,
                        kind=touched.kind,
                        partner_id=touched.number,
                        x=point.position[0],
                        y=point.position[1],
                        impulse=point.impulse,
                        robot_speed=point.robot_speed(robot),
                        partner_speed=point.partner_speed,
                    ),
                )
                self._cool_down = self.params.cool_down
                return

    def _extend(self, stamp: float, point: ContactPoint, impact: float, robot: Motion) -> None:
        event = self._open.get(point.touched)
        if event is None:
            event = self._open[point.touched] = _Event(
                first=point,
                stamp=stamp,
                last=stamp,
                robot_speed=point.robot_speed(robot),
                partner_speed=point.partner_speed,
            )
        event.extend(stamp, point.impulse, impact)

    def close_old(self, stamp: float) -> None:
        """Finish the events whose bodies have been apart for long enough."""
        ended = [
            t for t, event in self._open.items() if stamp - event.last > self.params.separation_time
        ]
        for touched in ended:
            self.finished += (self._open.pop(touched).finished(self.dt, self.robot_mass),)

    def close_all(self) -> None:
        """Finish every event: the episode is over."""
        self.finished += tuple(
            event.finished(self.dt, self.robot_mass) for event in self._open.values()
        )
        self._open.clear()


def contact_points(
    contacts: list[tuple[Any, ...]],
    dt: float,
    touchable: Mapping[int, Touched],
    motions: Mapping[int, Motion],
    gaps: Mapping[int, float],
) -> list[ContactPoint]:
    """What the robot touches after a step, in the solver's order.

    Args:
        contacts: as PyBullet lists them, robot first.
        dt: [s] of the step.
        touchable: what the bodies are.
        motions: of bodies before the step; others stand.
        gaps: [m] between bodies and robot before the step, where PyBullet's own does not hold.
    """
    points: list[ContactPoint] = []
    for raw in contacts:
        partner, position, normal, distance, force = raw[2], raw[6], raw[7], raw[8], raw[9]
        if force <= 0.0 and distance > 0.0:
            continue
        point = ContactPoint(
            touched=touchable[partner],
            position=position,
            normal=normal,
            impulse=force * dt,
            partner=motions.get(partner) or Motion(position, (0.0, 0.0, 0.0)),
            distance=gaps.get(partner, distance),
        )
        points.append(point)
    return points


def merge(points: list[ContactPoint]) -> list[ContactPoint]:
    """One point per partner, in order of appearance: the strongest, with the impulses of all."""
    sums: dict[Touched, float] = {}
    strongest: dict[Touched, ContactPoint] = {}
    for point in points:
        sums[point.touched] = sums.get(point.touched, 0.0) + point.impulse
        if point.touched not in strongest or point.impulse > strongest[point.touched].impulse:
            strongest[point.touched] = point
    return [
        dataclasses.replace(point, impulse=sums[touched]) for touched, point in strongest.items()
    ]
