"""AMCL with GPS: fixes hold it where scans do not, and bring it back from a wrong start.

They cannot carry it away.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from navstack.build import build_localizer
from navstack.errors import ParameterError
from navstack.localization.amcl import AmclLocalizer
from navstack.localization.amcl_gps import AmclGpsLocalizer
from navstack.params.amcl import AmclGpsParams, AmclParams
from navstack.params.nav2_file.file import load_nav2
from navstack.types import Belief, GpsFix, Health, Pose2D

from .corridor import RATE, START, drive, errors, exact, make_grid, with_landmarks

PARAMS = AmclParams(alpha1=0.01, alpha2=0.005, alpha3=0.02, alpha4=0.01, resample_interval=1)


@pytest.fixture(scope="module")
def landmarks():
    return with_landmarks()


@pytest.fixture(scope="module")
def bare():
    """Nothing but two walls: scans tell nothing of the place along them."""
    return make_grid([])


def started(grid, at=START, seed=0, params=PARAMS, **gps):
    localizer = AmclGpsLocalizer(params, AmclGpsParams(**gps), grid)
    localizer.reset(Belief(at, np.diag((0.04, 0.04, 0.003))), np.random.default_rng(seed))
    return localizer


def test_without_fixes_it_is_amcl(landmarks):
    plain = AmclLocalizer(PARAMS, landmarks)
    plain.reset(Belief(START, np.diag((0.04, 0.04, 0.003))), np.random.default_rng(0))
    for (ours, _), (theirs, _) in zip(
        drive(started(landmarks), landmarks, 4.0), drive(plain, landmarks, 4.0), strict=True
    ):
        assert ours.pose == theirs.pose
        assert ours.health is theirs.health
        np.testing.assert_array_equal(ours.covariance, theirs.covariance)


def test_fixes_hold_it_where_scans_tell_nothing(bare):
    noisy = replace(PARAMS, alpha3=0.2)  # Nav2's own, for wheels that are 10 % off
    without = errors(drive(started(bare, params=noisy), bare, 25.0, scale=0.9))
    with_fixes = errors(drive(started(bare, params=noisy), bare, 25.0, exact(0.5), scale=0.9))
    assert without[-1] > 1.5
    assert with_fixes[-1] < 0.5 * without[-1]


def test_late_fixes_are_taken_for_their_time(bare):
    prompt = errors(drive(started(bare), bare, 20.0, exact(0.5), scale=0.95))
    late = errors(drive(started(bare), bare, 20.0, exact(0.5), scale=0.95, late=30))
    assert late[-1] < prompt[-1] + 0.15  # if they were taken for now, they would drag it 1 m back


@pytest.mark.parametrize("heading", [True, False])
def test_a_start_five_metres_off(landmarks, heading):
    wrong = Pose2D(START.x + 4.6, START.y - 2.0, START.yaw if heading else 0.6)
    alone = errors(drive(started(landmarks, wrong), landmarks, 12.0, heading=heading))
    rows = drive(started(landmarks, wrong), landmarks, 12.0, exact(0.3), heading=heading)
    assert alone[-1] > 2.0
    assert errors(rows)[-1] < 0.2
    assert Health.DEGRADED in [belief.health for belief, _ in rows[:90]] or Health.LOST in [
        b.health for b, _ in rows[:90]
    ]
    assert rows[-1][0].health is Health.TRACKING


@pytest.mark.parametrize("error", [(6.0, 1.0), (-4.0, 0.0), (4.5, 0.5), (11.0, -1.0)])
def test_a_receiver_that_errs_and_is_sure_of_itself_cannot_carry_it_away(landmarks, error):
    def beside(stamp, truth):
        ahead = error[0] * (5.0 < stamp < 12.0)
        return GpsFix(stamp, truth.x + ahead, truth.y + error[1], 0.01)

    carried_away = 0
    for seed in range(6):
        rows = drive(started(landmarks, seed=seed), landmarks, 14.0, beside)
        carried_away += errors(rows).max() >= 0.4
        # one of the two is wrong, and it says so
        assert rows[11 * RATE][0].health is Health.DEGRADED
        assert rows[-1][0].health is Health.TRACKING
    assert carried_away == 0


def test_it_finds_itself_where_its_wheels_stand(landmarks):
    rows = drive(started(landmarks), landmarks, 16.0, exact(0.3), pushed=(4.0, 7.0))
    assert errors(rows)[4 * RATE + 2] > 6.0
    assert errors(rows)[-1] < 0.3


@pytest.mark.parametrize(("older", "x"), [(0.0, math.nan), (50.0, 99.0)])
def test_fixes_without_numbers_or_of_unknown_times_are_no_fixes(landmarks, older, x):
    def unusable(stamp, truth):
        return GpsFix(stamp - older, x, truth.y, 0.5)

    rows = drive(started(landmarks), landmarks, 4.0, unusable)
    without = drive(started(landmarks), landmarks, 4.0)
    assert [belief.pose for belief, _ in rows] == [belief.pose for belief, _ in without]


def test_without_a_fix_it_does_not_look_elsewhere(landmarks):
    recovering = replace(
        PARAMS,
        recovery_alpha_slow=0.001,
        recovery_alpha_fast=0.1,
        recovery_candidates=2000,
    )
    for fixes, elsewhere in ((None, False), (exact(0.3), True)):
        localizer = started(landmarks, Pose2D(START.x + 4.6, START.y - 2.0), params=recovering)
        drive(localizer, landmarks, 1.0, fixes)
        assert (np.ptp(localizer.particles.poses[:, 0]) > 3.0) == elsewhere


def test_a_fix_counts_as_the_share_of_an_independent_one(bare):
    localizer = started(bare, correlation_time=5.0)
    places = np.array(((5.0, 5.0), (6.0, 5.0)))
    first = GpsFix(1.0, 5.0, 5.0, 1.0)
    # bivariate t-distribution of 4 degrees of freedom, one deviation away
    of_one = (1.0 + 1.0 / 4.0) ** -3.0
    np.testing.assert_allclose(localizer._likelihoods(first, places), (1.0, of_one))
    localizer._last_fix = first
    for later, share in ((1.1, 0.01), (11.0, 1.0), (50.0, 1.0)):
        found = localizer._likelihoods(replace(first, stamp=later), places)
        np.testing.assert_allclose(found, (1.0, of_one**share))
    sure = localizer._likelihoods(GpsFix(60.0, 5.0, 5.0, 0.01), places)
    # not surer than the floor of 0.5 m
    np.testing.assert_allclose(sure, (1.0, (1.0 + 4.0 / 4.0) ** -3.0))
    silent = localizer._likelihoods(GpsFix(60.0, 5.0, 5.0, 0.0), places)
    np.testing.assert_allclose(silent, (1.0, (1.0 + 0.25 / 4.0) ** -3.0))  # states none: 2 m


def test_its_parameters_stand_in_a_node_of_their_own(landmarks, tmp_path):
    file = tmp_path / "robot.yaml"
    file.write_text(
        "amcl: {ros__parameters: {max_particles: 700}}\n"
        "amcl_gps: {ros__parameters: {patience: 7}}\n"
    )
    nav2 = load_nav2(file)
    assert nav2.read(AmclGpsParams, "amcl_gps") == AmclGpsParams(patience=7)
    assert isinstance(build_localizer("amcl-gps", nav2, landmarks), AmclGpsLocalizer)
    file.write_text("amcl_gps: {ros__parameters: {patiense: 7}}\n")
    with pytest.raises(ParameterError, match="patience"):
        load_nav2(file)
    for given in (
        {"rejection_threshold": 0.0},
        {"position_std": math.nan},
        {"recovery_share": 1.5},
    ):
        with pytest.raises(ParameterError, match=f"amcl_gps: {next(iter(given))}"):
            AmclGpsParams(**given)
