import math

import pytest

from navstack.errors import ParameterError
from navstack.params.safety import VelocitySmootherParams
from navstack.safety.velocity_smoother import VelocitySmoother
from navstack.types import Twist2D

STANDING = Twist2D()


def test_scaling_keeps_the_direction_of_the_change() -> None:
    params = VelocitySmootherParams(
        scale_velocities=True,
        max_velocity=(3.0, 0.0, 2.0),
        max_accel=(1.0, 0.0, 100.0),
    )
    sent = VelocitySmoother(params).smooth(Twist2D(1.6, 0.0, 1.2), STANDING, 0.0)
    assert sent.linear_x == pytest.approx(1.0 / 20.0)
    assert sent.angular_z == pytest.approx(1.2 / 1.6 / 20.0)


def test_scaling_asks_no_more_of_an_axis_that_cannot_follow_at_all() -> None:
    """As Nav2, whose share of 0 counts as none."""
    params = VelocitySmootherParams(
        scale_velocities=True,
        max_velocity=(3.0, 1.0, 2.0),
        max_accel=(1.0, 0.0, 100.0),
    )
    sent = VelocitySmoother(params).smooth(Twist2D(1.6, 0.5, 1.2), STANDING, 0.0)
    assert (sent.linear_x, sent.linear_y) == pytest.approx((1.0 / 20.0, 0.0))
    assert sent.angular_z == pytest.approx(1.2 / 1.6 / 20.0)


def test_a_changed_sign_brakes_with_the_deceleration() -> None:
    params = VelocitySmootherParams(
        smoothing_frequency=10.0,
        max_velocity=(3, 0, 1),
        min_velocity=(-3, 0, -1),
        max_accel=(1, 0, 1),
        max_decel=(-4, 0, -1),
    )
    smoother = VelocitySmoother(params)
    for _ in range(10):
        smoother.smooth(Twist2D(3.0), STANDING, 0.0)
    assert smoother.smooth(Twist2D(-3.0), STANDING, 0.0).linear_x == pytest.approx(1.0 - 0.4)


def test_without_commands_the_robot_is_brought_to_a_stop_and_starts_again() -> None:
    smoother = VelocitySmoother(VelocitySmootherParams(velocity_timeout=0.2))
    assert smoother.smooth(None, STANDING, 0.0) == STANDING
    assert smoother.smooth(Twist2D(0.2), STANDING, 0.05).linear_x == pytest.approx(0.125)
    assert smoother.smooth(None, STANDING, 0.25).linear_x == pytest.approx(0.2)
    assert smoother.smooth(None, STANDING, 0.30).linear_x == pytest.approx(0.075)
    assert smoother.smooth(None, STANDING, 0.35) == STANDING
    assert smoother.smooth(None, STANDING, 0.40) == STANDING
    assert smoother.smooth(Twist2D(0.1), STANDING, 0.45).linear_x == pytest.approx(0.1)
    smoother.reset()
    assert smoother.smooth(None, STANDING, 0.5) == STANDING


def test_without_commands_nothing_is_sent_after_a_standstill_however_the_robot_rolls() -> None:
    smoother = VelocitySmoother(
        VelocitySmootherParams(velocity_timeout=0.2, feedback="CLOSED_LOOP")
    )
    assert smoother.smooth(STANDING, STANDING, 0.0) == STANDING
    assert smoother.smooth(None, Twist2D(0.5, 0.0, 0.5), 0.3) == STANDING


@pytest.mark.parametrize("wrong", [Twist2D(math.nan), Twist2D(0.3, 0.0, math.inf)])
def test_a_command_that_is_not_finite_is_as_none(wrong: Twist2D) -> None:
    smoother, undisturbed = (
        VelocitySmoother(VelocitySmootherParams(velocity_timeout=0.2)) for _ in range(2)
    )
    assert smoother.smooth(wrong, STANDING, 0.0) == STANDING
    for k, command in enumerate((Twist2D(0.3), wrong, Twist2D(0.4), *[wrong] * 10)):
        stamp = 0.05 * (k + 1)
        expected = undisturbed.smooth(None if command is wrong else command, STANDING, stamp)
        assert smoother.smooth(command, STANDING, stamp) == expected
    assert expected == STANDING


@pytest.mark.parametrize(
    "wrong",
    [
        {"smoothing_frequency": 0.0},
        {"feedback": "LOOP"},
        {"max_accel": (-1.0, 0.0, 1.0)},
        {"max_decel": (1.0, 0.0, -1.0)},
        {"min_velocity": (0.1, 0.0, 0.0)},
    ],
)
def test_impossible_parameters_are_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ParameterError):
        VelocitySmootherParams(**wrong)  # type: ignore[arg-type]
