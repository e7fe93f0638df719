"""The inner loops of :mod:`.scoring`: the best trajectory, found by where trajectories end."""

import math
from typing import NamedTuple

import numpy as np

from navstack.control.dwb.end_kernels import end_poses
from navstack.control.dwb.kernels import CellArray, add_weighted, roll_out, step_counts
from navstack.control.dwb.pose_score import (
    CELL_COST,
    GOAL_ALIGNMENT,
    GOAL_DISTANCE,
    OUTLINE_COST,
    PATH_ALIGNMENT,
    PATH_DISTANCE,
    Situation,
    add_distances,
    locate,
    outline_score,
    plan_cells,
    read_map,
    seeds_of,
)
from navstack.control.dwb.velocity_samples import combine
from navstack.jit import njit
from navstack.types import (
    Float32Vector,
    FloatArray,
    FloatMatrix,
    FloatVector,
    IntArray,
    IntVector,
)

GIVEN = -2  # kind of a critic whose raw costs are given


class Sampling(NamedTuple):
    """How trajectories are made."""

    axes: FloatMatrix  # (3, 4) as velocity_samples.combine wants it, and so
    counts: IntVector  # (3,) and
    speeds: FloatVector  # (3,)
    # (4,) [s] of acceleration, [s] simulated, and the granularities [m] and [rad]
    times: FloatVector
    limits: FloatMatrix  # (3, 2) as kernels.roll_out wants it


class Terms(NamedTuple):
    """What C critics score."""

    kinds: IntVector  # (C,) of their measures, or GIVEN
    noses: FloatVector  # (C,) [m] of their measures
    scales: Float32Vector  # (C,) weights, none of them 0
    given: FloatMatrix  # (C, K) raw costs of the critics whose kind is GIVEN


class SampledDrive(NamedTuple):
    """Trajectories before they are driven."""

    robot: FloatArray  # (6,) pose and velocity
    commands: FloatArray  # (K, 3)
    steps: IntArray  # (K,)
    limits: FloatArray  # (3, 2)
    sim_time: float  # [s]


@njit(ahead=True)
def best_command(
    sampling: Sampling,
    terms: Terms,
    situation: Situation,
    guess: int,
    command: FloatVector,
) -> tuple[int, np.float32]:
    """Index and total of the best sample, the first of equals.

    The index is -1 where no sample is legal or the plan is off the map.

    Args:
        sampling: how trajectories are made.
        terms: what the critics score.
        situation: where.
        guess: index of a sample that is likely to be good.
        command: (3,) room for its vx, vy and yaw rate; written, for numba takes microseconds to
            return an array.
    """
    robot = situation.robot
    times = sampling.times
    commands = combine(robot[3:], sampling.axes, sampling.counts, sampling.speeds, times[0])
    if len(commands) == 0:
        return -1, np.float32(math.inf)
    steps = step_counts(commands, times[1], times[2], times[3])
    drive = SampledDrive(robot, commands, steps, sampling.limits, times[1])
    ends = end_poses(robot, commands, steps, drive.limits, drive.sim_time)
    best, total = choose(drive, terms, ends, situation, guess)
    if best >= 0:
        command[:] = commands[best]
    return best, total


@njit()
def choose(
    drive: SampledDrive,
    terms: Terms,
    ends: FloatArray,
    situation: Situation,
    guess: int,
) -> tuple[int, np.float32]:
    """Index and total of the best trajectory, the first of equals; -1: none is legal.

    Each is examined only as long as it may win: first the least that its end (``ends``) costs, then
    all that its end costs, then whether all its poses are legal. Totals are rounded to float32
    critic by critic, so that the bounds are lower bounds of them.
    """
    kinds = terms.kinds
    noses = terms.noses
    scales = terms.scales
    path = plan_cells(situation.plan, situation)
    seeds = [seeds_of(kinds[c], noses[c], path, situation) for c in range(len(kinds))]
    for c in range(len(kinds)):
        if kinds[c] >= PATH_DISTANCE and seeds[c].shape[1] == 0:
            return -1, np.float32(math.inf)
    cells = np.empty((len(kinds), 2, ends.shape[1]), dtype=np.int32)
    raw = score_ends(ends, terms, seeds, situation, cells)
    bounds = add_weighted(raw, scales)
    best = -1
    least = np.float32(math.inf)
    likely = (guess, int(bounds.argmin()))
    for i in range(-2, len(bounds)):
        k = i
        if i < 0:
            k = likely[i]
        if not 0 <= k < len(bounds) or bounds[k] > least or bounds[k] == math.inf:
            continue
        complete(k, kinds, ends, seeds, situation, cells, raw)
        total = add_weighted(raw[:, k : k + 1], scales)[0]
        if total == math.inf or total > least or (total == least and k >= best):
            continue
        if is_legal(drive, k, kinds, situation):
            best = k
            least = total
    return best, least


@njit()
def complete(
    k: int,
    kinds: IntArray,
    ends: FloatArray,
    seeds: list[CellArray],
    situation: Situation,
    cells: CellArray,
    raw: FloatArray,
) -> None:
    """Write the raw scores of end ``k`` that :func:`score_ends` leaves out."""
    for c in range(len(kinds)):
        if kinds[c] == PATH_DISTANCE or kinds[c] == PATH_ALIGNMENT:
            raw[c, k] = 0.0
            add_distances(cells[c, :, k : k + 1], seeds[c], raw[c, k : k + 1])
        elif kinds[c] == OUTLINE_COST:
            raw[c, k] = outline_score(ends[0, k], ends[1, k], ends[2, k], situation)


@njit()
def score_ends(
    ends: FloatArray,
    terms: Terms,
    seeds: list[CellArray],
    situation: Situation,
    cells: CellArray,
) -> FloatArray:
    """The least that ends (5, K) may score (C, K); inf: the end is illegal.

    The cells (C, 2, K) that critics look at are written.
    """
    raw = np.zeros((len(terms.kinds), ends.shape[1]))
    for c in range(len(raw)):
        kind = terms.kinds[c]
        first = 0
        while terms.noses[first] != terms.noses[c]:
            first += 1
        if first < c:
            cells[c] = cells[first]
        else:
            locate(ends, terms.noses[c], situation, cells[c])
        if kind == GIVEN:
            raw[c] = terms.given[c]
        elif kind != OUTLINE_COST:
            read_map(kind, ends, cells[c], situation, raw[c])
        if kind == GOAL_DISTANCE or kind == GOAL_ALIGNMENT:
            add_distances(cells[c], seeds[c], raw[c])
    return raw


@njit()
def is_legal(drive: SampledDrive, k: int, kinds: IntArray, situation: Situation) -> bool:
    """Whether all poses of trajectory ``k`` are legal to all critics."""
    poses = np.zeros((5, drive.steps[k] + 1))
    roll_out(
        drive.robot[:3],
        drive.robot[3:],
        drive.commands[k : k + 1],
        drive.limits,
        drive.steps[k : k + 1],
        drive.sim_time,
        poses[0:1],
        poses[1:2],
        poses[2:3],
        np.empty((1, 3)),
    )
    cells = np.empty((2, poses.shape[1]), dtype=np.int32)
    scores = np.zeros(poses.shape[1])
    locate(poses, 0.0, situation, cells)
    for kind in kinds:
        if CELL_COST <= kind <= GOAL_DISTANCE:
            read_map(kind, poses, cells, situation, scores)
            if scores.max() == math.inf:
                return False
    return True
