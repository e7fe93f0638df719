"""What a recording keeps for a replay."""

import numpy as np

from harness.metrics.replay_log import plans_of


def test_plans_come_back_piece_by_piece():
    points = np.arange(10.0).reshape(5, 2)
    arrays = {"plan_stamp": np.array([0.1, 1.1]), "plan_size": np.array([2, 3]), "plan_xy": points}
    (first, early), (second, late) = plans_of(arrays)
    assert (first, second) == (0.1, 1.1)
    np.testing.assert_array_equal(np.vstack((early, late)), points)
    assert (len(early), len(late)) == (2, 3)


def test_a_delivery_without_a_plan_has_none():
    arrays = {
        "plan_stamp": np.empty(0),
        "plan_size": np.empty(0, np.int32),
        "plan_xy": np.empty((0, 2)),
    }
    assert plans_of(arrays) == []
