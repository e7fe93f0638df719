"""The tracker, on scans whose truth is known."""

import math

import numpy as np
import pytest
from filterpy.kalman import KalmanFilter
from numpy.random import default_rng
from numpy.testing import assert_allclose

from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import ParameterError
from navstack.geometry import compose
from navstack.params.tracker import TrackerParams
from navstack.perception.scan_clusters import belongs, find_bodies, is_hidden
from navstack.perception.track_filter import TrackFilter, motion_of
from navstack.perception.tracker import Tracker
from navstack.types import LaserScan, Pose2D, Track

BEAMS = 360
RADIUS = 0.3
RATE = 10.0
INCREMENT = 2.0 * math.pi / BEAMS
MOUNT = Pose2D(-0.2, 0.1, 0.3)


def empty_map(*walls: tuple[slice, slice]) -> OccupancyGrid:
    """20 x 20 m about the origin, free but for walls given as rows and columns of 5 cm."""
    data = np.zeros((400, 400), dtype=np.int8)
    for wall in walls:
        data[wall] = 100
    return OccupancyGrid(data, 0.05, Pose2D(-10.0, -10.0, 0.0))


def scan_of(
    stamp: float,
    base: Pose2D,
    circles: list[tuple[float, float]],
    wall_x: float = math.inf,
) -> LaserScan:
    """What a lidar sees of circles of 0.3 m and of a wall along the y axis, from its true pose."""
    sensor = compose(base, MOUNT)
    angles = -math.pi + INCREMENT * np.arange(BEAMS) + sensor.yaw
    ranges = np.full(BEAMS, np.inf)
    with np.errstate(divide="ignore"):
        to_wall = (wall_x - sensor.x) / np.cos(angles)
    ranges = np.where(to_wall > 0.0, np.minimum(ranges, to_wall), ranges)
    for x, y in circles:
        along = (x - sensor.x) * np.cos(angles) + (y - sensor.y) * np.sin(angles)
        across = -(x - sensor.x) * np.sin(angles) + (y - sensor.y) * np.cos(angles)
        is_hit = (np.abs(across) < RADIUS) & (along > 0.0)
        reach = along - np.sqrt(np.maximum(RADIUS**2 - across**2, 0.0))
        ranges = np.where(is_hit, np.minimum(ranges, reach), ranges)
    return LaserScan(stamp, ranges, -math.pi, INCREMENT, 0.05, 30.0, MOUNT)


def follow(
    tracker: Tracker,
    seconds: float,
    place_of,
    base_of=lambda t: Pose2D(),
    **scene,
) -> list[Track]:
    """Let the tracker watch bodies; ``place_of`` gives their centres at a time."""
    tracks: list[Track] = []
    for k in range(round(seconds * RATE) + 1):
        stamp = k / RATE
        base = base_of(stamp)
        tracker.observe(scan_of(stamp, base, place_of(stamp), **scene), base, base)
        tracks = tracker.tracks(stamp)
    return tracks


def test_a_walking_person_is_followed_with_its_velocity() -> None:
    tracks = follow(
        Tracker(TrackerParams(), empty_map()), 4.0, lambda t: [(-3.0 + 1.2 * t, 3.0 - 0.5 * t)]
    )
    assert len(tracks) == 1
    track = tracks[0]
    assert math.hypot(track.x - 1.8, track.y - 1.0) < 0.08
    assert math.hypot(track.vx - 1.2, track.vy + 0.5) < 0.15
    assert track.radius == RADIUS
    assert np.linalg.eigvalsh(track.covariance).min() > 0.0


def test_a_standing_person_has_no_speed_though_the_robot_turns_and_drives() -> None:
    tracks = follow(
        Tracker(TrackerParams(), empty_map()),
        4.0,
        lambda t: [(4.0, 1.0)],
        lambda t: Pose2D(0.6 * t, 0.0, 0.8 * t),
    )
    assert len(tracks) == 1
    assert math.hypot(tracks[0].vx, tracks[0].vy) < 0.15


def test_what_the_map_shows_is_no_body() -> None:
    wall = (slice(None), slice(260, 264))  # x = 3 m
    scene = {"wall_x": 3.05}
    assert follow(Tracker(TrackerParams(), empty_map(wall)), 1.0, lambda t: [], **scene) == []
    seen = follow(
        Tracker(TrackerParams(), empty_map(wall)), 1.0, lambda t: [(1.5, 0.2 * t)], **scene
    )
    assert [round(track.x, 1) for track in seen] == [1.5]
    # A wall that no map shows is too wide for a body.
    assert follow(Tracker(TrackerParams(), empty_map()), 1.0, lambda t: [], **scene) == []


def test_people_keep_their_identities_where_they_cross_and_behind_each_other() -> None:
    def places(t: float) -> list[tuple[float, float]]:
        return [(-2.0 + t, 2.0), (2.0 - t, 3.5)]

    tracker = Tracker(TrackerParams(), empty_map())
    before = {t.id: math.copysign(1.0, t.vx) for t in follow(tracker, 1.0, places)}
    after = {}
    for k in range(11, 41):
        tracker.observe(scan_of(k / RATE, Pose2D(), places(k / RATE)), Pose2D(), Pose2D())
        after = {t.id: math.copysign(1.0, t.vx) for t in tracker.tracks(k / RATE)}
    assert len(before) == 2
    assert after == before


def test_a_track_is_told_of_after_some_hits_and_ends_after_some_time() -> None:
    tracker = Tracker(TrackerParams(), empty_map())
    for k in range(3):
        assert tracker.tracks(k / RATE) == []
        tracker.observe(scan_of(k / RATE, Pose2D(), [(2.0, 0.1 * k)]), Pose2D(), Pose2D())
    (track,) = tracker.tracks(0.2)
    for k in range(3, 11):
        tracker.observe(scan_of(k / RATE, Pose2D(), []), Pose2D(), Pose2D())
        assert [t.id for t in tracker.tracks(k / RATE)] == [track.id]  # it coasts
    tracker.observe(scan_of(1.1, Pose2D(), []), Pose2D(), Pose2D())
    assert tracker.tracks(1.1) == []
    tracker.reset()
    follow(tracker, 0.5, lambda t: [(2.0, 0.0)])
    assert tracker.tracks(0.5 + TrackerParams().max_coasting)
    assert tracker.tracks(30.0) == [], "no scan has come since"
    tracker.reset()
    follow(tracker, 0.5, lambda t: [(2.0, 0.0)])
    assert [t.id for t in tracker.tracks(0.5)] == [0]


def test_a_jump_of_the_belief_gives_nobody_a_speed() -> None:
    tracker = Tracker(TrackerParams(), empty_map())
    follow(tracker, 1.0, lambda t: [(3.0, 0.0)])
    odom = Pose2D()
    jumped = Pose2D(0.5, -0.3, 0.1)  # of the belief; the robot stood still
    tracker.observe(scan_of(1.1, odom, [(3.0, 0.0)]), jumped, odom)
    (track,) = tracker.tracks(1.1)
    expected = compose(jumped, Pose2D(3.0, 0.0, 0.0))
    assert math.hypot(track.x - expected.x, track.y - expected.y) < 0.08
    assert math.hypot(track.vx, track.vy) < 0.1


def test_tracks_are_predicted_and_old_scans_left_out() -> None:
    tracker = Tracker(TrackerParams(), empty_map())
    (now,) = follow(tracker, 3.0, lambda t: [(-2.0 + t, 2.0)])
    (later,) = tracker.tracks(3.5)
    assert later.stamp == 3.5
    assert (later.x, later.y) == pytest.approx((now.x + 0.5 * now.vx, now.y + 0.5 * now.vy))
    assert later.covariance[0, 0] > now.covariance[0, 0]
    tracker.observe(scan_of(3.0, Pose2D(), [(9.0, 9.0)]), Pose2D(), Pose2D())
    tracker.observe(scan_of(1.0, Pose2D(), [(9.0, 9.0)]), Pose2D(), Pose2D())
    (same,) = tracker.tracks(3.5)
    assert same.x == later.x
    assert same.y == later.y


def test_a_person_behind_the_robot_is_one_body_though_the_scan_begins_there() -> None:
    behind = compose(MOUNT, Pose2D(-2.0, 0.0, 0.0))
    tracks = follow(Tracker(TrackerParams(), empty_map()), 1.0, lambda t: [(behind.x, behind.y)])
    assert len(tracks) == 1
    assert math.hypot(tracks[0].x - behind.x, tracks[0].y - behind.y) < 0.05


def test_the_filter_equals_filterpys() -> None:
    rng = default_rng(3)
    ours = TrackFilter(0.7, 1.0)
    theirs = []
    places = rng.normal(size=(4, 2))
    variances = rng.uniform(0.01, 0.1, 4)
    ours.add(places, variances)
    for place, variance in zip(places, variances, strict=True):
        one = KalmanFilter(dim_x=4, dim_z=2)
        one.x = np.array((*place, 0.0, 0.0))
        one.P = np.diag((variance, variance, 1.0, 1.0))
        one.H = np.eye(2, 4)
        theirs.append(one)
    for _ in range(10):
        duration = rng.uniform(0.05, 0.3)
        seen = np.flatnonzero(rng.random(4) < 0.7)
        places = rng.normal(size=(len(seen), 2))
        variances = rng.uniform(0.01, 0.1, len(seen))
        ours.predict(duration)
        distances = ours.distances(places, variances)
        ours.update(seen, places, variances)
        for one in theirs:
            one.predict(F=motion_of(duration, 0.49)[0], Q=motion_of(duration, 0.49)[1])
        for j, i in enumerate(seen):
            theirs[i].update(places[j], R=variances[j] * np.eye(2))
            assert distances[i, j] == pytest.approx(theirs[i].mahalanobis ** 2)
    for i, one in enumerate(theirs):
        assert_allclose(ours.states[i], one.x, atol=1e-9)
        assert_allclose(ours.covariances[i], one.P, atol=1e-9)


def test_the_filter_is_consistent() -> None:
    """NEES of 200 bodies, against the chi-squared distribution's 99 % interval.

    The bodies are disturbed as the filter thinks.
    """
    rng = default_rng(5)
    count = 200
    std = 0.05
    truth = np.column_stack((rng.normal(size=(count, 2)), rng.normal(size=(count, 2))))
    ours = TrackFilter(0.7, 1.0)
    variances = np.full(count, std**2)
    ours.add(truth[:, :2] + std * rng.standard_normal((count, 2)), variances)
    for _ in range(20):
        acceleration = 0.7 * rng.standard_normal((count, 2))
        truth[:, :2] += truth[:, 2:] * 0.1 + 0.5 * acceleration * 0.01
        truth[:, 2:] += acceleration * 0.1
        ours.predict(0.1)
        ours.update(
            np.arange(count), truth[:, :2] + std * rng.standard_normal((count, 2)), variances
        )
    errors = ours.states - truth
    nees = np.einsum("ni,nij,nj->n", errors, np.linalg.inv(ours.covariances), errors)
    assert 3.5 < nees.mean() < 4.5  # 4 +- 2.58 sqrt(8 / 200)


def test_parameters_that_cannot_be_are_refused() -> None:
    with pytest.raises(ParameterError, match="max_coasting -1"):
        TrackerParams(max_coasting=-1.0)
    with pytest.raises(ParameterError, match="gate nan"):
        TrackerParams(gate=math.nan)


@pytest.mark.parametrize(
    ("first", "is_closed", "hidden"),
    [(0, False, 1.0), (44, False, 1.0), (20, False, 0.0), (0, True, 0.0), (44, True, 0.0)],
)
def test_a_body_at_the_end_of_an_open_scan_may_not_be_wholly_seen(
    first: int,
    is_closed: bool,
    hidden: float,
) -> None:
    ranges = np.full(50, np.inf)
    foreground = np.zeros(50, dtype=np.bool_)
    bodies = np.empty((50, 3))
    ranges[first : first + 6] = 3.0
    foreground[first : first + 6] = True
    assert find_bodies(ranges, foreground, 0.02, is_closed, 0.25, 2, 1.0, 0.3, bodies) == 1
    assert bodies[0].tolist() == [first + 2.5, 3.3, hidden]


@pytest.mark.parametrize("increment", [0.02, -0.02])
@pytest.mark.parametrize(("beams", "found"), [(16, 1), (18, 0)])
def test_what_is_wider_than_a_body_is_none_whichever_way_the_beams_turn(
    increment: float,
    beams: int,
    found: int,
) -> None:
    ranges = np.full(50, np.inf)
    foreground = np.zeros(50, dtype=np.bool_)
    bodies = np.empty((50, 3))
    ranges[20 : 20 + beams] = 3.0
    foreground[20 : 20 + beams] = True
    assert find_bodies(ranges, foreground, increment, False, 0.25, 2, 1.0, 0.3, bodies) == found


@pytest.mark.parametrize("increment", [0.01, -0.01])
def test_neighbours_may_differ_by_the_gap_and_twice_the_arc_between_them(increment: float) -> None:
    for near, far, expected in (
        (10.0, 10.29, True),
        (10.0, 10.31, False),
        (5.0, 5.19, True),
        (5.0, 5.21, False),
    ):
        assert belongs(near, far, increment, 0.1) == belongs(far, near, increment, 0.1) == expected


@pytest.mark.parametrize(
    ("beside", "expected"), [(1.49, True), (1.5, False), (3.0, False), (math.inf, False)]
)
def test_a_group_may_go_on_behind_what_is_nearer_by_more_than_the_gap(beside, expected):
    assert is_hidden(np.array((beside, 2.0)), 0, 2.0, 0.5) == expected
