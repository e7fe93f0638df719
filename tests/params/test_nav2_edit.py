from pathlib import Path

import pytest

from navstack.errors import ParameterError
from navstack.params.nav2_edit import format_value
from navstack.params.nav2_file import load_nav2
from navstack.params.nav2_views import read_costmap, read_dwb, read_velocity_smoother
from navstack.params.ros_yaml import parse_scalar

TUNED = Path(__file__).parents[2] / "params" / "nav2" / "tuned.yaml"


def changed_lines(before, after):
    return [line for line in after.splitlines() if line not in before.splitlines()]


def test_a_changed_value_is_the_only_changed_line():
    nav2 = load_nav2(TUNED)
    after = nav2.with_values({"controller_server.FollowPath.max_vel_x": 2, "velocity_smoother.max_velocity": [2, 0, 1]})
    assert read_dwb(after).max_vel_x == 2.0
    assert read_velocity_smoother(after).max_velocity == (2.0, 0.0, 1.0)
    assert changed_lines(nav2.document.text, after.document.text) == [
        "      max_vel_x: 2.0",
        "    max_velocity: [2.0, 0.0, 1.0]",
    ]
    assert read_dwb(nav2).max_vel_x == 3.0  # the original is unchanged


def test_dotted_names_and_comments_are_kept(inspect):
    nav2 = inspect(
        "controller_server:\n  ros__parameters:\n    FollowPath:  # the one\n"
        "      PathAlign.scale: 3.0   # tuned by hand\n      critics: [PathAlign]\n"
    )
    after = nav2.with_values({"controller_server.FollowPath.PathAlign.scale": 4.5})
    assert "      PathAlign.scale: 4.5   # tuned by hand\n" in after.document.text


def test_absent_parameters_are_added_in_their_namespace(inspect):
    nav2 = inspect(
        "controller_server:\n  ros__parameters:\n    FollowPath:\n      max_vel_x: 1.0  # [m/s]\n"
        "local_costmap: {local_costmap: {ros__parameters: {width: 3}}}"
    )
    after = nav2.with_values(
        {
            "controller_server.FollowPath.PathAlign.scale": 2.0,
            "controller_server.controller_frequency": 30.0,
            "local_costmap.robot_radius": 0.4,
            "global_costmap.robot_radius": 0.5,
            "velocity_smoother.feedback": "CLOSED_LOOP",
        }
    )
    assert (
        "      max_vel_x: 1.0  # [m/s]\n      PathAlign.scale: 2.0\n    controller_frequency: 30.0\n"
        in after.document.text
    )
    assert read_dwb(after).PathAlign.scale == 2.0
    assert after.value("controller_server", "controller_frequency") == 30.0
    assert read_costmap(after, "local_costmap").robot_radius == 0.4
    assert read_costmap(after, "global_costmap").robot_radius == 0.5
    assert read_velocity_smoother(after).feedback == "CLOSED_LOOP"
    assert not after.errors


def test_the_last_of_two_duplicates_is_changed(inspect):
    nav2 = inspect("amcl:\n  ros__parameters:\n    alpha1: 0.1\n    alpha1: 0.2\n")
    assert nav2.with_values({"amcl.alpha1": 0.3}).document.text.endswith("    alpha1: 0.1\n    alpha1: 0.3\n")


def test_block_lists_are_replaced(inspect):
    nav2 = inspect(
        "controller_server:\n  ros__parameters:\n    FollowPath:\n      critics:\n      - PathDist  # first\n"
        "      - GoalDist\n\n      # speed\n      max_vel_x: 1.0\n"
    )
    after = nav2.with_values({"controller_server.FollowPath.critics": ["PathAlign"]})
    assert read_dwb(after).critics == ("PathAlign",)
    assert read_dwb(after).max_vel_x == 1.0
    assert "# speed" in after.document.text


def test_a_value_behind_an_alias_is_not_changed(inspect):
    nav2 = inspect("amcl:\n  ros__parameters:\n    alpha1: &noise 0.1\n    alpha2: *noise\n    alpha3: 0.3\n")
    with pytest.raises(ParameterError, match="line 4: alpha2 is a YAML alias"):
        nav2.with_values({"amcl.alpha2": 0.2})
    assert nav2.with_values({"amcl.alpha3": 0.2}).value("amcl", "alpha3") == 0.2


def test_misspelt_changes_are_refused():
    nav2 = load_nav2(TUNED)
    with pytest.raises(ParameterError, match="did you mean 'max_vel_x'"):
        nav2.with_values({"controller_server.FollowPath.max_vel_xx": 1.0})
    with pytest.raises(ParameterError, match=r"is not node\.parameter"):
        nav2.with_values({"max_vel_x": 1.0})


@pytest.mark.parametrize("value", [True, False, 0, -7, 1e-10, 2.0, 0.1, float("inf"), -1.5e300])
def test_written_scalars_read_back_as_they_were(value):
    read = parse_scalar(format_value(value))
    assert (read, type(read)) == (value, type(value))
