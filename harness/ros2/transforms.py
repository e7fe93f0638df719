"""Transforms on /tf and /tf_static.

tf2_msgs has no wheel, so tf2_msgs/TFMessage goes out through Cyclone DDS. Type name and bytes are
those of ROS 2, so that nodes of every middleware hear it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import float64, int32, sequence, uint32
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from harness.ros2.messages import quaternion, time_of
from navstack.types import Pose2D

# messages stay on this machine, as rclpy's do
LOOPBACK = (
    "<CycloneDDS><Domain><General><Interfaces>"
    '<NetworkInterface name="lo" multicast="true"/>'
    "</Interfaces></General></Domain></CycloneDDS>"
)
_RELIABLE = Policy.Reliability.Reliable(duration(seconds=1))


@dataclass
class _Time(IdlStruct, typename="builtin_interfaces::msg::dds_::Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class _Header(IdlStruct, typename="std_msgs::msg::dds_::Header_"):
    stamp: _Time
    frame_id: str


@dataclass
class _Vector3(IdlStruct, typename="geometry_msgs::msg::dds_::Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class _Quaternion(IdlStruct, typename="geometry_msgs::msg::dds_::Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class _Transform(IdlStruct, typename="geometry_msgs::msg::dds_::Transform_"):
    translation: _Vector3
    rotation: _Quaternion


@dataclass
class _TransformStamped(IdlStruct, typename="geometry_msgs::msg::dds_::TransformStamped_"):
    header: _Header
    child_frame_id: str
    transform: _Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs::msg::dds_::TFMessage_"):
    """Frames in frames."""

    transforms: sequence[_TransformStamped]  # type: ignore[type-arg]


@dataclass(frozen=True, slots=True)
class Frame:
    """Where a frame is in its parent."""

    parent: str
    child: str
    pose: Pose2D


def transform_message(frames: Sequence[Frame], stamp: float) -> TFMessage:
    """Frames at a time [s] of the clock."""
    time = time_of(stamp)
    header_time = _Time(time.sec, time.nanosec)
    found = []
    for each in frames:
        turn = quaternion(each.pose.yaw)
        transform = _Transform(
            _Vector3(each.pose.x, each.pose.y, 0.0), _Quaternion(turn.x, turn.y, turn.z, turn.w)
        )
        found.append(_TransformStamped(_Header(header_time, each.parent), each.child, transform))
    return TFMessage(found)  # type: ignore[arg-type]


@cache
def _join(domain: int) -> tuple[Domain, DomainParticipant]:
    """A process joins a domain once, and stays."""
    return Domain(domain, LOOPBACK), DomainParticipant(domain)


class TransformPublisher:
    """Publishes moving frames on /tf, and those that stay on /tf_static."""

    def __init__(self, domain: int) -> None:
        """Join a domain of DDS on this machine's loopback."""
        _, participant = _join(domain)
        moving = Qos(_RELIABLE, Policy.History.KeepLast(100))
        staying = Qos(_RELIABLE, Policy.History.KeepLast(1), Policy.Durability.TransientLocal)
        self._moving = DataWriter(
            participant, Topic(participant, "rt/tf", TFMessage, moving), qos=moving
        )
        self._staying = DataWriter(
            participant, Topic(participant, "rt/tf_static", TFMessage, staying), qos=staying
        )

    def send(self, frames: Sequence[Frame], stamp: float) -> None:
        """Publish where moving frames are at a time [s] of the clock."""
        self._moving.write(transform_message(frames, stamp))

    def send_static(self, frames: Sequence[Frame]) -> None:
        """Publish frames that stay; whoever comes later hears them, too."""
        self._staying.write(transform_message(frames, 0.0))
