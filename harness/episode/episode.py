"""One delivery, from a task to its rows."""

import dataclasses
import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.economics.contact_costs import injury_costs, injury_measures, property_cost
from harness.economics.prices import Prices
from harness.episode.brain import Brain
from harness.episode.factory import Parts
from harness.episode.pedestrian_delay import PedestrianDelay
from harness.metrics.columns import Row
from harness.metrics.contacts import event_rows
from harness.metrics.decisions import DecisionLog, NoDecisionLog
from harness.metrics.delivery_log import JOULES_PER_KWH, DeliveryLog
from harness.metrics.encounters import Body
from harness.metrics.motion import success_weighted_path_length
from harness.metrics.replay_log import NoReplayLog, ReplayLog
from harness.task.mission import Mission
from harness.task.study import EpisodeTask
from harness.world.outcome import ARRIVALS, Verdict
from harness.world.truth import CountedContact, Partner, Truth
from harness.world.world import World
from navstack.types import Belief, Twist2D

MakeBrain = Callable[[Parts, World], Brain]


@dataclass(frozen=True, slots=True)
class Delivery:
    """What is kept of one delivery."""

    row: Row  # everything that the seed determines
    events: list[Row]
    timing: Row  # what the machine determines
    recording: Mapping[str, Any] | None  # arrays; None: not asked for
    decisions: tuple[dict[str, str], list[Row]] | None  # columns and rows; None: not asked for


def run_episode(task: EpisodeTask, make_brain: MakeBrain = Parts.brain) -> Delivery:
    """Simulate one delivery.

    Args:
        task: the delivery.
        make_brain: what drives it.

    Raises:
        NavstackError: the task cannot be set up.
    """
    began = time.perf_counter()
    parts = Parts(task)
    generators = task.generators()
    mission = parts.mission(generators["mission"])
    world = parts.world()
    brain = make_brain(parts, world)
    ready = time.perf_counter()

    observation = world.reset(mission, generators)
    brain.reset(
        mission.goal, Belief(mission.start), generators["planner"], generators["localizer"], generators["controller"]
    )
    kinds = frozenset(obstacle.kind for obstacle in parts.scene.obstacles)
    log = DeliveryLog(world.truth, kinds, _body(parts))
    delay = PedestrianDelay(world.people, world.truth, *world.tick)
    decisions = DecisionLog() if task.keep_decisions else NoDecisionLog()
    replay = ReplayLog() if task.keep_trace else NoReplayLog()
    command = Twist2D()
    while (verdict := parts.rules.judge(world.truth, mission.goal)) is None:
        command = brain.tick(observation)
        decisions.record(brain)
        replay.record(world.truth, observation, brain, command)
        observation = world.step(command)
        log.record(world.truth, brain.belief)
        delay.record(world.truth)

    truth = world.close_episode()
    replay.finish(truth, brain, command)
    wall = time.perf_counter() - ready
    where = {"stack": task.stack.name, "episode": task.episode}
    measured = {**log.measurements(truth), "pedestrian_delay_s": delay.total(truth)}
    events = event_rows(truth, [_cost(contact, parts.prices) for contact in truth.counted_contacts])
    return Delivery(
        row=_row(task, mission, verdict, truth, brain, measured, parts.prices),
        events=[{**where, **event} for event in events],
        timing={
            **where,
            "setup_s": ready - began,
            "wall_s": wall,
            "real_time_factor": truth.stamp / wall,
            **_latency("planner", "planner_calls", brain.latencies.planner),
            **_latency("controller", "controller_cycles", brain.latencies.controller),
        },
        recording=replay.recording() if task.keep_trace else None,
        decisions=(decisions.columns, decisions.rows) if task.keep_decisions else None,
    )


def _body(parts: Parts) -> Body:
    """The robot as people meet it."""
    return Body(parts.robot.center, parts.robot.half_size, parts.params.people.radius)


def _latency(part: str, count: str, durations: Sequence[float]) -> Row:
    """How often a part ran and how long it took in [ms]; null where it never ran."""
    if not len(durations):
        return {count: 0}
    median, p95, longest = (1000.0 * np.percentile(durations, (50.0, 95.0, 100.0))).tolist()
    return {count: len(durations), f"{part}_median_ms": median, f"{part}_p95_ms": p95, f"{part}_max_ms": longest}


def _row(
    task: EpisodeTask, mission: Mission, verdict: Verdict, truth: Truth, brain: Brain, measured: Row, prices: Prices
) -> Row:
    """The episode's row; :data:`harness.metrics.columns.EPISODE_COLUMNS` gives its order."""
    start, goal = mission.start, mission.goal
    people = [c.impulse for c in truth.counted_contacts if c.partner is Partner.PEDESTRIAN]
    return {
        "stack": task.stack.name,
        "stack_number": task.stack_number,
        "map": Path(task.map_name).stem,
        "seed": task.seed,
        "episode": task.episode,
        "start_x_m": start.x,
        "start_y_m": start.y,
        "start_yaw_rad": start.yaw,
        "goal_x_m": goal.x,
        "goal_y_m": goal.y,
        "shortest_path_m": mission.shortest_path,
        "outcome": verdict.outcome.value,
        "reason": verdict.reason,
        "navigator_status": brain.status.value,
        "gave_up": brain.trouble.gave_up,
        "navigator_history": brain.trouble.history,
        "navigator_error": brain.trouble.error,
        "navigator_error_code": brain.trouble.error_code,
        "recovery_error": brain.trouble.recovery_error,
        "recovery_error_code": brain.trouble.recovery_error_code,
        "goal_distance_m": math.hypot(truth.pose.x - goal.x, truth.pose.y - goal.y),
        **measured,
        "spl": success_weighted_path_length(verdict.outcome in ARRIVALS, mission.shortest_path, measured["distance_m"]),
        "published_energy_kwh": prices.rolling_resistance_force * measured["distance_m"] / JOULES_PER_KWH,
        **injury_measures(people, prices),
        **dataclasses.asdict(brain.counts),
    }


def _cost(contact: CountedContact, prices: Prices) -> float:
    """What a contact costs, in [USD]."""
    if contact.partner is Partner.PEDESTRIAN:
        return float(injury_costs(contact.impulse, prices))
    return property_cost(contact.kind, contact.impulse, prices)
