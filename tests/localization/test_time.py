"""No localizer is TRACKING while its clock, or a sensor's, keeps it blind."""

import copy
import dataclasses
import math
import warnings

import numpy as np
import pytest

from navstack.build import build_localizer
from navstack.params.nav2_file.file import load_nav2
from navstack.params.registry.localizers import LOCALIZERS
from navstack.types import Belief, Health

from .corridor import START, errors, exact, journey, with_landmarks

KINDS = ("odometry", "imu", "gps", "scan")
AT, FOR = 6.0, 6.0  # [s] when a clock fails, and for how long if it comes back
SECONDS = 20.0
BLIND = 1.0  # [m] of which no localizer may be off that says TRACKING


@pytest.fixture(scope="module")
def grid():
    return with_landmarks()


@pytest.fixture(scope="module")
def ticks(grid):
    return list(journey(grid, SECONDS, exact(0.3)))


@pytest.fixture(scope="module", params=sorted(LOCALIZERS))
def started(request, grid, ticks, tmp_path_factory):
    """A localizer that has come to ``AT``, and its beliefs and the truths until then."""
    file = tmp_path_factory.mktemp("time") / "robot.yaml"
    file.write_text("amcl: {ros__parameters: {alpha1: 0.01, alpha2: 0.005, alpha3: 0.02}}\n")
    made = build_localizer(request.param, load_nav2(file), grid)
    made.reset(Belief(START, np.diag((0.04, 0.04, 0.003))), np.random.default_rng(0))
    before = [tick for tick in ticks if tick[0].stamp < AT]
    return made, [(made.update(observation), truth) for observation, truth in before]


@pytest.fixture
def localizer(started):
    return copy.deepcopy(started[0])


def restamped(observation, change, kinds=KINDS, now=True):
    """An observation with changed stamps: of its messages of some kinds, and of itself."""
    changed = {}
    for kind in kinds:
        message = getattr(observation, kind)
        if message is not None:
            changed[kind] = dataclasses.replace(message, stamp=change(message.stamp))
    if now:
        changed["stamp"] = change(observation.stamp)
    return dataclasses.replace(observation, **changed)


@pytest.fixture
def drive(started, localizer, ticks):
    """Goes on from ``AT`` with changed stamps; gives all beliefs and truths."""

    def go_on(change, **which):
        rows = list(started[1])
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            for observation, truth in ticks[len(rows) :]:
                observation = restamped(observation, change, **which)
                rows.append((localizer.update(observation), truth))
        return rows

    return go_on


def farthest_tracking(rows):
    """How far off [m] a belief is at most that says TRACKING; infinite where one is not finite."""
    off = errors(rows)
    tracks = np.array([belief.health is Health.TRACKING for belief, _ in rows])
    if not np.isfinite(off).all():
        return math.inf
    return off[tracks].max(initial=0.0)


BACK = (-0.05, -0.3, -2.0, -4.0, -5.5, -1000.0, -1.7e9)
AHEAD = (0.05, 0.3, 2.0, 4.0, 30.0, 1e4, 1.7e9)
OF_ONE = (-1.7e9, -4.0, -0.3, 0.3, 4.0, 1.7e9)  # where each sensor is set alone


@pytest.mark.parametrize("step", BACK)
def test_a_clock_that_is_set_back_costs_nothing(drive, ticks, step):
    rows = drive(lambda stamp: stamp + step)
    assert farthest_tracking(rows) <= BLIND
    assert errors(rows).max() < 0.6
    assert rows[-1][0].health is Health.TRACKING
    assert math.isclose(rows[-1][0].stamp, ticks[-1][0].stamp + step)


def test_a_clock_that_starts_again_and_again(drive):
    rows = drive(lambda stamp: stamp % 2.5)
    assert farthest_tracking(rows) <= BLIND
    assert errors(rows).max() < 0.6


@pytest.mark.parametrize("step", AHEAD)
def test_a_clock_that_is_set_ahead(localizer, drive, step):
    rows = drive(lambda stamp: stamp + step)
    assert farthest_tracking(rows) <= BLIND
    is_reckoning = type(localizer).__name__ == "DeadReckoningLocalizer"
    if not is_reckoning:
        assert errors(rows)[-1] < 0.5
        assert rows[-1][0].health is Health.TRACKING


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("step", OF_ONE)
def test_one_sensor_whose_clock_is_set(drive, kind, step):
    assert farthest_tracking(drive(lambda stamp: stamp + step, kinds=(kind,), now=False)) <= BLIND


@pytest.mark.parametrize("step", BACK + AHEAD)
def test_all_sensors_whose_clock_is_set(drive, step):
    assert farthest_tracking(drive(lambda stamp: stamp + step, now=False)) <= BLIND


@pytest.mark.parametrize("lasts", [FOR, math.inf])
@pytest.mark.parametrize("kinds", [KINDS, (), *((kind,) for kind in KINDS)])
@pytest.mark.parametrize("now", [True, False])
def test_a_clock_that_stands(drive, kinds, now, lasts):
    def stop(stamp):
        return stamp if stamp > AT + lasts else min(stamp, AT)

    assert farthest_tracking(drive(stop, kinds=kinds, now=now)) <= BLIND


@pytest.mark.parametrize("period", [0.1, 0.5, 1.0])
def test_stamps_that_are_repeated(drive, period):
    rows = drive(lambda stamp: period * (stamp // period), now=False)
    assert farthest_tracking(rows) <= BLIND
    assert errors(rows)[-1] < BLIND
