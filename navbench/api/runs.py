"""Run folders as tables and numbers."""

import dataclasses
from pathlib import Path

import pyarrow as pa

from harness.analysis.dearest import Dear, dearest_of
from harness.economics.valuation import Valuation, value
from harness.statistics.interval import Interval
from harness.storage.tables import opened_table
from harness.study.stored_run import StoredRun, load_run
from navstack.errors import InputError

TABLES = ("episodes", "events", "timings")


@dataclasses.dataclass(frozen=True)
class Run:
    """A run folder: one or several stacks on the same deliveries."""

    stored: StoredRun

    @property
    def folder(self) -> Path:
        """Where it is."""
        return self.stored.folder

    @property
    def stacks(self) -> tuple[str, ...]:
        """The names of its stacks."""
        return tuple(stack.name for stack in self.stored.stacks)

    def __getitem__(self, stack: str) -> "Run":
        """The same run with one of its stacks.

        Raises:
            UnknownNameError: it has no such stack.
        """
        return Run(self.stored.only(stack))

    def dearest(self, episode: int | None = None) -> Dear:
        """The delivery that lost most, of all stacks.

        Args:
            episode: number of the delivery, if only the stack is to be chosen; None: all.

        Raises:
            InputError: no such delivery finished.
        """
        return dearest_of(self.stored, episode)

    def table(self, name: str = "episodes") -> pa.Table:
        """A table as Arrow has it.

        ``.to_pandas()`` makes a data frame of it where pandas is installed.

        Args:
            name: ``episodes``, a row per delivery; ``events``, a row per contact; ``timings``, wall
                and processor times.

        Raises:
            InputError: there is no such table.
        """
        if name not in TABLES:
            raise InputError(f"unknown table '{name}'; known: {', '.join(TABLES)}")
        with opened_table(self.folder / f"{name}.parquet") as file:
            table = file.read()
        is_own = [stack in self.stacks for stack in table["stack"].to_pylist()]
        return table.filter(pa.array(is_own, pa.bool_()))

    @property
    def valuations(self) -> dict[str, Valuation]:
        """What the deliveries of each stack come to.

        Stacks without a finished delivery are left out.
        """
        prices, seed = self.stored.prices(), self.stored.seed
        return {
            stack.name: value(stack.rows, stack, prices, seed, left_out=stack.errors)
            for stack in self.stored.stacks
            if stack.rows
        }

    @property
    def margins(self) -> dict[str, Interval]:
        """The contribution margin [USD/run] of each stack.

        Those whose cargo is not modelled are left out.
        """
        found = {
            stack: each.intervals.get("contribution_margin")
            for stack, each in self.valuations.items()
        }
        return {stack: margin for stack, margin in found.items() if margin is not None}


def load(folder: str | Path) -> Run:
    """A finished run by its folder, or one stack of it as ``FOLDER:stack``.

    It is found again from another working directory.

    Raises:
        InputError: it holds no run that can be read.
    """
    stored = load_run(str(folder))
    return Run(dataclasses.replace(stored, folder=stored.folder.absolute()))
