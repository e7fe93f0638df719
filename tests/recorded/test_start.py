"""Where a replay starts, and what is said meanwhile."""

import numpy as np
import pytest

from harness.recorded.start import local_frame, start_belief, static_map
from harness.storage.shipped import shipped
from navstack.costmap.occupancy_grid import UNKNOWN
from navstack.errors import InputError
from navstack.params.nav2_file.file import load_nav2
from navstack.types import Pose2D

STOCK = (shipped("params") / "nav2" / "stock.yaml").read_text(encoding="utf-8")


def nav2(folder, more: str = ""):
    """The stock file with more parameters of AMCL."""
    path = folder / "nav2.yaml"
    path.write_text(STOCK.replace("    laser_model_type:", f"{more}    laser_model_type:", 1))
    return load_nav2(path)


def test_amcl_starts_where_the_file_says_if_it_says_so(tmp_path):
    pose = "    initial_pose: {x: 1.5, y: -2.0, z: 0.0, yaw: 0.7}\n"
    said = nav2(tmp_path, "    set_initial_pose: true\n" + pose)
    assert start_belief(None, said, "amcl").pose == Pose2D(1.5, -2.0, 0.7)
    assert start_belief(None, said, "gps-ekf").pose == Pose2D()
    assert start_belief("3,4,0.1", said, "amcl").pose == Pose2D(3.0, 4.0, 0.1)
    assert start_belief(None, nav2(tmp_path, pose), "amcl") is None
    assert start_belief(None, nav2(tmp_path), "odom_imu").pose == Pose2D()


def test_deviations_of_the_start_become_its_covariance(tmp_path):
    belief = start_belief("1,2,3,0.5,0.2", nav2(tmp_path), "amcl")
    assert belief.covariance == pytest.approx(np.diag((0.25, 0.25, 0.04)))
    assert not start_belief("1,2,3", nav2(tmp_path), "amcl").covariance.any()
    assert start_belief("1,2,3,0,0", nav2(tmp_path), "amcl").covariance.max() == pytest.approx(
        1e-12
    )


@pytest.mark.parametrize(
    "text", ["", "1,2", "1,2,3,4", "1,2,x", "1,2,nan", "1,2,3,-1,1", "1,2,1e300"]
)
def test_another_start_is_an_error(tmp_path, text):
    with pytest.raises(InputError, match="--initial-pose"):
        start_belief(text, nav2(tmp_path), "amcl")


def test_a_start_may_lie_where_a_map_may():
    far = start_belief("-499998.5,42000005.25,0", None, "amcl")
    assert (far.pose.x, far.pose.y) == (-499998.5, 42000005.25)
    with pytest.raises(InputError, match=r"1,2e8,0' has a number beyond 1e\+08; give x,y,yaw"):
        start_belief("1,2e8,0", None, "amcl")


@pytest.mark.parametrize("text", ["91,0", "1", "1,2,3,4", "a,b", "0,400"])
def test_another_datum_is_an_error(text):
    with pytest.raises(InputError):
        local_frame(text)


def test_localizers_without_scans_need_no_map():
    assert local_frame(None) == (None, 0.0)
    assert (static_map(None, "gps-ekf").data == UNKNOWN).all()
    with pytest.raises(InputError, match="localizer amcl-gps needs a map"):
        static_map(None, "amcl-gps")
