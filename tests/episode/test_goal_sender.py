"""A goal that the robot gives up is sent again, on a district."""

from harness.episode.street_delivery import GoalSender
from harness.task.brain import Brain
from navstack.navigation_status import Status


class GivesUp(Brain):
    """Gives the goal up ``patience`` ticks after it was sent."""

    def __init__(self, patience: int) -> None:
        self._patience = self._left = patience
        self.sent = 0

    @property
    def status(self) -> Status:
        return Status.RUNNING if self._left > 0 else Status.FAILED

    def wait(self) -> None:
        self._left -= 1

    def send_again(self) -> None:
        self.sent += 1
        self._left = self._patience


def sendings(brain: GivesUp, after: float, seconds: int) -> list[int]:
    """When [s] the goal was sent again, looked at once a second."""
    sender, stamps = GoalSender(after), []
    for now in range(seconds):
        brain.wait()
        before = brain.sent
        sender.look(brain, float(now))
        if brain.sent > before:
            stamps.append(now)
    return stamps


def test_it_is_sent_so_long_after_each_time_that_it_was_given_up() -> None:
    assert sendings(GivesUp(5), after=10.0, seconds=50) == [14, 29, 44]


def test_a_robot_that_goes_on_is_left_alone() -> None:
    assert sendings(GivesUp(100), after=10.0, seconds=50) == []


def test_at_once_is_possible() -> None:
    assert sendings(GivesUp(1), after=0.0, seconds=3) == [0, 1, 2]
