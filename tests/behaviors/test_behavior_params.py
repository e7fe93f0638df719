"""What of a Nav2 file reaches the behaviors."""

import pytest

from navstack.build import read_frequencies
from navstack.params.nav2_file.file import Nav2File, inspect_nav2
from navstack.params.nav2_file.views import read_behavior_server, read_behaviors
from navstack.params.servers import BehaviorServerParams, DriveParams


@pytest.fixture
def read(tmp_path):
    def _read(text: str) -> Nav2File:
        path = tmp_path / "robot.yaml"
        path.write_text(text)
        return inspect_nav2(path)

    return _read


def test_without_a_section_nav2s_defaults_hold(read) -> None:
    nav2 = read("controller_server: {ros__parameters: {}}\n")
    assert read_behavior_server(nav2) == BehaviorServerParams()
    assert [(each.name, each.type, each.params) for each in read_behaviors(nav2)] == [
        ("spin", "nav2_behaviors::Spin", None),
        ("backup", "nav2_behaviors::BackUp", DriveParams()),
        ("drive_on_heading", "nav2_behaviors::DriveOnHeading", DriveParams()),
        ("wait", "nav2_behaviors::Wait", None),
    ]
    assert read_frequencies(nav2).behaviors == 10.0


def test_an_older_server_with_plugins_of_its_own_names_is_understood(read) -> None:
    nav2 = read(
        """
recoveries_server:
  ros__parameters:
    cycle_frequency: 20.0
    recovery_plugins: ["spin", "backup"]
    spin: {plugin: nav2_recoveries/Spin}
    backup: {plugin: nav2_recoveries/BackUp, acceleration_limit: 2.5, deceleration_limit: -2.0,
      minimum_speed: 0.1}
    max_rotational_vel: 1.5
"""
    )
    server = read_behavior_server(nav2)
    assert server.cycle_frequency == 20.0
    assert server.max_rotational_vel == 1.5
    assert server.min_rotational_vel == 0.4
    spin, backup = read_behaviors(nav2)
    assert spin.type == "nav2_behaviors::Spin"
    assert backup.params == DriveParams(2.5, -2.0, 0.1)
    assert read_frequencies(nav2).behaviors == 20.0


def test_a_behavior_that_does_not_exist_here_is_warned_of_and_left_out(read) -> None:
    nav2 = read(
        """
behavior_server:
  ros__parameters:
    behavior_plugins: ["wait", "assisted_teleop"]
    wait: {plugin: "nav2_behaviors::Wait"}
    assisted_teleop: {plugin: "nav2_behaviors::AssistedTeleop"}
"""
    )
    assert [each.name for each in read_behaviors(nav2)] == ["wait"]
    assert any(
        "AssistedTeleop is a Nav2 plugin that is not available here" in line
        for line in nav2.warnings
    )


@pytest.mark.parametrize(
    ("key", "value"), [("cycle_frequency", "0.0"), ("simulate_ahead_time", "-1.0")]
)
def test_values_that_make_no_sense_are_found_when_the_file_is_read(
    read, key: str, value: str
) -> None:
    nav2 = read(f"behavior_server:\n  ros__parameters:\n    {key}: {value}\n")
    assert any(key.rpartition(".")[2] in line for line in nav2.errors)
