"""A mission as the tuner asks for it: one delivery among nobody, and what meetings cost it."""

import dataclasses

from harness.economics.valuation import MEETINGS_LOSS
from harness.episode.episode import Delivery
from harness.meetings.mission import MissionTask, drive_mission
from harness.meetings.strata import NUMBER, PRIOR, PRIOR_SUM
from harness.task.stack import Stack
from harness.task.study import EpisodeTask


def deliver(task: EpisodeTask, original: Stack) -> Delivery:
    """Drive a mission among nobody and its meetings, the same for every stack.

    Args:
        task: the delivery.
        original: along whose planned way people are met.

    Returns:
        The delivery among nobody, whose row has what meetings cost it [USD] on average.

    Raises:
        NavstackError: it cannot be set up.
        CopyError: a meeting failed.
    """
    planned_by = dataclasses.replace(task, stack=original)
    mission = drive_mission(
        MissionTask((task,), tuple(PRIOR.tolist()), PRIOR_SUM / NUMBER, planned_by)
    )
    (arm,) = mission.arms
    where = {"stack": task.stack.name, "episode": task.episode}
    return Delivery(
        row={**arm.row, MEETINGS_LOSS: arm.margin - arm.expected_margin},
        events=[],
        timing=where,
        recording=None,
        decisions=None,
    )
