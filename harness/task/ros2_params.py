"""How a stack drives that runs elsewhere, over ROS 2: ``ros2`` in a stack file."""

from dataclasses import dataclass
from typing import Annotated

from navstack.ranges import NotNegative, Parameters, Positive, up_to, within


@dataclass(frozen=True, slots=True)
class Ros2Params(Parameters, whose="ros2"):
    """Time, topics and frames, as Nav2's tutorials and its loopback simulator have them."""

    # [Hz] at which a command is waited for; 0: at every tick
    controller_frequency: Annotated[float, within(0, 1000)] = 20.0
    # x real time at which the clock runs; 0: lockstep, it runs as fast as commands come
    rate: NotNegative = 0.0
    # [s] of wall time for a command; after a missed one the clock runs in real time
    wait: Annotated[float, up_to(600)] = 1.0
    # share of missed waits at which a delivery has failed; counted from the 50th command on
    most_missed: Annotated[float, up_to(1)] = 0.5
    # [s] of wall time for the first command after a goal was sent
    start_limit: Annotated[float, up_to(1800)] = 60.0
    # [s] of the clock for which the robot stands before it gets a goal, so that the marks of the
    # last delivery are cleared from costmaps
    settle: Annotated[float, within(0, 600)] = 3.0
    # [s] of the clock after which a command without a successor ends: the robot stops
    command_timeout: Positive = 0.2
    publishes_map_frame: bool = False  # map -> odom by the true pose: the peer need not localize
    latitude: Annotated[float, within(-90, 90)] = 34.05  # [deg] of the map's origin, for fixes
    longitude: Annotated[float, within(-180, 180)] = -118.25  # [deg]
    map_frame: str = "map"
    odom_frame: str = "odom"
    base_frame: str = "base_link"
    scan_frame: str = "base_scan"
    imu_frame: str = "imu_link"
    gps_frame: str = "gps_link"


NO_ROS2 = Ros2Params()
