"""Which topics are read."""

import pytest

from harness.recorded.ros_messages import FIX, IMU, ODOMETRY, POSE_COVARIANCE, SCAN, TRANSFORMS
from harness.recorded.topics import Topics
from navstack.errors import InputError


def topics(*remaps: str, **kinds: str) -> Topics:
    types = {name.replace("__", "/"): kind for name, kind in kinds.items()}
    return Topics(types, dict.fromkeys(types, 1), remaps)


def test_the_only_topic_of_a_type_is_taken_whatever_its_name():
    assert topics(__robot1__lidar=SCAN).find(SCAN, None) == "/robot1/lidar"
    assert topics(__robot1__lidar=SCAN).find(IMU, None) is None


def test_of_several_the_usual_name_is_taken_also_in_a_namespace():
    assert topics(__imu__data=IMU, __imu__data_raw=IMU).find(IMU, None) == "/imu/data"
    assert topics(__r1__scan=SCAN, __r1__scan_filtered=SCAN).find(SCAN, None) == "/r1/scan"
    assert topics(odom=ODOMETRY, odom_filtered=ODOMETRY).find(ODOMETRY, None) == "odom"
    with pytest.raises(
        InputError,
        match="several topics .*: /left/scan, /right/scan; choose one with --remap /scan:=",
    ):
        topics(__left__scan=SCAN, __right__scan=SCAN).find(SCAN, None)


def test_poses_that_a_localizer_is_told_are_not_its_own():
    told = {"__initialpose": POSE_COVARIANCE, "__ekf__set_pose": POSE_COVARIANCE}
    assert topics(**told).find(POSE_COVARIANCE, None) is None
    assert topics(**told, __amcl=POSE_COVARIANCE).find(POSE_COVARIANCE, None) == "/amcl"
    chosen = topics("/amcl_pose:=/initialpose", **told).find(POSE_COVARIANCE, None)
    assert chosen == "/initialpose"


def test_the_reference_is_no_input_unless_there_is_no_other():
    both = topics(__truth=ODOMETRY, __wheels=ODOMETRY)
    assert both.find(ODOMETRY, "/truth") == "/wheels"
    assert topics(__odom=ODOMETRY).find(ODOMETRY, "/odom") == "/odom"


@pytest.mark.parametrize("remap", ["/scan:=/front/scan", "scan:=front/scan", "/front/scan:=/scan"])
def test_a_remapping_names_the_topic_in_either_direction(remap):
    assert topics(remap, __front__scan=SCAN, __rear__scan=SCAN).find(SCAN, None) == "/front/scan"


def test_wrong_remappings_are_one_line():
    with pytest.raises(InputError, match="is not USUAL:=ACTUAL"):
        topics("/scan=/front", __front=SCAN)
    with pytest.raises(InputError, match="unknown topic to remap '/scam'; did you mean '/scan'"):
        topics("/scam:=/front", __front=SCAN)
    with pytest.raises(InputError, match="'/frond' is not in the bag; did you mean '/front'"):
        topics("/scan:=/frond", __front=SCAN)
    with pytest.raises(
        InputError, match="topic /fix is of the type sensor_msgs/msg/NavSatFix, not sensor_msgs"
    ):
        topics("/scan:=/fix", __fix=FIX).find(SCAN, None)


def test_frames_come_from_the_usual_topics_or_remapped_ones():
    assert topics(__tf=TRANSFORMS, __tf_static=TRANSFORMS).transforms() == [
        ("/tf", False),
        ("/tf_static", True),
    ]
    assert topics(__r1__tf_static=TRANSFORMS, __other=TRANSFORMS).transforms() == [
        ("/r1/tf_static", True)
    ]
    assert topics("/tf_static:=/frames", __frames=TRANSFORMS).transforms() == [("/frames", True)]
