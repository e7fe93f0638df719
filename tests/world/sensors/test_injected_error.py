"""A set error has the size and the pace that were asked for."""

import math

import numpy as np
import pytest

from harness.storage.shipped import shipped
from harness.task.stack import TRUTH, InjectedError, load_stack
from harness.world.sensors.ground_truth import (
    GroundTruthLocalizer,
    GroundTruthTracker,
    InjectedErrorLocalizer,
)
from navstack.errors import InputError, ParameterError
from navstack.types import Belief, Health, Observation, Pose2D

TRUE = Pose2D(10.0, -5.0, 3.1)
STEP = 0.5  # [s]


def drift(error, seed=0, steps=1, step=STEP, localizer=None):
    """Errors (steps, 3) of x, y [m], yaw [rad] along a drive."""
    localizer = localizer or InjectedErrorLocalizer(GroundTruthLocalizer(lambda: TRUE), error)
    localizer.reset(Belief(TRUE), np.random.default_rng(seed))
    poses = [localizer.update(Observation(i * step)).pose for i in range(steps)]
    away = np.array([(pose.x - TRUE.x, pose.y - TRUE.y, pose.yaw - TRUE.yaw) for pose in poses])
    away[:, 2] = (away[:, 2] + math.pi) % (2.0 * math.pi) - math.pi
    return away


def test_the_errors_have_the_size_asked_for():
    away = drift(InjectedError(0.3, 5.0, 10.0), steps=30_000)
    assert np.sqrt((away[:, :2] ** 2).sum(axis=1).mean()) == pytest.approx(0.3, rel=0.08)
    assert math.degrees(np.sqrt((away[:, 2] ** 2).mean())) == pytest.approx(5.0, rel=0.08)
    assert abs(np.corrcoef(away.T)[np.triu_indices(3, 1)]).max() < 0.1


def test_they_have_that_size_from_the_start():
    first = np.array([drift(InjectedError(0.3, 5.0), seed)[0] for seed in range(4000)])
    assert np.sqrt((first[:, :2] ** 2).sum(axis=1).mean()) == pytest.approx(0.3, rel=0.08)


@pytest.mark.parametrize("time", [2.0, 10.0])
def test_they_are_forgotten_over_the_correlation_time(time):
    x = drift(InjectedError(1.0, 0.0, time), steps=30_000)[:, 0]
    lag = round(time / STEP)
    correlation = np.corrcoef(x[:-lag], x[lag:])[0, 1]
    assert correlation == pytest.approx(math.exp(-1.0), abs=0.08)


def test_all_sizes_meet_the_same_drift():
    small, large = (drift(InjectedError(size, 2.0 * size), steps=200) for size in (0.1, 0.7))
    np.testing.assert_allclose(large, 7.0 * small, atol=1e-9)
    only_position = drift(InjectedError(0.7, 0.0), steps=200)
    np.testing.assert_allclose(only_position[:, :2], large[:, :2], atol=1e-12)
    np.testing.assert_allclose(only_position[:, 2], 0.0, atol=1e-12)


def test_another_delivery_drifts_otherwise_and_the_same_one_alike():
    localizer = InjectedErrorLocalizer(GroundTruthLocalizer(lambda: TRUE), InjectedError(0.5, 1.0))
    first, other, again = (drift(None, seed, 20, localizer=localizer) for seed in (1, 2, 1))
    assert not np.allclose(first, other)
    np.testing.assert_array_equal(first, again)


def test_the_belief_tells_its_own_uncertainty():
    localizer = InjectedErrorLocalizer(GroundTruthLocalizer(lambda: TRUE), InjectedError(0.2, 3.0))
    localizer.reset(Belief(TRUE), np.random.default_rng(0))
    belief = localizer.update(Observation(0.25))
    np.testing.assert_allclose(belief.covariance, np.diag((0.02, 0.02, math.radians(3.0) ** 2)))
    assert (
        belief.stamp == 0.25
        and belief.health is Health.TRACKING
        and -math.pi <= belief.pose.yaw <= math.pi
    )
    assert localizer.update(Observation(0.25)).pose == belief.pose  # no time, no drift


@pytest.mark.parametrize(
    "values", [(-0.1, 0.0, 1.0), (0.0, math.nan, 1.0), (0.0, 1.0, 0.0), (math.inf, 0.0, 1.0)]
)
def test_what_is_no_error_is_refused(values):
    with pytest.raises(ParameterError, match=r"injected error: \w+ .* must be"):
        InjectedError(*values)


def test_what_is_certain_cannot_be_made_uncertain_by_who_reads_it():
    belief = GroundTruthLocalizer(lambda: TRUE).update(Observation(0.0))
    (track,) = GroundTruthTracker(lambda: np.zeros((1, 4)), 0.3).tracks(0.0)
    for covariance, size in ((belief.covariance, 3), (track.covariance, 4)):
        assert covariance.tolist() == np.zeros((size, size)).tolist()
        with pytest.raises(ValueError, match="read-only"):
            covariance[0, 0] = 1.0


def test_who_knows_the_people_tells_of_them_as_they_are_now():
    # the last is not there
    people = np.array([(1.0, 2.0, 0.5, -0.5), (8.0, 9.0, 0.0, 1.3), (np.nan,) * 4])
    tracker = GroundTruthTracker(lambda: people, 0.3)
    people += (1.0, 0.0, 0.0, 0.0)
    told = tracker.tracks(7.0)
    assert [(each.id, each.x, each.y, each.vx, each.vy) for each in told] == [
        (0, 2.0, 2.0, 0.5, -0.5),
        (1, 9.0, 9.0, 0.0, 1.3),
    ]
    assert all(
        each.stamp == 7.0 and each.radius == 0.3 and not each.covariance.any() for each in told
    )


def test_a_stack_file_may_ask_for_it_and_for_nothing_else(tmp_path):
    text = (shipped("params") / "stacks" / "evasive-gps-ekf.yaml").read_text(encoding="utf-8")
    file = tmp_path / "knows.yaml"
    file.write_text(text + "tracker: ground_truth\n", encoding="utf-8")
    assert load_stack(str(file)).tracker == TRUTH
    file.write_text(text + "tracker: perfect\n", encoding="utf-8")
    with pytest.raises(InputError, match="tracker 'perfect'.*ground_truth"):
        load_stack(str(file))
