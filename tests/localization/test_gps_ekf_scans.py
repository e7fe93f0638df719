"""The GPS-EKF whose pose scans correct: by how much, and whether it knows how well."""

import dataclasses
from functools import lru_cache

import numpy as np
import pytest
from scipy.stats import chi2

from harness.world.sensors.noise import GaussMarkov
from navstack.geometry import normalize_angle
from navstack.localization.gps_ekf import GpsEkfLocalizer
from navstack.params.gps_ekf import GpsEkfParams
from navstack.types import Belief, Observation, Pose2D

from .gps_ekf_runs import off
from .made_up_scans import map_of, scan_of

SECONDS, SEEDS = 12.0, 12
SCAN_EVERY = 3  # ticks
# houses with gaps between them on both sides of the drive, and something in front
STREET = tuple((x, y, x + 4.5, y + 2.0) for x in (-6.0, 0.5, 7.0, 13.5) for y in (-6.0, 7.0)) + (
    (17.0, -4.0, 18.0, 5.0),
    (5.0, -3.0, 5.6, -2.4),
)
GRID = map_of(STREET)
STD = (0.1, 0.1, 0.02)  # [m, m, rad] of the start
SURVEYED = 0.05  # [m] by which each house stands elsewhere than on the map, along x and y


@lru_cache(maxsize=4)
def scans(drive, seed: int):
    """A drive whose fixes have an error that lasts, half of which they state, with its scans."""
    observations, truth = drive(seed, SECONDS)
    rng = np.random.default_rng((5, seed))
    multipath = GaussMarkov(rng, 2, 10.0)
    shifts = SURVEYED * rng.standard_normal((len(STREET), 2))
    houses = np.array(STREET) + np.tile(shifts, 2)
    seen: list[Observation] = []
    for i, (each, body) in enumerate(zip(observations, truth, strict=True)):
        fix, scan = each.gps, None
        if fix is not None:
            x, y = 0.4 * np.array(multipath.at(each.stamp))
            fix = dataclasses.replace(fix, x=fix.x + x, y=fix.y + y, position_std=0.2)
        if i % SCAN_EVERY == 0:
            base = Pose2D(body.x, body.y, body.yaw)
            scan = scan_of(houses, base, rng, [(body.x + 1.5, body.y - 1.0)], each.stamp)
        seen.append(dataclasses.replace(each, gps=fix, scan=scan))
    return seen, truth


def beliefs_of(observations, seed, **params):
    """What is believed tick by tick, from a start that is a little off."""
    localizer = GpsEkfLocalizer(dataclasses.replace(GpsEkfParams(), **params), GRID)
    covariance = np.diag(np.square(STD))
    start = np.random.default_rng((6, seed)).multivariate_normal(np.zeros(3), covariance)
    localizer.reset(Belief(Pose2D(*start), covariance), np.random.default_rng(0))
    return [localizer.update(each) for each in observations]


def squares_of(beliefs, truth):
    """Normalised squared errors of x, y and yaw (ticks,)."""
    found = []
    for belief, body in zip(beliefs, truth, strict=True):
        pose = belief.pose
        error = np.array((pose.x - body.x, pose.y - body.y, normalize_angle(pose.yaw - body.yaw)))
        found.append(error @ np.linalg.solve(belief.covariance, error))
    return found


def test_scans_correct_the_pose_that_fixes_get_wrong(drive):
    errors = {True: [], False: []}
    for seed in range(3):
        observations, truth = scans(drive, seed)
        for aligns, found in errors.items():
            beliefs = beliefs_of(observations, seed, scan0_alignment=aligns)
            found += [off(*pair) for pair in zip(beliefs, truth, strict=True)]
    assert np.mean(errors[False]) > 0.15
    assert np.mean(errors[True]) < 0.08
    assert np.max(errors[True]) < 0.25


@pytest.mark.slow
def test_errors_are_as_large_as_the_filter_says_with_scans(drive):
    squares = []
    for seed in range(SEEDS):
        observations, truth = scans(drive, seed)
        squares.append(squares_of(beliefs_of(observations, seed, scan0_alignment=True), truth))
    mean = np.mean(squares) / 3.0
    assert 0.3 < mean < 1.5
    assert (np.array(squares) < chi2.ppf(0.95, 3)).mean() > 0.9


@pytest.mark.parametrize(
    ("aligns", "sees", "stays"), [(True, True, True), (True, False, False), (False, True, False)]
)
def test_fixes_that_err_for_long_are_believed_only_where_no_scan_fits(drive, aligns, sees, stays):
    observations, truth = scans(drive, 0)
    wrong = []
    for each in observations:
        if each.gps is not None and each.stamp > 4.0:
            each = dataclasses.replace(each, gps=dataclasses.replace(each.gps, x=each.gps.x + 6.0))
        if not sees and each.stamp > 4.0:
            each = dataclasses.replace(each, scan=None)
        wrong.append(each)
    errors = [
        off(*pair) for pair in zip(beliefs_of(wrong, 0, scan0_alignment=aligns), truth, strict=True)
    ]
    assert (max(errors) < 0.3) is stays
    assert (max(errors) > 4.0) is not stays


@pytest.mark.parametrize("aligns", [False, True])
def test_scans_count_only_where_the_file_says_so(drive, aligns):
    observations, _ = scans(drive, 0)
    blind = [dataclasses.replace(each, scan=None) for each in observations]
    with_scans, without = (
        beliefs_of(each, 0, scan0_alignment=aligns)[-1].pose for each in (observations, blind)
    )
    assert (with_scans == without) is not aligns


def test_a_late_fix_leaves_scans_where_they_belong(drive):
    observations, truth = scans(drive, 1)
    late = list(observations)
    for i in range(0, len(late) - 6, 3):
        fix = observations[i].gps
        late[i] = dataclasses.replace(late[i], gps=None)
        late[i + 4] = dataclasses.replace(late[i + 4], gps=fix)
    prompt, delayed = (
        beliefs_of(each, 1, scan0_alignment=True)[-1].pose for each in (observations, late)
    )
    assert off(Belief(prompt), truth[-1]) < 0.1
    assert abs(prompt.x - delayed.x) < 0.05 and abs(prompt.y - delayed.y) < 0.05
