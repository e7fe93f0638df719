"""The filter of two models: filterpy's equations, and people who turn sharply."""

import dataclasses
import math

import numpy as np
import pytest
from filterpy.common import Q_discrete_white_noise
from filterpy.kalman import IMMEstimator, KalmanFilter
from numpy.random import default_rng
from pytest import approx
from scipy.linalg import expm

from navstack.errors import ParameterError
from navstack.params.tracker import TrackerParams
from navstack.perception.maneuvering_filter import ManeuveringFilter
from navstack.perception.track_filter import TrackFilter, motion_of
from navstack.perception.tracker import Tracker
from navstack.types import Pose2D

from . import test_tracker as scans

STRAIGHT = 0.7
TURNING = 5.0
BETWEEN = 8.0
LASTING = 0.7
DT = 0.1


def filterpys(place: tuple[float, float], variance: float) -> IMMEstimator:
    """The same filter of one body, of filterpy."""
    models = []
    for deviation in (STRAIGHT, TURNING):
        step, noise = motion_of(DT, deviation**2)
        model = KalmanFilter(dim_x=4, dim_z=2)
        model.x = np.array((*place, 0.0, 0.0))
        model.P = np.diag((variance, variance, 1.0, 1.0))
        model.F = step
        model.Q = noise
        model.H = np.eye(2, 4)
        model.R = variance * np.eye(2)
        models.append(model)
    rates = np.array(((-1.0 / BETWEEN, 1.0 / BETWEEN), (1.0 / LASTING, -1.0 / LASTING)))
    begin = np.array((BETWEEN, LASTING)) / (BETWEEN + LASTING)
    return IMMEstimator(models, begin, expm(rates * DT))


def test_it_equals_filterpys() -> None:
    rng = default_rng(2)
    ours = ManeuveringFilter(
        TrackFilter(STRAIGHT, 1.0), TrackFilter(TURNING, 1.0), BETWEEN, LASTING
    )
    variance = 0.05**2
    path = np.cumsum(rng.normal((0.12, 0.0), 0.03, (40, 2)), axis=0)
    path[20:, 1] += 0.12 * np.arange(20)  # turns
    ours.add(path[:1], np.full(1, variance))
    theirs = filterpys(tuple(path[0]), variance)
    body = np.zeros(1, dtype=np.int64)
    noise = np.full(1, variance)
    for place in path[1:]:
        ours.predict(DT)
        theirs.predict()
        ours.update(body, place[None], noise)
        theirs.update(place)
        assert ours.states[0] == approx(theirs.x, abs=1e-9)
        assert ours.covariances[0] == approx(theirs.P, abs=1e-9)


def test_the_noise_of_a_step_is_filterpys() -> None:
    for duration in (0.0, 0.1, 0.37):
        expected = Q_discrete_white_noise(
            2, duration, STRAIGHT**2, block_size=2, order_by_dim=False
        )
        assert np.array_equal(motion_of(duration, STRAIGHT**2)[1], expected)


def test_bodies_do_not_mix() -> None:
    alone, among = (
        ManeuveringFilter(TrackFilter(STRAIGHT, 1.0), TrackFilter(TURNING, 1.0), BETWEEN, LASTING)
        for _ in range(2)
    )
    places = np.array(((0.0, 0.0), (5.0, 5.0), (9.0, 1.0)))
    noise = np.full(3, 0.01)
    alone.add(places[1:2], noise[:1])
    among.add(places, noise)
    for _ in range(3):
        for each, body in ((alone, 0), (among, 1)):
            each.predict(DT)
            each.update(np.array((body,)), places[1:2] + 0.1, noise[:1])
    among.keep(np.array((False, True, False)))
    assert len(among) == 1
    assert among.states == approx(alone.states)
    later, spread = among.ahead(np.zeros(1, dtype=np.int64), 0.5)
    assert later[0, :2] == approx(among.states[0, :2] + 0.5 * among.states[0, 2:])
    assert np.linalg.eigvalsh(spread[0]).min() > np.linalg.eigvalsh(among.covariances[0]).min()


def test_a_sharp_turn_is_seen_sooner_and_straight_walks_are_as_exact(watch) -> None:
    """A person of 1.3 m/s turns by 75 degrees within 0.2 s.

    Errors of the place one second ahead in the 2 s after.
    """
    one = watch(TrackerParams())
    two = watch(TrackerParams(turning_acceleration_std=TURNING, min_hits=2))
    assert two.ahead < 0.6 * one.ahead
    assert two.straight < 1.3 * one.straight


def test_parameters_of_a_turn_are_checked() -> None:
    assert TrackerParams(turning_acceleration_std=0.0).turning_acceleration_std == 0.0
    with pytest.raises(ParameterError, match="turning_acceleration_std -1.0 must be 0 or more"):
        TrackerParams(turning_acceleration_std=-1.0)
    with pytest.raises(ParameterError, match="turning_time 0.0 must be more than 0"):
        TrackerParams(turning_time=0.0)


@pytest.fixture
def watch():
    """Lets a tracker watch somebody who turns.

    Mean errors of the velocity before, and one second ahead after.
    """

    class Errors:
        def __init__(self, straight: float, ahead: float) -> None:
            self.straight = straight
            self.ahead = ahead

    def _watch(params: TrackerParams) -> Errors:
        straight = []
        ahead = []
        for seed in range(6):
            rng = default_rng(seed)
            tracker = None
            place = np.array((-3.0, 3.0))
            heading = 0.0
            tracker = Tracker(params, scans.empty_map())
            for k in range(40):
                if k in (20, 21):
                    heading += math.radians(37.5)
                velocity = 1.3 * np.array((math.cos(heading), math.sin(heading)))
                place = place + velocity / scans.RATE
                scan = scans.scan_of(k / scans.RATE, Pose2D(), [tuple(place)])
                noisy = scan.ranges + rng.normal(0.0, 0.02, len(scan.ranges))
                tracker.observe(dataclasses.replace(scan, ranges=noisy), Pose2D(), Pose2D())
                found = [
                    t
                    for t in tracker.tracks(k / scans.RATE)
                    if math.hypot(t.x - place[0], t.y - place[1]) < 0.5
                ]
                if k < 10 or not found:
                    continue
                off = np.array((found[0].vx, found[0].vy)) - velocity
                if k < 20:
                    straight.append(math.hypot(*off))
                else:
                    ahead.append(math.hypot(*(np.array((found[0].x, found[0].y)) - place + off)))
        return Errors(float(np.mean(straight)), float(np.mean(ahead)))

    return _watch
