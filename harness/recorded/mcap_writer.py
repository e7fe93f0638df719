"""Writes ROS 2 messages into an MCAP file, as ``ros2 bag record -s mcap`` does."""

import tempfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from types import TracebackType
from typing import Any, Final

import numpy as np
from rosbags.interfaces import (
    Nodetype,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from harness.storage.files import require_writable
from navstack.errors import InputError

BAG_VERSION: Final = 9  # of the format of rosbag2's metadata: Jazzy's
NEVER = QosTime(0, 0)
LATCHED = Qos(
    history=QosHistory.KEEP_LAST,
    depth=1,
    reliability=QosReliability.RELIABLE,
    durability=QosDurability.TRANSIENT_LOCAL,
    deadline=NEVER,
    lifespan=NEVER,
    liveliness=QosLiveliness.AUTOMATIC,
    liveliness_lease_duration=NEVER,
    avoid_ros_namespace_conventions=False,
)  # late subscribers get the last message, as from map_server
NUMBERS = {"bool": np.bool_, "byte": np.uint8, "char": np.uint8} | {
    kind: np.dtype(kind).type
    for kind in (
        "int8",
        "uint8",
        "int16",
        "uint16",
        "int32",
        "uint32",
        "int64",
        "uint64",
        "float32",
        "float64",
    )
}


class McapWriter:
    """A file that is written message by message; it is there once it is closed without an error."""

    def __init__(self, path: Path) -> None:
        """Check where it will be.

        Args:
            path: of the file; an existing one is replaced.

        Raises:
            InputError: it has another suffix or is a folder, or its own does not exist or cannot be
                written.
        """
        require_writable("MCAP file", path, (".mcap",))
        self._path = path
        try:
            self._folder = tempfile.TemporaryDirectory(dir=path.absolute().parent, prefix=".bag-")
        except OSError as error:
            raise InputError(
                f"'{path}' cannot be written ({error.strerror}); choose another place"
            ) from None
        self._bag = Path(self._folder.name) / "bag"
        self._writer = Writer(self._bag, version=BAG_VERSION, storage_plugin=StoragePlugin.MCAP)
        self._writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        self._topics: dict[str, Any] = {}

    def __enter__(self) -> "McapWriter":
        self._writer.open()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        with self._folder:
            self._writer.close()
            if error is None:
                (self._bag / "bag.mcap").replace(self._path)

    def write(
        self,
        topic: str,
        kind: str,
        stamp: float,
        fields: Mapping[str, Any],
        is_latched: bool = False,
    ) -> None:
        """Add a message.

        Args:
            topic: its name.
            kind: its type, e.g. ``nav_msgs/msg/Path``; the same for all messages of a topic.
            stamp: [s] of its arrival.
            fields: of the message by name, messages in it as mappings; those left out are zero or
                empty.
            is_latched: whether late listeners get it; as the topic's first message says.
        """
        store = _store()
        if topic not in self._topics:
            self._topics[topic] = self._writer.add_connection(
                topic, kind, typestore=store, offered_qos_profiles=[LATCHED] if is_latched else ()
            )
        content = store.serialize_cdr(build(kind, fields), kind)
        self._writer.write(self._topics[topic], round(stamp * 1e9), content)


@cache
def _store() -> Typestore:
    return get_typestore(Stores.ROS2_JAZZY)


def build(kind: str, fields: Mapping[str, Any]) -> Any:
    """A message of a type from its fields; those left out are zero or empty.

    Raises:
        ValueError: the type has no such field.
    """
    store = _store()
    described = store.fielddefs[kind][1]
    unknown = set(fields) - {name for name, _ in described}
    if unknown:
        raise ValueError(f"{kind} has no field {sorted(unknown)[0]}")
    return store.types[kind](
        **{name: _value(description, fields.get(name)) for name, description in described}
    )


def _value(description: Any, value: Any) -> Any:
    """A field as rosbags wants it; None: it was left out."""
    node, detail = description
    if node is Nodetype.NAME:
        return build(detail, value or {})
    if node is Nodetype.BASE:
        if value is not None:
            return value
        if detail[0] == "string":
            return ""
        return NUMBERS[detail[0]](0).item()
    (inner, kind), size = detail
    if inner is Nodetype.NAME:
        return [build(kind, each) for each in value or ()]
    if kind[0] == "string":
        return list(value or ())
    if value is None:
        value = [0] * size
    return np.asarray(value, dtype=NUMBERS[kind[0]])
