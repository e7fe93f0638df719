"""The heading from a short way and fixes whose errors are alike."""

import math

import numpy as np
import pytest

from navstack.geometry import normalize_angle
from navstack.localization.heading_alignment import Alignment, HeadingAlignment, without
from navstack.types import GpsFix, Pose2D

SHARE, TIME = 0.9, 20.0  # [-], [s] of the correlated error


def fixes(
    rng: np.random.Generator,
    std: float,
    rest: int,
    count: int,
) -> tuple[HeadingAlignment, float, np.ndarray]:
    """After a fix a second, at rest and at 1.5 m/s.

    The alignment, the true turn, the shared error's end.
    """
    turn, shared = rng.uniform(-math.pi, math.pi), math.sqrt(SHARE) * std * rng.standard_normal(2)
    alignment, decay = HeadingAlignment(SHARE, TIME), math.exp(-1.0 / TIME)
    for second in range(rest + count):
        along = 1.5 * max(second - rest, 0)
        here = np.array((along, 2.0 * math.sin(0.1 * along)))
        shared = decay * shared + std * math.sqrt(SHARE * (1.0 - decay**2)) * rng.standard_normal(2)
        error = shared + std * math.sqrt(1.0 - SHARE) * rng.standard_normal(2)
        x, y = (
            here[0] * math.cos(turn) - here[1] * math.sin(turn),
            here[0] * math.sin(turn) + here[1] * math.cos(turn),
        )
        alignment.add(Pose2D(*here), GpsFix(float(second), x + error[0], y + error[1], std), std**2)
    return alignment, turn, shared


def found(alignment: HeadingAlignment) -> Alignment:
    result = alignment.solve(10.0)
    assert result is not None
    return result


@pytest.mark.parametrize("rest", [0, 30])
def test_its_errors_are_as_large_as_it_says(rest: int) -> None:
    """Turn, mean position, the next fixes' shared error, and how they go together: 500 draws."""
    rng, errors = np.random.default_rng(3), []
    for _ in range(500):
        alignment, turn, shared = fixes(rng, 0.5, rest, 12)
        fit = found(alignment)
        x, y = fit.center_here
        cos, sin = math.cos(turn), math.sin(turn)
        mean = fit.center_there - (cos * x - sin * y, sin * x + cos * y)
        errors.append(
            (normalize_angle(fit.turn - turn), *mean, *shared, *(shared @ _turned(fit, turn),))
        )
    errors_ = np.array(errors)
    spread = errors_.T @ errors_ / len(errors_)
    assert spread[0, 0] == pytest.approx(fit.turn_variance, rel=0.2)
    for axis in (1, 2):
        assert spread[axis, axis] == pytest.approx(fit.position_variance, rel=0.2)
        assert spread[axis, axis + 2] == pytest.approx(fit.shared_with_position, rel=0.25)
        assert spread[axis + 2, axis + 2] == pytest.approx(fit.shared_variance, rel=0.2)
    along = float(np.linalg.norm(fit.shared_with_turn))
    assert spread[0, 5] == pytest.approx(along, rel=0.35)


def _turned(fit: Alignment, turn: float) -> np.ndarray:
    """The direction (2,) in which the shared error goes with the turn's."""
    direction: np.ndarray = fit.shared_with_turn / np.linalg.norm(fit.shared_with_turn)
    back = turn - fit.turn
    cos, sin = math.cos(back), math.sin(back)
    return np.array(
        (cos * direction[0] - sin * direction[1], sin * direction[0] + cos * direction[1])
    )


def test_fixes_at_rest_tell_no_direction_and_a_far_one_is_left_out() -> None:
    rng = np.random.default_rng(0)
    alignment, _, _ = fixes(rng, 0.5, 40, 1)
    assert alignment.solve(10.0) is None
    alignment, turn, _ = fixes(rng, 0.05, 5, 10)
    alignment.add(Pose2D(13.5, 2.0 * math.sin(1.35)), GpsFix(15.0, 300.0, -200.0, 0.05), 0.05**2)
    assert abs(normalize_angle(found(alignment).turn - turn)) < 0.02
    assert alignment.solve(1e-4) is None


def test_the_way_that_a_heading_takes_shrinks_with_what_fixes_share() -> None:
    rng = np.random.default_rng(1)
    alignment, _, _ = fixes(rng, 2.0, 0, 8)
    independent = HeadingAlignment(0.0, TIME)
    independent._rows = alignment._rows
    assert found(alignment).turn_variance < 0.7 * found(independent).turn_variance


def test_a_covariance_without_a_variable_is_inverted_from_the_inverse_with_it() -> None:
    rng = np.random.default_rng(7)
    factors = rng.standard_normal((30, 12))
    covariance = factors.T @ factors
    smaller = np.delete(np.delete(covariance, 4, axis=0), 4, axis=1)
    assert without(np.linalg.inv(covariance), 4) == pytest.approx(np.linalg.inv(smaller))


def test_a_vain_search_that_leaves_out_many_fixes_pauses() -> None:
    """Fixes that fit no way, of a robot in a doubt, are not all looked through at each of them."""
    rng, alignment = np.random.default_rng(5), HeadingAlignment(SHARE, TIME)
    searches = 0
    for second in range(300):
        fix = GpsFix(float(second), *rng.uniform(-50.0, 50.0, 2).tolist(), 0.05)
        alignment.add(Pose2D(0.01 * second), fix, 0.05**2)
        before = alignment._pause
        assert alignment.solve(0.05) is None
        searches += second >= 200 and not before
    assert 0 < searches < 20


def test_after_a_pause_the_heading_is_found() -> None:
    """Once most fixes fit the way again."""
    rng, alignment = np.random.default_rng(5), HeadingAlignment(SHARE, TIME)
    solved = []
    for second in range(120):
        off = rng.uniform(-50.0, 50.0, 2) * (second < 30)
        x, y = (np.array((second, 0.0)) + off).tolist()
        alignment.add(Pose2D(float(second), 0.0), GpsFix(float(second), x, y, 0.05), 0.05**2)
        solved.append(alignment.solve(0.05))
    assert solved[29] is None
    last = solved[-1]
    assert last is not None
    assert abs(last.turn) < 0.01
