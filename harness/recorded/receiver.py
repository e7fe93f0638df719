"""From the messages of a bag to what the robot's localizers receive."""

import math
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

from harness.recorded import messages
from harness.recorded.clock import Clock
from harness.recorded.consistency import Consistency
from harness.recorded.mountings import (
    BASE_FRAMES,
    IDENTITY,
    Mountings,
    Transform,
    frame_name,
    own_bases,
    sensor_frame,
    type_name,
)
from harness.recorded.moving_frame import Edge, Motion, MovingFrame
from harness.recorded.ros_messages import FIX, IMU, ODOMETRY, SCAN, TRANSFORM_TYPES
from navstack.errors import InputError
from navstack.geometry import transform_points
from navstack.localization.geodesy import LocalFrame
from navstack.types import FloatArray, GpsFix, Imu, LaserScan, Odometry, Pose2D

# of a laser's plane, beyond which it is worth a word that it is taken as level
_SLANTED = math.radians(10.0)
_STORED = 100  # fixes of its last place that a receiver may begin with
_WEIGHED = 100  # messages of an inertial unit whose mean gives the vertical
_GRAVITY = (7.0, 12.5)  # [m/s2] norm of a mean that is gravity
_ONE_G, _VERTICAL = (0.8, 1.2), 0.9  # of a mean in g in place of m/s2, and its share along z
_UPRIGHT = math.radians(30.0)  # from the z axis at which gravity may be found

Measured = GpsFix | Imu | LaserScan | Odometry


class Receiver:
    """Turns decoded ROS messages into the robot's own."""

    def __init__(
        self,
        mountings: Mountings,
        base_frame: str | None,
        odometry_frame: str | None,
        frame: LocalFrame | None,
        heading: float,
        say: Callable[[str], None],
        edge: Edge | None = None,
        has_twist: bool = True,
    ) -> None:
        """Prepare.

        Args:
            mountings: where the sensors are.
            base_frame: that they are mounted on; None: the odometry's, or one with a usual name.
            odometry_frame: that the odometry is of; None: there is no odometry.
            frame: for fixes; None: such that the first fix stands where the robot is believed to
                be.
            heading: [rad] of the map's x axis, counter-clockwise from east.
            say: takes notes.
            edge: frames between which transforms tell odometry.
            has_twist: whether messages of odometry tell velocities; else their poses do.
        """
        self._mountings, self._say = mountings, say
        self._is_base_given = bool(base_frame)
        if base_frame:
            self._bases = [frame_name(base_frame)]
        else:
            self._bases = [frame_name(name) for name in (odometry_frame, *BASE_FRAMES) if name]
        self._frame, self._shift = frame, Pose2D()
        self._heading, self._is_datum_given = heading, frame is not None
        self._near = self._far = 0  # fixes about the datum; those elsewhere since
        self._too_far = ""  # why the first fix elsewhere is of no use
        self._motion, self._has_twist = Motion(), has_twist
        self._moving: MovingFrame | None = None
        if edge is not None:
            self._moving = MovingFrame(edge)
        self._mounted: dict[tuple[str, str], Transform] = {}
        self._forces: list[np.ndarray] = []  # of the inertial unit, in the base frame
        self.antenna: FloatArray = np.zeros(2)  # (2,) x, y [m] of that of the latest fix
        self.doubt = ""  # why the unit's mounting cannot be right
        self.left_out: Counter[str] = Counter()  # messages that hold nothing usable, by type
        self.taken: Counter[str] = Counter()  # the others
        self.consistency = Consistency()

    def stamp_of(self, kind: str, message: Any) -> float | None:
        """When a message was measured, by its header, in [s].

        None: it is a transform of no interest.
        """
        if kind in TRANSFORM_TYPES:
            message = self._moving and self._moving.stamped(message)
        if message is None:
            return None
        return messages.stamp_of(message)

    def convert(self, kind: str, message: Any, stamp: float, believed: Pose2D) -> Measured | None:
        """The robot's own message; None: it holds nothing usable, or nothing new.

        Args:
            kind: the message's type.
            message: decoded.
            stamp: [s] when it was measured.
            believed: where the robot is, as far as is known: for an antenna beside the base frame's
                origin.

        Raises:
            InputError: the first fixes are all too far from the local frame's origin.
        """
        measured: Measured | Pose2D | None
        if kind == FIX:
            measured = self._fix(message, stamp, believed)
        elif kind in TRANSFORM_TYPES:
            measured = self._place(message)
        elif kind == ODOMETRY:
            child = self._mounting(kind, message.child_frame_id)
            measured = messages.odometry(message, stamp, child)
            if measured is not None and not self._has_twist:
                measured = measured.pose
        elif kind == IMU:
            mounting = self._mounting(kind, message.header.frame_id)
            measured = messages.imu(message, stamp, mounting, self._heading)
            self._weigh(message, mounting)
        else:
            mounting = self._mounting(kind, message.header.frame_id)
            measured = messages.laser_scan(message, stamp, mounting)
        if measured is None:
            self.left_out[kind] += 1
            return None
        self.taken[kind] += 1
        if isinstance(measured, Pose2D):
            measured = self._motion.to(stamp, measured)
        self.consistency.take(measured)
        return measured

    def notes(self, clock: Clock) -> list[str]:
        """What is to be said of the messages once they are read, with the clock that they had."""
        found = [
            f"stamps of {topic} jump by {seconds:.3f} s; taken to run on from there"
            for topic, seconds in clock.jumps.items()
        ]
        found += [
            f"{count} messages of {topic} have stamps that are unset or of another time; taken as "
            "measured when they arrived"
            for topic, count in clock.replaced.items()
        ]
        found += [
            f"{count} messages of {type_name(kind)} hold nothing usable; left out"
            for kind, count in self.left_out.items()
        ]
        return found + self.consistency.doubts()

    def _place(self, message: Any) -> Pose2D | None:
        """Where the base is by a transform; None: it holds no numbers."""
        if self._moving is None or (place := self._moving.place(message)) is None:
            return None
        base = place @ self._mounting(ODOMETRY, self._moving.child).inverse
        x, y, _ = base.translation.tolist()
        return Pose2D(x, y, base.yaw)

    def _fix(self, message: Any, stamp: float, believed: Pose2D) -> GpsFix | None:
        coordinates = messages.coordinates(message)
        if coordinates is None:
            return None
        lever = self._mounting(FIX, message.header.frame_id).translation
        self.antenna = lever[:2]
        antenna = transform_points(believed, lever[None, :2])[0]
        if self._frame is None:
            self._place_datum(coordinates, antenna)
        place = self._in_frame(coordinates)
        if place is None and self._begins_elsewhere():
            self._say(
                f"fixes jump by more than 100 km after the first {self._near}: those that follow "
                "are placed where the robot is believed to be"
            )
            self._place_datum(coordinates, antenna)
            place = self._in_frame(coordinates)
        if place is None:
            return None
        x, y = place[0] + self._shift.x, place[1] + self._shift.y
        return messages.gps_fix(message, stamp, (x, y), lever, believed.yaw)

    def _place_datum(self, coordinates: tuple[float, float], antenna: FloatArray) -> None:
        """Let a fix be where the antenna (2,) [m] is believed to be."""
        self._frame = LocalFrame(*coordinates, self._heading)
        self._shift = Pose2D(float(antenna[0]), float(antenna[1]))
        self._near = self._far = 0

    def _in_frame(self, coordinates: tuple[float, float]) -> tuple[float, float] | None:
        """The place [m] of a fix about the datum; None: it is of a receiver that is lost.

        Raises:
            InputError: it is far from the datum, as so many were before, and none was near.
        """
        assert self._frame is not None
        try:
            place = self._frame.to_local(*coordinates)
        except InputError as error:
            self._far += 1
            self._too_far = self._too_far or str(error)
            if self.fixes_elsewhere and self._far > _STORED:
                raise
            return None
        self._near, self._far = self._near + 1, 0
        return place

    @property
    def fixes_elsewhere(self) -> str:
        """Why the fixes are of no use where all are far from the datum; empty: they are not."""
        return "" if self._near else self._too_far

    def _begins_elsewhere(self) -> bool:
        """Whether the log began at another place, with no more fixes than are elsewhere now."""
        return not self._is_datum_given and self._near <= min(self._far, _STORED)

    def _mounting(self, kind: str, frame: str) -> Transform:
        """Where a sensor is on the robot."""
        key = (kind, frame)
        if key not in self._mounted:
            self._mounted[key] = self._look_up(kind, frame)
        return self._mounted[key]

    def is_mounted(self, kind: str, name: str) -> bool:
        """Whether the log or the user says where the frame of a sensor is."""
        return self._find(sensor_frame(kind, name)) is not None

    def _find(self, frame: str) -> tuple[Transform, bool] | None:
        """Where a frame is on the robot, and whether it moves; None: nobody knows."""
        bases = self._bases
        if not self._is_base_given:
            bases = [*bases, *own_bases(frame)]
        return self._mountings.find_from_any(bases, frame)

    def _look_up(self, kind: str, name: str) -> Transform:
        if kind == ODOMETRY and not frame_name(name):
            return IDENTITY  # many drivers leave it out
        frame = sensor_frame(kind, name)
        if frame == self._bases[0]:
            return IDENTITY
        found = self._find(frame)
        if found is None and frame in self._bases:
            return IDENTITY
        if found is None:
            which = f"the frame of {type_name(kind)}, which names none,"
            if frame_name(name):
                which = f"frame '{frame}' of {type_name(kind)}"
            self._say(
                f"nobody says where {which} is on {self._bases[0]}: taken to be there, not turned; "
                f"give --static-tf '{self._bases[0]} {frame} x y z roll pitch yaw'"
            )
            return IDENTITY
        transform, moves = found
        if moves:
            self._say(f"frame '{frame}' moves on the robot; taken to stay where it was at first")
        if kind == SCAN and _SLANTED < transform.tilt < math.pi - _SLANTED:
            self._say(
                f"laser '{frame}' is tilted by {math.degrees(transform.tilt):.0f} degrees; taken "
                "as level"
            )
        return transform

    def _weigh(self, message: Any, mounting: Transform) -> None:
        """Warn of a mounting in which gravity does not point up, and of other units than m/s2."""
        if len(self._forces) >= _WEIGHED:
            return
        force = messages.specific_force(message)
        if force is None:
            return
        self._forces.append(mounting.rotation @ force)
        if len(self._forces) < _WEIGHED:
            return
        mean: FloatArray = np.mean(self._forces, axis=0)
        norm = float(np.linalg.norm(mean))
        frame = sensor_frame(IMU, message.header.frame_id)
        if _GRAVITY[0] < norm < _GRAVITY[1] and (angle := math.acos(mean[2] / norm)) > _UPRIGHT:
            self.doubt = (
                f"gravity is {math.degrees(angle):.0f} degrees off the vertical in frame "
                f"'{frame}': its mounting is wrong or missing; "
                f"{_upright(mounting.rotation.T @ mean)}"
            )
            self._say(f"{self.doubt}, and so will the headings be; see --static-tf")
        is_vertical = abs(mean[2]) > _VERTICAL * norm
        if norm > _GRAVITY[1] or (is_vertical and _ONE_G[0] < norm < _ONE_G[1]):
            self._say(
                f"the accelerations in frame '{frame}' begin with {norm:.3g} m/s2, where gravity "
                "has 9.8; they have to be in m/s2"
            )


def _upright(force: FloatArray) -> str:
    """Which turn of a unit sets it upright, by the force (3,) that it feels at rest."""
    x, y, z = force.tolist()
    roll = math.atan2(y, z)
    pitch = math.atan2(-x, math.hypot(y, z))
    turn = f"roll {roll:z.2f} and pitch {pitch:z.2f} rad would set it upright"
    return f"{turn}, of its yaw gravity says nothing"
