"""A delivery on a district: the legs of its mission, driven one after the other, as one row."""

import contextlib
import dataclasses
import gc
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from harness.episode.episode import Carried, Delivery, MakeBrain, RunningDelivery, latency_columns
from harness.episode.files import rules_of
from harness.episode.places import legs_of, street_mission, way_there
from harness.metrics.catalog import EPISODE_METRICS
from harness.metrics.columns import Row
from harness.metrics.motion import success_weighted_path_length
from harness.task.brain import Brain
from harness.task.mission import Mission
from harness.task.study import EpisodeTask
from harness.world.outcome import ARRIVALS, Outcome, Rules
from harness.world.truth import CargoState
from navstack.costmap.field_cache import passing_map
from navstack.navigation_status import Status
from navstack.stopwatch import Latencies
from navstack.types import Belief, FloatArray, Pose2D

SMALLEST = ("min_pedestrian_distance_m", "min_time_to_collision_s")
BY_DURATION = ("intimate_intrusion_percent", "personal_intrusion_percent")
BY_TIME_DRIVEN = ("ghost_tracks",)  # nobody is looked for at signals


@dataclass(frozen=True, slots=True)
class DrivenLeg:
    """What came of one leg."""

    delivery: Delivery
    series: Mapping[str, FloatArray]  # see DeliveryLog.series
    latencies: Latencies
    begin: float  # [s] since the mission began
    pose: Pose2D  # true, at its end

    @property
    def row(self) -> Row:
        """As of a delivery of its own."""
        return self.delivery.row

    @property
    def has_arrived(self) -> bool:
        """Whether the robot reached the leg's end."""
        return Outcome(self.row["outcome"]) in ARRIVALS


def drive_mission(task: EpisodeTask, make_brain: MakeBrain) -> Delivery:
    """Drive the legs of a mission until one fails; after an arrival, the way back if rules say so.

    A leg begins where the robot truly ended the one before, at rest, with its belief, what is left
    of its cargo, and the errors of its sensors that last. Time and impulse that were used up are
    missing from its limits. People are drawn anew.

    The way back has the time of the way there. It adds time, distance, energy and contacts to the
    row, not to its outcome and cargo; its legs are driven with a full bucket.

    Raises:
        NavstackError: the task cannot be set up.
    """
    return drive_in_legs(task, make_brain)[0]


def drive_in_legs(task: EpisodeTask, make_brain: MakeBrain) -> tuple[Delivery, list[DrivenLeg]]:
    """Drive a mission as :func:`drive_mission` does; its legs are recorded as the task says."""
    with passing_map(), _quick_collection():
        return _drive_mission(task, make_brain)


@contextlib.contextmanager
def _quick_collection() -> Iterator[None]:
    """Within it :func:`_free_memory` is quick."""
    try:
        yield
    finally:
        gc.unfreeze()


def _free_memory() -> None:
    """Free what the leg before left, world and brain; later searches pass over what stays."""
    gc.collect()
    gc.freeze()


def _drive_mission(task: EpisodeTask, make_brain: MakeBrain) -> tuple[Delivery, list[DrivenLeg]]:
    legs = legs_of(task)
    mission, turn = street_mission(legs), len(way_there(legs))
    carried = Carried(mission.start, Belief(mission.start), 0.0, 0.0)
    there, carried = _drive_legs(task, make_brain, range(turn), carried, 0.0)
    has_arrived = len(there) == turn and there[-1].has_arrived
    back: list[DrivenLeg] = []
    if has_arrived and carried.legacy:
        arrived = carried.seconds  # [s]
        refilled = dataclasses.replace(carried.legacy, pieces=None)
        carried = dataclasses.replace(carried, seconds=0.0, legacy=refilled)
        back, _ = _drive_legs(task, make_brain, range(turn, len(legs)), carried, arrived)
    done = [*there, *back]
    row = _joined(done, there, mission)
    if has_arrived:
        row |= _arrival(row, rules_of(task.rules))
    if back:
        row["way_back"] = _end_of_way_back(back, len(legs) - turn).value
    driven = sum(leg.row["distance_m"] for leg in there)
    row["spl"] = success_weighted_path_length(has_arrived, mission.shortest_path, driven)
    return Delivery(row, _events(done), _timing(done), None, None, _leg_rows(done)), done


def _drive_legs(
    task: EpisodeTask,
    make_brain: MakeBrain,
    numbers: Iterable[int],
    carried: Carried,
    before: float,
) -> tuple[list[DrivenLeg], Carried]:
    """Drive legs until one fails, and what is carried on; ``before``: [s] of the mission so far."""
    done: list[DrivenLeg] = []
    rules = rules_of(task.rules)
    for number in numbers:
        own = dataclasses.replace(task, leg=number)
        leg = legs_of(task)[number]
        wait = signal_wait(leg.signals, rules, own.generators()["signals"])
        begin = carried.seconds + wait
        legacy = carried.legacy and dataclasses.replace(carried.legacy, age=wait)
        carried = dataclasses.replace(carried, seconds=begin, legacy=legacy)
        driven, carried = _drive_leg(own, make_brain, carried, before + begin)
        done.append(driven)
        if not driven.has_arrived:
            break
    return done, carried


class GoalSender:
    """Sends a goal that the robot has given up again, as the software that sends robots out does.

    On one map nobody does, as in the published study.
    """

    def __init__(self, after: float) -> None:
        """Send it ``after`` so long [s]."""
        self._after = after
        self._since: float | None = None  # [s] when it was given up; None: it is not

    def look(self, brain: Brain, now: float) -> None:
        """Look at the robot after a tick, at ``now`` [s]."""
        if brain.status is not Status.FAILED:
            self._since = None
            return
        if self._since is None:
            self._since = now
        if now - self._since >= self._after:
            brain.send_again()
            self._since = None


def _drive_leg(
    task: EpisodeTask, make_brain: MakeBrain, carried: Carried, begin: float
) -> tuple[DrivenLeg, Carried]:
    """Drive one leg, with a world and a brain of its own."""
    _free_memory()
    running = RunningDelivery(task, make_brain, carried=carried)
    sender = GoalSender(rules_of(task.rules).resend_after)
    while running.verdict is None:
        running.drive_tick()
        sender.look(running.brain, running.truth.stamp)
    driven = _driven(running, begin)
    after = Carried(
        driven.pose,
        running.brain.belief or Belief(driven.pose),
        carried.seconds + driven.row["duration_s"],
        carried.impulse + driven.row["collision_impulse_ns"],
        running.world.legacy,
    )
    return driven, after


def _end_of_way_back(back: Sequence[DrivenLeg], legs: int) -> Outcome:
    """How it ended; a robot without cargo arrives."""
    if len(back) == legs and back[-1].has_arrived:
        return Outcome.ARRIVED
    return Outcome(back[-1].row["outcome"])


def signal_wait(signals: int, rules: Rules, rng: np.random.Generator) -> float:
    """Time [s] that a robot waits at signals, each met at any moment of its cycle."""
    moments = rng.uniform(0.0, rules.signal_cycle, signals)
    red = max(rules.signal_cycle - rules.signal_green, 0.0)
    return float(np.maximum(red - moments, 0.0).sum())


def _driven(running: RunningDelivery, begin: float) -> DrivenLeg:
    delivery, series = running.finish(), running.log.series()
    taken = running.brain.latencies
    latencies = Latencies(list(taken.planner), list(taken.controller))
    x, y, yaw = (float(series[name][-1]) for name in ("x", "y", "yaw"))
    return DrivenLeg(delivery, series, latencies, begin, Pose2D(x, y, yaw))


def _joined(done: Sequence[DrivenLeg], there: Sequence[DrivenLeg], mission: Mission) -> Row:
    """The row of a mission: sums, and statistics over all of its legs' ticks.

    How it ended, and what became of the cargo, is of the legs there.
    """
    first, last = done[0].row, there[-1].row
    goal, end = mission.goal, there[-1].pose
    series = {
        name: np.concatenate([_shifted(leg, name) for leg in done]) for name in done[0].series
    }
    row = dict(last)
    duration = done[-1].begin + done[-1].row["duration_s"]
    for metric in EPISODE_METRICS:
        found = [(leg.row[metric.key], leg.row["duration_s"]) for leg in done]
        known = [(value, seconds) for value, seconds in found if value is not None]
        if metric.is_of_series:
            row[metric.key] = metric.measured(series)
        elif known:
            driven = sum(seconds for _, seconds in found)
            row[metric.key] = _of_legs(metric.key, known, duration, driven)
    return row | {
        **{key: first[key] for key in ("start_x_m", "start_y_m", "start_yaw_rad")},
        "goal_x_m": goal.x,
        "goal_y_m": goal.y,
        "shortest_path_m": mission.shortest_path,
        "goal_distance_m": math.hypot(end.x - goal.x, end.y - goal.y),
        "duration_s": duration,
        "average_speed_mps": row["distance_m"] / duration if duration else 0.0,
        "collision_delta_v_mps": _mean_delta_v([leg.row for leg in done]),
        "pieces_at_start": first["pieces_at_start"],
        "pieces_lost": _pieces_lost(there),
    }


def _pieces_lost(legs: Sequence[DrivenLeg]) -> int | None:
    """Pieces lost before the last leg and on it; None: no cargo is modelled."""
    first, last = legs[0].row, legs[-1].row
    if last["pieces_lost"] is None:
        return None
    return int(first["pieces_at_start"] - last["pieces_at_start"] + last["pieces_lost"])


def _of_legs(
    key: str, known: Sequence[tuple[float, float]], duration: float, driven: float
) -> float:
    """A metric of a mission from its values in legs and their times [s].

    It lasted ``duration`` [s], legs without a value and waits included; the legs ``driven`` [s].
    """
    values, seconds = zip(*known, strict=True)
    if key in SMALLEST:
        return float(min(values))
    if key in BY_DURATION and duration > 0.0:
        return float(np.dot(values, seconds) / duration)
    if key in BY_TIME_DRIVEN and driven > 0.0:
        return float(np.dot(values, seconds) / driven)
    total: float = sum(values)
    return total


def _shifted(leg: DrivenLeg, name: str) -> FloatArray:
    values = leg.series[name]
    if name == "stamp":
        return values + leg.begin
    return values


def _mean_delta_v(rows: Sequence[Row]) -> float:
    """Over all counted contacts with people [m/s]; 0 without any."""
    contacts = sum(row["pedestrian_contacts"] for row in rows)
    total = sum(row["pedestrian_contacts"] * row["collision_delta_v_mps"] for row in rows)
    return float(total / max(contacts, 1))


def _arrival(row: Row, rules: Rules) -> Row:
    """The outcome at the goal, by what was lost on all legs."""
    if row["pieces_at_start"] is None:
        return {}
    lost = min(row["pieces_lost"], row["pieces_at_start"])
    verdict = rules.arrival(CargoState(row["pieces_at_start"], lost))
    return {"pieces_lost": lost, "outcome": verdict.outcome.value, "reason": verdict.reason}


def _leg_rows(done: Sequence[DrivenLeg]) -> list[Row]:
    """Each leg's row, as of a delivery of its own; waits at signals are in none."""
    rows = []
    for number, leg in enumerate(done):
        end = {"end_x_m": leg.pose.x, "end_y_m": leg.pose.y}
        rows.append(leg.row | {"leg": number, "begin_s": leg.begin} | end)
    return rows


def _events(done: Sequence[DrivenLeg]) -> list[Row]:
    return [
        {**event, "stamp_s": event["stamp_s"] + leg.begin}
        for leg in done
        for event in leg.delivery.events
    ]


def _timing(done: Sequence[DrivenLeg]) -> Row:
    timings = [leg.delivery.timing for leg in done]
    sums = {key: sum(each[key] for each in timings) for key in ("setup_s", "wall_s", "cpu_s")}
    latencies = Latencies(
        [each for leg in done for each in leg.latencies.planner],
        [each for leg in done for each in leg.latencies.controller],
    )
    driven = sum(leg.row["duration_s"] for leg in done)
    factor = driven / sums["wall_s"]
    return timings[0] | sums | {"real_time_factor": factor} | latency_columns(latencies)
