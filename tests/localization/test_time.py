"""No localizer is TRACKING while its clock, or a sensor's, keeps it blind."""

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


@pytest.fixture(params=sorted(LOCALIZERS))
def localizer(request, grid, tmp_path):
    file = tmp_path / "robot.yaml"
    file.write_text("amcl: {ros__parameters: {alpha1: 0.01, alpha2: 0.005, alpha3: 0.02}}\n")
    made = build_localizer(request.param, load_nav2(file), grid)
    made.reset(Belief(START, np.diag((0.04, 0.04, 0.003))), np.random.default_rng(0))
    return made


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


def drive(localizer, ticks, change, **which):
    """The beliefs and truths; stamps change from ``AT`` on."""
    rows = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for observation, truth in ticks:
            if observation.stamp >= AT:
                observation = restamped(observation, change, **which)
            rows.append((localizer.update(observation), truth))
    return rows


def require_honest(rows):
    """No belief that says TRACKING is far off."""
    off = errors(rows)
    tracks = np.array([belief.health is Health.TRACKING for belief, _ in rows])
    assert np.isfinite(off).all()
    assert not (tracks & (off > BLIND)).any(), off[tracks].max()


BACK = (-0.05, -0.3, -2.0, -4.0, -5.5, -1000.0, -1.7e9)
AHEAD = (0.05, 0.3, 2.0, 4.0, 30.0, 1e4, 1.7e9)


@pytest.mark.parametrize("step", BACK)
def test_a_clock_that_is_set_back_costs_nothing(localizer, ticks, step):
    rows = drive(localizer, ticks, lambda stamp: stamp + step)
    require_honest(rows)
    assert errors(rows).max() < 0.6
    assert rows[-1][0].health is Health.TRACKING
    assert math.isclose(rows[-1][0].stamp, ticks[-1][0].stamp + step)


def test_a_clock_that_starts_again_and_again(localizer, ticks):
    rows = drive(localizer, ticks, lambda stamp: stamp % 2.5)
    require_honest(rows)
    assert errors(rows).max() < 0.6


@pytest.mark.parametrize("step", AHEAD)
def test_a_clock_that_is_set_ahead(localizer, ticks, step):
    rows = drive(localizer, ticks, lambda stamp: stamp + step)
    require_honest(rows)
    is_reckoning = type(localizer).__name__ == "DeadReckoningLocalizer"
    if not is_reckoning:
        assert errors(rows)[-1] < 0.5
        assert rows[-1][0].health is Health.TRACKING


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("step", BACK + AHEAD)
def test_one_sensor_whose_clock_is_set(localizer, ticks, kind, step):
    require_honest(drive(localizer, ticks, lambda stamp: stamp + step, kinds=(kind,), now=False))


@pytest.mark.parametrize("step", BACK + AHEAD)
def test_all_sensors_whose_clock_is_set(localizer, ticks, step):
    require_honest(drive(localizer, ticks, lambda stamp: stamp + step, now=False))


@pytest.mark.parametrize("lasts", [FOR, math.inf])
@pytest.mark.parametrize("kinds", [KINDS, (), *((kind,) for kind in KINDS)])
@pytest.mark.parametrize("now", [True, False])
def test_a_clock_that_stands(localizer, ticks, kinds, now, lasts):
    def stop(stamp):
        return stamp if stamp > AT + lasts else min(stamp, AT)

    require_honest(drive(localizer, ticks, stop, kinds=kinds, now=now))


@pytest.mark.parametrize("period", [0.1, 0.5, 1.0])
def test_stamps_that_are_repeated(localizer, ticks, period):
    rows = drive(localizer, ticks, lambda stamp: period * (stamp // period), now=False)
    require_honest(rows)
    assert errors(rows)[-1] < BLIND
