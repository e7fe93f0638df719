"""A study from its tasks to its tables: run the episodes, keep them, sum them up and price them."""

import contextlib
import math
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.economics.prices import Prices
from harness.economics.valuation import Valuation, valuation_document, value
from harness.episode.episode import Delivery, run_episode
from harness.episode.factory import BRAINS_KEPT
from harness.episode.files import prices_of
from harness.execution.workers import Finished, Workers
from harness.metrics.columns import EPISODE_COLUMNS, EVENT_COLUMNS, LEG_COLUMNS, TIMING_COLUMNS, Row
from harness.statistics.interval import Interval
from harness.storage.checksums import root_digest
from harness.storage.rows import Rows
from harness.storage.run_folder import RunFolder
from harness.storage.texts import clean_texts
from harness.task.stack import Stack
from harness.task.study import EpisodeTask, Study
from navstack.errors import InputError
from navstack.types import FloatArray

TURN = 5  # deliveries of a worker, in which the time to make a brain anew is small
TABLES = {"episodes": EPISODE_COLUMNS, "events": EVENT_COLUMNS, "timings": TIMING_COLUMNS}


@dataclass(frozen=True, slots=True)
class StackResult:
    """What a stack did over its finished episodes, and what that costs."""

    stack: Stack
    episodes: int  # finished, errors not counted
    errors: int  # the machine's, which are left out
    valuation: Valuation | None  # None: no episode finished
    # median of simulated over processor time; the very first delivery also compiles
    real_time_factor_per_core: float | None  # None: run by a program that did not measure it
    wall_s: float  # of driving, summed over the episodes
    failures: int = 0  # finished ones that ended with an error of the stack
    km_per_core_hour: float | None = None  # driven per hour of processor time

    @property
    def intervals(self) -> dict[str, Interval]:
        """Of rates (Wilson) and of means (bootstrap)."""
        return {} if self.valuation is None else self.valuation.intervals


Progress = Callable[[Finished[EpisodeTask, Delivery], Row], None]


def require_own(study: Study, folder: RunFolder) -> None:
    """Check that a folder holds deliveries of this study only.

    Raises:
        InputError: it holds others.
    """
    numbers = [frozenset(study.numbers_of(number)) for number in range(len(study.stacks))]
    for number, episode, name in zip(
        *map(folder.rows.values, ("stack_number", "episode", "stack")), strict=True
    ):
        own = (
            0 <= number < len(study.stacks)
            and episode in numbers[number]
            and name == study.stacks[number].name
        )
        if not own:
            raise InputError(
                f"run folder '{folder.path}' holds delivery {episode} of stack '{name}', which its "
                "study has not: "
                "its journal or table belongs to another run"
            )


def drive_missing(study: Study, folder: RunFolder, workers: Workers, on_finished: Progress) -> None:
    """Drive every task that the folder lacks.

    Each finished episode is on disk before ``on_finished`` hears of it. The stacks take turns, so
    that the pace of the first half holds for the second, and what an interrupt leaves are the same
    missions of each. More brains than a process keeps drive several missions in a turn.
    """
    block = 1
    if len(study.stacks) > BRAINS_KEPT:
        block = TURN * study.workers
    tasks = study.tasks_in_turns(block)
    with contextlib.closing(driven(tasks, folder, workers)) as runs:
        for finished, record in runs:
            on_finished(finished, record)


def driven(
    tasks: Iterable[EpisodeTask],
    folder: RunFolder,
    workers: Workers,
    until: float = math.inf,
) -> Generator[tuple[Finished[EpisodeTask, Delivery], Row], None, None]:
    """Drive those of the tasks that the folder lacks; each is on disk before it is yielded.

    Closing the iterator, or ``until`` [s] of the monotonic clock, stops what is running.
    """
    known = folder.finished
    missing = (task for task in tasks if (task.stack_number, task.episode) not in known)
    with contextlib.closing(workers.run(run_episode, missing, until)) as runs:
        for finished in runs:
            record, delivery = record_of(finished), finished.result
            name = f"{finished.task.stack.name}-{finished.task.episode}"
            if delivery is not None and delivery.recording:
                folder.add_recording(name, delivery.recording)
            if delivery is not None and delivery.decisions:
                folder.add_table(f"{name}-decisions", *delivery.decisions)
            if delivery is not None and delivery.legs:
                folder.add_table(f"{name}-legs", LEG_COLUMNS, delivery.legs)
            folder.add(record)
            yield finished, record


def record_of(finished: Finished[EpisodeTask, Delivery]) -> Row:
    """An episode as the run folder keeps it; one without a result becomes an error row.

    Texts are cleaned: what a policy raises, or a file is called, need not be UTF-8.
    """
    record: Row = clean_texts(_record_of(finished))
    return record


def _record_of(finished: Finished[EpisodeTask, Delivery]) -> Row:
    if finished.result is not None:
        delivery = finished.result
        return {"row": delivery.row, "events": delivery.events, "timing": delivery.timing}
    task = finished.task
    where = {"stack": task.stack.name, "episode": task.episode}
    row = {
        **where,
        "stack_number": task.stack_number,
        "map": Path(task.map_name).stem,
        "seed": task.seed,
    }
    return {"row": {**row, "error": finished.error}, "events": [], "timing": where}


def summarize_study(study: Study, rows: Rows, timings: Rows) -> list[StackResult]:
    """One result per stack, of the rows of its deliveries and their timings."""
    prices = prices_of(study.template.prices)
    return [_summarize_stack(study, stack, rows, timings, prices) for stack in study.stacks]


def _summarize_stack(
    study: Study,
    stack: Stack,
    rows: Rows,
    timings: Rows,
    prices: Prices,
) -> StackResult:
    own = [number for number, name in enumerate(rows.values("stack")) if name == stack.name]
    seeds, episodes, errors = map(rows.values, ("seed", "episode", "error"))
    finished = sorted((n for n in own if errors[n] is None), key=lambda n: (seeds[n], episodes[n]))
    if not finished:
        return StackResult(stack, 0, len(own), None, None, 0.0)
    spent, driven = timings.take(finished), rows.take(finished)
    failed = rows.values("stack_error")
    left_out = len(own) - len(finished)
    factor, way = _speed(driven, spent.values("cpu_s"))
    return StackResult(
        stack=stack,
        episodes=len(finished),
        errors=left_out,
        failures=sum(failed[n] is not None for n in finished),
        valuation=value(driven, stack, prices, study.template.seed, left_out=left_out),
        real_time_factor_per_core=factor,
        wall_s=sum(spent.values("wall_s")),
        km_per_core_hour=way,
    )


def _speed(driven: Rows, cpu: list[float | None]) -> tuple[float | None, float | None]:
    """Median of simulated over processor time, and km per core hour, of deliveries.

    None where the processor time ``cpu`` [s] of one of them is unknown.
    """
    if not all(cpu):
        return None, None
    seconds: FloatArray = np.array(cpu)
    kilometres = 1e-3 * sum(driven.values("distance_m"))
    factors = np.array(driven.values("duration_s")) / seconds
    return float(np.median(factors)), kilometres / (float(seconds.sum()) / 3600.0)


def run_document(result: StackResult, study: Study, folder: Path | None) -> Row:
    """One entry of ``runs`` in the JSON document of ``navbench run``."""
    document: Row = {
        "stack": result.stack.name,
        "map": Path(study.template.map_name).stem,
        "seed": study.template.seed,
        "episodes": result.episodes,
        "errors": result.errors,
        "failures": result.failures,
        **valuation_document(result.valuation),
    }
    if folder is not None:
        document["real_time_factor_per_core"] = result.real_time_factor_per_core
        document["km_per_core_hour"] = result.km_per_core_hour
        document["wall_s"] = result.wall_s
        document["folder"] = str(folder)
        document["digest"] = root_digest(folder)
    return document


def finish(study: Study, folder: RunFolder) -> list[StackResult]:
    """The results of what is finished, which the folder keeps too."""
    results = summarize_study(study, folder.rows, folder.timings)
    if not folder.is_closed or folder.lacks_summary:
        folder.write_summary(
            {"schema": 1, "runs": [run_document(result, study, None) for result in results]}
        )
    return results
