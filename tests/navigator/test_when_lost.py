"""What the navigator does with a belief that says it is lost."""

import dataclasses
import math
from pathlib import Path
from types import SimpleNamespace

import pytest

from harness.episode.brains import navigator_on
from harness.storage.shipped import shipped
from harness.task.stack import load_stack
from harness.world.map.scene import Scene
from navstack.build import build_navigator
from navstack.errors import UnknownNameError
from navstack.localization.gps import LOST_AFTER
from navstack.localization.localizer import Localizer
from navstack.navigation_status import Status
from navstack.navigator import LOST_PATIENCE
from navstack.params.nav2_file.file import load_nav2
from navstack.types import Belief, Health, Observation, Pose2D

START = Pose2D(2.0, 4.0, 0.0)
GOAL = Pose2D(13.0, 4.0, 0.0)
TICK = 1.0 / 60.0  # [s] of the drives
STOPPED = 1.0  # [s] within which the smoother brings the robot to rest
ALLOWED = 10.0  # [s] without progress that the tuned file allows


class LosesItself(Localizer):
    """Believes what the test tells it, and is lost between two times."""

    pose = Pose2D()

    def __init__(self, begin: float, end: float) -> None:
        self._begin = begin
        self._end = end

    def reset(self, belief, rng):
        self.pose = belief.pose

    def update(self, observation):
        lost = self._begin <= observation.stamp < self._end
        return Belief(
            self.pose, health=Health.LOST if lost else Health.TRACKING, stamp=observation.stamp
        )


@pytest.fixture
def lost_drive(room, drive):
    """Drives through a room with a localizer that is lost from ``begin`` to ``end``.

    Stops when it is, or not.
    """

    def _lost_drive(begin, end, stops, seconds):
        localizer = LosesItself(begin, end)
        navigator = build_navigator(
            load_nav2(shipped("params") / "nav2" / "tuned.yaml"), localizer, room(), None, stops
        )
        return navigator, drive(navigator, localizer, START, GOAL, seconds)

    return _lost_drive


def speeds(driven, begin, end):
    """Of the commands between two times."""
    commands = driven.commands[round(begin / TICK) : round(end / TICK)]
    return [max(abs(command.linear_x), abs(command.angular_z)) for command in commands]


def test_a_robot_that_stops_when_lost_stands_and_goes_on(lost_drive):
    # longer than the progress checker would put up with
    begin = 3.0
    end = 3.0 + ALLOWED + 5.0
    navigator, driven = lost_drive(begin, end, True, 40.0)
    assert max(speeds(driven, 1.0, begin)) > 0.3
    assert max(speeds(driven, begin + STOPPED, end)) == 0.0
    assert max(speeds(driven, end, end + 2.0)) > 0.3
    assert math.hypot(driven.pose.x - GOAL.x, driven.pose.y - GOAL.y) < 2.0
    assert navigator.counts.recoveries == navigator.counts.failed_controls == 0


def test_one_that_has_found_itself_plans_at_once(lost_drive):
    found, _ = lost_drive(3.25, 3.5, True, 3.8)
    certain, _ = lost_drive(math.inf, math.inf, True, 3.8)
    assert found.counts.plans == certain.counts.plans + 1  # others plan again at 4 s


def test_others_drive_on(lost_drive):
    _, heedless = lost_drive(3.0, 20.0, False, 6.0)
    _, certain = lost_drive(math.inf, math.inf, True, 6.0)
    assert heedless == certain


def test_one_that_stays_lost_gives_up(lost_drive):
    navigator, driven = lost_drive(1.0, math.inf, True, LOST_PATIENCE + 5.0)
    assert navigator.status is Status.FAILED
    assert navigator.trouble.gave_up == f"lost for more than {LOST_PATIENCE:g} s"
    assert driven.seconds == pytest.approx(1.0 + LOST_PATIENCE, abs=0.1)
    assert navigator.counts.recoveries == 0


def test_a_goal_that_is_sent_again_has_all_patience(lost_drive):
    navigator, driven = lost_drive(1.0, math.inf, True, LOST_PATIENCE + 5.0)
    navigator.send_again()
    for later in (1.0, LOST_PATIENCE - 1.0, LOST_PATIENCE + 1.5):
        navigator.tick(Observation(driven.seconds + later))
        gone = navigator.status is Status.FAILED
        assert gone == (later > LOST_PATIENCE + 1.0)


def test_what_the_stack_says_reaches_the_navigator(room, drive):
    # no localizer here asks the world
    scene = Scene("room", (), (), room(), room())
    world = None
    for stops in (False, True):
        stack = dataclasses.replace(load_stack("nav2-gps"), when_lost="stop" if stops else "drive")
        navigator = navigator_on(scene, world, stack, load_nav2(Path(stack.nav2_file)))
        # without any fix
        driven = drive(navigator, SimpleNamespace(), START, GOAL, LOST_AFTER + 3.0)
        assert (max(speeds(driven, LOST_AFTER + STOPPED, LOST_AFTER + 3.0)) == 0.0) == stops


def test_the_stack_says_which(tmp_path):
    assert load_stack("nav2-amcl").when_lost == "drive"
    text = (shipped("params") / "stacks" / "nav2-amcl.yaml").read_text(encoding="utf-8")
    file = tmp_path / "careful.yaml"
    file.write_text(text + "when_lost: stop\n", encoding="utf-8")
    stack = load_stack(str(file))
    assert stack == dataclasses.replace(load_stack("nav2-amcl"), when_lost="stop", name="careful")
    file.write_text(text + "when_lost: stopp\n", encoding="utf-8")
    with pytest.raises(UnknownNameError, match="did you mean 'stop'"):
        load_stack(str(file))
