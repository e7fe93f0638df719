"""The round robin: who is next after a success, after a failure, and when all have failed."""

import pytest

from navstack.behaviors.behavior_server import BehaviorServer
from navstack.errors import BehaviorError
from navstack.recovery import BACK_UP, SPIN, WAIT, RoundRobin, default_recoveries
from navstack.types import Pose2D, RobotState, Twist2D

STATE = RobotState(Pose2D(), Twist2D())
TURN = Twist2D(angular_z=1.0)


class Act:
    """Does what its script says.

    "now" succeeds at once, "later" after one cycle, "no" cannot begin, "fails" later.
    """

    def __init__(self, name: str, script: str, log: list[str]) -> None:
        self.name = name
        self.script = script
        self._log = log

    def begin(self, state: RobotState) -> bool:
        self._log.append(self.name)
        self._cycles = 0
        if self.script == "no":
            raise BehaviorError("UNAVAILABLE", 0, self.name)
        return self.script == "now"

    def step(self, state: RobotState) -> Twist2D | None:
        self._cycles += 1
        if self._cycles == 1:
            return TURN
        if self.script == "fails":
            raise BehaviorError("COLLISION_AHEAD", 703, self.name)
        return None


def make(*scripts: str) -> tuple[RoundRobin, list[str], list[Act]]:
    log: list[str] = []
    actions = [Act("abcd"[i], script, log) for i, script in enumerate(scripts)]
    return RoundRobin(actions), log, actions


def call(robin: RoundRobin) -> list[Twist2D]:
    """One call for help; the commands until it succeeds."""
    commands: list[Twist2D] = []
    if robin.begin(STATE):
        return commands
    while (command := robin.step(STATE)) is not None:
        commands.append(command)
    return commands


def test_each_call_goes_on_with_the_next_action() -> None:
    robin, log, _ = make("now", "later", "later", "now")
    for _ in range(6):
        call(robin)
    assert "".join(log) == "abcdab"
    assert robin.begun == [2, 2, 1, 1]
    assert robin.failed == 0


@pytest.mark.parametrize("failure", ["no", "fails"])
def test_a_failed_action_hands_over_in_the_same_call(failure: str) -> None:
    robin, log, _ = make("now", failure, "later", "now")
    call(robin)
    commands = call(robin)
    assert "".join(log) == "abc"
    # a behavior that fails on the way has driven before; between two actions the robot stands
    assert commands == ([TURN] if failure == "no" else [TURN, Twist2D(), TURN])
    call(robin)
    call(robin)
    assert "".join(log) == "abcda"  # the next call never goes back to the one that failed
    assert robin.failed == 1


def test_when_all_have_failed_in_a_row_the_call_fails_and_the_first_is_next() -> None:
    robin, log, actions = make("later", "fails", "no", "no")
    call(robin)
    actions[0].script = "fails"
    with pytest.raises(BehaviorError) as caught:
        call(robin)
    assert "".join(log) == "abcda"  # the second call began with b and came round to a
    assert str(caught.value) == "a"
    assert robin.last_failure is caught.value
    actions[0].script = "now"
    call(robin)
    assert log[-1] == "a"


def test_failures_count_in_a_row_only() -> None:
    robin, log, _ = make("no", "later", "no", "later")
    for _ in range(6):
        call(robin)
    assert "".join(log) == "ab" + "cd" + "ab" + "cd" + "ab" + "cd"


def test_a_new_goal_begins_with_the_first_action() -> None:
    robin, log, _ = make("now", "no", "now", "now")
    call(robin)
    call(robin)
    robin.reset()
    assert robin.begun == [0, 0, 0, 0]
    assert robin.failed == 0
    assert robin.last_failure is None
    call(robin)
    assert "".join(log) == "abca"


def test_the_default_tree_asks_for_what_its_xml_says() -> None:
    assert SPIN.target_yaw == 1.57
    assert SPIN.time_allowance == 10.0
    assert WAIT.duration == 5.0
    assert BACK_UP.target_x == 0.30
    assert BACK_UP.speed == 0.15
    assert BACK_UP.time_allowance == 10.0


def test_clearing_clears_both_costmaps_at_once() -> None:
    class Costmap:
        cleared = 0

        def clear_entirely(self) -> None:
            self.cleared += 1

    local = Costmap()
    global_ = Costmap()
    robin = default_recoveries(BehaviorServer({}, None), global_, local)
    assert robin.begin(STATE)
    assert local.cleared == 1
    assert global_.cleared == 1
    assert robin.begin(STATE)  # spin, wait and backup do not exist: the next clearing's turn
    assert robin.begun == [2, 1, 1, 1]
    assert robin.failed == 3
