"""The parts of Nav2 that are compared, and the cases of each."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.parity.comparison import Comparison
from harness.parity.golden import GoldenFile


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """One recorded case."""

    name: str  # as in the names of its arrays
    file: GoldenFile
    arrays: frozenset[str]  # names of the arrays it accounts for

    @property
    def title(self) -> str:
        """The name with the file it stands in."""
        return f"{self.file.stem}/{self.name}"

    @property
    def facts(self) -> dict[str, Any]:
        """What ``meta_json`` says under the case's name."""
        return self.file.facts(self.name)

    def __getitem__(self, suffix: str) -> np.ndarray:
        """The array ``<name>_<suffix>``."""
        return self.file[f"{self.name}_{suffix}"]

    def __contains__(self, suffix: str) -> bool:
        return f"{self.name}_{suffix}" in self.file


@dataclass(frozen=True, slots=True)
class Part:
    """One part of Nav2: how its cases are found in a file, and how one is compared."""

    name: str
    find: Callable[[GoldenFile], Iterable[Case]]  # reads names and facts only
    check: Callable[[Case, Comparison], None] | None  # None: navstack does not have it
    unit: str = ""  # of the largest deviation, where it is not the quantity's own


def existing(file: GoldenFile, names: Iterable[str]) -> frozenset[str]:
    """Those of the names that are arrays of the file."""
    return file.names & frozenset(names)
