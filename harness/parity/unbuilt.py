"""Cases of parts that navstack does not have yet: they are found and counted, and nothing is compared."""

from collections.abc import Iterator

from harness.parity.golden import GoldenFile
from harness.parity.part import Case


def find_amcl(file: GoldenFile) -> Iterator[Case]:
    """Everything of a file with particle weights or a likelihood field."""
    if "map_occ" in file:
        yield Case("all", file, file.names)
