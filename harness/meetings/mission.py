"""A mission by all arms: what each earns among people, by the same meetings."""

import dataclasses
from dataclasses import dataclass

import numpy as np

from harness.episode.factory import BRAINS_KEPT, Parts
from harness.execution.process_cache import kept
from harness.meetings.crowd import Record, recorded
from harness.meetings.draw import BEFORE, Pool, drawn, pool_of
from harness.meetings.drive import ArmDrive, drive_arm
from harness.meetings.meet import Stage, stage_of
from harness.meetings.way import Way, way_of
from harness.task.study import EpisodeTask
from navstack.types import FloatArray, IntArray

STREAM = "meetings"  # the random generator of crowd and draws
MOST = 60  # meetings of a mission; a crowded one would take minutes


@dataclass(frozen=True, slots=True)
class MissionTask:
    """What is to be driven of a mission."""

    arms: tuple[EpisodeTask, ...]  # of one mission
    spreads: tuple[float, ...]  # [USD] of what a meeting costs, by stratum
    per_meeting: float  # [USD] of passings times spread that each stands for
    planned_by: EpisodeTask | None = None  # along whose way people are met; None: the first arm


@dataclass(frozen=True, slots=True, eq=False)
class MissionDrive:
    """What came of a mission."""

    episode: int
    usual: FloatArray  # meetings a delivery at a usual speed, shape (strata,)
    strata: IntArray  # of the meetings driven, shape (n,)
    stands_for: FloatArray  # meetings a delivery at a usual speed, of each driven, shape (n,)
    arms: tuple[ArmDrive, ...]

    @property
    def margins(self) -> tuple[float, ...]:
        """Of each arm [USD a delivery]."""
        return tuple(arm.expected_margin for arm in self.arms)

    @property
    def squares(self) -> FloatArray:
        """Of what the other arms lose less than the first by each meeting [USD2], shape (n,).

        Their mean over those arms; of one arm alone, of what it loses.
        """
        weighted = [[each.weight * each.loss for each in arm.met] for arm in self.arms]
        losses = np.array(weighted) / self.stands_for
        gains = losses
        if len(losses) > 1:
            gains = losses[0] - losses[1:]
        found: FloatArray = (gains**2).mean(axis=0)
        return found


def drive_mission(task: MissionTask) -> MissionDrive:
    """Plan, draw and drive a mission.

    Raises:
        NavstackError: it cannot be set up.
        CopyError: a meeting failed.
    """
    planned_by = task.planned_by or task.arms[0]
    generator = planned_by.generators()[STREAM]
    way, record, pool = crowd_along(planned_by, generator)
    spreads, usual = np.array(task.spreads), pool.usual_by_stratum
    step = max(task.per_meeting, float(usual @ spreads) / MOST)
    meetings = drawn(pool, spreads, step, generator)
    arms = tuple(drive_arm(arm, kept_stage(arm), way, record, meetings) for arm in task.arms)
    strata: IntArray = np.array([each.stratum for each in meetings], dtype=np.int64)
    return MissionDrive(planned_by.episode, usual, strata, step / spreads[strata], arms)


def crowd_along(
    task: EpisodeTask, rng: np.random.Generator, before: float = BEFORE
) -> tuple[Way, Record, Pool]:
    """The planned way of a mission, a crowd, and everybody of it who can be met there.

    Args:
        task: its delivery.
        rng: of the crowd's chance.
        before: [s] of the record that a meeting needs before its moment.
    """
    parts, way = Parts(task), way_of(task)
    start = parts.mission(task.generators()["mission"]).start
    record = recorded(parts.people(), rng, start)
    return way, record, pool_of(record, way, parts.rules.arrival_radius, before)


_stage_of = kept(BRAINS_KEPT, is_heavy=True)(stage_of)


def kept_stage(task: EpisodeTask) -> Stage:
    """The stage of a task's stack, the same for all its missions."""
    return _stage_of(dataclasses.replace(task, seed=0, episode=0))
