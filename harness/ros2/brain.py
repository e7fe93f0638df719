"""A delivery's driver that is elsewhere: nodes of another program, over ROS 2."""

import math
import time
from collections.abc import Callable
from functools import cache

from harness.ros2.robot import RobotNode
from harness.task.brain import Brain
from harness.task.ros2_params import Ros2Params
from navstack.errors import NavstackError
from navstack.navigation_status import Status, Trouble
from navstack.stopwatch import Latencies, Stopwatch
from navstack.types import Belief, FloatArray, Generators, Observation, Pose2D, Twist2D

BEFORE = 1.0  # [s] of the clock before the first delivery: 0 means that there is no clock
DISCOVERY = 1.0  # [s] of wall time for the rest of a peer to be found once a part of it is
SETTLE_RATE = 10.0  # [Hz] of the clock while the robot stands before its goal
TOLERANCE = 1e-6  # [s] by which a command's time may be missed by rounding
FROM_COMMAND = 50  # from which on the share of missed waits counts

# the robot's true pose, and people's true positions (n, 4)
WhatIs = Callable[[], tuple[Pose2D, FloatArray]]


class PeerError(NavstackError):
    """Whoever drives sent no command."""


class Ros2Brain(Brain):
    """Publishes what the sensors deliver, and drives by the commands that come."""

    def __init__(
        self,
        make_robot: Callable[[], RobotNode],
        params: Ros2Params,
        what_is: WhatIs,
    ) -> None:
        """Wait for nobody yet.

        Args:
            make_robot: makes the node, once the first delivery begins.
            params: limits.
            what_is: for frames and markers that show the truth.
        """
        self._make_robot = cache(make_robot)
        self._params, self._what_is = params, what_is
        self._waits = self._missed = self._refused_before = 0
        self._period = 1.0 / (
            params.controller_frequency or SETTLE_RATE
        )  # [s] between two commands
        self._watch = Stopwatch()
        self._offset, self._stamp = BEFORE, 0.0
        self._next = 0.0  # [s] of the clock at which the next command is due
        self._paced_at = self._paced = 0.0  # [s] of wall time and clock when it was paced last
        self._started = False

    @property
    def _robot(self) -> RobotNode:
        return self._make_robot()

    @property
    def belief(self) -> Belief | None:
        """What the peer believes is not asked."""
        return None

    @property
    def status(self) -> Status:
        """Failed once the peer has given up."""
        return Status.FAILED if self._robot.is_aborted else Status.RUNNING

    @property
    def trouble(self) -> Trouble:
        """How many commands were missed or refused, if any."""
        robot = self._robot
        refused = robot.refused - self._refused_before
        if not self._missed and not refused:
            return Trouble()
        return Trouble(
            history=f"{self._missed} of {self._waits} commands did not come in time, "
            f"{refused} were none that a robot can follow"
        )

    @property
    def latencies(self) -> Latencies:
        """How long commands took to come, in wall time."""
        return Latencies(controller=self._watch.durations)

    def reset(self, goal: Pose2D, initial_belief: Belief, generators: Generators) -> None:
        """Put the robot at the start; the goal is sent at the first tick."""
        # in whole tenths, so that the clock's nanoseconds are those of the delivery's time
        self._offset = math.ceil(SETTLE_RATE * (self._offset + self._stamp) + 1.0) / SETTLE_RATE
        self._stamp, self._heard_at = 0.0, 0.0
        self._waits = self._missed = 0
        self._is_late = self._started = False
        self._refused_before = self._robot.refused
        self._goal, self._start = goal, initial_belief.pose
        self._watch.clear()

    def tick(self, observation: Observation) -> Twist2D:
        """The command until the next tick.

        Raises:
            PeerError: no command came, or too few of them.
        """
        self._stamp = observation.stamp
        robot, heard = self._robot, self._robot.heard
        if not self._started:
            self._settle(observation)
            self._started = True
            self._paced_at, self._paced = time.monotonic(), self._offset + observation.stamp
        else:
            clock = self._offset + observation.stamp
            self._publish(observation)
            # a peer's timers have a phase of their own, which its commands' stamps tell
            is_each = self._params.controller_frequency == 0.0
            if is_each or clock >= self._next - TOLERANCE:
                self._next = clock + self._period
                self._wait()
            else:
                robot.take_in()
        if robot.heard != heard:
            self._heard_at = observation.stamp
            self._next = robot.commanded_at + self._period
        elif observation.stamp - self._heard_at >= self._params.command_timeout - TOLERANCE:
            return Twist2D()
        return robot.command

    def _wait(self) -> None:
        """Wait for the command of a period: in lockstep for itself, else for its wall time."""
        params, period = self._params, self._period
        timeout = params.wait
        if params.rate > 0.0:
            timeout = min(period / params.rate, params.wait)  # the clock does not wait for it
        elif self._is_late:
            timeout = min(period, params.wait)  # real time, until commands come again
        with self._watch:
            came = self._robot.wait_for_command(timeout)
        self._waits += 1
        self._missed += not came
        self._is_late = not came
        if self._waits >= FROM_COMMAND and self._missed > params.most_missed * self._waits:
            raise PeerError(
                f"{self._missed} of {self._waits} commands did not come within {timeout:g} s; "
                "is the navigation still running?"
            )
        if params.rate > 0.0:
            clock = self._offset + self._stamp
            due = self._paced_at + (clock - self._paced) / params.rate
            time.sleep(max(0.0, due - time.monotonic()))
            self._paced_at, self._paced = time.monotonic(), clock

    def _settle(self, first: Observation) -> None:
        """Let the peer see where it is, send it the goal, and wait until it drives.

        The world stands still: nobody walks, and the delivery's time does not run. The clock
        stands, too, while the first command is waited for, and goes on where none comes.
        """
        params, robot = self._params, self._robot
        deadline = time.monotonic() + params.start_limit
        listened = -math.inf
        while not robot.listeners:
            self._require_before(deadline, "nobody listens to /goal_pose")
            self._stand(first)
            listened = time.monotonic()
        while time.monotonic() < listened + DISCOVERY:
            self._stand(first)
        robot.begin(self._start, self._offset)
        for _ in range(round(params.settle * SETTLE_RATE)):
            self._stand(first)
        quiet = time.monotonic() + DISCOVERY
        while time.monotonic() < quiet and robot.wait_for_command(1.0 / SETTLE_RATE):
            pass  # what answered earlier times of the clock; by wall time some never fall silent
        listeners = robot.listeners
        robot.send_goal(self._goal, self._offset)
        self._publish(first)
        timeout, looked = params.wait, time.monotonic()
        while not robot.wait_for_command(timeout):
            self._require_before(deadline, "no command came on /cmd_vel")
            timeout = 1.0 / SETTLE_RATE
            self._advance()
            if time.monotonic() > looked + DISCOVERY:
                looked = time.monotonic()
                if robot.misses_commands:
                    robot.listen_anew()
            before, listeners = listeners, robot.listeners
            if listeners > before:  # e.g. a peer that was started again
                robot.send_goal(self._goal, self._offset)
            self._publish(first)

    def _stand(self, first: Observation) -> None:
        """Let a tenth of a second of the clock pass without a change in the world."""
        self._publish(first)
        self._robot.wait_for_command(1.0 / SETTLE_RATE)
        self._advance()

    def _advance(self) -> None:
        """Set the clock on by a period in which the world stands still."""
        self._offset = round(SETTLE_RATE * self._offset + 1.0) / SETTLE_RATE

    def _require_before(self, deadline: float, what: str) -> None:
        if time.monotonic() > deadline:
            raise PeerError(
                f"{what} within {self._params.start_limit:g} s; is the navigation running, with "
                "use_sim_time and in this ROS_DOMAIN_ID?"
            )

    def _publish(self, observation: Observation) -> None:
        truth, people = self._what_is()
        self._robot.publish(observation, truth, people, self._offset)
