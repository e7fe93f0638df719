"""The training missions of a study: how many, and in which order."""

import dataclasses

from harness.episode.factory import Parts
from harness.task.study import EpisodeTask
from harness.tuning.budget import LEAST_STUDY
from harness.tuning.racing import stratified

USUAL_MISSIONS = 32
# what a budget may leave of them; each can be halved into parts that racing takes
FEWER_MISSIONS = (20, 10)
PILOT = 5  # of them tell how long a delivery takes


def training_missions(template: EpisodeTask, count: int) -> tuple[int, ...]:
    """The first ``count`` missions of a study, in an order that mixes short and long ones.

    Args:
        template: any task of the study.
        count: number of missions.
    """
    lengths = {}
    for number in range(count):
        task = dataclasses.replace(template, episode=number)
        mission = Parts(task).mission(task.generators()["mission"])
        lengths[number] = mission.shortest_path
    return stratified(lengths, template.seed)


def missions_within(budget: float, pace: float) -> int:
    """For how many training missions a budget lasts, with a few trials and a test.

    Args:
        budget: [s] of wall time.
        pace: wall time [s] of a delivery.
    """
    for count in (USUAL_MISSIONS, *FEWER_MISSIONS):
        if LEAST_STUDY * count * pace <= budget:
            return count
    return FEWER_MISSIONS[-1]
