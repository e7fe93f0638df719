"""What a suite folder holds so far.

Every stack under every condition, its seeds together, driven or not.
"""

import dataclasses
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from statistics import fmean

from harness.analysis.compare import Comparison, compare
from harness.analysis.pairing import have_common_missions
from harness.analysis.repricing import accounted_margins
from harness.analysis.side import Side
from harness.economics.cost_terms import MARGIN
from harness.economics.valuation import CENT, Valuation, margins, valuation_document, value
from harness.metrics.columns import Row
from harness.statistics.interval import NO_INTERVAL, Interval
from harness.statistics.paired import PairedDifference, together
from harness.storage.texts import name_of
from harness.study.stored_run import StoredRun, load_run
from harness.study.suite import Cell, Condition, Suite, cells, conditions
from harness.study.suite_folder import run_of, stored_suite
from harness.study.suite_log import Session, sessions_of

PARTED_CONDITIONS, PARTED_MISSIONS = 3, 2  # of each, that are recorded to be looked at


@dataclass(frozen=True, slots=True)
class Standing:
    """What a stack did under a condition."""

    stack: str
    condition: Condition
    declared: int  # deliveries
    side: Side | None  # rows of all seeds; None: nothing is driven
    valuation: Valuation | None  # None: no delivery finished
    runs: tuple[StoredRun, ...] = ()  # of each seed that is begun

    @property
    def n(self) -> int:
        """Finished deliveries, without those that ended in an error."""
        if self.side is None:
            return 0
        return len(self.side.stack.rows)

    @property
    def errors(self) -> int:
        """Deliveries that ended in an error."""
        if self.side is None:
            return 0
        return self.side.stack.errors

    @property
    def is_complete(self) -> bool:
        """Whether every declared delivery is driven."""
        return self.n + self.errors >= self.declared

    def interval(self, key: str) -> Interval:
        """A quantity of the valuation with its interval; undefined where there is none."""
        if self.valuation is None:
            return NO_INTERVAL
        return self.valuation.intervals.get(key, NO_INTERVAL)


@dataclass(frozen=True, slots=True)
class MarginDifference:
    """A stack's margin less that of the first stack, on the missions that both finished."""

    pairs: int
    paired: PairedDifference  # adjusted for all stacks under the condition
    warnings: tuple[str, ...]  # why the two might differ for other reasons than their stacks


@dataclass(frozen=True, slots=True)
class WidestMissions:
    """Missions of a condition on which what the stacks earned differs most."""

    spread: float  # [USD] of the widest one
    seed: int
    episodes: tuple[int, ...]  # the widest first
    runs: tuple[StoredRun, ...]  # of the condition, of every stack and seed


@dataclass(frozen=True)
class Results:
    """A suite folder's content."""

    suite: Suite
    standings: tuple[Standing, ...]  # by condition, then stack, as declared
    sessions: tuple[Session, ...]
    strangers: tuple[str, ...]  # run folders in it that are none of the suite's cells

    @property
    def conditions(self) -> list[Condition]:
        """Every map, world, number of people and sensors."""
        return conditions(self.suite)

    @property
    def runs(self) -> list[StoredRun]:
        """One of each stack and condition that is driven."""
        return [each.side.run for each in self.standings if each.side is not None]

    def under(self, condition: Condition) -> list[Standing]:
        """What the stacks did under a condition."""
        return [each for each in self.standings if each.condition == condition]

    def label(self, condition: Condition) -> str:
        """A condition in few words: only what varies in the suite, at least the map."""
        parts = [Path(condition.map_name).stem]
        if len({each.world for each in self.conditions}) > 1:
            parts.append(Path(condition.world).stem)
        if len({each.pedestrians for each in self.conditions}) > 1:
            parts.append(
                "own people" if condition.pedestrians is None else f"{condition.pedestrians} people"
            )
        if len({each.sensors for each in self.conditions}) > 1:
            parts.append(name_of(condition.sensors or "own sensors"))
        return ", ".join(parts)

    @property
    def ranked(self) -> list[str]:
        """Stacks by their mean margin over the conditions under which they drove.

        Those that did not come last.
        """
        margins: dict[str, list[float]] = {name_of(stack): [] for stack in self.suite.stacks}
        for each in self.standings:
            if (margin := each.interval(MARGIN).value) is not None:
                margins[each.stack].append(margin)
        known = sorted(
            (name for name in margins if margins[name]), key=lambda name: -fmean(margins[name])
        )
        return known + [name for name in margins if not margins[name]]

    @cached_property
    def differences(self) -> dict[tuple[Condition, str], MarginDifference]:
        """Margins less the first stack's, by condition and stack.

        Left out where they share no mission.
        """
        found: dict[tuple[Condition, str], MarginDifference] = {}
        for condition in self.conditions:
            own = _against_first(self.under(condition))
            paired = together([comparison.differences[MARGIN].paired for _, comparison in own])
            for (stack, comparison), each in zip(own, paired, strict=True):
                warnings = tuple(comparison.warnings)
                found[condition, stack] = MarginDifference(comparison.pairs, each, warnings)
        return found

    @property
    def partings(self) -> list[WidestMissions]:
        """The conditions whose stacks part ways most, with the missions on which they do.

        Widest first.
        """
        found = [
            _widest_missions([each for each in self.under(where) if each.n])
            for where in self.conditions
        ]
        return sorted(filter(None, found), key=lambda each: -each.spread)[:PARTED_CONDITIONS]

    @cached_property
    def accounted(self) -> dict[tuple[Condition, str], dict[str, Interval]]:
        """Margins by condition and stack under every accounting."""
        return {
            (each.condition, each.stack): accounted_margins(
                each.side.run, [(run, run.stacks[0]) for run in each.runs]
            )
            for each in self.standings
            if each.side is not None and each.valuation is not None
        }


def read_results(path: Path) -> Results:
    """Read a suite folder.

    Raises:
        InputError: it holds no suite, or a run of it is damaged.
    """
    suite = stored_suite(path)
    groups: dict[tuple[Condition, str], list[Cell]] = {}
    for cell in cells(suite):
        groups.setdefault((cell.condition, cell.stack_name), []).append(cell)
    known = {name for cell in cells(suite) for name in (cell.name, cell.group)}
    strangers = sorted({run.parent.name for run in path.glob("*/run.json")} - known)
    standings = tuple(_standing(path, suite, own) for own in groups.values())
    return Results(suite, standings, sessions_of(path), tuple(strangers))


def overview(results: Results) -> Row:
    """The JSON document of ``navbench suite``: a row for each stack and condition that is begun."""
    rows = [_row(each, results.suite) for each in results.standings if each.side is not None]
    return {"schema": 1, "title": results.suite.title, "rows": rows}


def _row(standing: Standing, suite: Suite) -> Row:
    where = standing.condition
    return {
        "stack": standing.stack,
        "map": Path(where.map_name).stem,
        "world": Path(where.world).stem,
        "pedestrians": where.pedestrians,
        "sensors": where.sensors and name_of(where.sensors),
        "seeds": list(suite.seeds),
        "episodes": standing.n,
        "errors": standing.errors,
        "declared": standing.declared,
        **valuation_document(standing.valuation),
    }


def _standing(path: Path, suite: Suite, own: Sequence[Cell]) -> Standing:
    """The cells of one stack under one condition, which differ in their seeds only."""
    stored = [run_of(path, cell) for cell in own]
    runs = tuple(load_run(name) for name in stored if name is not None)
    first, declared = own[0], suite.episodes * len(own)
    if not runs:
        return Standing(first.stack_name, first.condition, declared, None, None)
    rows = tuple(row for run in runs for row in run.stacks[0].rows)
    errors = sum(run.stacks[0].errors for run in runs)
    side = Side(runs[0], dataclasses.replace(runs[0].stacks[0], rows=rows, errors=errors))
    valuation = None
    if rows:
        valuation = value(rows, side.stack, side.run.prices(), side.run.seed, left_out=errors)
    return Standing(first.stack_name, first.condition, declared, side, valuation, runs)


def _against_first(standings: Sequence[Standing]) -> list[tuple[str, Comparison]]:
    """The margins of all but the first stack that share missions with it, held against its."""
    first, *others = standings
    if first.side is None or first.interval(MARGIN).value is None:
        return []
    return [
        (other.stack, compare(first.side, other.side, [MARGIN]))
        for other in others
        if other.side is not None
        and other.interval(MARGIN).value is not None
        and have_common_missions(first.side, other.side)
    ]


def _widest_missions(standings: Sequence[Standing]) -> WidestMissions | None:
    """Where several stacks' margins differ; None where no mission's differ by a cent."""
    earned: defaultdict[tuple[int, int], list[float]] = defaultdict(list)
    for each in standings:
        assert each.side is not None
        rows = each.side.stack.rows
        known = margins(rows, each.side.run.prices())
        if known is None:
            return None
        for row, margin in zip(rows, known.tolist(), strict=True):
            earned[row["seed"], row["episode"]].append(margin)
    spread = {
        mission: max(of_all) - min(of_all)
        for mission, of_all in earned.items()
        if len(of_all) == len(standings)
    }
    widest = sorted(
        (mission for mission in spread if spread[mission] >= CENT),
        key=lambda each: (-spread[each], each),
    )
    if len(standings) < 2 or not widest:
        return None
    seed = widest[0][0]
    episodes = tuple(episode for its_seed, episode in widest if its_seed == seed)[:PARTED_MISSIONS]
    return WidestMissions(
        spread[widest[0]], seed, episodes, tuple(run for each in standings for run in each.runs)
    )
