import json
import os
from pathlib import Path

import numpy as np
import pytest

from navstack.errors import ParameterError
from navstack.params.safety import VelocitySmootherParams
from navstack.safety.velocity_smoother import VelocitySmoother
from navstack.types import Twist2D

GOLDEN = Path(os.environ.get("NAVSTACK_GOLDEN", Path(__file__).parents[1] / "golden"))
VECTORS = np.load(GOLDEN / "smoother_velocity_collision_shim.npz")
CASES = sorted(key[3 : -len("_out")] for key in VECTORS.files if key.startswith("vs_") and key.endswith("_out"))
PARAMETERS = json.loads(str(VECTORS["meta_json"]))["velocity_smoother"]
STANDING = Twist2D()


def params_of(case: str) -> VelocitySmootherParams:
    given = {
        key: tuple(value) if isinstance(value, list) else value for key, value in PARAMETERS[case]["params"].items()
    }
    given.pop("odom_duration", None)  # the odometry given here is smoothed already
    return VelocitySmootherParams(**given)


@pytest.mark.parametrize("case", CASES)
def test_it_sends_what_nav2_sends(case: str) -> None:
    smoother = VelocitySmoother(params_of(case))
    commands = list(VECTORS[f"vs_{case}_cmds_t_x_y_w"])
    measured = STANDING  # the recorded closed loop measures 0.8 of the speed and 0.9 of the turn that was sent
    for stamp, expected in zip(VECTORS[f"vs_{case}_t"], VECTORS[f"vs_{case}_out"], strict=True):
        while commands and commands[0][0] <= stamp:
            t, x, y, w = commands.pop(0)
            smoother.receive(Twist2D(x, y, w), t)
        sent = smoother.smooth(None, measured, stamp)
        np.testing.assert_allclose(
            (sent.linear_x, sent.linear_y, sent.angular_z), np.nan_to_num(expected), rtol=0.0, atol=1e-12
        )
        measured = Twist2D(0.8 * sent.linear_x, 0.8 * sent.linear_y, 0.9 * sent.angular_z)


def test_the_vectors_hold_cases() -> None:
    assert len(CASES) >= 5


def test_scaling_keeps_the_direction_of_the_change() -> None:
    params = VelocitySmootherParams(scale_velocities=True, max_velocity=(3.0, 0.0, 2.0), max_accel=(1.0, 0.0, 100.0))
    sent = VelocitySmoother(params).smooth(Twist2D(1.0, 0.0, 2.0), STANDING, 0.0)
    assert sent.linear_x == pytest.approx(1.0 / 20.0)
    assert sent.angular_z == pytest.approx(2.0 / 20.0)


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
