"""Whether ROS 2 is here."""

import sys
from importlib import import_module

from navstack.errors import InputError

NEEDED = ("rclpy", "sensor_msgs", "nav_msgs", "geometry_msgs", "rosgraph_msgs", "cyclonedds")
PYTHON = f"Python {sys.version_info.major}.{sys.version_info.minor}"


def require_ros2() -> None:
    """Refuse to go on without ROS 2's Python packages, or with those of another Python.

    Raises:
        InputError: one cannot be imported.
    """
    for name in NEEDED:
        try:
            import_module(name)
        except ImportError as error:
            reason = str(error).splitlines()[0]
            raise InputError(
                f"ROS 2's {name} cannot be imported by this {PYTHON} ({reason}); source the "
                f"setup.bash of a ROS 2 for {PYTHON}, or install its wheels: "
                "pip install 'navbench[ros2]'"
            ) from None
