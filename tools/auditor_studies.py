"""Studies made of deliveries: honest ones, and some with a planted exploit of the cost model."""

import copy
import dataclasses
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path

import numpy as np
import optuna

from harness.audit.pairs import EVENTS
from harness.economics.accountings import COUNTED, EVENT, PERSON
from harness.economics.contact_costs import injury_measures
from harness.economics.prices import Prices
from harness.metrics.contacts import PRICED_PROPERTY
from harness.study.stored_run import load_run
from harness.tuning.evaluation import Candidate, unseen_missions
from harness.tuning.result import COMPLETE, StudyResult, Trial
from harness.tuning.space.space import Parameter, Space
from tools.auditor_exploits import (
    EXPLOITS,
    IMPROVEMENTS,
    THRESHOLD,
    TIMEOUT,
    Change,
    Row,
    counted_event,
    new_event,
    unchanged,
)

DIMENSIONS, TRIALS = 8, 60
NOISE = 0.2  # of a trial's objective, whose best is 0
SAMPLES = Parameter("samples", ("node.vx_samples",), 20, 5.0, 200.0, is_int=True)


def stored_deliveries(folders: Sequence[Path]) -> dict[str, list[Row]]:
    """The deliveries of runs of one seed by stack, on the missions that all finished.

    Each has its events.
    """
    runs = [load_run(str(folder)) for folder in folders]
    rows = {
        stack.name: {row["episode"]: dict(row) for row in stack.rows}
        for run in runs
        for stack in run.stacks
    }
    common = sorted(set.intersection(*(set(own) for own in rows.values())))
    for name, own in rows.items():
        for row in own.values():
            row[EVENTS] = []
        for event in (event for run in runs for event in run.events):
            if event["stack"] == name and event["episode"] in own:
                own[event["episode"]][EVENTS].append(dict(event))
    return {name: [own[episode] for episode in common] for name, own in rows.items()}


def drawn_deliveries(rng: np.random.Generator, n: int) -> dict[str, list[Row]]:
    """Deliveries of three made-up stacks on the same missions: other pace, other touches."""
    lengths = rng.uniform(20.0, 190.0, n)
    kinds = {
        "fast": (1.8, 0.4, 150.0, 0.08),
        "careful": (1.6, 0.10, 30.0, 0.0),
        "lively": (1.9, 0.2, 25.0, 0.0),
    }
    return {
        name: [_drawn_row(rng, episode, float(lengths[episode]), *kind) for episode in range(n)]
        for name, kind in kinds.items()
    }


def _drawn_row(
    rng: np.random.Generator,
    episode: int,
    shortest: float,
    speed: float,
    touches: float,
    impulse: float,
    helped: float = 0.0,
) -> Row:
    distance, mean_speed = shortest * rng.uniform(0.98, 1.05), speed * rng.uniform(0.85, 1.03)
    events = []
    for number in range(rng.poisson(touches)):
        strength = float(rng.gamma(2.5, impulse / 2.5))
        fault = rng.choice(["robot_into_person", "person_into_robot", "person_into_standing_robot"])
        events.append(new_event(PERSON, strength, 0.85 * strength, str(fault), number))
    row = {
        "stack": "drawn",
        "map": "sidewalk",
        "seed": 0,
        "episode": episode,
        "error": None,
        "gave_up": "",
        "start_x_m": float(episode),
        "start_y_m": 0.0,
        "start_yaw_rad": 0.0,
        "goal_x_m": shortest,
        "goal_y_m": 0.0,
        "shortest_path_m": shortest,
        "distance_m": distance,
        "duration_s": distance / mean_speed,
        "average_speed_mps": mean_speed,
        "goal_distance_m": 1.98,
        "outcome": "sla",
        "reason": "arrived",
        **{f"{kind}_contacts": 0 for kind in PRICED_PROPERTY},
        "personal_intrusion_percent": float(rng.uniform(0.0, 3.0)),
        "recoveries": 0,
        "pieces_lost": 0,
        "min_pedestrian_distance_m": float(rng.uniform(0.0, 2.0)),
        EVENTS: events,
    }
    if helped and rng.random() < helped:
        row |= {"outcome": "physical_assistance", "reason": "orientation"}
    elif rng.random() < 0.02:
        row |= {
            "outcome": "timeout",
            "reason": "timeout",
            "duration_s": TIMEOUT,
            "goal_distance_m": 0.4 * shortest,
        }
        row |= {"distance_m": 0.6 * shortest, "average_speed_mps": 0.6 * shortest / TIMEOUT}
    return row


def settle(row: Row, prices: Prices) -> None:
    """Work out what follows from a delivery's contact events: which count, and what they cost."""
    events = [event for event in row[EVENTS] if event["type"] == EVENT]
    hard = [
        event
        for event in events
        if event["peak_step_impulse_ns"] >= THRESHOLD and event["kind"] == PERSON
    ]
    counted = [counted_event(event) for event in hard]
    property_contacts = [
        event for event in row[EVENTS] if event["type"] == COUNTED and event["kind"] != PERSON
    ]
    row[EVENTS] = [*events, *counted, *property_contacts]
    touches = sum(event["kind"] == PERSON for event in events)
    row["pedestrian_contacts"], row["soft_contacts"] = len(counted), touches - len(hard)
    row["collision_impulse_ns"] = float(sum(event["impulse_ns"] for event in counted))
    row |= injury_measures([event["impulse_ns"] for event in counted], prices)


@lru_cache
def searched(seed: int, at_edge: bool) -> tuple[Space, tuple[Trial, ...], dict[str, float]]:
    """A search of a noisy objective: its space, its trials, and the best point."""
    rng = np.random.default_rng((seed, 1))
    best, weight = (
        rng.uniform(0.2, 0.8, DIMENSIONS),
        rng.uniform(1.0, 6.0, DIMENSIONS) * (np.arange(DIMENSIONS) % 2),
    )
    if at_edge:
        best[1], weight[1] = 1.3, 6.0
    names = [f"parameter_{i}" for i in range(DIMENSIONS)]
    space = Space("made-up", "", tuple(Parameter(n, (f"node.{n}",), 0.5, 0.0, 1.0) for n in names))
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    is_tpe = seed % 3 != 2
    sampler = (
        optuna.samplers.TPESampler(seed=seed) if is_tpe else optuna.samplers.CmaEsSampler(seed=seed)
    )
    study = optuna.create_study(direction="maximize", sampler=sampler)
    study.enqueue_trial({name: 0.5 for name in names})
    trials = []
    for number in range(TRIALS):
        asked = study.ask()
        point = {name: asked.suggest_float(name, 0.0, 1.0) for name in names}
        value = float(
            rng.normal(0.0, NOISE) - weight @ (np.array(list(point.values())) - best) ** 2
        )
        study.tell(asked, value)
        trial = Candidate(f"trial-{number}", space.values(point))
        trials.append(Trial(number, trial, dict(point), COMPLETE, 20, (value,), (value,), None, ""))
    top = max(trials, key=lambda trial: trial.values[0])
    return space, tuple(trials), dict(top.point)  # type: ignore[arg-type]


def resampled(
    stacks: tuple[Sequence[Row], Sequence[Row]],
    change: Change,
    missions: int,
    prices: Prices,
    rng: np.random.Generator,
    exchanged: float = 0.0,
) -> tuple[list[Row], list[Row]]:
    """Rows of original and incumbent on resampled missions, each taken for one of its own.

    ``exchanged`` is the share of missions on which the two change places; at a half they do not
    differ.
    """
    sides: tuple[list[Row], list[Row]] = ([], [])
    for number, chosen in enumerate(rng.integers(0, len(stacks[0]), missions)):
        pair = [copy.deepcopy(stack[chosen]) for stack in stacks]
        if rng.random() < exchanged:
            pair.reverse()
        change(pair[1], rng)
        for side, row, name in zip(sides, pair, ("original", "incumbent"), strict=True):
            settle(row, prices)
            row |= {
                "stack": name,
                "seed": 1,
                "episode": number,
                "start_x_m": row["start_x_m"] + 1e-6 * number,
            }
            side.append(row)
    return sides


def made_study(
    rows: tuple[list[Row], list[Row]],
    seed: int,
    at_edge: bool = False,
    computes: float = 1.0,
) -> StudyResult:
    """A study whose test brought these rows.

    ``computes`` is how many times the samples its incumbent takes.
    """
    space, trials, best = searched(seed, at_edge)
    values = space.values(best)
    if computes != 1.0:
        space = dataclasses.replace(space, parameters=(*space.parameters, SAMPLES))
        drawn = np.random.default_rng(seed).integers(
            int(SAMPLES.low), int(SAMPLES.high), len(trials)
        )
        trials = tuple(
            dataclasses.replace(trial, point={**trial.point, SAMPLES.name: int(own)})
            for trial, own in zip(trials, drawn, strict=True)
        )
        values = {**values, SAMPLES.paths[0]: int(computes * float(SAMPLES.original))}
    return StudyResult(
        original=Candidate("original", {}),
        incumbent=Candidate("incumbent", values),
        objectives=("margin",),
        space=space,
        trials=trials,
        front=(0,),
        seed=seed,
        train_missions=(),
        test_missions=unseen_missions(len(rows[0])),
        train_rows=((), ()),
        test_rows=rows,
    )


def honest_study(
    stacks: dict[str, list[Row]],
    number: int,
    missions: int,
    prices: Prices,
    seed: int,
) -> tuple[str, StudyResult]:
    """One of the honest studies, and what it is."""
    rng = np.random.default_rng((seed, number, 2))
    names = list(stacks)
    pairs = [(a, b) for a in names for b in names if a != b]
    first, second = pairs[number % len(pairs)]
    kind = number // len(pairs) % 3
    if kind == 0:
        title = f"{first} -> {second}"
        rows = resampled((stacks[first], stacks[second]), unchanged, missions, prices, rng)
    elif kind == 1:
        title = f"{first}, {second} exchanged at random"
        rows = resampled(
            (stacks[first], stacks[second]),
            unchanged,
            missions,
            prices,
            rng,
            exchanged=0.5,
        )
    else:
        change = IMPROVEMENTS[number % len(IMPROVEMENTS)]
        title = f"{first}, {change.__name__.replace('_', ' ')}"
        rows = resampled((stacks[first], stacks[first]), change, missions, prices, rng)
    return title, made_study(rows, 1000 * seed + number)


def exploiting_study(
    stacks: dict[str, list[Row]],
    key: str,
    missions: int,
    prices: Prices,
    seed: int,
) -> tuple[str, StudyResult]:
    """A study into which one exploit is planted, and what it is."""
    rng = np.random.default_rng((seed, list(EXPLOITS).index(key), 3))
    first, planted = next(iter(stacks)), EXPLOITS[key]
    rows = resampled((stacks[first], stacks[first]), planted.change, missions, prices, rng)
    return f"{first}, planted: {planted.title}", made_study(
        rows, 1000 * seed, planted.at_edge, planted.computes
    )
