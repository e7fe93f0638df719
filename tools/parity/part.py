"""The parts of Nav2 that are compared, and the cases of each."""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from navstack.costmap.costmap import Costmap
from navstack.errors import InputError
from tools.parity.comparison import Comparison
from tools.parity.golden import GoldenFile


@dataclass(frozen=True, slots=True, eq=False)
class Case:
    """One recorded case."""

    name: str  # as in the names of its arrays
    file: GoldenFile
    arrays: frozenset[str]  # names of the arrays it accounts for
    keys: tuple[str, ...] = ()  # under which ``meta_json`` has its facts; none: its name

    @property
    def title(self) -> str:
        """The name with the file it stands in."""
        return f"{self.file.stem}/{self.name}"

    @property
    def facts(self) -> dict[str, Any]:
        """What ``meta_json`` says of the case."""
        return self.file.facts(*(self.keys or (self.name,)))

    def settings(self, form: re.Pattern[str]) -> tuple[str, ...]:
        """What the name says, group by group of its form.

        Raises:
            KeyError: it has another form.
        """
        given = form.fullmatch(self.name)
        if given is None:
            raise KeyError(f"a name of the form {form.pattern}")
        return given.groups()

    def pass_over(self, *suffixes: str) -> None:
        """Read arrays that hold nothing which upstream has computed."""
        for suffix in suffixes:
            if suffix in self:
                self[suffix]

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
    check: Callable[[Case, Comparison], None]
    unit: str | None = None  # of the largest deviation; None: the quantity's own


@dataclass(frozen=True, slots=True)
class Shape:
    """How cases are found by the names of their arrays; ``{}`` stands for what tells them apart."""

    arrays: tuple[str, ...]  # that every case has; the first one is looked for
    more: tuple[str, ...] = ()  # that a case may have
    keys: tuple[str, ...] = ("{}",)  # under which ``meta_json`` has the facts
    fact: str | None = ""  # that they must hold; empty: any, None: there may be none
    name: str = "{}"

    def __call__(self, file: GoldenFile) -> Iterator[Case]:
        """The cases of a file."""
        prefix, _, suffix = self.arrays[0].partition("{}")
        for base in file.bases(suffix, prefix):
            arrays, more, keys = (
                tuple(text.replace("{}", base) for text in texts)
                for texts in (self.arrays, self.more, self.keys)
            )
            facts = file.facts(*keys)
            has_facts = self.fact is None or (self.fact in facts if self.fact else bool(facts))
            if has_facts and file.names.issuperset(arrays):
                yield Case(
                    self.name.replace("{}", base), file, existing(file, (*arrays, *more)), keys
                )


def costmap_of(cells: np.ndarray, resolution: float, origin: Sequence[float]) -> Costmap:
    """A recorded costmap.

    Raises:
        InputError: it has no cells.
    """
    if cells.ndim != 2 or not cells.size:
        raise InputError(f"a costmap of shape {cells.shape}; rows and columns are needed")
    return Costmap(cells, resolution, float(origin[0]), float(origin[1]))


def existing(file: GoldenFile, names: Iterable[str]) -> frozenset[str]:
    """Those of the names that are arrays of the file."""
    return file.names & frozenset(names)
