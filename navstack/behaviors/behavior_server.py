"""Runs behaviors by their names, one at a time: nav2_behaviors::BehaviorServer."""

from collections.abc import Mapping
from typing import Any

from navstack.behaviors.behavior import Behavior, BehaviorGoal
from navstack.costmap.costmap import Costmap
from navstack.errors import BehaviorError
from navstack.types import RobotState, Twist2D


class BehaviorServer:
    """The behaviors of a file by the names of their sections, which name their actions, too."""

    def __init__(self, behaviors: Mapping[str, Behavior[Any]], costmap: Costmap) -> None:
        """Keep the behaviors and the local costmap in which they look ahead."""
        self._behaviors = behaviors
        self._costmap = costmap
        self._running: Behavior[Any] | None = None

    def reset(self) -> None:
        """Stop whatever runs."""
        self._running = None

    def start(self, name: str, goal: BehaviorGoal, state: RobotState) -> None:
        """Start a behavior.

        Raises:
            BehaviorError: there is none of this name for such a goal, or the goal makes no sense.
        """
        self._running = None
        behavior = self._behaviors.get(name)
        if behavior is None or behavior.goal_type is not type(goal):
            known = ", ".join(sorted(self._behaviors)) or "none"
            kind = type(goal).__name__
            message = f"no behavior '{name}' takes a {kind}; behaviors of the file: {known}"
            raise BehaviorError("UNAVAILABLE", 0, message)
        behavior.start(goal, state)
        self._running = behavior

    def step(self, state: RobotState) -> Twist2D | None:
        """One cycle of the running behavior: its velocity, or None when it is done or nothing runs.

        Raises:
            BehaviorError: it failed.
        """
        if self._running is None:
            return None
        try:
            command = self._running.step(state, self._costmap)
        except BehaviorError:
            self._running = None
            raise
        if command is None:
            self._running = None
        return command
