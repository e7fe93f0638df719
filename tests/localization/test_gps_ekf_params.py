"""The node ``gps_ekf`` of a robot's parameter file."""

import dataclasses
from pathlib import Path

import pytest

from harness.storage.shipped import shipped
from harness.task.stack import load_stack
from navstack.errors import ParameterError
from navstack.params.gps_ekf import GpsEkfParams
from navstack.params.nav2_file.file import inspect_nav2, load_nav2


def file_with(tmp_path, text):
    file = tmp_path / "robot.yaml"
    file.write_text(f"gps_ekf: {{ros__parameters: {{{text}}}}}\n", encoding="utf-8")
    return file


def test_without_a_section_the_defaults_hold():
    nav2 = load_nav2(shipped("params") / "nav2" / "tuned.yaml")
    assert nav2.read(GpsEkfParams, "gps_ekf") == GpsEkfParams()


def test_every_parameter_is_known_and_read(tmp_path):
    other = {
        field.name: {float: 0.125, int: 7, str: "filterpy", bool: True}[type(field.default)]
        for field in dataclasses.fields(GpsEkfParams)
    }
    text = ", ".join(f"{name}: {str(value).lower()}" for name, value in other.items())
    nav2 = load_nav2(file_with(tmp_path, text))
    assert nav2.read(GpsEkfParams, "gps_ekf") == GpsEkfParams(**other)
    assert not nav2.warnings
    assert not nav2.ignored
    assert nav2.merged()["gps_ekf"]["ros__parameters"] == other


def test_a_misspelt_parameter(tmp_path):
    (error,) = inspect_nav2(file_with(tmp_path, "gps0_lockout_cuont: 3")).errors
    assert "gps0_lockout_cuont" in error
    assert "did you mean 'gps0_lockout_count'" in error


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("gps0_position_std: 0.0", "gps0_position_std 0.0 must be more than 0"),
        ("odom0_scale_std: -0.1", "odom0_scale_std -0.1 must be 0 or more"),
        ("gps0_correlated_share: 1.0", "gps0_correlated_share 1.0 must be less than 1"),
        ("engine: matlab", "engine matlab must be one of kernel, filterpy"),
        ("history_length: .inf", "history_length inf must be a finite number"),
        ("gps0_lockout_count: 0", "gps0_lockout_count 0 must be more than 0"),
        ("gps0_lockout_count: many", "gps0_lockout_count: 'many' is not a whole number"),
    ],
)
def test_a_value_that_cannot_be(tmp_path, text, said):
    with pytest.raises(ParameterError, match=said) as raised:
        load_nav2(file_with(tmp_path, text)).read(GpsEkfParams, "gps_ekf")
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize(("name", "base"), [("nav2-gps-ekf", "amcl"), ("rpp-gps-ekf", "rpp")])
def test_the_stacks_files_differ_from_those_without_it_by_its_section_only(name, base):
    stack = load_stack(name)
    assert (stack.localizer, stack.planning_map, stack.carries) == (
        "gps-ekf",
        "geometry",
        ("lidar", "gps"),
    )
    own, other = (
        load_nav2(Path(stack.nav2_file)),
        load_nav2(shipped("params") / "nav2" / f"{base}.yaml"),
    )
    calibrated = dataclasses.replace(
        GpsEkfParams(), imu0_yaw_offset_std=0.05, imu0_yaw_offset_walk=0.003
    )
    assert own.read(GpsEkfParams, "gps_ekf") == calibrated
    merged, without = own.merged(), other.merged()
    del merged["gps_ekf"], without["gps_ekf"]
    if base == "amcl":  # which knows this robot's odometry
        del merged["amcl"], without["amcl"]
    assert merged == without
