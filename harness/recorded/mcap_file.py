"""MCAP files (mcap.dev/spec), read from the front: their summary is not needed."""

import struct
from pathlib import Path

from harness.recorded.bag_file import DamageError, Topic, type_name
from harness.recorded.blocks import WHOLE_FILE, Block, BlockFile, FileBytes

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
        if not self._take_records(self._file, WHOLE_FILE, len(MAGIC), ""):
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
        while len(head := content[position : position + _HEAD.size]) == _HEAD.size:
            opcode, length = _HEAD.unpack(head)
            start = position + _HEAD.size
            position = start + length
            if block == WHOLE_FILE and opcode == _FOOTER:
                return True
            if block == WHOLE_FILE and opcode == _CHUNK:
                self._take_chunk(start, length)
            elif position > len(content):
                return False
            elif opcode == _MESSAGE:
                self._take_message(
                    content[start : min(start + _MESSAGE_HEAD.size, position)], block, start, length
                )
            elif opcode in (_SCHEMA, _CHANNEL):
                self._describe(opcode, content[start : min(start + _LONGEST, position)])
        return block != WHOLE_FILE

    def _take_chunk(self, start: int, length: int) -> None:
        head = self._file[start : start + min(length, _CHUNK_HEAD.size + 4 + 64 + 8)]
        try:
            _, _, full_size, checksum = _CHUNK_HEAD.unpack_from(head)
            compression, position = _text(head, _CHUNK_HEAD.size)
            (size,) = struct.unpack_from("<Q", head, position)
        except struct.error:
            raise DamageError(f"is cut off in the block at byte {start}") from None
        self._take_block(start, Block(start + position + 8, size, compression, full_size, checksum))

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

    def _take_message(self, head: bytes, block: int, start: int, length: int) -> None:
        """Take in the message with this head, whose data begin at ``start`` of its block."""
        if len(head) < _MESSAGE_HEAD.size:
            raise DamageError("has a message that is too short")
        channel, _, time, _ = _MESSAGE_HEAD.unpack(head)
        topic = self._wanted.get(channel)
        if topic is not None:
            self._enter_message(
                topic, time, block, start + _MESSAGE_HEAD.size, length - _MESSAGE_HEAD.size
            )


def _text(record: bytes, position: int) -> tuple[str, int]:
    """A text at a position, and where it ends."""
    (size,) = struct.unpack_from("<I", record, position)
    end = position + 4 + size
    if end > len(record):
        raise struct.error
    return record[position + 4 : end].decode(errors="replace"), end
