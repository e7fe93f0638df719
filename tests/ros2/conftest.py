"""Each worker of the tests has a domain of ROS 2 of its own, on this machine only."""

import os
from collections.abc import Iterator

import pytest

FIRST_DOMAIN = 60


@pytest.fixture(scope="session", autouse=True)
def domain() -> Iterator[int]:
    pytest.importorskip("rclpy", reason="ROS 2's wheels are not installed: navbench[ros2]")
    pytest.importorskip("cyclonedds", reason="Cyclone DDS is not installed: navbench[ros2]")
    worker = os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw")
    number = FIRST_DOMAIN + int(worker) + 20 * (os.getpid() % 2)
    os.environ |= {
        "ROS_DOMAIN_ID": str(number),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    }
    yield number
    import rclpy

    if rclpy.ok():
        rclpy.shutdown()
