"""MCAP files (mcap.dev/spec), read from the front: their summary is not needed."""

import struct
from pathlib import Path

from harness.recorded.bag_file import DamageError, Topic, type_name
from harness.recorded.blocks import WHOLE_FILE, Block, BlockFile

MAGIC = b"\x89MCAP0\r\n"
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = 2, 3, 4, 5, 6  # opcode of a record
_HEAD = struct.Struct("<BQ")  # opcode and size
_MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, sequence, times of arrival and sending [ns]
_CHUNK_HEAD = struct.Struct("<QQQI")  # first and last time, decompressed size, CRC-32
_ENCODINGS = ("cdr", "ros1")
_LONGEST = 10_000_000  # [bytes] of a schema or channel


class McapFile(BlockFile):
    """A ``.mcap`` file; also one that was not closed, or lost its end."""

    def __init__(self, path: Path, types: frozenset[str]) -> None:
        """Open the file."""
        super().__init__(path, types)
        self._schemas: dict[int, str] = {}

    def _scan(self) -> None:
        position, size = len(MAGIC), self.size
        while position < size:
            head = self._bytes_at(position, _HEAD.size)
            if len(head) < _HEAD.size:
                break
            opcode, length = _HEAD.unpack(head)
            start = position + _HEAD.size
            if opcode == _FOOTER:
                return
            if opcode == _CHUNK:
                self._take_chunk(start, length)
            elif opcode == _MESSAGE and start + length <= size:
                head = self._bytes_at(start, _MESSAGE_HEAD.size)
                self._take_message(head, 0, WHOLE_FILE, start, length)
            elif opcode in (_SCHEMA, _CHANNEL) and start + length <= size:
                self._describe(opcode, self._bytes_at(start, min(length, _LONGEST)))
            position = start + length
        raise DamageError(f"was never closed by its recorder, or is cut off at byte {size}")

    def _take_chunk(self, start: int, length: int) -> None:
        head = self._bytes_at(start, min(length, _CHUNK_HEAD.size + 4 + 64 + 8))
        try:
            _, _, full_size, checksum = _CHUNK_HEAD.unpack_from(head)
            compression, position = _text(head, _CHUNK_HEAD.size)
            (size,) = struct.unpack_from("<Q", head, position)
        except struct.error:
            raise DamageError(f"is cut off in the block at byte {start}") from None
        self._take_block(start, Block(start + position + 8, size, compression, full_size, checksum))

    def _take_records(self, content: bytes, block: int, where: str) -> None:
        """Take in the records of a block."""
        position = 0
        while position + _HEAD.size <= len(content):
            opcode, length = _HEAD.unpack_from(content, position)
            data = position + _HEAD.size
            if data + length > len(content):
                raise DamageError(f"has a record beyond the end of {where}")
            if opcode == _MESSAGE:
                self._take_message(content, data, block, data, length)
            elif opcode in (_SCHEMA, _CHANNEL):
                self._describe(opcode, content[data : data + length])
            position = data + length

    def _describe(self, opcode: int, record: bytes) -> None:
        """Take in a schema or a channel."""
        try:
            (key,) = struct.unpack_from("<H", record)
            if opcode == _SCHEMA:
                self._schemas[key] = type_name(_text(record, 2)[0])
                return
            (schema,) = struct.unpack_from("<H", record, 2)
            name, position = _text(record, 4)
            encoding, _ = _text(record, position)
        except struct.error:
            raise DamageError("has a topic whose description cannot be read") from None
        if key in self._wanted:
            return
        kind = self._schemas.get(schema, "")
        self._enter_topic(key, Topic(name, kind, encoding), encoding in _ENCODINGS)

    def _take_message(self, content: bytes, head: int, block: int, start: int, length: int) -> None:
        """Take in the message whose head stands in ``content`` and that itself is at ``start`` of its block."""
        size = length - _MESSAGE_HEAD.size
        if size < 0 or head + _MESSAGE_HEAD.size > len(content):
            raise DamageError("has a message that is too short")
        channel, _, time, _ = _MESSAGE_HEAD.unpack_from(content, head)
        topic = self._wanted.get(channel)
        if topic is not None:
            self._enter_message(topic, time, block, start + _MESSAGE_HEAD.size, size)


def _text(record: bytes, position: int) -> tuple[str, int]:
    """A text at a position, and where it ends."""
    (size,) = struct.unpack_from("<I", record, position)
    end = position + 4 + size
    if end > len(record):
        raise struct.error
    return record[position + 4 : end].decode(errors="replace"), end
