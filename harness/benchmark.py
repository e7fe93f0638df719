"""A study from its tasks to its tables: run the episodes, keep them, sum them up and price them."""

import dataclasses
import hashlib
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np

from harness.economics.cost_model import Economics, Measured, price
from harness.economics.prices import Prices
from harness.episode import Delivery, run_episode
from harness.execution import Finished, run_tasks
from harness.metrics import EPISODE_COLUMNS, EVENT_COLUMNS, TIMING_COLUMNS, Row, summarize
from harness.runs import RunFolder
from harness.setup import nav2_parameters, prices_of, scene_of
from harness.stack import Stack
from harness.statistics import Interval, bootstrap_mean, wilson_interval
from harness.study import EpisodeTask, Study

TABLES = {"episodes": EPISODE_COLUMNS, "events": EVENT_COLUMNS, "timings": TIMING_COLUMNS}
OUTCOMES = ("sla", "spoiled", "timeout", "physical_assistance")
LIBRARIES = ("navbench", "numpy", "scipy", "numba", "pybullet", "ompl", "shapely", "pyarrow")
BOOTSTRAP_DRAWS = 10_000


@dataclass(frozen=True, slots=True)
class StackResult:
    """What a stack did over its finished episodes, and what that costs."""

    stack: Stack
    episodes: int  # finished, errors not counted
    errors: int
    measured: Row  # keys of the paper's simulation table
    economics: Economics
    intervals: dict[str, Interval]  # of rates (Wilson) and of means (bootstrap)
    real_time_factor_per_core: float
    wall_s: float  # summed over the episodes


Progress = Callable[[Finished[EpisodeTask, Delivery], Row], None]


def run_study(study: Study, folder: RunFolder, on_finished: Progress) -> list[Row]:
    """Run every task; each finished episode is on disk before ``on_finished`` hears of it."""
    records: list[Row] = []
    tasks = run_tasks(run_episode, study.tasks(), study.workers)
    try:
        for finished in tasks:
            record = _record(finished)
            folder.add(record)
            if finished.result is not None and finished.result.recording:
                folder.add_recording(f"{finished.task.stack.name}-{finished.task.episode}", finished.result.recording)
            records.append(record)
            on_finished(finished, record)
    finally:
        tasks.close()
    return records


def _record(finished: Finished[EpisodeTask, Delivery]) -> Row:
    """An episode as the run folder keeps it; one without a result becomes an error row."""
    if finished.result is not None:
        delivery = finished.result
        return {"row": delivery.row, "events": delivery.events, "timing": delivery.timing}
    task = finished.task
    where = {"stack": task.stack.name, "episode": task.episode}
    row = {**where, "stack_number": task.stack_number, "map": task.map_name, "seed": task.seed}
    return {"row": {**row, "error": finished.error}, "events": [], "timing": where}


def summarize_study(study: Study, records: Sequence[Row]) -> list[StackResult]:
    """One result per stack that finished at least one episode."""
    prices = prices_of(study.template.prices)
    results = [_summarize_stack(study, stack, records, prices) for stack in study.stacks]
    return [result for result in results if result is not None]


def _summarize_stack(study: Study, stack: Stack, records: Sequence[Row], prices: Prices) -> StackResult | None:
    own = sorted((r for r in records if r["row"]["stack"] == stack.name), key=lambda r: r["row"]["episode"])
    rows = [r["row"] for r in own if r["row"].get("error") is None]
    if not rows:
        return None
    summary = summarize(rows, prices.rolling_resistance_force)
    economics = price(Measured(**summary), stack.carries, False, prices)
    wall = sum(r["timing"]["wall_s"] for r in own if r["row"].get("error") is None)
    simulated = sum(row["duration_s"] for row in rows)
    return StackResult(
        stack=stack,
        episodes=len(rows),
        errors=len(own) - len(rows),
        measured=summary,
        economics=economics,
        intervals=_intervals(rows, stack, prices, study.template.seed),
        real_time_factor_per_core=simulated / wall,
        wall_s=wall,
    )


def _intervals(rows: Sequence[Row], stack: Stack, prices: Prices, seed: int) -> dict[str, Interval]:
    """95 % intervals: Wilson for shares of episodes, bootstrap over episodes for means."""
    n = len(rows)
    intervals = {o: wilson_interval(sum(row["outcome"] == o for row in rows), n) for o in OUTCOMES}
    if any(row["outcome"] == "arrived" for row in rows):
        del intervals["sla"], intervals["spoiled"]
    per_episode = [summarize([row], prices.rolling_resistance_force) for row in rows]
    means = [key for key in per_episode[0] if key not in OUTCOMES]
    for key in means:
        intervals[key] = _bootstrap([summary[key] for summary in per_episode], seed)
    priced = [price(Measured(**summary), stack.carries, False, prices) for summary in per_episode]
    for term in ("pedestrian_safety", "property_damage", "repair", "service_compensation", "opex", "revenue"):
        intervals[term] = _bootstrap([getattr(p, term) for p in priced], seed)
    intervals["contribution_margin"] = _bootstrap([p.contribution_margin for p in priced], seed)
    return {key: interval for key, interval in intervals.items() if interval is not None}


def _bootstrap(values: Sequence[float | None], seed: int) -> Interval | None:
    """Mean and interval; None where a value is undefined. No bounds where all deliveries are alike: too few to tell."""
    known = [value for value in values if value is not None]
    if len(known) < len(values):
        return None
    if min(known) == max(known):
        return Interval(known[0], None, None, len(known))
    return bootstrap_mean(np.array(known), np.random.default_rng(seed), BOOTSTRAP_DRAWS)


def about(study: Study, command: Sequence[str]) -> Row:
    """Content of ``run.json``: all that is needed to run it again."""
    template = study.template
    scene = scene_of(template.map_name)
    digest = hashlib.sha256(scene.geometry.data.tobytes() + scene.walkable.data.tobytes()).hexdigest()
    task = dataclasses.asdict(dataclasses.replace(template, stack_number=0))
    del task["stack"], task["stack_number"], task["episode"]
    return {
        "command": list(command),
        "stacks": [dataclasses.asdict(stack) for stack in study.stacks],
        "episodes": study.episodes,
        **task,
        "map_sha256": digest,
        "versions": {name: version(name) for name in LIBRARIES},
    }


def parameters(study: Study) -> dict[str, str]:
    """The merged parameters of every stack and the files they lean on, by file name."""
    template = study.template
    files = {Path(template.world), Path(template.rules)}
    texts = {f"{path.parent.name}-{path.name}": path.read_text(encoding="utf-8") for path in sorted(files)}
    texts[f"prices-{Path(template.prices).name}"] = Path(template.prices).read_text(encoding="utf-8")
    for stack in study.stacks:
        for path in (Path(stack.sensors), Path(stack.robot)):
            texts[f"{stack.name}-{path.parent.name}-{path.name}"] = path.read_text(encoding="utf-8")
        if stack.nav2_file:
            nav2 = nav2_parameters(stack.nav2_file, template.allow_unknown)
            texts[f"{stack.name}-nav2.yaml"] = nav2.dump_merged()
            texts[f"{stack.name}-ignored.txt"] = "\n".join((*nav2.warnings, *nav2.ignored, ""))
    return texts


def run_document(result: StackResult, study: Study, folder: Path | None, wall_s: float) -> Row:
    """One entry of ``runs`` in the JSON document of ``navbench run``."""
    outcomes = {name: result.intervals[name].as_json() if name in result.intervals else None for name in OUTCOMES}
    document: Row = {
        "stack": result.stack.name,
        "map": study.template.map_name,
        "seed": study.template.seed,
        "episodes": result.episodes,
        "errors": result.errors,
        "outcomes": outcomes,
        "measured": result.measured,
        "economics": dataclasses.asdict(result.economics),
        "intervals": {name: interval.as_json() for name, interval in result.intervals.items()},
    }
    if folder is not None:
        document["real_time_factor_per_core"] = result.real_time_factor_per_core
        document["wall_s"] = wall_s
        document["folder"] = str(folder)
    return document


class Stopwatch:
    """Wall time since it was made."""

    def __init__(self) -> None:
        self._start = time.perf_counter()

    @property
    def seconds(self) -> float:
        """Elapsed [s]."""
        return time.perf_counter() - self._start
