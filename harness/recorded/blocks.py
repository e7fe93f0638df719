"""Bag files with blocks that hold messages, compressed or not.

What ROS 1 bags and MCAP files have in common.
"""

import os
import zlib
from abc import abstractmethod
from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pyarrow as pa

from harness.recorded.bag_file import LARGEST_MESSAGE, BagError, BagFile, DamageError, Topic

LARGEST_BLOCK = 128_000_000  # [bytes] compressed or not; recorders write blocks of 1 to 4 MB
_KEPT = 128_000_000  # [bytes] of blocks in memory
_PIECE = 1 << 20  # [bytes] decompressed at a time
COMPRESSIONS: Final = ("", "bz2", "lz4", "zstd")
WHOLE_FILE: Final = -1  # in place of the number of a block: the message stands in the file itself


@dataclass(frozen=True, slots=True)
class Block:
    """Where some messages are."""

    offset: int  # [bytes] in the file
    size: int  # [bytes] there
    compression: str  # one of COMPRESSIONS
    full_size: int  # [bytes] decompressed
    checksum: int = 0  # CRC-32 of the decompressed bytes; 0: there is none


class FileBytes:
    """The bytes of a file, read as slices are taken; a slice is shorter where the file ends."""

    def __init__(self, path: Path) -> None:
        """Open the file.

        Raises:
            OSError: it cannot be opened.
        """
        self._file = os.open(path, os.O_RDONLY)
        self._size = os.fstat(self._file).st_size

    def __len__(self) -> int:
        return self._size

    def __getitem__(self, part: slice) -> bytes:
        start, end, _ = part.indices(self._size)
        return os.pread(self._file, max(end - start, 0), start)

    def close(self) -> None:
        """Let go of the file."""
        os.close(self._file)


class BlockFile(BagFile):
    """A bag whose messages stand in the file itself or in blocks of it.

    The latest blocks are kept in memory.
    """

    def __init__(self, path: Path, types: frozenset[str]) -> None:
        """Open the file.

        Raises:
            OSError: it cannot be opened.
        """
        super().__init__(path, types)
        self._file = FileBytes(path)
        self._blocks: list[Block] = []
        self._loaded: OrderedDict[int, bytes] = OrderedDict()
        # the file's number of a topic -> ours; None: of another type
        self._wanted: dict[int, int | None] = {}

    def close(self) -> None:
        """Let go of the file."""
        self._file.close()

    def read(self, *place: int) -> bytes:
        """See :meth:`BagFile.read`.

        The place is a block or ``WHOLE_FILE``, and offset and size in it.
        """
        number, offset, size = place
        if number == WHOLE_FILE:
            return self._file[offset : offset + size]
        return self._load(number)[offset : offset + size]

    @abstractmethod
    def _take_records(
        self,
        content: bytes | FileBytes,
        block: int,
        position: int,
        within: str,
    ) -> bool:
        """Take in records up to the first that cannot be read, which is a DamageError.

        Args:
            content: a block's, or the whole file.
            block: its number, or ``WHOLE_FILE``.
            position: of the first record.
            within: words that say which block it is; empty: the file.

        Returns:
            Whether the last record ends within the content; of a file, whether its recorder closed
            it.
        """

    def _take_block(self, start: int, block: Block) -> None:
        """Take in a block whose record's data begin at ``start``."""
        if block.compression not in COMPRESSIONS:
            known = ", ".join(filter(None, COMPRESSIONS))
            raise BagError(
                f"a block of the bag is compressed with '{block.compression[:40]}'; known: {known}"
            )
        if max(block.size, block.full_size) > LARGEST_BLOCK:
            raise DamageError(
                f"the block at byte {block.offset} says that it has more than {LARGEST_BLOCK} bytes"
            )
        self._blocks.append(block)
        number = len(self._blocks) - 1
        within = f" of the block at byte {start}"
        if not self._take_records(self._load(number), number, 0, within):
            raise DamageError(f"has a record beyond the end{within}")

    def _enter_topic(self, number: int, topic: Topic, is_known: bool = True) -> None:
        """Enter a topic under the file's number of it.

        ``is_known``: its messages can be decoded.
        """
        entered = self.add_topic(topic)
        self._wanted[number] = None
        if is_known and topic.type in self.types:
            self._wanted[number] = entered

    def _enter_message(self, topic: int, time: int, *place: int) -> None:
        """Enter a message of a wanted topic; its place is as in :meth:`read`."""
        if place[2] > LARGEST_MESSAGE:
            raise DamageError(
                f"has a message of {place[2]} bytes; at most {LARGEST_MESSAGE} are read"
            )
        self.add_message(topic, time, *place)

    def _load(self, number: int) -> bytes:
        """The decompressed bytes of a block.

        Raises:
            DamageError: they are not what the file says.
        """
        if number in self._loaded:
            self._loaded.move_to_end(number)
            return self._loaded[number]
        block = self._blocks[number]
        packed = self._file[block.offset : block.offset + block.size]
        if len(packed) < block.size:
            raise DamageError(
                f"the block at byte {block.offset} is cut off at byte {len(self._file)}"
            )
        try:
            content = decompress(packed, block.compression, block.full_size)
        except DamageError as error:
            raise DamageError(f"the block at byte {block.offset} {error}") from None
        if block.checksum and zlib.crc32(content) != block.checksum:
            raise DamageError(
                f"the block at byte {block.offset} does not have the checksum that it says"
            )
        self._loaded[number] = content
        while len(self._loaded) > 1 and sum(map(len, self._loaded.values())) > _KEPT:
            self._loaded.popitem(last=False)
        return content


def decompress(content: bytes, compression: str, size: int) -> bytes:
    """What was compressed, never more than ``size`` bytes as was declared.

    Raises:
        DamageError: it cannot be decompressed, or has another size.
    """
    full = content
    if compression:
        full = _decompressed(content, compression, size)
    if len(full) == size:
        return full
    if len(full) > size:
        raise DamageError(f"has more bytes than the {size} that it says")
    raise DamageError(f"has fewer bytes than the {size} that it says")


def decompress_message(content: bytes) -> bytes:
    """A message that was compressed by itself with zstd.

    Raises:
        DamageError: it was not, or is too large.
    """
    try:
        full = _decompressed(content, "zstd", LARGEST_MESSAGE)
    except DamageError as error:
        raise DamageError(f"a message {error}") from None
    if len(full) > LARGEST_MESSAGE:
        raise DamageError(f"a message decompresses to more than {LARGEST_MESSAGE} bytes")
    return full


def _decompressed(content: bytes, compression: str, size: int) -> bytes:
    """The decompressed bytes, at most one more than ``size``.

    Raises:
        DamageError: they cannot be decompressed.
    """
    pieces, done = [], 0
    try:
        with pa.CompressedInputStream(pa.BufferReader(content), compression) as stream:
            while done <= size and (piece := stream.read(min(_PIECE, size + 1 - done))):
                pieces.append(piece)
                done += len(piece)
    except (OSError, pa.ArrowException):
        raise DamageError("cannot be decompressed") from None
    return b"".join(pieces)
