"""The files that Nav2 itself ships, of every living branch, drive as they are."""

import math
import os
from pathlib import Path

import pytest

from navstack.build import build_navigator
from navstack.navigation_status import Status
from navstack.params.nav2_file.file import load_nav2
from navstack.types import Pose2D

DATA = Path(os.environ.get("NAVSTACK_DATA", ""), "nav2_defaults")


@pytest.mark.skipif(not (DATA / "main.yaml").exists(), reason="NAVSTACK_DATA has no nav2_defaults")
@pytest.mark.parametrize("release", ["humble", "jazzy", "kilted", "lyrical", "main"])
def test_nav2s_own_file_drives(room, make, drive, release: str) -> None:
    grid = room(8.0, 5.0)
    _, localizer = make(grid)
    navigator = build_navigator(load_nav2(DATA / f"{release}.yaml"), localizer, grid, None)
    goal = Pose2D(5.0, 3.0, 0.0)
    driven = drive(navigator, localizer, Pose2D(2.5, 2.0, 0.3), goal, 40.0)
    assert navigator.status is Status.SUCCEEDED
    assert math.hypot(driven.pose.x - goal.x, driven.pose.y - goal.y) <= 0.3
    assert navigator.counts.recoveries == 0
