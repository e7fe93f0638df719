"""The simulated robot as a node: what its sensors deliver goes out, commands come in."""

import os
import time
from collections.abc import Sequence

import rclpy
from action_msgs.msg import GoalStatus, GoalStatusArray
from action_msgs.srv import CancelGoal
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist, TwistStamped
from nav_msgs.msg import OccupancyGrid as GridMessage
from nav_msgs.msg import Odometry as OdometryMessage
from rclpy.executors import SingleThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.signals import SignalHandlerOptions
from rclpy.subscription import Subscription
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import Imu as ImuMessage
from sensor_msgs.msg import LaserScan as ScanMessage
from sensor_msgs.msg import NavSatFix
from visualization_msgs.msg import Marker, MarkerArray

from harness.ros2 import messages
from harness.ros2.transforms import Frame, TransformPublisher
from harness.task.ros2_params import Ros2Params
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.geometry import compose, relative_to
from navstack.localization.geodesy import LocalFrame
from navstack.types import FloatArray, Observation, Pose2D, Twist2D

NODE = "navbench_robot"
LATCHED = QoSProfile(
    depth=1,
    durability=DurabilityPolicy.TRANSIENT_LOCAL,
    reliability=ReliabilityPolicy.RELIABLE,
)
# takes commands of reliable and of best-effort publishers
_COMMANDS = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
_COMMAND_TYPES = {"geometry_msgs/msg/Twist": Twist, "geometry_msgs/msg/TwistStamped": TwistStamped}
OLDEST = 1.0  # [s] that the stamp of a command is believed to be old
_PERSON_HEIGHT = 1.75  # [m] of a marker
# the environment variable that keeps discovery on this machine, unless the user says otherwise
_RANGE = "ROS_AUTOMATIC_DISCOVERY_RANGE"


def join() -> None:
    """Join ROS 2 on this machine, once per process."""
    os.environ.setdefault(_RANGE, "LOCALHOST")
    if not rclpy.ok():
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)


class RobotNode:
    """Publishes the clock, sensors, frames, the map and people; holds the newest command."""

    def __init__(self, params: Ros2Params, planning_map: OccupancyGrid) -> None:
        """Join, and publish the map.

        Args:
            params: topics' frames and limits.
            planning_map: for /map.
        """
        join()
        self._params = params
        self._site = LocalFrame(params.latitude, params.longitude)
        self._node = rclpy.create_node(NODE)
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._transforms = TransformPublisher(int(os.environ.get("ROS_DOMAIN_ID", "0")))
        publish = self._node.create_publisher
        self._clock = publish(Clock, "/clock", 10)
        self._scan = publish(ScanMessage, "scan", 10)
        self._odometry = publish(OdometryMessage, "odom", 10)
        self._imu = publish(ImuMessage, "imu", 10)
        self._fix = publish(NavSatFix, "gps/fix", 10)
        self._start = publish(PoseWithCovarianceStamped, "initialpose", 10)
        self._goal = publish(PoseStamped, "goal_pose", 10)
        self._people = publish(MarkerArray, "people", 10)
        self._map = publish(GridMessage, "map", LATCHED)
        self._map.publish(messages.map_message(planning_map, params.map_frame))
        self._node.create_subscription(
            GoalStatusArray, "navigate_to_pose/_action/status", self._take_status, LATCHED
        )
        self._cancel = self._node.create_client(CancelGoal, "navigate_to_pose/_action/cancel_goal")
        self._subscription: Subscription | None = None
        self._heard_type = ""  # of commands that are subscribed to
        self._heard_before = 0  # commands before that
        self.heard, self.refused = 0, 0  # commands so far, and those that no robot can follow
        self.command = Twist2D()
        # [s] of the clock at the newest command, by its stamp where that can be; and now
        self.commanded_at = self._now = 0.0
        self.is_aborted = False
        self._odom_pose = Pose2D()
        self._static: Sequence[Frame] = ()

    @property
    def listeners(self) -> int:
        """How many listen to goals; who was killed counts for some seconds more."""
        return int(self._node.count_subscribers("goal_pose"))

    def begin(self, start: Pose2D, stamp: float) -> None:
        """End the goal of the delivery before, if there is one, and say where the robot is put.

        Commands are looked for anew: a peer that was restarted may have another type of them.
        """
        self.listen_anew()
        if self._cancel.service_is_ready():
            self._cancel.call_async(CancelGoal.Request())  # without a goal's id: all of them
        self.command, self.is_aborted, self._odom_pose = Twist2D(), False, Pose2D()
        frame = self._params.map_frame
        self._start.publish(messages.start_message(start, stamp, frame))

    def send_goal(self, goal: Pose2D, stamp: float) -> None:
        """Send the goal of a delivery."""
        self._goal.publish(messages.goal_message(goal, stamp, self._params.map_frame))

    def publish(self, seen: Observation, truth: Pose2D, people: FloatArray, offset: float) -> None:
        """Publish what was seen, and last the clock.

        Args:
            seen: what arrived since the last call.
            truth: where the robot is, for map -> odom where it is asked for.
            people: their true positions (n, 4), nan where there is nobody.
            offset: [s] of the clock at the delivery's begin.
        """
        params, stamp = self._params, seen.stamp + offset
        if seen.odometry is not None:
            self._odom_pose = seen.odometry.pose
            self._odometry.publish(messages.odometry_message(seen.odometry, offset, params))
        frames = [Frame(params.odom_frame, params.base_frame, self._odom_pose)]
        if params.publishes_map_frame:
            frames.append(Frame(params.map_frame, params.odom_frame, self._odom_in_map(truth)))
        self._transforms.send(frames, stamp)
        if seen.imu is not None:
            self._imu.publish(messages.imu_message(seen.imu, offset, params.imu_frame))
        if seen.gps is not None:
            fix = messages.fix_message(seen.gps, offset, params.gps_frame, self._site)
            self._fix.publish(fix)
        if seen.scan is not None:
            self._send_sensors(seen.scan.sensor_pose)
            self._scan.publish(messages.scan_message(seen.scan, offset, params.scan_frame))
            self._people.publish(self._markers(people, stamp))
        self._now = stamp
        self._clock.publish(Clock(clock=messages.time_of(stamp)))

    def wait_for_command(self, timeout: float) -> bool:
        """Take in what comes until a command does; whether one came within ``timeout`` [s]."""
        before, deadline = self.heard, time.monotonic() + timeout
        self._listen()
        while self.heard == before:
            left = deadline - time.monotonic()
            if left <= 0.0:
                return False
            self._executor.spin_once(timeout_sec=left if self._subscription else min(left, 0.05))
            self._listen()
        return True

    def take_in(self) -> None:
        """Take in what has come, without waiting."""
        self._listen()
        self._executor.spin_once(timeout_sec=0.0)

    @property
    def misses_commands(self) -> bool:
        """Whether commands are published of another type than is subscribed to."""
        return bool(self._command_types() - {self._heard_type})

    def _command_types(self) -> set[str]:
        """The types that are published; who was killed counts for some seconds more."""
        published = self._node.get_publishers_info_by_topic("/cmd_vel")
        return {each.topic_type for each in published} & set(_COMMAND_TYPES)

    def listen_anew(self) -> None:
        """Look again for who publishes commands."""
        if self._subscription is not None:
            self._node.destroy_subscription(self._subscription)
            self._subscription = None

    def _listen(self) -> None:
        """Subscribe to commands once somebody publishes them, by the type that he has.

        A topic has one type at a time. Where two are published, one may be of a peer that was
        killed: from a type of which nothing was heard it turns to the other one.
        """
        if self._subscription is not None:
            return
        types = self._command_types()
        if not types:
            return
        is_deaf = self.heard == self._heard_before
        if is_deaf and len(types) > 1:
            types.discard(self._heard_type)
        if is_deaf or self._heard_type not in types:
            self._heard_type = min(types)
        self._heard_before = self.heard
        kind = _COMMAND_TYPES[self._heard_type]
        self._subscription = self._node.create_subscription(
            kind, "/cmd_vel", self._take_command, _COMMANDS
        )

    def _take_command(self, message: Twist | TwistStamped) -> None:
        command = messages.command_of(message)
        if command is None:
            self.refused += 1
            return
        self.command, self.commanded_at = command, self._now
        self.heard += 1
        if isinstance(message, TwistStamped):
            stamp = messages.seconds(message.header.stamp)
            if 0.0 <= self._now - stamp <= OLDEST:
                self.commanded_at = stamp

    def _take_status(self, message: GoalStatusArray) -> None:
        statuses = [each.status for each in message.status_list]
        self.is_aborted = statuses[-1:] == [GoalStatus.STATUS_ABORTED]

    def _send_sensors(self, laser: Pose2D) -> None:
        params = self._params
        frames = [
            Frame(params.base_frame, params.scan_frame, laser),
            Frame(params.base_frame, params.imu_frame, Pose2D()),
            Frame(params.base_frame, params.gps_frame, Pose2D()),
        ]
        if frames != self._static:
            self._static = frames
            self._transforms.send_static(frames)

    def _odom_in_map(self, truth: Pose2D) -> Pose2D:
        return compose(truth, relative_to(self._odom_pose, Pose2D()))

    def _markers(self, people: FloatArray, stamp: float) -> MarkerArray:
        found = MarkerArray()
        for number, (x, y, _, _) in enumerate(people.tolist()):
            marker = Marker(ns="people", id=number, type=Marker.CYLINDER, action=Marker.ADD)
            marker.header.frame_id = self._params.map_frame
            marker.header.stamp = messages.time_of(stamp)
            if x != x:  # nobody there
                marker.action = Marker.DELETE
                found.markers.append(marker)
                continue
            marker.pose = messages.pose_message(Pose2D(x, y))
            marker.pose.position.z = 0.5 * _PERSON_HEIGHT
            marker.scale.x, marker.scale.y, marker.scale.z = 0.5, 0.5, _PERSON_HEIGHT
            marker.color.r, marker.color.g, marker.color.b, marker.color.a = 0.9, 0.4, 0.1, 1.0
            found.markers.append(marker)
        return found
