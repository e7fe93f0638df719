"""Fixes of a log as positions of the base."""

import math

import numpy as np
import pytest

from harness.recorded import messages
from harness.recorded.mountings import Mountings
from harness.recorded.receiver import Receiver
from harness.recorded.ros_messages import FIX
from navstack.errors import InputError
from navstack.localization.geodesy import LocalFrame
from navstack.types import Pose2D

from . import writing
from .writing import ros


def test_fixes_are_metres_of_the_base_from_the_antenna():
    said: list[str] = []
    mountings = Mountings()
    mountings.give("base_link gps 1.0 0 0")
    frame = LocalFrame(*writing.DATUM)
    receiver = Receiver(mountings, None, "base_link", frame, 0.0, said.append)
    fix = receiver.convert(
        FIX, ros(writing.fix(1.0, 30.0, -10.0, std=0.7)), 1.0, Pose2D(0.0, 0.0, math.pi / 2)
    )
    # a sphere's metres against the ellipsoid's
    assert (fix.x, fix.y) == pytest.approx((30.0, -11.0), abs=0.2)
    assert fix.position_std == pytest.approx(0.7) and not said


def test_the_first_fix_stands_where_the_robot_starts():
    receiver = Receiver(Mountings(), None, None, None, 0.0, lambda _: None)
    first = receiver.convert(FIX, ros(writing.fix(0.0, 500.0, 900.0)), 0.0, Pose2D(3.0, 4.0, 1.0))
    assert (first.x, first.y) == pytest.approx((3.0, 4.0), abs=1e-6)
    second = receiver.convert(FIX, ros(writing.fix(1.0, 510.0, 900.0)), 1.0, Pose2D(3.0, 4.0, 1.0))
    assert (second.x, second.y) == pytest.approx((13.0, 4.0), abs=0.1)


@pytest.mark.parametrize("count", [1, 3])
def test_fixes_of_another_place_at_the_beginning_are_not_the_datum(count):
    said: list[str] = []
    receiver = Receiver(Mountings(), None, "gps", None, 0.0, said.append)
    stored = writing.fix(0.0, 0.0, 0.0)
    stored.fields |= {"latitude": 22.5, "longitude": 114.0}
    for _ in range(count):
        assert receiver.convert(FIX, ros(stored), 0.0, Pose2D()) is not None
    xs = []
    for number in range(10):
        fix = receiver.convert(FIX, ros(writing.fix(1.0, 5.0 * number, 0.0)), 1.0, Pose2D(3.0))
        xs.append(fix and fix.x)
    assert xs[: count - 1] == [None] * (count - 1)
    steps = 5.0 * np.arange(11 - count)
    assert xs[count - 1 :] == pytest.approx(3.0 + steps, abs=0.2)
    assert said == [
        f"fixes jump by more than 100 km after the first {count}: those that follow are placed "
        "where the robot is believed to be"
    ]


def elsewhere(stamp: float) -> writing.Entry:
    """A fix of another continent."""
    entry = writing.fix(stamp, 0.0, 0.0)
    entry.fields |= {"latitude": 22.5, "longitude": 114.0}
    return entry


def test_bad_fixes_before_the_first_good_one_are_left_out_of_a_given_datum():
    frame = LocalFrame(*writing.DATUM)
    receiver = Receiver(Mountings(), None, "gps", frame, 0.0, lambda _: None)
    for number in range(3):
        assert receiver.convert(FIX, ros(elsewhere(0.1 * number)), 0.0, Pose2D()) is None
    assert "more than 100 km from the datum (37.4, -122.1)" in receiver.fixes_elsewhere
    fix = receiver.convert(FIX, ros(writing.fix(1.0, 5.0, 0.0)), 1.0, Pose2D())
    assert fix.x == pytest.approx(5.0, abs=0.2)
    assert receiver.fixes_elsewhere == "" and receiver.left_out[FIX] == 3


def test_a_datum_far_from_all_fixes_is_an_error():
    frame = LocalFrame(*writing.DATUM)
    receiver = Receiver(Mountings(), None, "gps", frame, 0.0, lambda _: None)
    message = ros(elsewhere(0.0))
    for _ in range(100):
        receiver.convert(FIX, message, 0.0, Pose2D())
    with pytest.raises(InputError, match="give a datum near the robot"):
        receiver.convert(FIX, message, 0.0, Pose2D())


def test_a_fix_far_away_on_a_drive_is_left_out():
    said: list[str] = []
    receiver = Receiver(Mountings(), None, "gps", None, 0.0, said.append)
    for number in range(5):
        receiver.convert(FIX, ros(writing.fix(0.0, 5.0 * number, 0.0)), 0.0, Pose2D())
    lost = writing.fix(0.0, 0.0, 0.0)
    lost.fields |= {"latitude": 0.01, "longitude": 0.01}
    assert receiver.convert(FIX, ros(lost), 0.0, Pose2D()) is None
    fix = receiver.convert(FIX, ros(writing.fix(0.0, 25.0, 0.0)), 0.0, Pose2D())
    assert fix.x == pytest.approx(25.0, abs=0.2) and not said


@pytest.mark.parametrize(
    "changes",
    [
        {"status": {"status": -1}},
        {"latitude": math.nan},
        {"latitude": 0.0, "longitude": 0.0},
        {"latitude": 91.0},
    ],
)
def test_no_fix_is_left_out(changes):
    entry = writing.fix(0.0, 1.0, 2.0)
    entry.fields |= changes
    assert messages.coordinates(ros(entry)) is None


@pytest.mark.parametrize(
    "unknown",
    [{"position_covariance_type": 0}, {"position_covariance": np.full(9, math.ulp(0.0))}],
)
def test_an_unknown_covariance_is_no_deviation(unknown):
    entry = writing.fix(0.0, 1.0, 2.0)
    entry.fields |= unknown
    assert messages.gps_fix(ros(entry), 0.0, (1.0, 2.0), np.zeros(3), 0.0).position_std == 0.0
