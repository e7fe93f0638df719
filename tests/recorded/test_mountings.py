"""Where sensors are on the robot."""

import math
from types import SimpleNamespace as Plain

import numpy as np
import pytest

from harness.recorded.mountings import Mountings, from_angles, from_quaternion, parse_transform
from navstack.errors import InputError


def message(parent: str, child: str, x: float, yaw: float = 0.0) -> Plain:
    turn = Plain(x=0.0, y=0.0, z=math.sin(yaw / 2), w=math.cos(yaw / 2))
    transform = Plain(translation=Plain(x=x, y=0.0, z=0.0), rotation=turn)
    return Plain(
        transforms=[Plain(header=Plain(frame_id=parent), child_frame_id=child, transform=transform)]
    )


def test_frames_are_found_over_a_common_parent_and_against_the_direction():
    mountings = Mountings()
    mountings.take(message("base_footprint", "base_link", 1.0), True)
    mountings.take(message("/base_link", "/mast", 2.0, math.pi / 2), True)
    mountings.take(message("mast", "laser", 3.0), True)
    transform, moves = mountings.find("base_link", "laser")
    assert transform.translation == pytest.approx(
        (2.0, 3.0, 0.0)
    ) and transform.yaw == pytest.approx(math.pi / 2)
    assert not moves
    back, _ = mountings.find("laser", "base_footprint")
    assert (
        back.rotation @ (transform.translation + (1, 0, 0)) + back.translation
    ) == pytest.approx((0, 0, 0))
    assert mountings.find("base_link", "camera") is None


def test_what_the_user_gives_stands():
    mountings = Mountings()
    mountings.give("base_link laser 0.5 0 0")
    mountings.take(message("base_link", "laser", 9.0), True)
    assert mountings.find("base_link", "laser")[0].translation[0] == 0.5


def test_what_changes_in_tf_is_known_to_move():
    mountings = Mountings()
    for x in (0.0, 0.0, 0.2):
        mountings.take(message("base_link", "lift", x), False)
        mountings.take(message("base_link", "laser", 0.3), False)
    assert mountings.find("base_link", "lift")[1]
    assert not mountings.find("base_link", "laser")[1]


@pytest.mark.parametrize(
    "text",
    [
        "base_link imu 0.1 -0.2 0.3 1.5707963 0 -1.5707963",
        "/base_link,/imu,0.1,-0.2,0.3,1.5707963,0,-1.5707963",
        "0.1 -0.2 0.3 -1.5707963 0 1.5707963 base_link imu",
        "base_link imu 0.1 -0.2 0.3 0.5 -0.5 -0.5 0.5",
    ],
)
def test_the_forms_of_a_mounting_agree(text):
    parent, child, transform = parse_transform(text)
    assert (parent, child) == ("base_link", "imu")
    assert transform.translation == pytest.approx((0.1, -0.2, 0.3))
    # x points to the right of the base, y up, z back
    assert transform.rotation == pytest.approx(
        np.array(((0, 0, -1), (-1, 0, 0), (0, 1, 0))), abs=1e-6
    )


def test_the_short_form_is_planar():
    _, _, transform = parse_transform("base_link laser 0.3 0.1 0.5")
    assert transform.translation == pytest.approx(
        (0.3, 0.1, 0.0)
    ) and transform.yaw == pytest.approx(0.5)
    assert transform.tilt == 0.0


@pytest.mark.parametrize(
    "text",
    [
        "",
        "base_link",
        "base_link laser 1 2",
        "base_link base_link 0 0 0",
        "a b nan 0 0",
        "a b 1 2 3 4 5",
        "a b 0 0 0 0 0 0 0",
        "a b x y yaw",
        "a b 1e9 0 0",
    ],
)
def test_another_form_is_an_error_in_one_line(text):
    with pytest.raises(InputError, match="--static-tf .* is none of 'PARENT CHILD x y yaw'"):
        Mountings().give(text)


def test_a_quaternion_and_angles_give_one_rotation():
    assert from_quaternion(0.0, 0.0, math.sin(0.3), math.cos(0.3)) == pytest.approx(
        from_angles(0.0, 0.0, 0.6)
    )
    assert from_quaternion(0.0, 0.0, 0.0, 0.0) is None
    assert from_quaternion(math.nan, 0.0, 0.0, 1.0) is None
