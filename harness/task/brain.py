"""What drives a delivery: the robot's navigator, a policy, or nobody."""

from typing import Protocol

from navstack.control.decision import Option
from navstack.navigation_status import Counts, Status, Trouble
from navstack.navigator import TickRecord
from navstack.stopwatch import Latencies
from navstack.types import Belief, Generators, Observation, Path, Pose2D, Track, Twist2D


class Brain(Protocol):
    """What drives. The defaults are those of a robot that stands and reports nothing."""

    @property
    def belief(self) -> Belief | None:
        """Where it believes the robot to be; None: it does not localize."""
        return None

    @property
    def status(self) -> Status:
        """How the navigation stands."""
        return Status.RUNNING

    @property
    def counts(self) -> Counts:
        """Plans, failures and recoveries so far."""
        return Counts()

    @property
    def trouble(self) -> Trouble:
        """What went wrong last, and why the navigation was given up if it was."""
        return Trouble()

    @property
    def decision(self) -> TickRecord | None:
        """How the last tick was decided; None: nothing was due in it."""
        return None

    @property
    def plan(self) -> Path | None:
        """What it follows, in the map frame; None: nothing."""
        return None

    @property
    def tracks(self) -> tuple[Track, ...]:
        """What it sees moving about, in the map frame."""
        return ()

    @property
    def options(self) -> tuple[Option, ...]:
        """Motions that its controller weighed last, the chosen one first."""
        return ()

    @property
    def latencies(self) -> Latencies:
        """How long planner and controller took, in wall time."""
        return Latencies()

    def reset(self, goal: Pose2D, initial_belief: Belief, generators: Generators) -> None:
        """Start a delivery; all chance is drawn from the generators."""
        return

    def send_again(self) -> None:
        """Take the goal once more, where it was given up."""
        return

    def tick(self, observation: Observation) -> Twist2D:
        """The command until the next tick."""
        return Twist2D()


class Parked(Brain):
    """Never moves: what other people's walking costs."""
