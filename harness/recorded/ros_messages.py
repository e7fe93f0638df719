"""From the bytes of a message to its fields, as ROS defines the types.

The only place that knows rosbags.

Definitions that a bag brings along are not compiled: whoever made it would decide what is executed.
The types that are read have not changed between the releases of ROS 2, and in ROS 1 the bag names
the MD5 sum of the definition it used.
"""

import contextlib
import struct
from collections.abc import Iterator
from functools import cache
from typing import Any

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from harness.recorded.bag import Bag, Message
from harness.recorded.bag_file import DamageError, Topic

SCAN, IMU = "sensor_msgs/msg/LaserScan", "sensor_msgs/msg/Imu"
FIX, ODOMETRY = "sensor_msgs/msg/NavSatFix", "nav_msgs/msg/Odometry"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
OLD_TRANSFORMS = "tf/msg/tfMessage"  # of early ROS 1; the same definition
TRANSFORM_TYPES = (TRANSFORMS, OLD_TRANSFORMS)
POSE, POSE_COVARIANCE = (
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
)
TWIST, TWIST_STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"
COMMAND_TYPES = (TWIST, TWIST_STAMPED)
TYPES = frozenset((SCAN, IMU, FIX, ODOMETRY, POSE, POSE_COVARIANCE, *TRANSFORM_TYPES))


def decode(message: Message) -> Any:
    """The message with its fields as attributes.

    Raises:
        DamageError: it is not what its type says.
    """
    topic = message.topic
    kind = topic.type
    if kind == OLD_TRANSFORMS:
        kind = TRANSFORMS
    _require_definition(topic, kind)
    store = _store(topic.encoding)
    read = store.deserialize_cdr
    if topic.encoding == "ros1":
        read = store.deserialize_ros1
    try:
        return read(message.content, kind)
    except (
        SerdeError,
        struct.error,
        ValueError,
        AssertionError,
        IndexError,
        KeyError,
        OverflowError,
    ) as error:
        reason = str(error).rstrip(".")
        raise DamageError(f"a message of {topic.name} is no {topic.type}: {reason}") from None


def first_messages(bag: Bag, topic: str, most: int) -> Iterator[tuple[Message, Any]]:
    """The first messages of a topic, each with its decoded self, up to the first damage."""
    with contextlib.suppress(DamageError):
        for place in bag.places({topic})[:most]:
            message = bag.read(place)
            yield message, decode(message)


@cache
def _store(encoding: str) -> Typestore:
    kind = Stores.ROS2_JAZZY
    if encoding == "ros1":
        kind = Stores.ROS1_NOETIC
    store = get_typestore(kind)
    if TRANSFORMS not in store.fielddefs:
        store.register(
            get_types_from_msg("geometry_msgs/TransformStamped[] transforms", TRANSFORMS)
        )
    return store


@cache
def _require_definition(topic: Topic, kind: str) -> None:
    """Refuse a type of ROS 1 that only has the name of one that is known."""
    if topic.encoding != "ros1" or topic.digest in ("", "*"):
        return
    if topic.digest != _store("ros1").generate_msgdef(kind)[1]:
        raise DamageError(f"topic {topic.name} has another definition of {topic.type} than ROS has")
