"""Clocks of wall time, beside a simulation that takes longer than it lasts."""

import dataclasses
from pathlib import Path

import pytest

from harness.episode.brains import delivery_prices
from harness.episode.factory import Parts
from harness.episode.wall_time import on_wall_time
from harness.storage.shipped import shipped
from harness.task.study import make_study
from harness.world.outcome import Outcome, Rules
from harness.world.truth import Truth
from navstack.errors import ParameterError
from navstack.params.nav2_file.file import load_nav2
from navstack.params.safety import VelocitySmootherParams
from navstack.params.strict import load_dataclass
from navstack.safety.velocity_smoother import VelocitySmoother
from navstack.types import Pose2D, Twist2D

PARAMS = shipped("params")
RULES = load_dataclass(Rules, PARAMS / "rules" / "costnav.yaml")


def smoother_of(nav2):
    return nav2.read(VelocitySmootherParams, "velocity_smoother")


@pytest.mark.parametrize("factor", [1.0, 0.85, 0.7])
def test_a_delivery_is_late_after_the_timeout_of_wall_time(factor):
    rules = dataclasses.replace(RULES, real_time_factor=factor)
    limit = 241.0 * factor
    for stamp, expected in ((limit - 0.01, None), (limit + 0.01, Outcome.TIMEOUT)):
        verdict = rules.judge(
            Truth(stamp, Pose2D(), 0.0, Twist2D(), None, (), (), None, 0.0), Pose2D(50.0, 0.0)
        )
        assert (verdict and verdict.outcome) == expected
    parts = Parts(next(make_study(stacks=["paper-gps"], episodes=1, workers=1).tasks()))
    assert delivery_prices(parts.prices, rules, 50.0).time_limit == pytest.approx(limit)


@pytest.mark.parametrize("factor", [0.85, 0.7])
def test_the_smoother_allows_what_it_allows_per_second_of_wall_time(factor):
    """2.5 m/s2 of wall time are 2.5 / factor of simulated time, up and down."""
    file = load_nav2(PARAMS / "nav2" / "tuned.yaml", False)
    smoother = VelocitySmoother(smoother_of(on_wall_time(file, factor)))
    first = smoother.smooth(Twist2D(3.0, 0.0, 1.2), Twist2D(), 0.0)
    assert first.linear_x == pytest.approx(2.5 / 20.0 / factor)
    assert first.angular_z == pytest.approx(3.2 / 20.0 / factor)
    assert smoother.smooth(Twist2D(), Twist2D(), 0.05).linear_x == 0.0
    assert smoother_of(file).max_accel == (2.5, 0.0, 3.2)  # the file itself is as it was


def test_limits_of_the_file_are_scaled_and_the_rest_stays(tmp_path: Path):
    text = (
        "velocity_smoother:\n  ros__parameters:\n    max_accel: [1.0, 0.0, 2.0]\n"
        "    max_velocity: [0.7, 0.0, 1.0]\n"
    )
    (tmp_path / "mine.yaml").write_text(text)
    scaled = smoother_of(on_wall_time(load_nav2(tmp_path / "mine.yaml", False), 0.5))
    assert scaled.max_accel == (2.0, 0.0, 4.0) and scaled.max_decel == (-5.0, 0.0, -6.4)
    assert scaled.max_velocity == (0.7, 0.0, 1.0) and scaled.smoothing_frequency == 20.0


def test_a_file_without_the_node_gets_its_defaults_scaled(tmp_path: Path):
    (tmp_path / "mine.yaml").write_text("amcl:\n  ros__parameters:\n    max_beams: 60\n")
    assert smoother_of(on_wall_time(load_nav2(tmp_path / "mine.yaml", False), 0.5)).max_accel == (
        5.0,
        0.0,
        6.4,
    )


def test_in_real_time_nothing_changes():
    file = load_nav2(PARAMS / "nav2" / "tuned.yaml", False)
    assert on_wall_time(file, 1.0) is file
    assert RULES.time_limit == RULES.timeout == 241.0


@pytest.mark.parametrize("factor", [0.0, 1.1, -1.0])
def test_impossible_factors_are_refused(factor):
    with pytest.raises(ParameterError, match="real_time_factor"):
        dataclasses.replace(RULES, real_time_factor=factor)
