"""What containers of compressed blocks have in common."""

from pathlib import Path

from harness.recorded.bag_file import BagFile
from harness.recorded.blocks import Blocks


class BlockFile(BagFile):
    """A bag whose messages stand in the file or in compressed blocks of it."""

    def __init__(self, path: Path, types: frozenset[str]) -> None:
        """Open the file."""
        super().__init__(path, types)
        self._blocks = Blocks(path)

    def close(self) -> None:
        """Let go of the file."""
        self._blocks.close()

    def read(self, *place: int) -> bytes:
        """See :meth:`BagFile.read`."""
        return self._blocks.message(*place)
