"""Each worker of the tests has a domain of ROS 2 of its own, on this machine only."""

import gc
import os
from collections.abc import Iterator

import pytest

# domains that Linux leaves free of its own ports are below 102
FIRST_DOMAIN, DOMAINS = 20, 80


@pytest.fixture(scope="session", autouse=True)
def domain() -> Iterator[int]:
    pytest.importorskip("rclpy", reason="ROS 2's wheels are not installed: navbench[ros2]")
    pytest.importorskip("cyclonedds", reason="Cyclone DDS is not installed: navbench[ros2]")
    # workers' processes start one after the other; those of another checkout do elsewhere
    number = FIRST_DOMAIN + os.getpid() % DOMAINS
    os.environ |= {
        "ROS_DOMAIN_ID": str(number),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }
    yield number
    import rclpy

    if rclpy.ok():
        rclpy.shutdown()


@pytest.fixture(scope="module", autouse=True)
def robots_leave(domain: int) -> Iterator[None]:
    """A robot that was served in this process publishes no longer than its module's tests."""
    yield
    from harness.execution.process_cache import forget
    from harness.ros2.robot import RobotNode

    for each in gc.get_objects():
        # isinstance() would ask a dead weak proxy of somebody else for its class, which raises
        if type(each) is RobotNode:
            each._node.destroy_node()
    forget()
