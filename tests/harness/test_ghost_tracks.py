"""Tracks without a person, counted against made-up people."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from harness.metrics.ghost_tracks import GhostTracks, in_true_frame
from navstack.types import Belief, Pose2D

HERE = Pose2D()


def look(ghosts, stamp, tracks, people, true=HERE, believed=HERE):
    truth = SimpleNamespace(stamp=stamp, pose=true, pedestrians=np.array(people).reshape(-1, 2))
    places = [SimpleNamespace(x=x, y=y) for x, y in tracks]
    ghosts.record(truth, SimpleNamespace(tracks=places, belief=Belief(believed)))


def test_tracks_count_that_have_no_person_within_80_cm():
    ghosts = GhostTracks()
    look(ghosts, 0.0, [(1.0, 0.0), (5.0, 0.0)], [(1.7, 0.0), (math.inf, math.inf)])
    look(ghosts, 0.2, [(9.0, 0.0)] * 5, [])  # between two looks
    look(ghosts, 0.5, [(1.0, 0.0), (5.0, 0.0), (8.0, 1.0)], [])
    look(ghosts, 1.0, [], [(1.0, 0.0)])
    assert ghosts.mean == pytest.approx(4 / 3)


def test_an_error_of_the_own_place_makes_no_ghosts():
    ghosts = GhostTracks()
    true, believed = Pose2D(3.0, 4.0, 0.5), Pose2D(4.5, 3.0, 0.8)
    # (4.5, 2) from the believed place, turned back by 0.3 rad, from the true one
    person = np.array([(7.890, 4.581)])
    found = in_true_frame(np.array([(9.0, 5.0)]), believed.as_array(), true.as_array())
    assert found == pytest.approx(person, abs=1e-3)
    look(ghosts, 0.0, [(9.0, 5.0)], person, true, believed)
    assert ghosts.mean == 0.0


def test_who_tracks_nothing_has_no_ghosts_and_no_number():
    ghosts = GhostTracks()
    look(ghosts, 0.0, [], [(1.0, 0.0)])
    assert ghosts.mean is None
