"""Every cycle of a navigation can be explained, from who decided to what was driven."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from navstack.behavior_tree import NavigateToPose
from navstack.costmap.occupancy_grid import OCCUPIED
from navstack.navigation_status import Status
from navstack.navigator import Navigator, TickRecord
from navstack.types import Pose2D


def listen(navigator: Navigator) -> list[TickRecord]:
    """Keep what the navigator tells after each tick."""
    told: list[TickRecord] = []
    tick = navigator.tick

    def and_tell(observation):
        command = tick(observation)
        if navigator.decision is not None:
            told.append(navigator.decision)
        return command

    navigator.tick = and_tell
    return told


def test_a_drive_is_told_cycle_by_cycle(room, make, drive) -> None:
    navigator, localizer = make(room())
    told = listen(navigator)
    drive(navigator, localizer, Pose2D(3.0, 4.0, math.pi), Pose2D(13.0, 4.0, 0.0), 8.0)
    # controller_frequency
    assert np.diff([tick.decision.stamp for tick in told]) == pytest.approx(1.0 / 30.0)
    assert {tick.decision.decided_by for tick in told} >= {
        "RotationShimController",
        "DWBLocalPlanner",
    }
    assert all(tick.wanted == tick.decision.command for tick in told)
    assert all(tick.monitor.action == "none" for tick in told)  # nothing is near
    scored = [tick.decision for tick in told if tick.decision.decided_by == "DWBLocalPlanner"]
    assert scored[-1].total == pytest.approx(
        sum(score.weighted for score in scored[-1].scores), rel=1e-5
    )
    steps = np.diff([tick.command.linear_x for tick in told])
    # smoothed
    assert np.abs(steps).max() < np.abs(np.diff([tick.wanted.linear_x for tick in told])).max()
    assert told[-1].belief.pose == localizer.pose


def test_recoveries_and_idle_cycles_are_told_by_name(room, make, drive) -> None:
    grid = room()
    grid.data[:, 150:160] = OCCUPIED
    navigator, localizer = make(grid)
    told = listen(navigator)
    drive(navigator, localizer, Pose2D(2.0, 4.0), Pose2D(13.0, 4.0), 90.0, grid.data == OCCUPIED)
    assert navigator.status is Status.FAILED
    assert {tick.decision.decided_by for tick in told} == {
        "behavior_tree",
        "spin",
        "wait",
        "backup",
    }
    backwards = {tick.decision.decided_by for tick in told if tick.wanted.linear_x < 0.0}
    assert backwards == {"backup"}
    assert len(navigator.latencies.planner) == navigator.counts.failed_plans == 14
    assert len(navigator.latencies.controller) == 0


@pytest.mark.parametrize(
    ("stamp", "now", "is_told"), [(0.0, 0.1, True), (0.0, 0.2, False), (3.0, 3.3, False)]
)
def test_what_a_controller_weighed_is_told_for_a_fifth_of_a_second(stamp, now, is_told):
    server = SimpleNamespace(
        decision=SimpleNamespace(stamp=stamp), controller=SimpleNamespace(options=("an option",))
    )
    tree = SimpleNamespace(_controller_server=server)
    assert NavigateToPose.options(tree, now) == (("an option",) if is_told else ())
    server.decision = None
    assert NavigateToPose.options(tree, now) == ()


def test_a_controller_without_options_is_not_asked_for_its_decision() -> None:
    """Which takes longer than a control cycle."""
    server = SimpleNamespace(controller=SimpleNamespace(options=()))
    assert NavigateToPose.options(SimpleNamespace(_controller_server=server), 0.0) == ()


def test_a_new_goal_forgets_what_was_told(room, make, drive) -> None:
    navigator, localizer = make(room())
    told = listen(navigator)
    drive(navigator, localizer, Pose2D(2.0, 2.0), Pose2D(13.0, 5.0), 3.0)
    first = told.copy()
    told.clear()
    drive(navigator, localizer, Pose2D(2.0, 2.0), Pose2D(13.0, 5.0), 3.0)
    assert [(tick.decision, tick.command) for tick in told] == [
        (tick.decision, tick.command) for tick in first
    ]
    assert 0 < len(navigator.latencies.controller) <= len(told)
