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
from harness.episode.factory import Parts
from harness.episode.pedestrian_delay import PedestrianDelay
from harness.metrics.columns import Row
from harness.metrics.contacts import event_rows
from harness.metrics.decisions import DecisionLog, NoDecisionLog
from harness.metrics.delivery_log import JOULES_PER_KWH, DeliveryLog
from harness.metrics.encounters import Body
from harness.metrics.ghost_tracks import GhostTracks
from harness.metrics.motion import success_weighted_path_length
from harness.metrics.replay_log import NoReplayLog, ReplayLog
from harness.storage.shipped import is_district
from harness.storage.texts import clean_text, clean_texts
from harness.task.brain import Brain, Parked
from harness.task.mission import Mission
from harness.task.study import EpisodeTask, brain_rngs
from harness.world.outcome import ARRIVALS, Outcome, Verdict
from harness.world.pybullet_world import PyBulletWorld
from harness.world.truth import CountedContact, Partner, Truth
from harness.world.world import Legacy, World
from navstack.errors import InputError
from navstack.plugin_answers import is_command
from navstack.stopwatch import Latencies
from navstack.types import Belief, Observation, Pose2D, Twist2D

MakeBrain = Callable[[Parts, World], Brain]
STACK_FAILED = "stack failed"  # the reason of an outcome
# errors that are no stack's: there is no result then
OF_THE_MACHINE = (MemoryError, OSError)


@dataclass(frozen=True, slots=True)
class Delivery:
    """Results of one delivery."""

    row: Row  # everything that the seed determines
    events: list[Row]
    timing: Row  # what the machine determines
    recording: Mapping[str, Any] | None  # arrays; None: not asked for
    decisions: tuple[dict[str, str], list[Row]] | None  # columns and rows; None: not asked for
    legs: Sequence[Row] = ()  # of a mission on a district; columns: LEG_COLUMNS


@dataclass(frozen=True, slots=True)
class Carried:
    """What a robot takes over from the legs of a mission that it has driven."""

    pose: Pose2D  # true
    belief: Belief
    seconds: float  # [s] since its way there or back began
    impulse: float  # [N s] of counted contacts
    legacy: Legacy | None = None  # of the leg before; None: it is the first


class RunningDelivery:
    """A delivery under way: driven by commands until there is a verdict, then finished."""

    def __init__(
        self,
        task: EpisodeTask,
        make_brain: MakeBrain = Parts.brain,
        world: PyBulletWorld | None = None,
        carried: Carried | None = None,
    ) -> None:
        """Set the delivery up; no time has passed.

        Args:
            task: the delivery.
            make_brain: what drives it, or senses for an external driver.
            world: one of its own, of :meth:`Parts.new_world`, so that several can be under way in a
                process; None: the process's.
            carried: from earlier legs; None: it begins at the mission's start, and knows it.

        Raises:
            NavstackError: the task cannot be set up.
        """
        began = time.perf_counter()
        self.task, self.parts = task, Parts(task)
        generators = task.generators()
        self.mission = self.parts.mission(generators["mission"])
        believed, legacy = Belief(self.mission.start), None
        if carried is not None:
            legacy = carried.legacy
            self.mission = dataclasses.replace(self.mission, start=carried.pose)
            believed = Belief(carried.belief.pose, carried.belief.covariance)
            self.parts.rules = self.parts.rules.after(carried.seconds, carried.impulse)
        self.world = world or self.parts.world()
        self.brain = make_brain(self.parts, self.world)
        self._ready, self._ready_cpu = time.perf_counter(), time.process_time()
        self._setup = self._ready - began  # [s]
        self.observation = self.world.reset(self.mission, generators, legacy)
        self._failure: str | None = None  # of the stack
        try:
            self.brain.reset(self.mission.goal, believed, brain_rngs(generators))
        except Exception as error:  # whatever a stack or a policy raises
            self.fail(error)
            self.brain = Parked()
        self._log = DeliveryLog(self.world.truth, self.parts.scene, _body(self.parts))
        self._delay = PedestrianDelay(self.world.people, self.world.truth, *self.world.tick)
        self._ghosts = GhostTracks()
        self._decisions = DecisionLog() if task.keep_decisions else NoDecisionLog()
        self._replay = ReplayLog() if task.keep_trace else NoReplayLog()
        self._command = Twist2D()

    @property
    def truth(self) -> Truth:
        """The true state now."""
        return self.world.truth

    @property
    def verdict(self) -> Verdict | None:
        """How it ended; None: it goes on."""
        if self._failure is not None:
            return Verdict(Outcome.PHYSICAL_ASSISTANCE, STACK_FAILED)
        return self.parts.rules.judge(self.world.truth, self.mission.goal)

    def drive_tick(self) -> None:
        """Drive a tick as the brain commands; what it raises ends the delivery, which has failed.

        Raises:
            MemoryError, OSError: the machine is to blame.
        """
        try:
            command = self.brain.tick(self.observation)
            self._decisions.record(self.brain)
        except Exception as error:  # whatever a stack or a policy raises
            self.fail(error)
        else:
            self._drive(command)

    def fail(self, error: Exception) -> None:
        """End the delivery, which has failed by what its stack raised.

        Raises:
            MemoryError, OSError: the machine is to blame.
        """
        if isinstance(error, OF_THE_MACHINE):
            raise error
        self._failure = clean_text(f"{type(error).__name__}: {error}")

    def drive(self, command: Twist2D) -> Observation:
        """Drive a tick by a command; returns what the sensors delivered.

        Raises:
            InputError: it is no Twist2D of finite numbers.
        """
        if not is_command(command):
            raise InputError(f"drive({command!r}): give a Twist2D of finite numbers")
        self._decisions.record(self.brain)
        return self._drive(command)

    def _drive(self, command: Twist2D) -> Observation:
        self._command = command
        self._ghosts.record(self.world.truth, self.brain)
        self._replay.record(self.world.truth, self.observation, self.brain, command)
        self.observation = self.world.step(command)
        self._log.record(self.world.truth, self.brain.belief)
        self._delay.record(self.world.truth)
        return self.observation

    @property
    def log(self) -> DeliveryLog:
        """What was watched so far."""
        return self._log

    def finish(self) -> Delivery:
        """Its results, once there is a verdict.

        Raises:
            ValueError: there is none yet.
        """
        verdict, brain, task = self.verdict, self.brain, self.task
        if verdict is None:
            raise ValueError("the delivery goes on; drive it until there is a verdict")
        truth = self.world.close_episode()
        self._replay.finish(truth, brain, self._command)
        wall, cpu = time.perf_counter() - self._ready, time.process_time() - self._ready_cpu
        where = {"stack": task.stack.name, "episode": task.episode}
        measured = {
            **self._log.measurements(truth),
            "pedestrian_delay_s": self._delay.total(truth),
            "ghost_tracks": self._ghosts.mean,
        }
        prices, decisions = self.parts.prices, self._decisions
        events = event_rows(truth, [cost_of(contact, prices) for contact in truth.counted_contacts])
        row = _row(task, self.mission, verdict, truth, brain, measured, prices)
        return Delivery(
            row=clean_texts({**row, "stack_error": self._failure}),  # as they are stored
            events=[{**where, **event} for event in events],
            timing={
                **where,
                "setup_s": self._setup,
                "wall_s": wall,
                "cpu_s": cpu,
                "real_time_factor": truth.stamp / wall,
                **latency_columns(brain.latencies),
            },
            recording=self._replay.recording() if task.keep_trace else None,
            decisions=(decisions.columns, decisions.rows) if task.keep_decisions else None,
        )


def run_episode(task: EpisodeTask, make_brain: MakeBrain = Parts.brain) -> Delivery:
    """Simulate one delivery; on a district all legs of its mission.

    Args:
        task: the delivery.
        make_brain: what drives it.

    Raises:
        NavstackError: the task cannot be set up.
    """
    if is_district(task.map_name):
        from harness.episode.street_delivery import drive_mission

        return drive_mission(task, make_brain)
    delivery = RunningDelivery(task, make_brain)
    while delivery.verdict is None:
        delivery.drive_tick()
    return delivery.finish()


def _body(parts: Parts) -> Body:
    """The robot as people meet it."""
    return Body(parts.robot.center, parts.robot.half_size, parts.params.people.radius)


def latency_columns(latencies: Latencies) -> Row:
    """How often planner and controller ran, and how long they took."""
    return {
        **_latency("planner", "planner_calls", latencies.planner),
        **_latency("controller", "controller_cycles", latencies.controller),
    }


def _latency(part: str, count: str, durations: Sequence[float]) -> Row:
    """How often a part ran and how long it took in [ms]; null where it never ran."""
    if not len(durations):
        return {count: 0}
    median, p95, longest = (1000.0 * np.percentile(durations, (50.0, 95.0, 100.0))).tolist()
    return {
        count: len(durations),
        f"{part}_median_ms": median,
        f"{part}_p95_ms": p95,
        f"{part}_max_ms": longest,
    }


def _row(
    task: EpisodeTask,
    mission: Mission,
    verdict: Verdict,
    truth: Truth,
    brain: Brain,
    measured: Row,
    prices: Prices,
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
        "way_back": None,
        "navigator_status": brain.status.value,
        "gave_up": brain.trouble.gave_up,
        "navigator_history": brain.trouble.history,
        "navigator_error": brain.trouble.error,
        "navigator_error_code": brain.trouble.error_code,
        "recovery_error": brain.trouble.recovery_error,
        "recovery_error_code": brain.trouble.recovery_error_code,
        "goal_distance_m": math.hypot(truth.pose.x - goal.x, truth.pose.y - goal.y),
        **measured,
        "spl": success_weighted_path_length(
            verdict.outcome in ARRIVALS, mission.shortest_path, measured["distance_m"]
        ),
        "published_energy_kwh": prices.rolling_resistance_force
        * measured["distance_m"]
        / JOULES_PER_KWH,
        **injury_measures(people, prices),
        **dataclasses.asdict(brain.counts),
    }


def cost_of(contact: CountedContact, prices: Prices) -> float:
    """What a contact costs, in [USD]."""
    if contact.partner is Partner.PEDESTRIAN:
        return float(injury_costs(contact.impulse, prices))
    return property_cost(contact.kind, contact.impulse, prices)
