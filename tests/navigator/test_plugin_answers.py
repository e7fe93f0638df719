"""What algorithms of other packages answer is checked where it is taken."""

import math

import numpy as np
import pytest

from navstack.behavior_tree import PLANNER_RECOVERY_HELPS
from navstack.errors import NoPathFoundError, PluginError
from navstack.plugin_answers import checked_belief, checked_command, checked_costs, checked_plan
from navstack.types import Belief, Path, Pose2D, Twist2D


class Mine:
    """What the answer is from."""


def checked_three_costs(answer: object, source: object) -> object:
    return checked_costs(answer, 3, source)


@pytest.mark.parametrize(
    ("check", "answer"),
    [
        (checked_command, Twist2D(0.5, 0.0, np.float32(0.1))),
        (checked_three_costs, [0.0, math.inf, 2]),
        (checked_belief, Belief(Pose2D())),
        (checked_plan, Path(np.zeros((1, 3)))),
    ],
)
def test_an_answer_is_passed_on(check, answer):
    assert np.array_equal(check(answer, Mine()), answer)


def test_a_path_without_poses_is_no_path_which_recoveries_answer():
    with pytest.raises(NoPathFoundError, match="^Mine answered a path without poses$") as told:
        checked_plan(Path(np.zeros((0, 3))), Mine())
    assert told.value.code in PLANNER_RECOVERY_HELPS


@pytest.mark.parametrize(
    ("check", "answers"),
    [
        (checked_command, (None, (1.0, 0.0), Twist2D(math.nan), Twist2D(0.0, 0.0, math.inf))),
        (checked_three_costs, (None, 0.0, [0.0], [[0.0]] * 3, [0.0, math.nan, 0.0], [0, -1, 0])),
        (checked_belief, (None, Pose2D(), Belief(Pose2D(math.nan)))),
        (
            checked_belief,
            (Belief(Pose2D(), np.zeros((2, 2))), Belief(Pose2D(), np.diag([np.inf, 1.0, 1.0]))),
        ),
        (checked_plan, (None, [], Path(np.zeros((4, 2))), Path(np.full((4, 3), np.nan)))),
    ],
)
def test_what_is_no_answer_is_refused_with_who_gave_it(check, answers):
    for answer in answers:
        with pytest.raises(PluginError, match="^Mine answered .*; it has to answer ") as refused:
            check(answer, Mine())
        assert "\n" not in str(refused.value)
