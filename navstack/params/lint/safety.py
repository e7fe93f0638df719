"""Rules about the collision monitor: does it trigger, and in time?"""

import math
from collections.abc import Iterator

import numpy as np

from navstack.errors import ParameterError
from navstack.params.collision_monitor import parse_polygon
from navstack.params.lint.costmap_view import CostmapView
from navstack.params.lint.rule import Finding, RuleGroup, above, below
from navstack.params.lint.subject import MONITOR, Subject
from navstack.types import FloatArray

LARGEST_INT = 2**31 - 1  # min_points is a C++ int
MANY_POINTS = 10_000  # in a zone at once: more than any planar lidar has in all
LONGEST_STALE_DRIVE = 1.5  # [m] on a sensor that has died

RULES = RuleGroup("Collision monitor", MONITOR)


@RULES.warning
def monitor_never_triggers(subject: Subject) -> Iterator[Finding]:
    """A zone of the collision monitor waits for more points than it can ever see.

    Why: the zone never slows or stops the robot; the monitor only seems to be there.
    """
    for name in _zones(subject):
        for key, usual in (("min_points", 4), ("max_points", 3)):
            points = subject.number(MONITOR, f"{name}.{key}", 0.0)
            if points > MANY_POINTS:
                found = f"waits for {points:.0f} points in the zone at once"
                if points > LARGEST_INT:
                    found += ", more than Nav2's 32 bits hold"
                yield Finding(f"{name}.{key}", found, f"{key}: {usual}")


@RULES.warning
def monitor_all_disabled(subject: Subject) -> Iterator[Finding]:
    """No zone of the collision monitor is enabled.

    Why: commands pass through it unchanged.
    """
    if subject.has(MONITOR) and not list(_zones(subject)):
        yield Finding(
            "polygons",
            "no polygon is both listed and enabled",
            "enable one, e.g. FootprintApproach",
        )


@RULES.warning
def late_approach(subject: Subject, braking: float, top_speed: float) -> Iterator[Finding]:
    """An approach zone asks for more deceleration than there is.

    Why: the monitor lowers the speed so that time_before_collision remains, but the robot cannot
    follow and touches.
    """
    for name in _zones(subject, "approach"):
        time = subject.number(MONITOR, f"{name}.time_before_collision", 2.0)
        if time > 0.0 and top_speed / time > braking:
            yield Finding(
                f"{name}.time_before_collision",
                f"{time:g} s: slowing down from {top_speed:g} m/s with it takes "
                f"{top_speed / time:.2f} m/s2, but {braking:g} m/s2 are allowed",
                f"time_before_collision: {above(top_speed / braking)}",
            )


@RULES.warning
def short_stop_zone(subject: Subject, local: CostmapView, top_speed: float) -> Iterator[Finding]:
    """A stop zone is shorter than the braking distance.

    Why: the robot stops after it has hit what it stops for.
    """
    front = float(local.footprint[:, 0].max())
    braking = subject.braking or math.inf
    distance = top_speed * top_speed / (2.0 * braking)
    for name in _zones(subject, "stop"):
        reach = _reach_ahead(subject, name)
        if reach is None or _guards_elsewhere(subject, name, local):
            continue
        if reach - front < distance - 1e-9:
            yield Finding(
                _shape(subject, name),
                f"the zone reaches {reach:.2f} m ahead of the base, {reach - front:.2f} m beyond "
                f"the robot's front, but stopping from {top_speed:g} m/s takes {distance:.2f} m",
                f"let it reach {above(front + distance + 0.05, 2)} m ahead",
            )


@RULES.warning
def hidden_slow_zone(subject: Subject, local: CostmapView) -> Iterator[Finding]:
    """A slowdown or limit zone lies inside the robot.

    Why: nothing is ever in it ahead of the robot, so it never slows down.
    """
    front = float(local.footprint[:, 0].max())
    for name in _zones(subject, "slowdown", "limit"):
        reach = _reach_ahead(subject, name)
        if reach is None or _guards_elsewhere(subject, name, local):
            continue
        if reach <= front:
            yield Finding(
                _shape(subject, name),
                f"the zone reaches {reach:.2f} m ahead of the base, "
                f"but the robot itself {front:.2f} m",
                f"let it reach at least {front + 0.5:.2f} m ahead",
            )


@RULES.warning
def stale_scan(subject: Subject, top_speed: float) -> Iterator[Finding]:
    """A sensor may be silent for long before the collision monitor stops the robot.

    Why: with a dead lidar the robot drives on blindly for this long.
    """
    if not subject.has(MONITOR) or top_speed <= 0.0:
        return
    shared = subject.number(MONITOR, "source_timeout", 2.0)
    for name in subject.names(MONITOR, "observation_sources"):
        if subject.value(MONITOR, f"{name}.enabled", True) is False:
            continue
        own = f"{name}.source_timeout"
        key = subject.default_note(MONITOR, own, "source_timeout") or own
        timeout = subject.number(MONITOR, own, shared)
        driven = timeout * top_speed
        if driven > LONGEST_STALE_DRIVE:
            yield Finding(
                key,
                f"{name} may be silent for {timeout:g} s: "
                f"at {top_speed:g} m/s that is {driven:.1f} m",
                f"{key}: {below(max(0.2, 0.5 / top_speed), 1)}",
            )
        elif timeout == 0.0:
            yield Finding(key, f"0 s: {name} may be silent for ever", f"{key}: 0.5")


def _zones(subject: Subject, *actions: str) -> Iterator[str]:
    """The enabled polygons, of the given action types if any are given."""
    for name in subject.names(MONITOR, "polygons"):
        is_wanted = not actions or subject.value(MONITOR, f"{name}.action_type") in actions
        if is_wanted and subject.value(MONITOR, f"{name}.enabled", True) is not False:
            yield name


def _shape(subject: Subject, name: str) -> str:
    """The parameter that gives a zone its size."""
    if subject.value(MONITOR, f"{name}.type") == "circle":
        return f"{name}.radius"
    return f"{name}.points"


def _reach_ahead(subject: Subject, name: str) -> float | None:
    """How far a fixed zone reaches ahead of the base, in [m].

    None: it is not fixed, or not readable.
    """
    if subject.value(MONITOR, f"{name}.type") == "circle":
        return subject.number(MONITOR, f"{name}.radius", 0.0)
    corners = _corners(subject, name)
    return None if corners is None else float(corners[:, 0].max())


def _guards_elsewhere(subject: Subject, name: str, local: CostmapView) -> bool:
    """Whether a zone reaches beyond the robot's sides or rear, and not ahead of it."""
    corners, body = _corners(subject, name), local.footprint
    if corners is None or subject.value(MONITOR, f"{name}.type") == "circle":
        return False
    if corners[:, 0].max() > body[:, 0].max():
        return False
    is_behind = corners[:, 0].min() < body[:, 0].min()
    return bool(is_behind or np.abs(corners[:, 1]).max() > np.abs(body[:, 1]).max())


def _corners(subject: Subject, name: str) -> FloatArray | None:
    """The corners (N, 2) [m] of a fixed zone; None: it has none, or they are not readable."""
    points = subject.value(MONITOR, f"{name}.points")
    if isinstance(points, str):  # "[[x, y], ...]" since Jazzy
        try:
            return parse_polygon(points)
        except ParameterError:
            return None
    if isinstance(points, list):  # [x, y, x, y, ...] up to Iron
        numbers = [float(each) for each in points if isinstance(each, int | float)]
        if numbers and len(numbers) == len(points) and len(numbers) % 2 == 0:
            return np.reshape(numbers, (-1, 2))
    return None
