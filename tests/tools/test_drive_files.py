"""Published parameter files drive the robots that they describe."""

import os
from pathlib import Path

import pytest

from harness.metrics.columns import Row
from harness.world.outcome import ARRIVALS
from tools.nav2.drive_files import Driven, drive, files_of, new_offers, summary

DATA = os.environ.get("NAVSTACK_DATA")
FILES = (
    "nav2_defaults/humble.yaml",
    "nav2_params/ROBOTIS-GIT__main__turtlebot3_navigation2_param_burger.yaml",
    "nav2_params/linorobot__humble__linorobot2_navigation_config_navigation.yaml",
)
ARRIVED = [outcome.value for outcome in ARRIVALS]


@pytest.mark.slow
@pytest.mark.skipif(DATA is None, reason="NAVSTACK_DATA is unset: no published files")
@pytest.mark.parametrize("name", FILES)
def test_a_published_file_delivers_on_its_own_body(name):
    driven = drive(Path(DATA or "", name))
    assert (driven.how, driven.agrees) == ("as it is", True), driven.why
    assert driven.outcome in ARRIVED, driven.line()


@pytest.mark.parametrize(
    "text",
    [
        "controller_server: 5",
        "planner_server: {ros__parameters: {expected_planner_frequency: '2.0.0'}}",
        "local_costmap: {local_costmap: {ros__parameters: {resolution: -1.0}}}",
        "controller_server: {ros__parameters: {FollowPath: {max_vel_x: fast}}}",
        "controller_server: {ros__parameters: {FollowPath: {"
        "plugin: 'nav2_mppi_controller::MPPIController', critics: [CostCritic], "
        "CostCritic: {consider_footprint: true}}}}",
        "collision_monitor: {ros__parameters: {polygons: [slow], slow: {action_type: slowdown}}}",
        "costmap_common: {inflation_layer.inflation_radius: 0.6}",
    ],
)
def test_what_run_refuses_is_an_error_of_lint(tmp_path, text):
    (tmp_path / "refused.yaml").write_text(text)
    (file,) = files_of([tmp_path])
    driven = drive(file)
    assert (driven.how, driven.agrees, driven.row) == ("refused", True, {})
    assert "| refused | agrees |" in driven.line()


def test_of_the_offers_for_a_plugin_the_first_is_taken_once():
    message = (
        "drive with another one by --substitute scan=a::Obstacle, or without it by --substitute "
        "scan=none; also drive with another one by --substitute "
        "FollowPath=dwb_core::DWBLocalPlanner"
    )
    follow = "FollowPath=dwb_core::DWBLocalPlanner"
    assert new_offers(message, []) == ["scan=a::Obstacle", follow]
    assert new_offers(message, ["scan=none"]) == [follow]


def test_shares_have_their_intervals():
    row: Row = {"outcome": ARRIVED[0]}
    driven = [
        Driven("a", "as it is", False, False, 1.0, row=row),
        Driven("b", "refused", False, True, 1.0),
    ]
    lines = dict(line.removeprefix("- ").split(": ") for line in summary(driven))
    assert lines["arrived"].startswith("1 = 0.5 [")
    assert lines["lint agrees with run"].startswith("1 = 0.5 [")
    assert lines["traceback"].startswith("0 = 0 [")
