"""The checks of scenarios by name.

Each looks at what happened and says whether it holds, and what was measured.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from harness.metrics.contacts import fault
from harness.scenarios.scenario import Area, Checks
from harness.world.map.scene import Scene
from harness.world.truth import Partner, Truth
from navstack.types import BoolArray, FloatArray


@dataclass(frozen=True, slots=True, eq=False)
class ScenarioDrive:
    """What happened in a scenario."""

    scene: Scene
    feet: FloatArray  # (F, 2) [m] where the robot stands, base frame
    times: FloatArray  # (T,) [s]
    poses: FloatArray  # (T, 3) x, y [m], yaw [rad] of the base frame
    # (T,) [m] between the surfaces of the robot and of the nearest person; inf: nobody there
    distances: FloatArray
    errors: FloatArray  # (T,) [m] between the believed and the true position
    truth: Truth  # at the end
    arrived: bool
    gave_up: bool
    error: str  # Nav2's name of the last failure; empty: none


@dataclass(frozen=True, slots=True)
class CheckResult:
    """What became of one check."""

    check: str  # its name
    asked: str  # the value that was asked for; empty: none
    holds: bool
    measured: str


Answer = tuple[bool, str]


def _no_collision(drive: ScenarioDrive, asked: bool) -> Answer:
    if not drive.truth.contacts:
        return True, "touched nothing"
    return False, _touched(drive)


def _not_at_fault(drive: ScenarioDrive, asked: bool) -> Answer:
    faults = [fault(contact) for contact in drive.truth.contacts]
    measured = ", ".join(dict.fromkeys(faults)) or "no contact"
    return set(faults) <= {"person_into_standing_robot"}, measured


def _no_injury(drive: ScenarioDrive, asked: bool) -> Answer:
    counted = drive.truth.counted_contacts
    hits = sum(contact.partner is Partner.PEDESTRIAN for contact in counted)
    return not hits, f"{hits} counted contacts with people"


def _arrives_within(drive: ScenarioDrive, seconds: float) -> Answer:
    end = float(drive.times[-1])
    if drive.arrived:
        return end <= seconds, f"arrived after {end:.1f} s"
    measured = f"had not arrived after {end:.1f} s"
    if drive.gave_up:
        measured += f", gave up with {drive.error}"
    return False, measured


def _gives_up_with(drive: ScenarioDrive, error: str) -> Answer:
    if not drive.gave_up:
        return False, "did not give up"
    return drive.error == error, f"gave up with {drive.error}"


def _stays_off(drive: ScenarioDrive, kinds: tuple[str, ...]) -> Answer:
    ground = shapely.Polygon()
    for zone in drive.scene.zones:  # of those that overlap the later counts
        polygon = shapely.Polygon(zone.polygon)
        if zone.kind in kinds:
            ground = ground.union(polygon)
        else:
            ground = ground.difference(polygon)
    x, y, yaw = drive.poses.T
    on_it = np.zeros(len(x), dtype=bool)
    for ahead, left in drive.feet:
        foot_x = x + np.cos(yaw) * ahead - np.sin(yaw) * left
        foot_y = y + np.sin(yaw) * ahead + np.cos(yaw) * left
        on_it |= shapely.contains_xy(ground, foot_x, foot_y)
    return not on_it.any(), _first(drive, on_it, f"on {' or '.join(kinds)}")


def _keeps_out_of(drive: ScenarioDrive, areas: tuple[Area, ...]) -> Answer:
    x, y = drive.poses[:, 0], drive.poses[:, 1]
    inside = np.zeros(len(x), dtype=bool)
    for x0, y0, x1, y1 in areas:
        inside |= (x0 <= x) & (x <= x1) & (y0 <= y) & (y <= y1)
    return not inside.any(), _first(drive, inside, "inside")


def _never_closer_than(drive: ScenarioDrive, least: float) -> Answer:
    nearest = float(drive.distances.min())
    if nearest == math.inf:
        return True, "nobody was there"
    return nearest >= least, f"{nearest:.2f} m at the nearest"


def _moves_at_most(drive: ScenarioDrive, most: float) -> Answer:
    farthest = float(np.hypot(*(drive.poses[:, :2] - drive.poses[0, :2]).T).max())
    return farthest <= most, f"moved {farthest:.2f} m"


def _believes_within(drive: ScenarioDrive, most: float) -> Answer:
    worst = float(drive.errors.max())
    return worst <= most, f"{worst:.2f} m off at the worst"


CHECKS: dict[str, Callable[[ScenarioDrive, Any], Answer]] = {
    "no_collision": _no_collision,
    "not_at_fault": _not_at_fault,
    "no_injury": _no_injury,
    "arrives_within": _arrives_within,
    "gives_up_with": _gives_up_with,
    "stays_off": _stays_off,
    "keeps_out_of": _keeps_out_of,
    "never_closer_than": _never_closer_than,
    "moves_at_most": _moves_at_most,
    "believes_within": _believes_within,
}


def judge(drive: ScenarioDrive, checks: Checks) -> tuple[CheckResult, ...]:
    """The findings of all checks that a scenario asks for."""
    return tuple(
        CheckResult(name, _plain(value), *CHECKS[name](drive, value))
        for name, value in checks.asked.items()
    )


def _plain(value: Any) -> str:
    if value is True:
        return ""
    if isinstance(value, tuple):
        return ", ".join(map(str, value))
    return str(value)


def _touched(drive: ScenarioDrive) -> str:
    first, *more = drive.truth.contacts
    words = f"{fault(first)} ({first.kind}) after {first.stamp:.1f} s, {first.impulse:.1f} N s"
    if more:
        words += f" and {len(more)} more"
    return words


def _first(drive: ScenarioDrive, where: BoolArray, words: str) -> str:
    if not where.any():
        return f"never {words}"
    first = float(drive.times[np.argmax(where)])
    return f"{words} first after {first:.1f} s"
