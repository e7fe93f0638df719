"""Body, wheels and sensor frames from a URDF.

urdf_parser_py reads it. What could fetch or execute anything is refused before: document types,
entities and xacro. Meshes are not opened.
"""

import contextlib
import io
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.recorded.mountings import IDENTITY, Transform, from_angles
from navstack.errors import InputError
from navstack.files import check_regular
from navstack.types import FloatArray

LARGEST = 5_000_000  # [bytes]
MOST_LINKS = 2000
_DECLARED = re.compile(r"<!(?:DOCTYPE|ENTITY)", re.IGNORECASE)
_TO_EXPAND = re.compile(r"<\w*:include|<xacro:[\w.]*|\$\{[^}]{0,40}\}?", re.IGNORECASE)
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_MOVING = ("continuous", "revolute", "prismatic", "planar", "floating")
_FARTHEST = 50.0  # [m] of anything from the base
_MOST_OFFSET = 1000.0  # [m], [rad] from one link to the next
_BASES = ("base_link", "base_footprint")
_CASTER = re.compile("caster|castor|idler", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class UrdfBody:
    """What a URDF says of a robot; None where it says nothing."""

    box: FloatArray | None  # lower and upper corner (2, 2) [m] of its shapes, base frame
    height: float | None  # [m] of the highest shape over the lowest one
    mass: float | None  # [kg]
    center_of_mass: FloatArray | None  # (3,) [m], base frame, z above the lowest shape
    wheel_radius: float | None  # [m] of the driven wheels
    track: float | None  # [m] between them
    axle: float | None  # [m] x of the driven axle, or of the middle of several
    casters: float | None  # [m] x of the rearmost caster; of the foremost if none is behind
    frames: tuple[str, ...]  # ``PARENT CHILD x y z roll pitch yaw`` of each fixed joint


def read_urdf(path: Path) -> UrdfBody:
    """Read a URDF.

    Raises:
        InputError: it cannot be read, is no URDF, or is one that would have to be expanded.
    """
    robot = _parsed(path)
    places = _places(robot)
    shapes = [corners for link in robot.links for corners in _shapes(link, places)]
    box = height = None
    ground = 0.0
    if shapes:
        corners = np.vstack(shapes)
        ground = float(corners[:, 2].min())
        height = float(corners[:, 2].max()) - ground
        box = np.array((corners[:, :2].min(axis=0), corners[:, :2].max(axis=0)))
        if not np.ptp(corners, axis=0).all():
            raise InputError(f"URDF '{path}' has shapes without extent only; give its outline")
    mass, center = _masses(robot, places)
    if center is not None:
        center = center - (0.0, 0.0, ground)
    wheels, casters = _wheels(robot, places)
    radius = track = axle = None
    if len(wheels) >= 2:
        radius = float(np.median(wheels[:, 2])) or None
        track = float(np.ptp(wheels[:, 1])) or None
        axle = float(wheels[:, 0].mean())
    return UrdfBody(box, height, mass, center, radius, track, axle, casters, _fixed(robot))


def _parsed(path: Path) -> Any:
    """The robot of a URDF, checked."""
    try:
        check_regular(path, LARGEST)
        text = path.read_text(encoding="utf-8")
    except OSError as error:
        raise InputError(f"URDF '{path}' cannot be read: {error.strerror or error}") from None
    except UnicodeDecodeError:
        raise InputError(f"URDF '{path}' is no text; give the XML file of a robot") from None
    if found := _DECLARED.search(text) or _TO_EXPAND.search(_COMMENT.sub("", text)):
        raise InputError(
            f"URDF '{path}' has '{found.group()}', which is not expanded here; give the plain "
            "result of `xacro robot.urdf.xacro > robot.urdf`"
        )
    try:
        from urdf_parser_py.urdf import URDF
    except ImportError:
        raise InputError(
            "reading a URDF needs urdf_parser_py; install it with: pip install 'navbench[urdf]'"
        ) from None
    try:
        with contextlib.redirect_stderr(io.StringIO()):  # it names tags that it does not know
            robot = URDF.from_xml_string(text.encode())
    except Exception as error:  # whatever lxml and it raise
        reason = " ".join(str(error).split())[:200] or type(error).__name__
        raise InputError(f"URDF '{path}' is no robot description: {reason}") from None
    if not robot.links or len(robot.links) > MOST_LINKS:
        raise InputError(f"URDF '{path}' has {len(robot.links)} links; 1 to {MOST_LINKS} are read")
    names = [link.name for link in robot.links]
    for name in names:
        if len(name.split()) != 1 or names.count(name) > 1:
            raise InputError(
                f"URDF '{path}' has a link '{name}'; give each a name of its own without spaces"
            )
    return robot


def _transform(origin: Any) -> Transform:
    if origin is None:
        return IDENTITY
    place = np.array(origin.xyz or (0.0, 0.0, 0.0), dtype=np.float64)
    angles = np.array(origin.rpy or (0.0, 0.0, 0.0), dtype=np.float64)
    numbers = np.abs(np.concatenate((place, angles)))
    if place.shape != (3,) or angles.shape != (3,) or not (numbers <= _MOST_OFFSET).all():
        raise InputError(
            f"the URDF has an origin {place.tolist()} m, {angles.tolist()} rad; give three numbers "
            f"each, at most {_MOST_OFFSET:g}"
        )
    return Transform(from_angles(*angles.tolist()), place)


def _places(robot: Any) -> dict[str, Transform]:
    """Where each link is in the base frame, joints at 0; links that do not connect are left out."""
    children: dict[str, list[tuple[str, Transform]]] = {}
    for joint in robot.joints:
        step = _transform(joint.origin)
        children.setdefault(joint.parent, []).append((joint.child, step))
        children.setdefault(joint.child, []).append((joint.parent, step.inverse))
    names = [link.name for link in robot.links]
    base = next((name for name in _BASES if name in names), names[0])
    places, waiting = {base: IDENTITY}, [base]
    while waiting:
        here = waiting.pop()
        for name, step in children.get(here, ()):
            if name not in places:
                places[name] = places[here] @ step
                waiting.append(name)
    return places


def _shapes(link: Any, places: dict[str, Transform]) -> list[FloatArray]:
    """Corners (8, 3) [m] of the boxes about a link's shapes, base frame; meshes have none."""
    if link.name not in places:
        return []
    found = []
    for shape in link.collisions or link.visuals:
        half = _half_size(shape.geometry)
        if half is None:
            continue
        signs = np.array(np.meshgrid((-1, 1), (-1, 1), (-1, 1))).reshape(3, -1).T
        place = places[link.name] @ _transform(shape.origin)
        corners = signs * half @ place.rotation.T + place.translation
        if np.abs(corners).max() <= _FARTHEST:
            found.append(corners)
    return found


def _half_size(geometry: Any) -> FloatArray | None:
    """Half the sides (3,) [m] of the box about a shape; None: a mesh."""
    name = type(geometry).__name__
    if name == "Box":
        half = 0.5 * np.array(geometry.size, dtype=np.float64)
    elif name == "Cylinder":
        half = np.array((geometry.radius, geometry.radius, 0.5 * geometry.length))
    elif name == "Sphere":
        half = np.full(3, float(geometry.radius))
    else:
        return None
    if half.shape != (3,) or not ((half >= 0.0) & (half <= _FARTHEST)).all():
        raise InputError(
            f"the URDF has a {name.lower()} of {(2.0 * half).tolist()} m; give three sides from 0 "
            f"to {2.0 * _FARTHEST:g} m"
        )
    return half


def _masses(robot: Any, places: dict[str, Transform]) -> tuple[float | None, FloatArray | None]:
    """Mass [kg] and centre of mass (3,) [m] in the base frame."""
    total, moment = 0.0, np.zeros(3)
    for link in robot.links:
        if link.inertial is None or link.name not in places or not link.inertial.mass:
            continue
        mass = float(link.inertial.mass)
        if not 0.0 < mass < 1e5:
            raise InputError(
                f"the URDF's link '{link.name}' has the mass {mass:g} kg; allowed is above 0 and "
                "below 100000, or none"
            )
        place = places[link.name] @ _transform(link.inertial.origin)
        total += mass
        moment += mass * place.translation
    if total <= 0.0:
        return None, None
    return total, moment / total


def _wheels(robot: Any, places: dict[str, Transform]) -> tuple[FloatArray, float | None]:
    """Rows x, y, radius [m] of the driven wheels, and x of the rearmost caster.

    A driven wheel is what a continuous joint turns about an axis across the robot.
    """
    links = {link.name: link for link in robot.links}
    wheels, casters = [], []
    for joint in robot.joints:
        if joint.child not in places:
            continue
        place = places[joint.child]
        if _CASTER.search(joint.child):
            casters.append(float(place.translation[0]))
        elif joint.type == "continuous":
            axis = place.rotation @ np.array(joint.axis or (1.0, 0.0, 0.0), dtype=np.float64)
            if abs(axis[1]) < 0.9:
                continue
            radius = _radius(links.get(joint.child))
            wheels.append((*place.translation[:2].tolist(), radius))
    farthest = min(casters, default=None)
    if farthest is not None and farthest > 0.0:
        farthest = max(casters)
    return np.array(wheels).reshape(-1, 3), farthest


def _radius(link: Any) -> float:
    """[m] of a wheel; 0: a mesh."""
    for shape in (*link.collisions, *link.visuals) if link is not None else ():
        if type(shape.geometry).__name__ in ("Cylinder", "Sphere"):
            return float(shape.geometry.radius)
    return 0.0


def _fixed(robot: Any) -> tuple[str, ...]:
    """The fixed joints as transforms that a user may give."""
    found = []
    for joint in robot.joints:
        if joint.type in _MOVING:
            continue
        origin = joint.origin
        place = (0.0, 0.0, 0.0) if origin is None else origin.xyz or (0.0, 0.0, 0.0)
        turn = (0.0, 0.0, 0.0) if origin is None else origin.rpy or (0.0, 0.0, 0.0)
        numbers = " ".join(f"{value:.9g}" for value in (*place, *turn))
        found.append(f"{joint.parent} {joint.child} {numbers}")
    return tuple(found)
