"""A study from its tasks to its tables: run the episodes, keep them, sum them up and price them."""

import dataclasses
import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path

import numpy as np

from harness.economics.cost_model import Economics, Measured, price
from harness.economics.prices import Prices
from harness.episode import Delivery, run_episode
from harness.execution import Finished, run_tasks
from harness.metrics import EPISODE_COLUMNS, EVENT_COLUMNS, TIMING_COLUMNS, Row, summarize, summarize_more
from harness.runs import RunFolder
from harness.setup import nav2_parameters, prices_of, rules_of, scene_of, world_params
from harness.stack import Stack
from harness.statistics import Interval, bootstrap_mean, wilson_interval
from harness.study import EpisodeTask, Study
from harness.world.robot import RobotParams
from harness.world.sensors import SensorParams
from navstack.params.strict import dump_dataclass, load_dataclass

TABLES = {"episodes": EPISODE_COLUMNS, "events": EVENT_COLUMNS, "timings": TIMING_COLUMNS}
OUTCOMES = ("sla", "spoiled", "timeout", "physical_assistance")
LIBRARIES = ("navbench", "numpy", "scipy", "numba", "pybullet", "ompl", "shapely", "pyarrow")
BOOTSTRAP_DRAWS = 10_000
DOLLARS = (
    *("pedestrian_safety", "property_damage", "repair", "service_compensation"),
    *("opex", "revenue", "contribution_margin"),
)
CENT = 0.01  # [USD] deliveries whose costs differ by less are alike


@dataclass(frozen=True, slots=True)
class StackResult:
    """What a stack did over its finished episodes, and what that costs."""

    stack: Stack
    episodes: int  # finished, errors not counted
    errors: int
    measured: Row | None  # keys of the paper's simulation table; None: no episode finished
    more: Row  # means that the paper's table does not have
    economics: Economics | None
    intervals: dict[str, Interval]  # of rates (Wilson) and of means (bootstrap)
    real_time_factor_per_core: float | None  # median over the deliveries; the very first one also compiles
    wall_s: float  # of driving, summed over the episodes


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
    row = {**where, "stack_number": task.stack_number, "map": Path(task.map_name).stem, "seed": task.seed}
    return {"row": {**row, "error": finished.error}, "events": [], "timing": where}


def summarize_study(study: Study, records: Sequence[Row]) -> list[StackResult]:
    """One result per stack."""
    prices = prices_of(study.template.prices)
    return [_summarize_stack(study, stack, records, prices) for stack in study.stacks]


def _summarize_stack(study: Study, stack: Stack, records: Sequence[Row], prices: Prices) -> StackResult:
    own = sorted((r for r in records if r["row"]["stack"] == stack.name), key=lambda r: r["row"]["episode"])
    rows = [r["row"] for r in own if r["row"].get("error") is None]
    if not rows:
        return StackResult(stack, 0, len(own), None, {}, None, {}, None, 0.0)
    summary = summarize(rows, prices.rolling_resistance_force)
    economics = price(Measured(**summary), stack.carries, False, prices)
    timings = [r["timing"] for r in own if r["row"].get("error") is None]
    return StackResult(
        stack=stack,
        episodes=len(rows),
        errors=len(own) - len(rows),
        measured=summary,
        more=summarize_more(rows),
        economics=economics,
        intervals=_intervals(rows, stack, prices, study.template.seed),
        real_time_factor_per_core=float(np.median([timing["real_time_factor"] for timing in timings])),
        wall_s=sum(timing["wall_s"] for timing in timings),
    )


def _intervals(rows: Sequence[Row], stack: Stack, prices: Prices, seed: int) -> dict[str, Interval]:
    """95 % intervals: Wilson for shares of episodes, bootstrap over episodes for means."""
    n = len(rows)
    intervals = {o: wilson_interval(sum(row["outcome"] == o for row in rows), n) for o in OUTCOMES}
    if any(row["outcome"] == "arrived" for row in rows):
        del intervals["sla"], intervals["spoiled"]
    per_episode = [summarize([row], prices.rolling_resistance_force) for row in rows]
    for key in [key for key in per_episode[0] if key not in OUTCOMES]:
        intervals[key] = _bootstrap([summary[key] for summary in per_episode], seed)
    more = [summarize_more([row]) for row in rows]
    for key in more[0]:
        intervals[key] = _bootstrap([summary[key] for summary in more], seed)
    priced = [price(Measured(**summary), stack.carries, False, prices) for summary in per_episode]
    for term in DOLLARS:
        intervals[term] = _bootstrap([getattr(p, term) for p in priced], seed, CENT)
    return {key: interval for key, interval in intervals.items() if interval is not None}


def _bootstrap(values: Sequence[float | None], seed: int, resolution: float = 0.0) -> Interval | None:
    """Mean and interval; None where a value is undefined. No bounds where all deliveries are alike: too few to tell."""
    known = [value for value in values if value is not None]
    if len(known) < len(values):
        return None
    if max(known) - min(known) <= resolution:
        return Interval(float(np.mean(known)), None, None, len(known))
    return bootstrap_mean(np.array(known), np.random.default_rng(seed), BOOTSTRAP_DRAWS)


def about(study: Study, command: Sequence[str]) -> Row:
    """Content of ``run.json``: all that is needed to run it again, with the files in ``params/`` by name."""
    template = study.template
    names = _names(study)
    scene = scene_of(template.map_name)
    digest = hashlib.sha256(scene.geometry.data.tobytes() + scene.walkable.data.tobytes()).hexdigest()
    task = dataclasses.asdict(template)
    for key in ("stack", "stack_number", "episode"):
        del task[key]
    return {
        "command": ["navbench", *command[1:]],
        "stacks": [{**dataclasses.asdict(stack), **names[stack.name]} for stack in study.stacks],
        "episodes": study.episodes,
        **task,
        **{key: f"params/{key}.yaml" for key in ("world", "rules", "prices")},
        "map_sha256": digest,
        "versions": {name: version(name) for name in LIBRARIES},
    }


def parameters(study: Study) -> dict[str, str]:
    """What the run really uses, defaults and overrides filled in, by file name in ``params/``."""
    template = study.template
    world = world_params(template.world, template.pedestrians)
    texts = {
        "world.yaml": dump_dataclass(world),
        "rules.yaml": dump_dataclass(rules_of(template.rules)),
        "prices.yaml": dump_dataclass(prices_of(template.prices)),
    }
    for stack in study.stacks:
        names = _names(study)[stack.name]
        texts[names["sensors"].removeprefix("params/")] = dump_dataclass(
            load_dataclass(SensorParams, Path(stack.sensors))
        )
        texts[names["robot"].removeprefix("params/")] = dump_dataclass(load_dataclass(RobotParams, Path(stack.robot)))
        if stack.nav2_file:
            nav2 = nav2_parameters(stack.nav2_file, template.allow_unknown)
            texts[f"{stack.name}-nav2.yaml"] = nav2.dump_merged()
            texts[f"{stack.name}-ignored.txt"] = "\n".join((*nav2.warnings, *nav2.ignored, ""))
    return texts


def _names(study: Study) -> dict[str, dict[str, str]]:
    """Where each stack's files are in the run folder."""
    kinds = ("sensors", "robot")
    return {
        stack.name: {
            **{kind: f"params/{stack.name}-{kind}.yaml" for kind in kinds},
            "nav2_file": f"params/{stack.name}-nav2.yaml" if stack.nav2_file else "",
        }
        for stack in study.stacks
    }


def run_document(result: StackResult, study: Study, folder: Path | None) -> Row:
    """One entry of ``runs`` in the JSON document of ``navbench run``."""
    outcomes = {name: result.intervals[name].as_json() if name in result.intervals else None for name in OUTCOMES}
    document: Row = {
        "stack": result.stack.name,
        "map": Path(study.template.map_name).stem,
        "seed": study.template.seed,
        "episodes": result.episodes,
        "errors": result.errors,
        "outcomes": outcomes,
        "measured": None if result.measured is None else {**result.measured, **result.more},
        "economics": None if result.economics is None else dataclasses.asdict(result.economics),
        "intervals": {name: interval.as_json() for name, interval in result.intervals.items()},
    }
    if folder is not None:
        document["real_time_factor_per_core"] = result.real_time_factor_per_core
        document["wall_s"] = result.wall_s
        document["folder"] = str(folder)
    return document
