"""The seconds before a moment: what was decided, believed, seen and done, put side by side."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.explain.activities import STANDING
from harness.explain.brains import Weighed
from harness.explain.evidence import Evidence
from harness.explain.moments import Moment
from harness.metrics.columns import Row
from harness.metrics.encounters import in_base_frame, surface_distances
from harness.metrics.ghost_tracks import in_true_frame
from harness.metrics.motion import wrapped
from navstack.errors import InputError
from navstack.types import FloatArray, IntArray

STEP = 0.5  # [s] between the instants that are told
LEAST, MOST = 5.0, 20.0  # [s] that are told where nobody says how many
ON_ITS_WAY = 1.0  # [s] that are told of how it drove before it was held up
SAME_BODY = 0.75  # [m] between a track and a person's centre, up to which the track is the person's
ABSENT, FARTHEST = 1e9, 1e6  # [m] where who is absent stands, and beyond which nobody is
NEAR = 10.0  # [m] beyond which nobody matters
# [s] before the moment the decision is looked at: later than that, hardly any would have helped
A_SECOND = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Seconds:
    """The seconds before a moment: arrays with an entry per trace time, the last at the moment."""

    moment: Moment
    since: float  # [s]
    at: FloatArray  # (m,) [s] relative to the moment
    robot: FloatArray  # (m, 3) true pose: x, y [m], yaw [rad]
    speed: FloatArray  # (m,) [m/s] true, ahead
    command: FloatArray  # (m, 2) [m/s], [rad/s] to the wheels
    position_error: FloatArray  # (m,) [m] of the belief at the last decision; NaN: nobody decides
    heading_error: FloatArray  # (m,) [rad]
    decided_at: FloatArray  # (k,) [s] of the decisions relative to the moment
    # (k,) [m] that the believed position was off then; instants of the trace come with the
    decided_off: FloatArray
    # fixes of a GPS, so that their mean would be too good
    person: int | None  # who was touched, else the nearest; None: nobody was near
    people: FloatArray  # (m, n, 2) [m]
    # (m,) [m] between robot and that person; NaN: there is none, or it is absent
    distance: FloatArray
    closing: FloatArray  # (m,) [m/s] at which that distance shrinks
    track_error: FloatArray  # (m,) [m] between the person and its track; NaN: none
    tracks: tuple[FloatArray, ...]  # m arrays (k, 2) [m]: tracks where the robot truly sees them
    shaking: FloatArray  # (m,) [m/s2] horizontal acceleration, ahead and sideways
    pieces_lost: FloatArray  # (m,)
    decisions: tuple[Row, ...]  # of these seconds
    weighed: Weighed | None  # of the whole delivery; None: not recorded

    def instants(self) -> list[int]:
        """Places in the arrays every :data:`STEP` back from the moment, in order of time."""
        wanted = np.arange(0.0, self.moment.stamp - self.since + 1e-6, STEP)
        return sorted({int(np.abs(self.at + back).argmin()) for back in wanted})

    def decision_at(self, at: float) -> Row | None:
        """The last decision by a time [s] relative to the moment; None: there was none."""
        stamp = self.moment.stamp + at + 1e-6
        return next((row for row in reversed(self.decisions) if row["stamp_s"] <= stamp), None)

    @property
    def telling(self) -> Row | None:
        """The last scored decision about :data:`A_SECOND` back, else the first that is scored."""
        scored = [row for row in self.decisions if row["samples"]]
        until = self.moment.stamp + float(self.at[int(np.abs(self.at + A_SECOND).argmin())]) + 1e-6
        early = [row for row in scored if row["stamp_s"] <= until]
        if early:
            return early[-1]
        if scored:
            return scored[0]
        return None

    @property
    def tracked_since(self) -> float | None:
        """Since when [s] before the moment a track has been with the person without a gap.

        None: none is.
        """
        lost = np.flatnonzero(np.isnan(self.track_error))
        first = 0
        if len(lost):
            first = int(lost[-1]) + 1
        if first == len(self.at):
            return None
        return float(-self.at[first])


def since_cause(evidence: Evidence, moment: Moment) -> float:
    """Seconds before a moment from which on they are told: :data:`LEAST` to :data:`MOST`.

    They begin before the robot was held up: since then it has stood or reversed, with less than
    :data:`LEAST` seconds of driving in between.
    """
    stamps, speed = evidence.stamps, evidence.trace[:, 4]
    held = stamps[(speed <= STANDING) & (stamps <= moment.stamp)]
    known = np.append(held, moment.stamp)
    drives = np.flatnonzero(np.diff(known) > LEAST)
    first = 0
    if len(drives):
        first = int(drives[-1]) + 1
    return float(np.clip(moment.stamp - known[first] + ON_ITS_WAY, LEAST, MOST))


def seconds_before(evidence: Evidence, moment: Moment, before: float | None = None) -> Seconds:
    """The record of the ``before`` seconds that led to a moment; fewer where it came earlier.

    None: those of :func:`since_cause`.

    Raises:
        InputError: the delivery was over at once.
    """
    if before is None:
        before = since_cause(evidence, moment)
    since = max(moment.stamp - before, 0.0)
    stamps = evidence.stamps
    if len(stamps) < 2:
        raise InputError(
            "the delivery was over within 0.1 s: no seconds before that can be told; check its "
            "start"
        )
    inside = np.flatnonzero((stamps >= since - 1e-6) & (stamps <= moment.stamp + 1e-6))
    if len(inside) < 2:
        inside = np.arange(2, dtype=np.int64)
    trace, people = evidence.trace[inside], evidence.crowd[inside]
    distances = _distances(evidence, inside)
    person = moment.person
    if person is None:
        person = _nearest(distances)
    distance, place = np.full(len(inside), np.nan), np.full((len(inside), 2), np.nan)
    if person is not None:
        distance, place = distances[:, person], people[:, person]
    tracks = _true_tracks(evidence, inside)
    decisions = tuple(
        row for row in evidence.decisions if since - 1e-6 <= row["stamp_s"] <= moment.stamp + 1e-6
    )
    decided, errors = _errors(evidence)
    error = errors[np.maximum(np.searchsorted(decided, trace[:, 0] + 1e-6) - 1, 0)]
    within = (decided >= since - 1e-6) & (decided <= moment.stamp + 1e-6)
    return Seconds(
        moment=moment,
        since=since,
        at=trace[:, 0] - moment.stamp,
        robot=trace[:, 1:4],
        speed=trace[:, 4],
        command=trace[:, 9:11],
        position_error=error[:, 0],
        heading_error=error[:, 1],
        decided_at=decided[within] - moment.stamp,
        decided_off=errors[within, 0],
        person=person,
        people=people,
        distance=distance,
        closing=-np.gradient(distance, trace[:, 0]),
        track_error=_track_errors(tracks, place),
        tracks=tracks,
        shaking=np.hypot(np.gradient(trace[:, 4], trace[:, 0]), trace[:, 4] * trace[:, 5]),
        pieces_lost=evidence.pieces_lost[inside],
        decisions=decisions,
        weighed=evidence.weighed,
    )


def _distances(evidence: Evidence, inside: IntArray) -> FloatArray:
    """Distance (m, n) [m] between the bodies of robot and people; NaN: of who is absent."""
    trace, people = evidence.trace[inside], evidence.crowd[inside]
    rows, number = people.shape[:2]
    if not number:
        return np.empty((rows, 0))
    robot = np.zeros((rows * number, 7))
    robot[:, 1:4] = np.repeat(trace[:, 1:4], number, axis=0)
    flat = np.zeros((rows * number, 4))
    flat[:, :2] = np.nan_to_num(people.reshape(-1, 2), nan=ABSENT, posinf=ABSENT, neginf=-ABSENT)
    distances = surface_distances(in_base_frame(robot, flat), evidence.body).reshape(rows, number)
    return np.where(distances < FARTHEST, distances, np.nan)


def _nearest(distances: FloatArray) -> int | None:
    """Who came nearest (m, n); None: nobody within :data:`NEAR`."""
    known = np.nan_to_num(distances, nan=np.inf)
    if not known.size or known.min() > NEAR:
        return None
    return int(known.min(axis=0).argmin())


def _errors(evidence: Evidence) -> tuple[FloatArray, FloatArray]:
    """Times of decisions (k,) [s], and errors of position [m] and heading [rad] then (k, 2).

    A belief is compared with the true pose of its own time, which lies between two rows of the
    trace. Where nobody decides there is one entry, of NaN.
    """
    rows = evidence.decisions
    if not rows:
        return np.full(1, np.nan), np.full((1, 2), np.nan)
    keys = ("stamp_s", "believed_x_m", "believed_y_m", "believed_yaw_rad")
    believed = np.array([[row[key] for key in keys] for row in rows])
    times = believed[:, 0]
    trace = evidence.trace
    x = np.interp(times, trace[:, 0], trace[:, 1])
    y = np.interp(times, trace[:, 0], trace[:, 2])
    yaw = np.interp(times, trace[:, 0], np.unwrap(trace[:, 3]))
    off = np.hypot(believed[:, 1] - x, believed[:, 2] - y)
    turned = np.abs(wrapped(believed[:, 3] - yaw))
    return times, np.column_stack((off, turned))


def _true_tracks(evidence: Evidence, inside: IntArray) -> tuple[FloatArray, ...]:
    """Tracks (k, 2) [m] moved from the believed map frame to the true one."""
    moved = []
    for place in inside.tolist():
        row = evidence.trace[place]
        moved.append(in_true_frame(evidence.tracks[place][:, 1:3], row[6:9], row[1:4]))
    return tuple(moved)


def _track_errors(tracks: Sequence[FloatArray], person: FloatArray) -> FloatArray:
    """Distance (m,) [m] between a person (m, 2) and the nearest track.

    NaN: none is near enough to be the person's.
    """
    nearest = [
        np.hypot(*(seen - at).T).min(initial=np.inf)
        for seen, at in zip(tracks, person, strict=True)
    ]
    return np.where(np.array(nearest) <= SAME_BODY, nearest, np.nan)
