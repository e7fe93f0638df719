"""Blocks of a bag file that hold messages, compressed or not; the latest ones are kept in memory."""

import os
import zlib
from collections import OrderedDict
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pyarrow as pa

from harness.recorded.bag_file import LARGEST_MESSAGE, BagError, DamageError

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


class Blocks:
    """Reads blocks of a file, and messages in them."""

    def __init__(self, path: Path) -> None:
        """Open the file.

        Raises:
            OSError: it cannot be opened.
        """
        self._file = os.open(path, os.O_RDONLY)
        self.size = os.fstat(self._file).st_size
        self._blocks: list[Block] = []
        self._loaded: OrderedDict[int, bytes] = OrderedDict()

    def close(self) -> None:
        """Let go of the file."""
        os.close(self._file)

    def bytes_at(self, offset: int, size: int) -> bytes:
        """Bytes of the file itself; fewer where it ends."""
        return os.pread(self._file, min(size, max(self.size - offset, 0)), offset)

    def add(self, block: Block) -> int:
        """Enter a block; returns its number.

        Raises:
            DamageError: it is too large to be genuine, or compressed in an unknown way.
        """
        if block.compression not in COMPRESSIONS:
            known = ", ".join(filter(None, COMPRESSIONS))
            raise BagError(f"a block of the bag is compressed with '{block.compression[:40]}'; known: {known}")
        if max(block.size, block.full_size) > LARGEST_BLOCK:
            raise DamageError(f"the block at byte {block.offset} says that it has more than {LARGEST_BLOCK} bytes")
        self._blocks.append(block)
        return len(self._blocks) - 1

    def load(self, number: int) -> tuple[bytes, str | None]:
        """The decompressed bytes of a block as far as they are good, and what is wrong with the rest."""
        if number in self._loaded:
            self._loaded.move_to_end(number)
            return self._loaded[number], None
        block = self._blocks[number]
        packed = self.bytes_at(block.offset, block.size)
        content, trouble = decompress(packed, block.compression, block.full_size)
        if len(packed) < block.size:
            trouble = f"is cut off at byte {self.size}"
        if trouble is None and block.checksum and zlib.crc32(content) != block.checksum:
            content, trouble = b"", "does not have the checksum that it says"
        self._loaded[number] = content
        while len(self._loaded) > 1 and sum(map(len, self._loaded.values())) > _KEPT:
            self._loaded.popitem(last=False)
        return content, None if trouble is None else f"the block at byte {block.offset} {trouble}"

    def message(self, number: int, offset: int, size: int) -> bytes:
        """The bytes of a message in a block, or in the file itself where ``number`` is ``WHOLE_FILE``."""
        if number == WHOLE_FILE:
            return self.bytes_at(offset, size)
        return self.load(number)[0][offset : offset + size]


def decompress(content: bytes, compression: str, size: int) -> tuple[bytes, str | None]:
    """As much as can be decompressed, but never more than was declared; and what is wrong with the rest."""
    if not compression:
        return content[:size], None if len(content) >= size else "is cut off"
    pieces, done = [], 0
    try:
        with pa.CompressedInputStream(pa.BufferReader(content), compression) as stream:
            while done <= size and (piece := stream.read(min(_PIECE, size + 1 - done))):
                pieces.append(piece)
                done += len(piece)
    except (OSError, pa.ArrowException):
        return b"".join(pieces)[:size], "cannot be decompressed"
    if done != size:
        return b"".join(pieces)[:size], f"has {'more' if done > size else 'fewer'} bytes than the {size} that it says"
    return b"".join(pieces), None


def decompress_message(content: bytes) -> bytes:
    """A message that was compressed by itself with zstd.

    Raises:
        DamageError: it was not, or is too large.
    """
    try:
        with pa.CompressedInputStream(pa.BufferReader(content), "zstd") as stream:
            full: bytes = stream.read(LARGEST_MESSAGE + 1)
    except (OSError, pa.ArrowException):
        raise DamageError("a message cannot be decompressed") from None
    if len(full) > LARGEST_MESSAGE:
        raise DamageError(f"a message decompresses to more than {LARGEST_MESSAGE} bytes")
    return full
