"""What drives a delivery where a policy does."""

from harness.policy.interface import PolicyObservation
from harness.policy.process import PolicyProcess
from harness.policy.senses import Senses
from harness.policy.waypoints import WaypointFollower
from harness.task.brain import Brain
from navstack.clock import Clock
from navstack.navigation_status import Counts
from navstack.stopwatch import Latencies, Stopwatch
from navstack.types import Belief, FloatArray, Generators, Observation, Path, Pose2D, Twist2D


class SteeredBrain(Brain):
    """Senses, and holds the command of a policy or of an environment's user."""

    def __init__(self, senses: Senses, rate: float) -> None:
        """Stand.

        Args:
            senses: what is seen.
            rate: [Hz] at which a command is due.
        """
        self._senses, self._clock = senses, Clock(rate)
        self.command = Twist2D()

    @property
    def belief(self) -> Belief | None:
        """Where it believes the robot to be."""
        return self._senses.belief

    @property
    def plan(self) -> Path | None:
        """The route that was planned at the start, in the map frame."""
        return self._senses.plan

    @property
    def counts(self) -> Counts:
        """One plan, at the start."""
        return Counts(plans=1)

    def reset(self, goal: Pose2D, initial_belief: Belief, generators: Generators) -> None:
        """Start a delivery, standing."""
        self._senses.reset(goal, initial_belief, generators)
        self._clock.reset()
        self.command = Twist2D()

    def sense(self, observation: Observation) -> bool:
        """Take in what arrived since the last tick; whether a command is due."""
        self._senses.take_in(observation)
        return self._clock.is_due(observation.stamp)

    def view(self) -> PolicyObservation:
        """What is seen now."""
        return self._senses.view()

    def tick(self, observation: Observation) -> Twist2D:
        """The command that is held."""
        self.sense(observation)
        return self.command


class PolicyBrain(SteeredBrain):
    """A policy's answers, driven as they are, or followed where they are waypoints."""

    def __init__(
        self,
        senses: Senses,
        rate: float,
        policy: PolicyProcess,
        follower: WaypointFollower,
    ) -> None:
        """Ask nothing yet, see :class:`SteeredBrain`.

        Args:
            senses: what the policy sees.
            rate: [Hz] at which it is asked.
            policy: that is asked.
            follower: of its waypoints.
        """
        super().__init__(senses, rate)
        self._policy, self._follower = policy, follower
        self._watch = Stopwatch()
        self._follows = False

    def load(self) -> None:
        """Load the policy, unless it is there.

        Raises:
            PolicyError: it cannot be loaded.
        """
        self._policy.start()

    def let_go(self) -> None:
        """End the policy's process: each process that drives has its own."""
        self._policy.close()

    @property
    def latencies(self) -> Latencies:
        """How long the policy took to answer, in wall time."""
        return Latencies(controller=self._watch.durations)

    def reset(self, goal: Pose2D, initial_belief: Belief, generators: Generators) -> None:
        """Start a delivery.

        Raises:
            PolicyError: the policy fails.
        """
        super().reset(goal, initial_belief, generators)
        self._watch.clear()
        self._follower.clear()
        self._follows = False
        self._policy.reset(int(generators.controller.integers(2**63)))

    def tick(self, observation: Observation) -> Twist2D:
        """The command until the next tick.

        Raises:
            PolicyError: the policy fails.
        """
        if self.sense(observation):
            with self._watch:
                answer = self._policy.act(self.view())
            self._take(answer)
        if self._follows:
            self.command = self._follower.follow(self._senses.odometry.pose)
        return self.command

    def _take(self, answer: FloatArray) -> None:
        self._follows = answer.ndim == 2
        if self._follows:
            self._follower.take(answer, self._senses.odometry.pose)
        else:
            speed, yaw_rate = answer.tolist()
            self.command = Twist2D(speed, 0.0, yaw_rate)
