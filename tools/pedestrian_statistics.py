"""What recorded people do: how fast they walk, how far from each other, how predictable they are.

Works on a :class:`Recording` whose people are sampled at common times, real or simulated.
"""

import itertools
from collections.abc import Iterator

import numpy as np

from harness.world.people.replay_file import Recording
from navstack.types import BoolArray, FloatArray, IntArray

# [m] 7 feet, within which people count as together (McPhail & Wohlstein 1983)
COMPANY_DISTANCE = 2.13
COMPANY_SHARE = 0.8  # of their common time that companions spend within it
SAME_PLACE = 0.3  # [m] between two centres that were at the same place
LONGEST_PET = 5.0  # [s] beyond which nobody encroaches on anybody
COMPANY_TIME = 5.0  # [s] common time at least


def record_states(states: FloatArray, period: float, window: tuple[float, float]) -> Recording:
    """Simulated people, as a camera sees them that looks at a part of the x axis.

    Args:
        states: (T, n, >= 2) x, y [m] of everybody.
        period: [s] between them.
        window: [m] from where to where along x; who leaves it and comes back is somebody new.
    """
    times = np.arange(len(states)) * period
    firsts, kept_times, kept_positions = [0], [], []
    for person in range(states.shape[1]):
        positions = states[:, person, :2]
        inside = np.concatenate(
            ([False], (window[0] <= positions[:, 0]) & (positions[:, 0] <= window[1]), [False])
        )
        edges = np.flatnonzero(np.diff(inside.astype(np.int8))).reshape(-1, 2)
        for begin, end in edges.tolist():
            firsts.append(firsts[-1] + end - begin)
            kept_times.append(times[begin:end])
            kept_positions.append(positions[begin:end])
    return Recording(np.array(firsts), np.concatenate(kept_times), np.concatenate(kept_positions))


def walking_speeds(recording: Recording) -> FloatArray:
    """Speeds (N,) [m/s] between consecutive samples of all people."""
    speeds = []
    for times, positions in _people(recording):
        speeds.append(np.hypot(*np.diff(positions, axis=0).T) / np.diff(times))
    return np.concatenate(speeds)


def separations(recording: Recording, period: float) -> FloatArray:
    """Distance (N,) [m] from each sample to the nearest person who is no companion.

    Args:
        recording: sampled every ``period`` [s].
        period: [s].
    """
    owners = np.repeat(np.arange(recording.count), np.diff(recording.firsts))
    ticks = np.rint(recording.times / period).astype(np.int64)
    together = companions(recording, period)
    found = []
    for tick in np.unique(ticks):
        now = np.flatnonzero(ticks == tick)
        if len(now) > 1:
            offsets = recording.positions[now, None] - recording.positions[now]
            distances = np.hypot(offsets[..., 0], offsets[..., 1])
            distances[together[np.ix_(owners[now], owners[now])]] = np.inf
            found.append(distances.min(axis=1))
    nearest = np.concatenate(found)
    apart: FloatArray = nearest[np.isfinite(nearest)]
    return apart


def companions(recording: Recording, period: float) -> BoolArray:
    """Who walks in company, (n, n) bool: near each other for most of their common time.

    Everybody with himself.
    """
    together = np.eye(recording.count, dtype=np.bool_)
    ticks = [np.rint(times / period).astype(np.int64) for times, _ in _people(recording)]
    places = [positions for _, positions in _people(recording)]
    for i, j in itertools.combinations(range(recording.count), 2):
        if ticks[i][0] > ticks[j][-1] or ticks[j][0] > ticks[i][-1]:
            continue
        _, a, b = np.intersect1d(ticks[i], ticks[j], assume_unique=True, return_indices=True)
        near = np.hypot(*(places[i][a] - places[j][b]).T) < COMPANY_DISTANCE
        together[i, j] = together[j, i] = (
            len(a) * period >= COMPANY_TIME and near.mean() >= COMPANY_SHARE
        )
    return together


def post_encroachment_times(recording: Recording, period: float) -> FloatArray:
    """Times (N,) [s] after which somebody is where another was, of all pairs of strangers.

    Of each pair the least time between samples that are within :data:`SAME_PLACE`, up to
    :data:`LONGEST_PET` (Allen, Shin & Cooper 1978; between people as in the literature on
    crossings: of bodies, not of their edges).
    """
    together, found = companions(recording, period), []
    people = [_refined(times, positions) for times, positions in _people(recording)]
    for i, j in itertools.combinations(range(recording.count), 2):
        (times, places), (others, elsewhere) = people[i], people[j]
        if (
            together[i, j]
            or times[0] > others[-1] + LONGEST_PET
            or others[0] > times[-1] + LONGEST_PET
        ):
            continue
        apart = np.hypot(*(places[:, None] - elsewhere).transpose(2, 0, 1))
        after = np.abs(times[:, None] - others)[apart <= SAME_PLACE]
        if after.size and after.min() <= LONGEST_PET:
            found.append(float(after.min()))
    return np.array(found)


def _refined(times: FloatArray, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same way with a sample every tenth of a second, between samples straight."""
    fine = np.arange(times[0], times[-1], 0.1) if len(times) > 1 else times
    return fine, np.column_stack([np.interp(fine, times, positions[:, axis]) for axis in (0, 1)])


def prediction_errors(
    recording: Recording,
    observed: int = 8,
    predicted: int = 12,
) -> tuple[float, float, int]:
    """Errors of "goes on as in the last step", over all windows of samples.

    Returns:
        Average and final displacement error (ADE, FDE) [m], and the number of windows.
    """
    errors = []
    for _, positions in _people(recording):
        for start in range(len(positions) - observed - predicted + 1):
            now = start + observed - 1
            steps = np.arange(1, predicted + 1)[:, None]
            guess = positions[now] + steps * (positions[now] - positions[now - 1])
            errors.append(np.hypot(*(guess - positions[now + 1 : now + 1 + predicted]).T))
    table = np.array(errors)
    return float(table.mean()), float(table[:, -1].mean()), len(table)


def mean_presence(recording: Recording, period: float) -> float:
    """How many people are there on average, over the times with anybody."""
    ticks: IntArray = np.unique(np.rint(recording.times / period), return_counts=True)[1]
    return float(ticks.mean())


def _people(recording: Recording) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Times (m,) [s] and positions (m, 2) [m] of one after the other."""
    for first, last in itertools.pairwise(recording.firsts):
        yield recording.times[first:last], recording.positions[first:last]
