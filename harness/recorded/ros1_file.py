"""Bags of ROS 1, format 2.0 (wiki.ros.org/Bags/Format/2.0), read from the front.

Their index is not needed.
"""

import struct

from harness.recorded.bag_file import BagError, DamageError, Topic, type_name
from harness.recorded.blocks import WHOLE_FILE, Block, BlockFile, FileBytes

MAGIC = b"#ROSBAG V"
_VERSION = b"#ROSBAG V2.0\n"
_MESSAGE, _BAG, _CHUNK, _CONNECTION = 2, 3, 5, 7  # op of a record
# [bytes] of a record; a connection's holds the definition of its type in its data
_LONGEST_HEADER = 1_000_000
_LONGEST_CONNECTION = 10_000_000  # [bytes] of the data of one
_COMPRESSIONS = {b"none": "", b"bz2": "bz2", b"lz4": "lz4"}
_LENGTH, _TIME = struct.Struct("<I"), struct.Struct("<II")

Header = dict[bytes, bytes]


class Ros1File(BlockFile):
    """A ``.bag`` file; also one that was not closed, or lost its end."""

    def _scan(self) -> None:
        if self._file[: len(_VERSION)] != _VERSION:
            raise BagError(
                f"bag '{self.path}' is not of the format 2.0; convert it with 'rosbag fix' or "
                "'rosbags-convert'"
            )
        if not self._take_records(self._file, WHOLE_FILE, len(_VERSION), ""):
            raise DamageError(
                f"was never closed by its recorder, or is cut off at byte {len(self._file)}"
            )

    def _take_records(
        self,
        content: bytes | FileBytes,
        block: int,
        position: int,
        within: str,
    ) -> bool:
        """See :class:`BlockFile`."""
        ends_at = 0  # [bytes] where the file's index should begin; 0: the recorder never wrote it
        while position < len(content):
            header, start, size = _record(content, position, within)
            op, position = _number(header, b"op", 1), start + size
            if block == WHOLE_FILE and op == _BAG:
                ends_at = _number(header, b"index_pos", 8)
                if header.get(b"encryptor"):
                    raise BagError(f"bag '{self.path}' is encrypted, which is not supported")
            elif block == WHOLE_FILE and op == _CHUNK:
                self._take_chunk(header, start, size)
            elif position > len(content):
                return False
            elif op == _CONNECTION:
                if size > _LONGEST_CONNECTION:
                    raise DamageError(
                        f"has a connection of {size} bytes; at most {_LONGEST_CONNECTION} are read"
                    )
                self._take_connection(header, content[start:position])
            elif op == _MESSAGE:
                self._take_message(header, block, start, size)
        return position == len(content) and (block != WHOLE_FILE or 0 < ends_at <= len(content))

    def _take_chunk(self, header: Header, start: int, size: int) -> None:
        name = header.get(b"compression", b"")
        compression = _COMPRESSIONS.get(name, name.decode(errors="replace") or "?")
        full_size = _number(header, b"size", 4)
        self._take_block(start, Block(start, size, compression, full_size))

    def _take_connection(self, header: Header, data: bytes) -> None:
        connection = _number(header, b"conn", 4)
        if connection in self._wanted:
            return
        about = {name: value.decode(errors="replace") for name, value in _fields(data).items()}
        name, kind = (
            header.get(b"topic", b"").decode(errors="replace"),
            type_name(about.get(b"type", "")),
        )
        self._enter_topic(connection, Topic(name, kind, "ros1", about.get(b"md5sum", "")))

    def _take_message(self, header: Header, block: int, start: int, size: int) -> None:
        topic = self._wanted.get(_number(header, b"conn", 4))
        if topic is None:
            return
        time = header.get(b"time", b"")
        if len(time) != _TIME.size:
            raise DamageError("has a message without time")
        seconds, nanoseconds = _TIME.unpack(time)
        self._enter_message(topic, seconds * 1_000_000_000 + nanoseconds, block, start, size)


def _record(content: bytes | FileBytes, position: int, within: str) -> tuple[Header, int, int]:
    """The header of the record at a position, and where its data are.

    From which byte on, how many.
    """
    (length,) = _LENGTH.unpack(content[position : position + 4].ljust(4, b"\0"))
    if length > _LONGEST_HEADER:
        raise DamageError(f"has a record of impossible size at byte {position}{within}")
    head = content[position : position + 8 + length]
    if len(head) < 8 + length:
        raise DamageError(f"is cut off at byte {position}{within}")
    return _fields(head[4:-4]), position + len(head), _LENGTH.unpack(head[-4:])[0]


def _fields(content: bytes) -> Header:
    """The fields ``name=value`` of a header."""
    fields, position = {}, 0
    while position + 4 <= len(content):
        (size,) = _LENGTH.unpack_from(content, position)
        name, equals, value = content[position + 4 : position + 4 + size].partition(b"=")
        if not equals or position + 4 + size > len(content):
            raise DamageError("has a record whose header cannot be read")
        fields[name] = value
        position += 4 + size
    return fields


def _number(header: Header, name: bytes, size: int) -> int:
    value = header.get(name, b"")
    if len(value) != size:
        raise DamageError(f"has a record without the field '{name.decode()}'")
    return int.from_bytes(value, "little")
