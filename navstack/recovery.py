"""What the default behavior tree tries when planning or following fails, one after the other.

The actions are those of ``navigate_to_pose_w_replanning_and_recovery.xml``; their order and what
follows on a failure are those of nav2_behavior_tree's RoundRobin.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from navstack.behaviors.behavior import BehaviorGoal
from navstack.behaviors.behavior_server import BehaviorServer
from navstack.behaviors.drive import BackUpGoal
from navstack.behaviors.spin import SpinGoal
from navstack.behaviors.wait import WaitGoal
from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.errors import BehaviorError
from navstack.types import RobotState, Twist2D

TIME_ALLOWANCE = 10.0  # [s] of Spin and BackUp, where the tree names none
SPIN = SpinGoal(target_yaw=1.57, time_allowance=TIME_ALLOWANCE)
WAIT = WaitGoal(duration=5.0)
BACK_UP = BackUpGoal(target_x=0.30, speed=0.15, time_allowance=TIME_ALLOWANCE)


class RecoveryAction(NamedTuple):
    """One thing to try.

    What it cannot begin, and how it has failed, are raised as BehaviorError.
    """

    name: str
    begin: Callable[[RobotState], bool]  # whether that was all
    # the command of this behavior cycle; None: it has succeeded
    step: Callable[[RobotState], Twist2D | None]


class RoundRobin:
    """Takes turns among its actions, after nav2_behavior_tree::RoundRobinNode.

    Each call for help goes on with the action after the last one tried, whether that succeeded or
    failed. An action that fails hands over to the next one in the same call; when all have failed
    in a row, the call has failed.
    """

    def __init__(self, actions: Sequence[RecoveryAction]) -> None:
        self._actions = actions
        self.reset()

    def restart(self) -> None:
        """Begin with the first action again, as for another goal; counts go on."""
        self._next = self._current = 0
        self._failures = 0  # in a row
        self.last_failure: BehaviorError | None = None

    def reset(self) -> None:
        """Forget everything."""
        self.restart()
        self.begun = [0] * len(self._actions)  # how often each action was begun
        self.failed = 0  # how many of them failed

    @property
    def current(self) -> str:
        """Name of the action that runs."""
        return self._actions[self._current].name

    def begin(self, state: RobotState) -> bool:
        """Begin the next action that can begin; whether it has succeeded already.

        Raises:
            BehaviorError: all actions failed; the error is the last one's.
        """
        while True:
            self._current = self._next
            self._next = (self._next + 1) % len(self._actions)
            self.begun[self._current] += 1
            try:
                done = self._actions[self._current].begin(state)
            except BehaviorError as error:
                self._note(error)
                continue
            if done:
                self._failures = 0
            return done

    def step(self, state: RobotState) -> Twist2D | None:
        """The command of this behavior cycle; None: an action has succeeded.

        Raises:
            BehaviorError: all actions failed; the error is the last one's.
        """
        try:
            command = self._actions[self._current].step(state)
        except BehaviorError as error:
            self._note(error)
            if self.begin(state):
                return None
            return Twist2D()
        if command is None:
            self._failures = 0
        return command

    def _note(self, error: BehaviorError) -> None:
        """Remember a failure; the one that completes the round is raised."""
        self.failed += 1
        self._failures += 1
        self.last_failure = error
        if self._failures == len(self._actions):
            self._next = self._failures = 0
            raise error


def default_recoveries(
    server: BehaviorServer, global_costmap: LayeredCostmap, local_costmap: LayeredCostmap
) -> RoundRobin:
    """Those of the default tree: clear both costmaps, spin, wait, back up."""

    def clear(_: RobotState) -> bool:
        for costmap in (local_costmap, global_costmap):
            costmap.clear_entirely()  # what is still seen comes back with the next update
        return True

    def run(name: str, goal: BehaviorGoal) -> RecoveryAction:
        def begin(state: RobotState) -> bool:
            server.start(name, goal, state)
            return False

        return RecoveryAction(name, begin, server.step)

    return RoundRobin(
        [
            RecoveryAction("clear_costmaps", clear, lambda _: None),
            run("spin", SPIN),
            run("wait", WAIT),
            run("backup", BACK_UP),
        ]
    )
