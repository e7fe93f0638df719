"""Logs in which clocks were set back or ahead, or stood."""

import dataclasses
import functools
import math

import numpy as np
import pytest

from harness.recorded.clock import Clock
from navstack.types import Pose2D

from .test_localize import replay
from .writing import START, fix, imu, odometry, write

AT = 6.0  # [s] when a clock fails
SECONDS = 16.0


def entries(change, topics=("/odom", "/imu/data", "/fix"), recorder=False):
    """1 m/s to the east; stamps of some topics change from ``AT`` on, and times of arrival."""
    made = []
    for i in range(round(SECONDS / 0.02)):
        t = 0.02 * i
        messages = [odometry(START + t, Pose2D(t, 0.0, 0.0), 1.0, 0.0), imu(START + t, 0.0, 0.0)]
        if i % 10 == 0:
            messages.append(fix(START + t, t, 0.0, std=0.2))
        for entry in messages:
            stamp = arrival = entry.stamp
            if t >= AT and entry.topic in topics:
                stamp = change(stamp)
            if t >= AT and recorder:
                arrival = change(arrival)
            made.append(dataclasses.replace(entry, stamp=stamp, arrival=arrival))
    return made


def follow(tmp_path, capsys, localizer, *of_entries, **more):
    """The document of a replay, and what was said."""
    return told(write(tmp_path / "log", entries(*of_entries, **more), "ros1"), capsys, localizer)


def told(bag, capsys, localizer):
    document = replay(bag, localizer, "--initial-pose", "0,0,0,0.1,0.01")
    return document, capsys.readouterr().err


@pytest.fixture(scope="module")
def bag_of(tmp_path_factory):
    """A log in which clocks were set by a step [s], with or without the recorder's."""

    @functools.cache
    def made(step, recorder):
        log = entries(lambda each: each + step, recorder=recorder)
        return write(tmp_path_factory.mktemp("set") / "log", log, "ros1")

    return made


@pytest.mark.parametrize("localizer", ["odom_imu", "gps-ekf", "gps"])
@pytest.mark.parametrize("step", [-40.0, -7.0, -2.0, 2.0, 7.0, 40.0])
@pytest.mark.parametrize("recorder", [False, True])
def test_a_clock_that_was_set(bag_of, capsys, localizer, step, recorder):
    found, said = told(bag_of(step, recorder), capsys, localizer)
    is_pause = recorder and step > 0.0  # nobody can tell the two apart
    if is_pause and localizer == "odom_imu":
        assert found["degraded_s"] + found["lost_s"] > SECONDS - AT - 0.1
        return
    assert found["final"][:2] == pytest.approx((SECONDS, 0.0), abs=0.5)
    is_said = "note: stamps of" in said or "stamps that are unset or of another time" in said
    assert is_said != is_pause


@pytest.mark.parametrize("localizer", ["odom_imu", "gps-ekf", "gps"])
def test_a_log_of_a_loop(tmp_path, capsys, localizer):
    def again(stamp):
        return START + (stamp - START) % 2.5

    found, said = follow(tmp_path, capsys, localizer, again, recorder=True)
    assert found["final"][:2] == pytest.approx((SECONDS, 0.0), abs=0.5)
    assert "stamps of" in said


@pytest.mark.parametrize("localizer", ["odom_imu", "gps-ekf", "gps"])
@pytest.mark.parametrize("topics", [("/odom", "/imu/data", "/fix"), ("/odom",), ("/fix",)])
def test_a_clock_that_stood(tmp_path, capsys, localizer, topics):
    found, said = follow(tmp_path, capsys, localizer, lambda _: START + AT, topics)
    assert found["final"][:2] == pytest.approx((SECONDS, 0.0), abs=0.6)
    uses = {"odom_imu": ("/odom", "/imu/data"), "gps": ("/imu/data", "/fix")}
    stood = set(uses.get(localizer, topics)) & set(topics)
    assert ("stamps that are unset" in said) == bool(stood)


def test_one_stamp_that_is_wrong_is_not_followed():
    for step in (-5.0, 5.0):
        clock = Clock(0.0)
        for i in range(100):
            stamp = 0.1 * i
            taken = clock.take("/a", stamp, stamp + step * (i == 60))
            assert math.isclose(taken, stamp, abs_tol=0.01)
        assert list(np.round(list(clock.jumps.values()), 3)) == [step]
