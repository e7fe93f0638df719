"""AMCL with GPS: fixes hold it where scans do not, bring it back from a wrong start, and cannot carry it away."""

import math
from dataclasses import replace

import numpy as np
import pytest

from navstack.build import build_localizer
from navstack.costmap.distances import squared_distances
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from navstack.errors import ParameterError
from navstack.geometry import compose
from navstack.localization.amcl import AmclLocalizer
from navstack.localization.amcl_gps import AmclGpsLocalizer
from navstack.localization.amcl_kernels import cast_rays
from navstack.params.amcl import AmclGpsParams, AmclParams
from navstack.params.nav2_file.file import load_nav2
from navstack.types import (
    Belief,
    GpsFix,
    Health,
    Imu,
    LaserScan,
    Observation,
    Odometry,
    Pose2D,
    Twist2D,
)

RESOLUTION = 0.05  # [m]
BEAMS, RANGE = 180, 12.0  # of the scanner, [m]
RATE = 30  # [Hz] of the odometry; scans and fixes come with every third
SPEED = 1.0  # [m/s]
PARAMS = AmclParams(alpha1=0.01, alpha2=0.005, alpha3=0.02, alpha4=0.01, resample_interval=1)
START = Pose2D(5.0, 5.0, 0.0)


def make_grid(pillars):
    """A corridor of 40 m x 10 m, with pillars at some of its cells."""
    cells = np.full((200, 800), FREE, dtype=np.int8)
    cells[:4] = cells[-4:] = OCCUPIED
    for row, column in pillars:
        cells[row : row + 8, column : column + 8] = OCCUPIED
    return OccupancyGrid(cells, RESOLUTION, Pose2D())


@pytest.fixture(scope="module")
def landmarks():
    """With pillars of which no stretch has the same."""
    rng = np.random.default_rng(4)
    return make_grid(
        [(int(rng.choice([12, 40, 150, 175])), column) for column in range(20, 780, 45)]
    )


@pytest.fixture(scope="module")
def bare():
    """Nothing but two walls: scans tell nothing of the place along them."""
    return make_grid([])


def scanner(grid):
    """Makes what a scanner at the base sees from a pose."""
    clear = np.ceil(
        np.sqrt(
            squared_distances(np.pad(grid.data != FREE, 1, constant_values=True), 100_000) / 2.0
        )
    )
    bearings = np.linspace(-math.pi, math.pi, BEAMS, endpoint=False)

    def see(pose, stamp):
        sensor = np.array([[pose.x / RESOLUTION + 1.5, pose.y / RESOLUTION + 1.5, pose.yaw]])
        ranges = (
            cast_rays(clear.astype(np.uint8), sensor, bearings, RANGE / RESOLUTION)[0] * RESOLUTION
        )
        ranges[ranges >= RANGE] = math.inf
        return LaserScan(stamp, ranges, -math.pi, 2.0 * math.pi / BEAMS, 0.05, RANGE)

    return see


def drive(
    localizer, grid, seconds, fix_of=None, scale=1.0, late=0, heading=True, pushed=(math.inf, 0.0)
):
    """Drive along the corridor; the beliefs and truths of all ticks.

    Args:
        fix_of: makes the fix from stamp and true pose; None: there is none.
        scale: of the odometry's lengths.
        late: ticks by which fixes come after their time.
        heading: whether the inertial unit has an absolute one.
        pushed: [s] when the robot is carried along x while its wheels stand, and [m] how far.
    """
    see, truth, odom, rows, fixes = scanner(grid), START, Pose2D(2.0, 1.0, 0.7), [], []
    for tick in range(round(seconds * RATE)):
        stamp, is_due = tick / RATE, tick % 3 == 0
        if tick == round(min(pushed[0], 1e6) * RATE):
            truth = Pose2D(truth.x + pushed[1], truth.y, truth.yaw)
        if fix_of is not None and is_due:
            fixes.append(fix_of(stamp, truth))
        fix = fixes.pop(0) if fixes and fixes[0].stamp <= stamp - late / RATE else None
        belief = localizer.update(
            Observation(
                stamp,
                Odometry(stamp, odom, Twist2D(SPEED)),
                Imu(stamp, truth.yaw if heading else math.nan, 0.0, 0.0, 0.0),
                fix,
                see(truth, stamp) if is_due else None,
            )
        )
        rows.append((belief, truth))
        step = 0.0 if stamp >= pushed[0] else SPEED / RATE
        truth, odom = compose(truth, Pose2D(step)), compose(odom, Pose2D(scale * step))
    return rows


def exact(std):
    """Fixes without error that claim a standard deviation [m]."""
    return lambda stamp, truth: GpsFix(stamp, truth.x, truth.y, std)


def started(grid, at=START, seed=0, params=PARAMS, **gps):
    localizer = AmclGpsLocalizer(params, AmclGpsParams(**gps), grid)
    localizer.reset(Belief(at, np.diag((0.04, 0.04, 0.003))), np.random.default_rng(seed))
    return localizer


def errors(rows):
    return np.array(
        [math.hypot(belief.pose.x - truth.x, belief.pose.y - truth.y) for belief, truth in rows]
    )


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


def test_fixes_without_numbers_or_of_unknown_times_are_no_fixes(landmarks):
    def unusable(stamp, truth):
        known = stamp >= 1.0
        return GpsFix(stamp - 50.0 if known else stamp, 99.0 if known else math.nan, truth.y, 0.5)

    rows = drive(started(landmarks), landmarks, 4.0, unusable)
    assert [b.pose for b, _ in rows] == [
        b.pose for b, _ in drive(started(landmarks), landmarks, 4.0)
    ]


def test_without_a_fix_it_does_not_look_elsewhere(landmarks):
    recovering = replace(
        PARAMS, recovery_alpha_slow=0.001, recovery_alpha_fast=0.1, recovery_candidates=2000
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
        "amcl: {ros__parameters: {max_particles: 700}}\namcl_gps: {ros__parameters: {patience: 7}}\n"
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
