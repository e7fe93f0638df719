"""Sidewalks around nodes at which one way of a street ends and another goes on."""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely

from harness.street.rules import RULES
from harness.street.walks import Street, Walk
from navstack.types import FloatArray

_NEAR = 0.2  # [m] of a sidewalk to where it should end
_INSIDE = 0.5  # [m] by which the sidewalks on both sides are overlapped
_SHORT = 0.1  # [m] a shorter gap is passed straight
# [rad] between arms: sidewalks of a smaller angle overlap, those of a larger one turn back
_LEAST, _MOST = np.radians((175.0, 300.0))


@dataclass(frozen=True, slots=True, eq=False)
class _Arm:
    """A street that leaves a node."""

    street: Street
    at: FloatArray  # (2,) [m]
    away: FloatArray  # (2,) [-] direction

    @property
    def angle(self) -> float:
        """Direction [rad]."""
        return float(np.arctan2(self.away[1], self.away[0]))


def around_bends(streets: list[Street], sides: list[Walk]) -> list[Walk]:
    """The sidewalks on the outer sides of bends between two ways, which end at their node each."""
    tree = shapely.STRtree([walk.line for walk in sides])
    found = []
    for arms in _arms(streets).values():
        by_angle = sorted(arms, key=lambda arm: arm.angle)
        for first, second in pairwise([*by_angle, by_angle[0]]):
            turn = (second.angle - first.angle) % (2.0 * np.pi)
            if first.street is second.street or not _LEAST <= turn <= _MOST:
                continue
            begin, end = _ending(first, 1.0, sides, tree), _ending(second, -1.0, sides, tree)
            if begin is not None and end is not None:
                found.append(_around(first, begin, second, end))
    return found


def _arms(streets: list[Street]) -> dict[int, list[_Arm]]:
    """Those of the nodes at which ways end, by node."""
    found = defaultdict(list)
    ends = {node for street in streets for node in (street.nodes[0], street.nodes[-1])}
    for street in streets:
        corners = shapely.get_coordinates(street.line)
        for number, node in enumerate(street.nodes):
            if node in ends:
                for away in _directions(corners, number):
                    found[node].append(_Arm(street, corners[number], away))
    return {node: arms for node, arms in found.items() if len(arms) > 1}


def _directions(corners: FloatArray, number: int) -> Iterator[FloatArray]:
    """In which a line leads away from a corner (2,)."""
    for other in (number - 1, number + 1):
        if 0 <= other < len(corners):
            step = corners[other] - corners[number]
            yield step / np.hypot(*step)


def _ending(arm: _Arm, side: float, sides: list[Walk], tree: shapely.STRtree) -> Walk | None:
    """The sidewalk to the left (1) or right (-1) of an arm that reaches its node."""
    most = 0.5 * arm.street.width + RULES.walk_widths["sidewalk"]
    near = tree.query(shapely.Point(arm.at), predicate="dwithin", distance=most)
    return next(
        (
            sides[number]
            for number in near
            if shapely.dwithin(sides[number].line, _end(arm, side, sides[number]), _NEAR)
        ),
        None,
    )


def _end(arm: _Arm, side: float, walk: Walk) -> shapely.Geometry:
    """Where a sidewalk beside an arm ends."""
    normal = side * np.array((-arm.away[1], arm.away[0]))
    return shapely.Point(arm.at + 0.5 * (arm.street.width + walk.width) * normal)


def _around(first: _Arm, begin: Walk, second: _Arm, end: Walk) -> Walk:
    """The way from the left of one arm to the right of the next."""
    ends = _end(first, 1.0, begin), _end(second, -1.0, end)
    low, high = shapely.get_coordinates(ends)
    turns = []
    if np.hypot(*(high - low)) > _SHORT:
        outwards = 0.5 * (low + high) - first.at
        radius = 0.5 * (np.hypot(*(low - first.at)) + np.hypot(*(high - first.at)))
        turns = [low, first.at + radius * outwards / np.hypot(*outwards), high]
    line = [low + _INSIDE * first.away, *turns, high + _INSIDE * second.away]
    source = "tag" if begin.source == end.source == "tag" else "rule"
    width = min(begin.width, end.width)
    return Walk("sidewalk", shapely.LineString(line), width, source)
