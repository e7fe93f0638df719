"""Where the time of a made-up delivery went."""

import dataclasses

import numpy as np
import pytest

from harness.explain.activities import activities
from harness.world.map.scene import Scene
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.types import Pose2D

from .made_up import evidence

# [s] from when on, and [m/s]: it drives, stands, reverses, creeps on, drives away,
# drives to the goal
PHASES = ((0.0, 2.0), (5.0, 0.0), (10.0, -1.0), (12.0, 0.5), (20.0, 2.0), (24.0, 2.0), (32.0, 0.0))
AWAY = (20.0, 24.0)
LENGTH, WIDTH, CELL = 60.0, 6.0, 0.1  # [m] of the street, and of its cells


@pytest.fixture(scope="module")
def made():
    """Along x, but from 20 s to 24 s it drives forward in the other direction."""
    base = evidence()
    stamps = np.arange(0.0, PHASES[-1][0], 0.1)
    starts, speeds = np.array(PHASES).T
    speed = speeds[np.searchsorted(starts, stamps + 1e-9, side="right") - 1]
    back = (stamps >= AWAY[0] - 1e-9) & (stamps < AWAY[1] - 1e-9)
    trace = np.zeros((len(stamps), 11))
    trace[:, 0], trace[:, 4] = stamps, speed
    trace[1:, 1] = np.cumsum(0.1 * np.where(back, -speed, speed))[:-1]
    trace[:, 6:9] = trace[:, 1:4]
    crowd = np.full((len(stamps), 2, 2), np.inf)
    crowd[:, 0] = (12.0, 3.0)  # stands; the other one is absent
    tracks = [np.zeros((0, 6)) for _ in stamps]
    for k in np.flatnonzero((stamps >= 5.0) & (stamps < 10.0)).tolist():
        tracks[k] = np.array([(1, 12.0, 3.1, 0, 0, 0.3), (2, 4.0, 0.0, 0, 0, 0.3)])
    row = {**base.row, "goal_x_m": 40.0, "goal_y_m": 0.0}
    return dataclasses.replace(base, row=row, trace=trace, crowd=crowd, tracks=tuple(tracks))


def by_name(found):
    return {each.activity: each for each in found}


def test_seconds_and_metres_by_activity(made):
    found = activities(made, None)
    assert [each.time_s for each in found] == sorted((each.time_s for each in found), reverse=True)
    assert sum(each.time_s for each in found) == pytest.approx(made.trace[-1, 0])
    each = by_name(found)
    assert set(each) == {"fast", "slow", "stands", "reverses", "away from the goal"}
    assert each["stands"].time_s == pytest.approx(5.0, abs=0.11)
    assert each["reverses"].progress_m == pytest.approx(-2.0, abs=0.11)
    assert each["slow"].distance_m == pytest.approx(4.0, abs=0.6)
    # where it turns round the way left is compared over a second to each side
    assert each["away from the goal"].progress_m == pytest.approx(-8.0, abs=2.1)


def test_places_people_and_tracks_that_were_nobody(made):
    each = by_name(activities(made, None))["stands"]
    assert each.longest_since_s == pytest.approx(5.0, abs=0.11)
    assert each.longest_x_m == pytest.approx(10.0, abs=0.21)
    assert each.people_near == 1.0
    assert each.ghost_tracks == pytest.approx(1.0)
    assert each.street_width_m is None
    assert by_name(activities(made, None))["fast"].ghost_tracks == 0.0


def test_on_a_map_the_width_is_known_and_ways_are_walked(made):
    """A street along x, in which the way is straight but for the steps of the grid."""
    data = np.full((round((WIDTH + 4.0) / CELL), round(LENGTH / CELL)), 100, dtype=np.int8)
    street = slice(round(2.0 / CELL), round((2.0 + WIDTH) / CELL))
    data[street] = 0
    grid = OccupancyGrid(data, CELL, Pose2D(-5.0, -5.0, 0.0))
    each = by_name(activities(made, Scene("street", (), (), grid, grid)))
    assert each["fast"].street_width_m == pytest.approx(WIDTH, abs=0.9)
    straight = by_name(activities(made, None))
    for name, known in each.items():
        assert known.progress_m == pytest.approx(straight[name].progress_m, rel=0.05, abs=0.5)
