"""The velocities that DWB samples, and how trajectories come to speed and turn."""

import itertools
import math

import numpy as np
import pytest

from navstack.control.dwb import end_kernels, kernels, velocity_samples


def axis_twin(current, limits, count, time):
    """OneDVelocityIterator, as the state machine that Nav2 describes."""
    least, most, acceleration, deceleration = limits
    current = least if current < least else most if current > most else current

    def project(target):
        if current < target:
            return min(target, current + acceleration * time)
        return max(target, current + deceleration * time)

    high = project(most)
    low = project(least)
    increment = 1.0 if abs(low - high) < 1e-5 else (high - low) / (max(2, count) - 1)
    value = low
    zero_left = True
    zero_now = False
    out = []
    while not value > high + 1e-5:
        out.append(0.0 if zero_now else value)
        if zero_left and value < 0.0 < value + increment <= high + 1e-5:
            zero_now = True
            zero_left = False
        else:
            value = value + increment
            zero_now = False
    return out


@pytest.mark.parametrize("count", [1, 2, 7, 20])
@pytest.mark.parametrize("current", [-2.0, -0.3, 0.0, 0.4, 5.0])
@pytest.mark.parametrize(
    "limits",
    [
        (-0.5, 1.0, 2.5, -2.5),
        (0.0, 3.0, 4.0, -1.0),
        (0.0, 0.0, 0.0, 0.0),
        (-6e-6, 6e-6, 1.0, -1.0),
        (1.0, 0.5, 2.0, -2.0),
    ],
)
def test_axis_samples_equal_the_twin(count, current, limits):
    ours = velocity_samples.axis_samples(current, np.array(limits), count, 0.2)
    assert ours.tolist() == axis_twin(current, limits, count, 0.2)


@pytest.mark.parametrize(
    "speeds", [(-1.0, -1.0, -1.0), (0.25, 0.6, 0.3), (0.25, -1.0, 0.3), (0.0, 0.6, 0.0)]
)
def test_samples_are_all_combinations_that_neither_stand_nor_crawl_nor_race(
    speeds,
):
    limits = ((-0.3, 0.8, 2.0, -2.0), (-0.2, 0.3, 1.0, -3.0), (-0.9, 0.7, 3.0, -1.0))
    current = (0.1, 0.05, -0.1)
    counts = (5, 3, 7)
    axes = [
        axis_twin(v, limit, count, 0.4)
        for v, limit, count in zip(current, limits, counts, strict=True)
    ]
    expected = []
    for vx, vy, yaw_rate in itertools.product(*axes):
        speed = math.hypot(vx, vy)
        races = 0.0 <= speeds[1] < speed - 1e-5
        crawls = (
            min(speeds[0], speeds[2]) >= 0.0
            and speed < speeds[0]
            and abs(yaw_rate) < speeds[2] - 1e-5
        )
        if not (races or crawls or (speed == 0.0 and yaw_rate == 0.0)):
            expected.append((vx, vy, yaw_rate))
    ours = velocity_samples.combine.py_func(
        np.array(current), np.array(limits), np.array(counts), np.array(speeds), 0.4
    )
    np.testing.assert_array_equal(ours, expected)


def test_a_small_least_speed_is_no_rounding():
    """A robot that stands may turn no slower than 0.3 rad/s: 0.001 m/s squared are 1e-6."""
    limits = np.array(((0.0, 0.5, 2.5, -2.5), (0.0, 0.0, 0.0, 0.0), (-1.0, 1.0, 3.2, -3.2)))
    speeds = np.array((0.001, 0.5, 0.3))
    found = velocity_samples.combine(np.zeros(3), limits, np.array((5, 1, 21)), speeds, 0.5)
    on_the_spot = found[found[:, 0] == 0.0]
    assert len(on_the_spot) and np.abs(on_the_spot[:, 2]).min() >= 0.3 - 1e-6


@pytest.mark.parametrize("axis", [end_kernels.VX, end_kernels.RATE])
def test_speeds_change_towards_the_command_and_no_farther(axis):
    b = np.zeros(end_kernels.BUFFER_SIZE)
    limits = np.array((2.0, -3.0))
    dt = 0.1
    cases = [(0.5, 0.9), (0.5, 0.6), (0.5, -0.4), (0.5, 0.3), (-0.2, -0.1), (0.4, 0.4)]
    for i, (now, wanted) in enumerate(cases):
        end_kernels._load_axis.py_func(b, axis + i, now, wanted, limits, dt)
    assert end_kernels._speed_up.py_func(b, axis, len(cases))
    expected = [
        velocity_samples.project_velocity.py_func(now, 2.0, -3.0, dt, wanted)
        for now, wanted in cases
    ]
    assert b[axis : axis + len(cases)].tolist() == expected
    for _ in range(4):
        end_kernels._speed_up.py_func(b, axis, len(cases))
    assert b[axis : axis + len(cases)].tolist() == [wanted for _, wanted in cases]
    assert not end_kernels._speed_up.py_func(b, axis, len(cases))


@pytest.mark.parametrize("turns", [(-0.05, 0.03, 0.0, 0.05), (-0.3, 0.049, 0.06, -0.01)])
def test_turns_of_a_tile_have_the_bits_of_one_turn(turns):
    b = np.zeros(end_kernels.BUFFER_SIZE)
    b[end_kernels.RATE : end_kernels.RATE + 4] = turns
    b[end_kernels.DT : end_kernels.DT + 4] = 1.0
    end_kernels._turn.py_func(b, 4)
    for i, turn in enumerate(turns):
        assert b[end_kernels.TURN + i] == turn
        assert (
            b[end_kernels.TURN_SINE + i],
            b[end_kernels.TURN_COSINE + i],
        ) == kernels.sine_cosine.py_func(turn)
