"""The map that a robot's map server publishes."""

import time

import rclpy
from nav_msgs.msg import OccupancyGrid as GridMessage
from rclpy.executors import SingleThreadedExecutor

from harness.ros2 import messages
from harness.ros2.robot import LATCHED, join
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import InputError

_NODE = "navbench_drive_map"


def receive_map(timeout: float) -> OccupancyGrid:
    """The map that somebody publishes on /map.

    Args:
        timeout: [s] of wall time.

    Raises:
        InputError: none came.
    """
    join()
    node = rclpy.create_node(_NODE)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    found: list[GridMessage] = []
    node.create_subscription(GridMessage, "map", found.append, LATCHED)
    deadline = time.monotonic() + timeout
    while not found and time.monotonic() < deadline:
        executor.spin_once(timeout_sec=0.1)
    executor.shutdown()
    node.destroy_node()
    if not found:
        raise InputError(f"no map came on /map within {timeout:g} s; give --map FILE")
    return messages.grid_of(found[0])
