"""The motions that a search in (x, y, heading) puts one after the other, as tables by heading."""

import json
import math
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from navstack.errors import ParameterError
from navstack.types import FloatArray, IntArray

# kinds of motions
STRAIGHT = 0
LEFT = 1
RIGHT = 2
IN_PLACE = 3
# sides of a lattice's motions, as ``left_turn`` in Nav2's files: straight ones count as left
_RIGHT_TURN = 0
_LEFT_TURN = 1
SHORTEST = math.sqrt(2.0)  # [cells] of a motion, which leaves its cell
STEP = 1.0  # [cells] between the poses of a motion at most
HEADINGS = (  # of a lattice, as steps on the grid: those of Nav2's lattice files
    *((1, 0), (2, 1), (1, 1), (1, 2), (0, 1), (-1, 2), (-1, 1), (-2, 1)),
    *((-1, 0), (-2, -1), (-1, -1), (-1, -2), (0, -1), (1, -2), (1, -1), (2, -1)),
)
FARTHEST = 4.0  # turning radii within which a lattice's motions end


class Motions(NamedTuple):
    """K motions from each of B headings; those that a heading lacks have no poses."""

    headings: FloatArray  # (B,) [rad]
    ends: IntArray  # (B, K) number of the heading at the end
    kinds: IntArray  # (B, K) STRAIGHT, LEFT, RIGHT or IN_PLACE
    is_reverse: IntArray  # (B, K) 0 or 1
    lengths: FloatArray  # (B, K) [cells]
    poses: FloatArray  # (B, K, S, 3) from the start, [cells, cells, rad]; headings are not relative
    counts: IntArray  # (B, K) how many of the S poses there are; the last is the end
    sides: IntArray  # (B, K) a turn after a motion of another side pays ``change_penalty``
    by_dearest: bool  # a motion costs what the dearest of its cells does, not the last


class _Motion(NamedTuple):
    end: int
    kind: int
    side: int
    is_reverse: bool
    length: float
    poses: FloatArray  # (n, 3) without the start


@lru_cache(maxsize=4)
def arcs(bins: int, radius: float, reverses: bool) -> Motions:
    """Hybrid-A*'s motions (``node_hybrid.cpp``).

    Straight on and arcs to both sides, each just out of its cell.

    Args:
        bins: headings, evenly spread.
        radius: least turning radius [cells], 1 or more.
        reverses: the same motions backwards, too (Reeds and Shepp); False: forwards only (Dubins).
    """
    size = 2.0 * math.pi / bins
    angle = 2.0 * math.asin(SHORTEST / (2.0 * radius))
    turns = max(1, math.ceil(angle / size - 1e-9))
    angle = turns * size
    chord = 2.0 * radius * math.sin(angle / 2.0)
    signs = [1]
    table = []
    if reverses:
        signs.append(-1)
    for b in range(bins):
        found = []
        for sign in signs:
            found.append(_arc(b, b, size, 0.0, sign * chord, STRAIGHT, sign < 0))
            for side, kind in ((1, LEFT), (-1, RIGHT)):
                end = (b + sign * side * turns) % bins
                found.append(
                    _arc(b, end, size, side / radius, sign * radius * angle, kind, sign < 0)
                )
        table.append(found)
    return _table(np.arange(bins, dtype=np.float64) * size, table, by_dearest=False)


def _arc(
    start: int, end: int, size: float, curvature: float, length: float, kind: int, is_reverse: bool
) -> _Motion:
    """A motion of signed length [cells] at a curvature [1/cells]."""
    count = max(1, math.ceil(abs(length) / STEP - 1e-9))
    at = length * np.arange(1, count + 1) / count
    yaw = start * size + curvature * at
    if curvature == 0.0:
        x = at * math.cos(start * size)
        y = at * math.sin(start * size)
    else:
        x = (np.sin(yaw) - math.sin(start * size)) / curvature
        y = (math.cos(start * size) - np.cos(yaw)) / curvature
    side = 2 * kind + is_reverse
    return _Motion(end, kind, side, is_reverse, abs(length), np.stack((x, y, yaw), axis=1))


@lru_cache(maxsize=4)
def lattice(radius: float) -> Motions:
    """A lattice of 16 headings whose motions end at cells.

    Straight on, and to the next heading on both sides.

    A turn is an arc between two straight pieces, of which one has no length: the shortest whose
    radius is not below ``radius`` [cells], as Nav2's lattice generator makes them.
    """
    headings = np.array([math.atan2(y, x) for x, y in HEADINGS]) % (2.0 * math.pi)
    table = []
    for b, (x, y) in enumerate(HEADINGS):
        times = math.ceil(SHORTEST / math.hypot(x, y) - 1e-9)
        found = [_line_and_arc(headings, b, b, (times * x, times * y), radius)]
        for side in (1, -1):
            found.append(_shortest_turn(headings, b, (b + side) % len(HEADINGS), radius))
        table.append([motion for motion in found if motion is not None])
    return _table(headings, table, by_dearest=True)


def _shortest_turn(headings: FloatArray, b: int, end: int, radius: float) -> _Motion | None:
    """The turn to the heading ``end`` whose end is nearest; None: there is none in reach."""
    reach = math.ceil(FARTHEST * radius)
    numbers = range(-reach, reach + 1)
    places = [(x, y) for x in numbers for y in numbers if (x, y) != (0, 0)]
    places.sort(key=lambda place: (math.hypot(*place), place))
    for place in places:
        motion = _line_and_arc(headings, b, end, place, radius)
        if motion is not None:
            return motion
    return None


def _line_and_arc(
    headings: FloatArray, b: int, end: int, place: tuple[int, int], radius: float
) -> _Motion | None:
    """The motion from (0, 0) to a place [cells] by one straight piece and one wide enough arc."""
    first = float(headings[b])
    last = float(headings[end])
    turn = (last - first + math.pi) % (2.0 * math.pi) - math.pi
    x, y = place
    if turn == 0.0:
        length = math.hypot(x, y)
        at = np.linspace(0.0, 1.0, max(1, math.ceil(length / STEP)) + 1)[1:]
        return _Motion(
            end,
            STRAIGHT,
            _LEFT_TURN,
            False,
            length,
            np.stack((at * x, at * y, np.full(len(at), first)), axis=1),
        )
    # the two headings' lines through start and end meet at ``before`` cells from the start,
    # ``after`` before the end
    sine = math.sin(turn)
    before = (x * math.sin(last) - y * math.cos(last)) / sine
    after = (y * math.cos(first) - x * math.sin(first)) / sine
    tangent = min(before, after)
    if tangent <= 0.0 or tangent / math.tan(abs(turn) / 2.0) < radius - 1e-9:
        return None
    bend = tangent / math.tan(abs(turn) / 2.0)
    pieces = (
        (before - tangent, 0.0),
        (bend * abs(turn), math.copysign(1.0 / bend, turn)),
        (after - tangent, 0.0),
    )
    poses = _along(first, pieces)
    poses[-1] = (x, y, last)
    kind = LEFT if turn > 0.0 else RIGHT
    side = _LEFT_TURN if turn > 0.0 else _RIGHT_TURN
    return _Motion(end, kind, side, False, sum(length for length, _ in pieces), poses)


def _along(yaw: float, pieces: tuple[tuple[float, float], ...]) -> FloatArray:
    """Poses (n, 3) from the origin along pieces of a length [cells] and a curvature [1/cells]."""
    total = sum(length for length, _ in pieces)
    count = max(1, math.ceil(total / STEP - 1e-9))
    poses = []
    x = 0.0
    y = 0.0
    begin = 0.0
    for length, curvature in pieces:
        inside = [
            total * i / count
            for i in range(1, count + 1)
            if begin < total * i / count <= begin + length + 1e-9
        ]
        poses += [_ahead(x, y, yaw, at - begin, curvature) for at in inside]
        x, y, yaw = _ahead(x, y, yaw, length, curvature)
        begin += length
    return np.array(poses)


def _ahead(
    x: float, y: float, yaw: float, length: float, curvature: float
) -> tuple[float, float, float]:
    if curvature == 0.0:
        return x + length * math.cos(yaw), y + length * math.sin(yaw), yaw
    end = yaw + curvature * length
    return (
        x + (math.sin(end) - math.sin(yaw)) / curvature,
        y + (math.cos(yaw) - math.cos(end)) / curvature,
        end,
    )


@lru_cache(maxsize=4)
def read_lattice(path: Path, resolution: float) -> tuple[Motions, float]:
    """The motions of one of Nav2's lattice files (JSON), and its turning radius [m].

    Raises:
        ParameterError: the file is none, or one for another resolution.
    """
    try:
        content: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
        metadata = content["lattice_metadata"]
        made_for = float(metadata["grid_resolution"])
        radius = float(metadata["turning_radius"])
        angles = np.array(metadata["heading_angles"], dtype=np.float64)
        headings = angles % (2.0 * math.pi)
        primitives = [_stored(primitive, made_for) for primitive in content["primitives"]]
    except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
        raise ParameterError(f"lattice file {path}: is none of Nav2's: {error!r}") from None
    if not (math.isfinite(radius) and radius > 0.0):
        raise ParameterError(
            f"lattice file {path}: turning_radius {radius:g} must be more than 0 m"
        )
    if not math.isclose(made_for, resolution, rel_tol=1e-3):
        raise ParameterError(
            f"lattice file {path}: is for {made_for:g} m per cell, the costmap has {resolution:g} m"
        )
    table: list[list[_Motion]] = [[] for _ in headings]
    for start, motion in primitives:
        if not (0 <= start < len(table) and 0 <= motion.end < len(table)):
            raise ParameterError(
                f"lattice file {path}: a primitive's heading is none of its {len(table)}"
            )
        table[start].append(motion)
    return _table(headings, table, by_dearest=True), radius


def _stored(primitive: dict[str, Any], resolution: float) -> tuple[int, _Motion]:
    poses = np.array(primitive["poses"], dtype=np.float64)
    poses[:, :2] /= resolution
    length = float(primitive["trajectory_length"]) / resolution
    start = int(primitive["start_angle_index"])
    end = int(primitive["end_angle_index"])
    if length == 0.0:
        kind = IN_PLACE
    elif start == end:
        kind = STRAIGHT
    elif primitive["left_turn"]:
        kind = LEFT
    else:
        kind = RIGHT
    moved = poses[-1:]
    if length > 0.0:
        moved = poses[np.hypot(poses[:, 0], poses[:, 1]) > 1e-9]
    side = _LEFT_TURN if primitive["left_turn"] else _RIGHT_TURN
    return start, _Motion(end, kind, side, False, length, moved)


def _table(headings: FloatArray, table: list[list[_Motion]], by_dearest: bool) -> Motions:
    shape = (len(table), max(len(found) for found in table))
    most = max(len(motion.poses) for _, _, motion in _each(table))
    ends, kinds, is_reverse, counts, sides = (np.zeros(shape, dtype=np.int64) for _ in range(5))
    motions = Motions(
        headings,
        ends,
        kinds,
        is_reverse,
        np.zeros(shape),
        np.zeros((*shape, most, 3)),
        counts,
        sides,
        by_dearest,
    )
    for b, k, motion in _each(table):
        motions.ends[b, k] = motion.end
        motions.kinds[b, k] = motion.kind
        motions.sides[b, k] = motion.side
        motions.is_reverse[b, k] = motion.is_reverse
        motions.lengths[b, k] = motion.length
        motions.poses[b, k, : len(motion.poses)] = motion.poses
        motions.counts[b, k] = len(motion.poses)
    return motions


def _each(table: list[list[_Motion]]) -> Iterator[tuple[int, int, _Motion]]:
    return ((b, k, motion) for b, found in enumerate(table) for k, motion in enumerate(found))
