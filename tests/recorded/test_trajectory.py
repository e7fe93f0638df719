"""TUM files and errors of trajectories."""

import math

import numpy as np
import pytest

from harness.recorded.trajectory import (
    Trajectory,
    absolute_errors,
    align,
    match,
    read_tum,
    relative_errors,
    write_tum,
)
from navstack.errors import InputError
from navstack.geometry import compose, relative_to
from navstack.types import Pose2D


def drive(count: int = 200, step: float = 0.1) -> Trajectory:
    """A bend, ten poses per second."""
    at, rows = Pose2D(3.0, -2.0, 2.9), []
    for i in range(count):
        rows.append((100.0 + step * i, at.x, at.y, at.yaw))
        at = compose(at, Pose2D(0.1, 0.0, 0.03))
    return Trajectory.of_rows(np.array(rows))


def moved(trajectory: Trajectory, frame: Pose2D) -> Trajectory:
    poses = [compose(frame, Pose2D(*pose)).as_array() for pose in trajectory.poses.tolist()]
    return Trajectory(trajectory.stamps, np.array(poses))


def test_a_file_holds_what_was_written(tmp_path):
    written = drive()
    write_tum(tmp_path / "out.tum", written)
    lines = (tmp_path / "out.tum").read_text().splitlines()
    assert len(lines) == 200 and all(len(line.split()) == 8 for line in lines)
    read = read_tum(tmp_path / "out.tum")
    assert read.stamps == pytest.approx(written.stamps, abs=1e-9)
    assert read.poses[:, :2] == pytest.approx(written.poses[:, :2], abs=1e-6)
    assert np.cos(read.poses[:, 2] - written.poses[:, 2]) == pytest.approx(1.0)


def test_the_yaw_is_that_of_the_whole_quaternion(tmp_path):
    (tmp_path / "a.tum").write_text(
        "# timestamp tx ty tz qx qy qz qw\n5 1 2 3 0.5 0.5 0.5 0.5\n4 0 0 0 0 0 1 0\n"
    )
    read = read_tum(tmp_path / "a.tum")
    assert read.stamps.tolist() == [4.0, 5.0]
    assert read.poses[0, 2] == pytest.approx(math.pi) and read.poses[1, 2] == pytest.approx(
        math.pi / 2
    )


@pytest.mark.parametrize(
    "text", ["", "1 2 3\n", "a b c d e f g h\n", "1 0 0 0 0 0 0 nan\n", "1 0 0 0 0 0 0 1\n1 2\n"]
)
def test_another_file_is_an_error_in_one_line(tmp_path, text):
    (tmp_path / "bad.tum").write_text(text)
    with pytest.raises(InputError, match="bad.tum' is no TUM file") as caught:
        read_tum(tmp_path / "bad.tum")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("how", ["start", "se2"])
def test_alignment_takes_away_a_rigid_motion(how):
    reference = drive()
    estimate = moved(reference, Pose2D(5.0, 7.0, 1.1))
    errors = absolute_errors(align(estimate, reference, how), reference)
    assert errors.positions == pytest.approx(np.zeros(200), abs=1e-9)
    assert errors.yaws == pytest.approx(np.zeros(200), abs=1e-9)
    raw = absolute_errors(align(estimate, reference, "none"), reference)
    assert raw.positions.min() > 1.0 and raw.yaws == pytest.approx(np.full(200, 1.1))


def test_the_best_alignment_leaves_no_less_than_any_other():
    rng = np.random.default_rng(0)
    reference = drive()
    noise = 0.3 * rng.standard_normal((200, 3)) * (1, 1, 0)
    estimate = Trajectory(reference.stamps, moved(reference, Pose2D(1.0, 2.0, 0.7)).poses + noise)
    best = align(estimate, reference, "se2")
    least = (absolute_errors(best, reference).positions ** 2).sum()
    for nudge in (
        Pose2D(0.01),
        Pose2D(0.0, 0.01),
        Pose2D(0.0, 0.0, 0.005),
        Pose2D(0.0, 0.0, -0.005),
    ):
        centre = Pose2D(*best.poses[:, :2].mean(axis=0))
        about = compose(compose(centre, nudge), relative_to(centre, Pose2D()))
        assert (absolute_errors(moved(best, about), reference).positions ** 2).sum() > least


def test_errors_of_a_known_drift():
    reference = drive()
    estimate = Trajectory(
        reference.stamps, reference.poses + np.linspace(0.0, 1.99, 200)[:, None] * (1.0, 0.0, 0.0)
    )
    ape = absolute_errors(estimate, reference).as_json()
    assert (
        ape["n"] == 200
        and ape["max_m"] == pytest.approx(1.99)
        and ape["median_m"] == pytest.approx(0.995)
    )
    assert ape["rmse_m"] == pytest.approx(math.sqrt(np.mean(np.linspace(0, 1.99, 200) ** 2)))
    assert ape["p95_m"] == pytest.approx(1.99 * 0.95)
    rpe = relative_errors(estimate, reference, 1.0)
    # 0.01 m more with each tenth of a second
    assert rpe.positions == pytest.approx(np.full(190, 0.1))
    assert rpe.yaws == pytest.approx(np.zeros(190), abs=1e-12)


def test_relative_errors_are_those_of_the_definition():
    rng = np.random.default_rng(1)
    reference = drive(40)
    estimate = Trajectory(reference.stamps, reference.poses + 0.1 * rng.standard_normal((40, 3)))
    rpe = relative_errors(estimate, reference, 0.5)
    for i in range(35):
        q = relative_to(Pose2D(*reference.poses[i]), Pose2D(*reference.poses[i + 5]))
        p = relative_to(Pose2D(*estimate.poses[i]), Pose2D(*estimate.poses[i + 5]))
        error = relative_to(q, p)  # (Q_i^-1 Q_i+d)^-1 (P_i^-1 P_i+d)
        assert rpe.positions[i] == pytest.approx(math.hypot(error.x, error.y))
        assert rpe.yaws[i] == pytest.approx(abs(error.yaw))


def test_positions_alone_have_no_heading_errors():
    reference = drive()
    places = Trajectory(reference.stamps, reference.poses * (1, 1, math.nan))
    estimate = moved(reference, Pose2D(2.0, 0.0, 0.0))
    errors = absolute_errors(align(estimate, places, "start"), places)
    assert errors.as_json()["yaw_max_rad"] is None and errors.positions.max() == pytest.approx(
        0.0, abs=1e-9
    )
    assert relative_errors(estimate, places, 1.0) is None


def test_poses_are_matched_by_time():
    estimate, reference = drive(200, 0.1), drive(50, 0.333)
    ours, theirs = match(estimate, reference)
    assert (np.abs(ours.stamps - theirs.stamps) <= 0.02).all() and 0 < len(ours) == len(theirs) < 50
    late = Trajectory(reference.stamps + 1000.0, reference.poses)
    with pytest.raises(
        InputError, match="runs from 100.00 to 119.90 s, the reference from 1100.00 to"
    ):
        match(estimate, late)
