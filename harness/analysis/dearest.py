"""The deliveries of finished runs that lost most."""

from collections.abc import Sequence
from dataclasses import dataclass

from harness.economics.valuation import margins
from harness.metrics.columns import Row
from harness.storage.rows import values
from harness.study.stored_run import StoredRun
from navstack.errors import InputError
from navstack.types import FloatArray


@dataclass(frozen=True, slots=True)
class Dear:
    """A delivery and what it earned."""

    run: StoredRun  # with its one stack
    episode: int
    margin: float | None  # [USD]; None: the cargo was not simulated

    @property
    def stack(self) -> str:
        """Name of what drove."""
        return self.run.stacks[0].name


def earned_of(rows: Sequence[Row], margin: FloatArray | None) -> list[float]:
    """By what deliveries are ranked: their margins [USD]; without cargo what injuries cost."""
    if margin is not None:
        return [float(each) for each in margin]
    return [-(usd or 0.0) for usd in values(rows, "pedestrian_injury_usd")]


def dearest(runs: Sequence[StoredRun], most: int) -> list[Dear]:
    """At most that many deliveries, the one that lost most first.

    Injuries decide where cargo was not simulated. Deliveries that earned the same stand in the
    order of stacks and episodes.
    """
    found: list[tuple[float, Dear]] = []
    for run in runs:
        for stack in run.stacks:
            if not stack.rows:
                continue
            only = run.only(stack.name)
            earned = margins(stack.rows, run.prices())
            episodes, ranks = values(stack.rows, "episode"), earned_of(stack.rows, earned)
            found += [
                (rank, Dear(only, episode, None if earned is None else rank))
                for episode, rank in zip(episodes, ranks, strict=True)
            ]
    found.sort(key=lambda each: each[0])
    return [each for _, each in found[:most]]


def dearest_of(run: StoredRun, episode: int | None = None) -> Dear:
    """The delivery of a run that lost most.

    Args:
        run: with one stack or several.
        episode: number of the delivery, if only the stack is to be chosen; None: all.

    Raises:
        InputError: no such delivery finished.
    """
    found = dearest([run], sum(len(stack.rows) for stack in run.stacks))
    if episode is not None:
        found = [each for each in found if each.episode == episode]
    if not found:
        which = "delivery" if episode is None else f"episode {episode}"
        raise InputError(f"{run.folder}: no {which} finished; there is nothing to show")
    return found[0]
