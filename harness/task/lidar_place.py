"""Where a robot carries the lidar of a sensor preset that was made for another one."""

import io
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML

from harness.storage.shipped import shipped
from harness.task.made_files import made_file
from navstack.errors import InputError
from navstack.params.strict import load_yaml
from navstack.types import FloatArray

MARGIN = 0.25  # [m] beyond a body that the filter of its own returns reaches at most


def is_preset(sensors: Path) -> bool:
    """Whether a file of sensors comes with the program."""
    return sensors.parent == (shipped("params") / "sensors").resolve()


def fitting_sensors(sensors: Path, robot: Path) -> Path:
    """A preset with its lidar in the middle of the robot, unless it is where it can be.

    A user's own file is taken as it is, and a robot's file that cannot be read is refused where
    the robot is built.
    """
    if not is_preset(sensors):
        return sensors
    try:
        box = box_about(np.array(load_yaml(robot)["footprint"], dtype=np.float64))
    except (InputError, LookupError, TypeError, ValueError):
        return sensors
    if box.shape != (2, 2):
        return sensors
    content = load_yaml(sensors)
    if _fits(content["lidar"], box):
        return sensors
    carry(content["lidar"], box)
    return made_file(sensors.name, yaml_text(content))


def box_about(outline: FloatArray) -> FloatArray:
    """Lower and upper corner (2, 2) about a polygon (N, 2)."""
    return np.round((outline.min(axis=0), outline.max(axis=0)), 6)


def carry(lidar: dict[str, Any], box: FloatArray) -> None:
    """Place a lidar in the middle of a body.

    Args:
        lidar: as a file of sensors has it; is changed.
        box: lower and upper corner (2, 2) of the body in [m], base frame.
    """
    (x_min, y_min), (x_max, y_max) = box.tolist()
    lidar["mount"] = {"x": 0.5 * (x_min + x_max), "y": 0.5 * (y_min + y_max), "yaw": 0.0}
    lidar["self_filter"] = {"x_min": x_min, "x_max": x_max, "y_min": y_min, "y_max": y_max}


def yaml_text(content: dict[str, Any]) -> str:
    """A mapping as YAML."""
    stream = io.StringIO()
    YAML(pure=True).dump(content, stream)
    return stream.getvalue()


def _fits(lidar: dict[str, Any], box: FloatArray) -> bool:
    """Whether a lidar stands on a body, and hides that body and little more from itself."""
    mount = np.array((lidar["mount"]["x"], lidar["mount"]["y"]))
    hidden = lidar["self_filter"]
    low = np.array((hidden["x_min"], hidden["y_min"]))
    high = np.array((hidden["x_max"], hidden["y_max"]))
    beyond = np.concatenate((box[0] - low, high - box[1]))
    is_on_body = bool((box[0] <= mount).all() and (mount <= box[1]).all())
    return is_on_body and bool((beyond >= 0.0).all() and (beyond <= MARGIN).all())
