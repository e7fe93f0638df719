"""From what is to be timed to rows of the document.

One per component and reference, one per closed loop.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.execution.workers import Workers, available_cores
from harness.task.study import EpisodeTask
from navstack.errors import InputError, NavstackError, UnknownNameError
from navstack.types import FloatArray
from tools.bench import controllers, costmaps, localizers, planners
from tools.bench.breakdown import break_down
from tools.bench.component import MEASURED, SOURCE, TWIN, Component
from tools.bench.loops import LOOPS, Course, Driven, Loop, drive
from tools.bench.timing import PROCESSOR, WALL, Spread, readings

Row = dict[str, Any]

CPP = "nav2 c++ (recorded)"
TWO_WORKERS = "two workers"
SHARED_LOOP = "paper-gps incremental"  # what two workers drive
LEAST_SPEEDUP = 1.9  # of two workers on two cores
COMPONENTS = {
    component.name: component
    for module in (costmaps, controllers, planners, localizers)
    for component in module.COMPONENTS
}
GROUPS = {"components": tuple(COMPONENTS), "loops": (*LOOPS, TWO_WORKERS)}
NAMES = (*COMPONENTS, *LOOPS, TWO_WORKERS)


@dataclass(frozen=True, slots=True)
class Effort:
    """How long is measured."""

    runs: int  # readings of each component
    fewest: int  # of them, where the budget ends before
    budget: float  # [s] of processor time per component
    deliveries: int  # of each closed loop
    shared: int  # deliveries that the workers share
    rounds: int  # of one worker and two
    seconds: float | None  # simulated time after which a delivery is cut off; None: whole ones


FULL = Effort(runs=40, fewest=5, budget=4.0, deliveries=10, shared=16, rounds=3, seconds=None)
QUICK = Effort(runs=7, fewest=1, budget=0.5, deliveries=3, shared=4, rounds=1, seconds=15.0)


def chosen(only: Sequence[str]) -> list[str]:
    """The names that a user asked for, in their usual order: whole names, groups or parts of names.

    None: all.

    Several may stand in one text with commas between them, unless the text with its commas is part
    of a name.

    Raises:
        InputError: one is empty.
        UnknownNameError: one fits nothing.
    """
    wanted: set[str] = set()
    for given in only:
        for part in [given] if _fitting(given) else given.split(","):
            if not part.strip():
                raise InputError(
                    f"--only '{given}' names nothing; give a name, a part of one, "
                    f"{' or '.join(GROUPS)}"
                )
            fitting = _fitting(part.strip())
            if not fitting:
                raise UnknownNameError("--only", part.strip(), (*GROUPS, *NAMES))
            wanted.update(fitting)
    return [name for name in NAMES if not only or name in wanted]


def _fitting(given: str) -> list[str]:
    """What a group, a name or a part of one stands for; nothing for an empty text."""
    if given in GROUPS or given in NAMES:
        return list(GROUPS.get(given, (given,)))
    return [name for name in NAMES if given.strip() and given.casefold() in name.casefold()]


def measure(name: str, effort: Effort, folder: Path) -> list[Row]:
    """The rows of one name.

    Args:
        name: of ``NAMES``.
        effort: how long to measure.
        folder: for parameter files that differ from the shipped ones.

    Raises:
        NavstackError: it cannot be set up, or a kernel and its twin do not agree.
    """
    if name in COMPONENTS:
        return component_rows(COMPONENTS[name], effort)
    if name == TWO_WORKERS:
        if available_cores() == 1:
            return []
        return [workers_row(effort, folder)]
    return [loop_row(LOOPS[name], effort, folder)]


def component_rows(component: Component, effort: Effort) -> list[Row]:
    """Times of a component in this process against its twin and against the recorded C++."""
    prepared = component.prepare()
    steps = [prepared.ours]
    if prepared.twin is not None:
        steps.append(prepared.twin)
    taken = 1e3 * readings(steps, effort.runs, effort.budget, effort.fewest)
    ours = taken[:, 0, PROCESSOR]
    known = {
        "name": component.name,
        "ours_ms": np.median(ours),
        "ours_wall_ms": np.median(taken[:, 0, WALL]),
    }
    rows = []
    if component.recorded_ms is not None:
        compared = _compared(ours, component.recorded_ms, component.target)
        rows.append({**known, "reference": CPP, **compared, "note": SOURCE})
    if prepared.twin is not None:
        compared = _compared(ours, taken[:, 1, PROCESSOR], None)
        rows.append({**known, "reference": TWIN, **compared, "note": MEASURED})
    return rows


def _compared(ours: FloatArray, reference: FloatArray | float, target: float | None) -> Row:
    """Median and quartiles of ours / reference, and whether the median keeps the target."""
    spread = Spread.of(ours / reference)
    row = {"reference_ms": np.median(reference), **spread.as_json("ratio")}
    met = None
    if target is not None:
        met = spread.median <= target
    return row | {"target": target, "met": met}


def loop_row(loop: Loop, effort: Effort, folder: Path) -> Row:
    """Simulated seconds per second of one core over deliveries, after one that does not count.

    Then where the time goes.
    """
    course = Course(loop, folder / loop.name, effort.seconds)
    drive(course.task(0))
    driven = [drive(course.task(episode)) for episode in range(effort.deliveries)]
    factors = Spread.of(np.array([each.factor for each in driven]))
    return {
        "name": loop.name,
        **factors.as_json("real_time_factor"),
        "wall_real_time_factor": float(np.median([each.simulated / each.wall for each in driven])),
        "simulated_s": sum(each.simulated for each in driven),
        "target": loop.target,
        "met": factors.median >= loop.target,
        **break_down([course.task(episode) for episode in range(effort.rounds)]),
    }


def workers_row(effort: Effort, folder: Path) -> Row:
    """The same deliveries by one process and by two, in turn.

    Wall time, so on a machine that does nothing else.
    """
    course = Course(LOOPS[SHARED_LOOP], folder / "workers", seconds=effort.seconds)
    tasks = [course.task(episode) for episode in range(effort.shared)]
    speedups, factors, slower = [], [], []
    with Workers(1) as one, Workers(2) as two:
        for workers in (one, two):
            _drive_all(workers, [course.task(0)] * 4)
        for turn in range(effort.rounds):
            order = [one, two]
            if turn % 2:
                order.reverse()
            took = {id(workers): _drive_all(workers, tasks) for workers in order}
            (wall_one, by_one), (wall_two, by_two) = took[id(one)], took[id(two)]
            speedups.append(wall_one / wall_two)
            factors.append(sum(each.simulated for each in by_two) / wall_two)
            slower.append(
                sum(each.processor for each in by_two) / sum(each.processor for each in by_one)
            )
    speedup = Spread.of(np.array(speedups))
    return {
        "name": TWO_WORKERS,
        **Spread.of(np.array(factors)).as_json("real_time_factor"),
        "loop": SHARED_LOOP,
        "deliveries": effort.shared,
        "of_one_worker": speedup.as_json(),
        "processor_time_of_one_worker": Spread.of(np.array(slower)).as_json(),
        "target": LEAST_SPEEDUP,
        "met": speedup.median >= LEAST_SPEEDUP,
    }


def _drive_all(workers: Workers, tasks: Sequence[EpisodeTask]) -> tuple[float, list[Driven]]:
    """Wall time in [s] of some deliveries, and what each took.

    Raises:
        NavstackError: one of them failed.
    """
    began = time.perf_counter()
    finished = list(workers.run(drive, tasks))
    took = time.perf_counter() - began
    trouble = next((each.error for each in finished if each.error), None)
    if trouble is not None:
        raise NavstackError(f"a delivery of the benchmark failed: {trouble}")
    return took, [each.result for each in finished if each.result is not None]
