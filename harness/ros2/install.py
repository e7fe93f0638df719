"""Whether ROS 2 is here."""

from importlib.util import find_spec

from navstack.errors import InputError

NEEDED = ("rclpy", "sensor_msgs", "nav_msgs", "geometry_msgs", "rosgraph_msgs", "cyclonedds")


def require_ros2() -> None:
    """Refuse to go on without ROS 2's Python packages.

    Raises:
        InputError: one is missing.
    """
    missing = [name for name in NEEDED if find_spec(name) is None]
    if missing:
        raise InputError(
            f"ROS 2's {', '.join(missing)} cannot be imported; source your ROS 2's setup.bash, or "
            "install its wheels: pip install 'navbench[ros2]'"
        )
