"""Where the sensors are on the robot: from ``tf_static``, ``tf`` or the user."""

import math
from collections import defaultdict, deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from harness.recorded.bag_file import printable
from navstack.errors import InputError
from navstack.types import FloatArray

BASE_FRAMES = ("base_link", "base_footprint", "base", "base_frame")  # tried where no frame is given
MOST_FRAMES = 10_000
_FARTHEST = 1000.0  # [m] of a sensor from the base
_STILL = 1e-4  # [m], [-] by which a mounting may change
_FORMS = (
    "'PARENT CHILD x y yaw', 'PARENT CHILD x y z roll pitch yaw' or, as in ROS 1, "
    "'x y z yaw pitch roll PARENT CHILD'"
)
_AFTER_FRAMES = {3: "planar", 6: "roll pitch yaw", 7: "quaternion"}
_BEFORE_FRAMES = {6: "yaw pitch roll", 7: "quaternion"}


@dataclass(frozen=True, slots=True, eq=False)
class Transform:
    """Where a frame stands in another one."""

    rotation: FloatArray  # (3, 3) from the frame's to the parent's axes
    translation: FloatArray  # (3,) [m] of its origin

    def __matmul__(self, inner: "Transform") -> "Transform":
        """Where a frame stands that is given in this one."""
        return Transform(
            self.rotation @ inner.rotation, self.rotation @ inner.translation + self.translation
        )

    @property
    def inverse(self) -> "Transform":
        """Where the parent stands in the frame."""
        return Transform(self.rotation.T, -self.rotation.T @ self.translation)

    @property
    def yaw(self) -> float:
        """Direction in [rad] of the frame's x axis in the parent's plane."""
        return math.atan2(self.rotation[1, 0], self.rotation[0, 0])

    @property
    def tilt(self) -> float:
        """Angle [rad] between the z axes; pi where the frame is upside down."""
        return math.atan2(math.hypot(*self.rotation[2, :2]), self.rotation[2, 2])


IDENTITY = Transform(np.eye(3), np.zeros(3))


def from_quaternion(x: float, y: float, z: float, w: float) -> FloatArray | None:
    """The rotation (3, 3) of a quaternion that may not be quite normalised; None: it is none."""
    if not 0.5 < math.hypot(x, y, z, w) < 2.0:  # also not a number
        return None
    rotation: FloatArray = Rotation.from_quat((x, y, z, w)).as_matrix()
    return rotation


def from_angles(roll: float, pitch: float, yaw: float) -> FloatArray:
    """The rotation (3, 3) about the fixed axes x, y, z in this order, as tf and URDF have it.

    Angles in [rad].
    """
    rotation: FloatArray = Rotation.from_euler("xyz", (roll, pitch, yaw)).as_matrix()
    return rotation


@dataclass(slots=True)
class _Edge:
    parent: str
    transform: Transform
    moves: bool = False


class Mountings:
    """A tree of frames, of which the user's own come first."""

    def __init__(self) -> None:
        self._edges: dict[str, _Edge] = {}  # by child
        self._given: set[str] = set()

    def give(self, text: str) -> None:
        """Enter a frame that the user gave.

        Raises:
            InputError: it has none of the forms.
        """
        parent, child, transform = parse_transform(text)
        self._edges[child] = _Edge(parent, transform)
        self._given.add(child)

    def take(self, message: Any, is_static: bool) -> None:
        """Enter the transforms of a ``tf2_msgs/TFMessage``.

        What is not static may turn out to move.
        """
        for stamped in message.transforms:
            move, turn = stamped.transform.translation, stamped.transform.rotation
            rotation = from_quaternion(turn.x, turn.y, turn.z, turn.w)
            translation = np.array((move.x, move.y, move.z))
            parent, child = frame_name(stamped.header.frame_id), frame_name(stamped.child_frame_id)
            if (
                rotation is None
                or not np.isfinite(translation).all()
                or child in self._given
                or child == parent
            ):
                continue
            edge = self._edges.get(child)
            if is_static or edge is None:
                if len(self._edges) < MOST_FRAMES:
                    self._edges[child] = _Edge(parent, Transform(rotation, translation))
            elif not _is_same(edge.transform, Transform(rotation, translation)):
                edge.moves = True

    def find(self, base: str, frame: str) -> tuple[Transform, bool] | None:
        """Where a frame stands in the base frame, and whether that changes; None: nobody knows."""
        neighbours: defaultdict[str, list[tuple[str, Transform, bool]]] = defaultdict(list)
        for child, edge in self._edges.items():
            neighbours[edge.parent].append((child, edge.transform, edge.moves))
            neighbours[child].append((edge.parent, edge.transform.inverse, edge.moves))
        waiting = deque([(base, IDENTITY, False)])
        seen = {base}
        while waiting:
            here, transform, moves = waiting.popleft()
            if here == frame:
                return transform, moves
            for there, step, step_moves in neighbours[here]:
                if there not in seen:
                    seen.add(there)
                    waiting.append((there, transform @ step, moves or step_moves))
        return None

    def find_from_any(self, bases: Iterable[str], frame: str) -> tuple[Transform, bool] | None:
        """As :meth:`find`, for the first base frame from which the frame can be reached."""
        for base in bases:
            found = self.find(base, frame)
            if found is not None:
                return found
        return None


def frame_name(name: str) -> str:
    """A frame's name without the slash with which those of ROS 1 may begin."""
    return printable(name.strip().lstrip("/"))


def sensor_frame(kind: str, name: str) -> str:
    """The frame that messages of a type name; the type's own name where they name none."""
    return frame_name(name) or type_name(kind)


def own_bases(frame: str) -> list[str]:
    """The usual base frames with a frame's own prefix: ``robot1/base_link`` of ``robot1/laser``."""
    prefix, slash, _ = frame.rpartition("/")
    if not slash:
        return []
    return [f"{prefix}/{base}" for base in BASE_FRAMES]


def type_name(kind: str) -> str:
    """The name of a type of messages without its package: ``LaserScan``."""
    return kind.rsplit("/", 1)[-1]


def parse_transform(text: str) -> tuple[str, str, Transform]:
    """Parent, child and transform as a user gives them.

    Raises:
        InputError: the text has none of the forms.
    """
    words = text.replace(",", " ").split()
    numbers = [_number(word) for word in words]
    if len(words) >= 5 and numbers[0] is None and numbers[1] is None:
        frames, values, forms = words[:2], numbers[2:], _AFTER_FRAMES
    else:
        frames, values, forms = words[-2:], numbers[:-2], _BEFORE_FRAMES
    known = [value for value in values if value is not None and abs(value) <= _FARTHEST]
    form, rotation = forms.get(len(values)), None
    if form is not None and len(known) == len(values):
        rotation = _rotation(form, known)
    if rotation is None or frame_name(frames[0]) == frame_name(frames[1]):
        raise InputError(f"--static-tf '{text}' is none of {_FORMS}; [m] and [rad]")
    place = np.array(known[:3])
    if form == "planar":
        place[2] = 0.0
    return frame_name(frames[0]), frame_name(frames[1]), Transform(rotation, place)


def _rotation(form: str, values: list[float]) -> FloatArray | None:
    if form == "planar":
        return from_angles(0.0, 0.0, values[2])
    if form == "quaternion":
        return from_quaternion(*values[3:])
    angles = values[3:]
    if form == "yaw pitch roll":
        angles.reverse()
    return from_angles(*angles)


def _number(word: str) -> float | None:
    try:
        return float(word)
    except ValueError:
        return None


def _is_same(one: Transform, other: Transform) -> bool:
    return bool(
        (np.abs(one.rotation - other.rotation) < _STILL).all()
        and (np.abs(one.translation - other.translation) < _STILL).all()
    )
