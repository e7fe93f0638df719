"""One delivery, from a task to its rows."""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.economics.prices import Price, Prices
from harness.injury import injury_cost
from harness.metrics import DeliveryLog, Row, event_rows, is_paid
from harness.mission import Mission
from harness.outcome import Verdict
from harness.setup import Brain, build_brain, build_world, mission_of, prices_of, rules_of, scene_of
from harness.study import EpisodeTask
from harness.truth import CountedContact, Partner, Truth
from navstack.types import Belief


@dataclass(frozen=True, slots=True)
class Delivery:
    """What is kept of one delivery."""

    row: Row  # everything that the seed determines
    events: list[Row]
    timing: Row  # what the machine determines
    recording: Mapping[str, Any] | None  # arrays; None: not asked for


def run_episode(task: EpisodeTask) -> Delivery:
    """Simulate one delivery.

    Raises:
        NavstackError: the task cannot be set up.
    """
    began = time.perf_counter()
    scene = scene_of(task.map_name)
    generators = task.generators()
    mission = mission_of(task, generators["mission"])
    rules = rules_of(task.rules)
    world = build_world(task)
    brain = build_brain(task, world)
    ready = time.perf_counter()

    observation = world.reset(mission, generators)
    brain.reset(mission.goal, Belief(mission.start), generators["planner"])
    log = DeliveryLog(world.truth, frozenset(obstacle.kind for obstacle in scene.obstacles), task.keep_trace)
    while (verdict := rules.judge(world.truth, mission.goal)) is None:
        command = brain.tick(observation)
        observation = world.step(command)
        log.record(world.truth, brain.belief, command)

    truth = world.close_episode()
    wall = time.perf_counter() - ready
    where = {"stack": task.stack.name, "episode": task.episode}
    events = event_rows(truth, _costs(truth, prices_of(task.prices)))
    return Delivery(
        row=_row(task, mission, verdict, truth, brain, log),
        events=[{**where, **event} for event in events],
        timing={**where, "setup_s": ready - began, "wall_s": wall, "real_time_factor": truth.stamp / wall},
        recording=log.recording() if task.keep_trace else None,
    )


def _row(task: EpisodeTask, mission: Mission, verdict: Verdict, truth: Truth, brain: Brain, log: DeliveryLog) -> Row:
    """The episode's row; :data:`harness.metrics.EPISODE_COLUMNS` gives its order."""
    start, goal = mission.start, mission.goal
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
        "navigator_error": brain.last_error,
        "goal_distance_m": math.hypot(truth.pose.x - goal.x, truth.pose.y - goal.y),
        **log.measurements(truth),
        **_injury(truth, prices_of(task.prices)),
        "plans": brain.counts.plans,
        "failed_plans": brain.counts.failed_plans,
        "failed_controls": brain.counts.failed_controls,
        "recoveries": brain.counts.recoveries,
    }


def _injury(truth: Truth, prices: Prices) -> Row:
    """Injury cost of the counted contacts with people; delta_v is impulse over the robot's mass, as published."""
    impulses = [c.impulse for c in truth.counted_contacts if c.partner is Partner.PEDESTRIAN]
    delta_v = np.array(impulses) / prices.robot_mass.value  # [m/s]
    return {
        "collision_delta_v_mps": float(delta_v.mean()) if len(delta_v) else 0.0,
        "pedestrian_injury_usd": float(injury_cost(delta_v, prices).sum()),
    }


def _costs(truth: Truth, prices: Prices) -> list[float]:
    """What each counted contact costs, in [USD]."""
    return [_cost(contact, prices) if is_paid(contact) else 0.0 for contact in truth.counted_contacts]


def _cost(contact: CountedContact, prices: Prices) -> float:
    if contact.partner is Partner.PEDESTRIAN:
        return float(injury_cost(contact.impulse / prices.robot_mass.value, prices))
    price: Price = getattr(prices.property_damage, contact.kind)
    return price.value
