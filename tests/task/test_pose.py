"""Poses that a user gives as texts."""

import pytest

from harness.task.study import parse_pose
from navstack.errors import InputError


def test_a_pose_may_lie_wherever_a_map_may():
    assert parse_pose("--start", "-499998.5,42000005.25,0") == (-499998.5, 42000005.25, 0.0)


@pytest.mark.parametrize("text", ["1,2", "1,2,x", "nan,5,0", "inf,5,0", "", "1,2,3,4"])
def test_what_is_no_pose_is_refused(text):
    with pytest.raises(InputError, match="is not x,y,yaw: three numbers"):
        parse_pose("--start", text)


def test_a_pose_beyond_any_map_is_told_its_limit():
    with pytest.raises(InputError, match=r"'1,-2e8,0' has a number beyond 1e\+08, where no map"):
        parse_pose("--goal", "1,-2e8,0")
