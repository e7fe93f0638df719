"""What --record full keeps beside the trajectory, in a real delivery."""

import math

import numpy as np
import pytest

from harness.episode.episode import run_episode
from harness.metrics.replay_log import NO_RETURN, millimetres
from harness.task.study import make_study

START, GOAL = (-67.875, -71.875, 0.0), (-67.875, -66.0, 0.0)


@pytest.fixture(scope="module")
def deliveries():
    """The same short delivery, recorded and not."""
    studies = {
        record: make_study(
            stacks=["evasive-gps-ekf"],
            episodes=1,
            start=START,
            goal=GOAL,
            pedestrians=4,
            workers=1,
            record=record,
        )
        for record in ("events", "full")
    }
    return {record: run_episode(next(iter(study.tasks()))) for record, study in studies.items()}


def test_rows_do_not_depend_on_what_is_recorded(deliveries):
    assert deliveries["full"].row == deliveries["events"].row
    assert deliveries["full"].events == deliveries["events"].events
    assert deliveries["events"].recording is None


def test_every_row_of_the_trace_has_what_was_seen(deliveries):
    delivery = deliveries["full"]
    arrays = delivery.recording
    assert arrays is not None
    rows = len(arrays["trace"])
    assert (arrays["trace"][0, 0], arrays["trace"][-1, 0]) == (0.0, delivery.row["duration_s"])
    assert rows == pytest.approx(delivery.row["duration_s"] * 10, abs=2)
    for name in ("pieces_lost", "motion_energy_j", "odometry", "belief_covariance", "track_count"):
        assert len(arrays[name]) == rows
    assert arrays["pieces_lost"][-1] <= delivery.row["pieces_at_start"]
    assert arrays["motion_energy_j"][-1] == pytest.approx(
        delivery.row["motion_energy_kwh"] * 3.6e6, rel=0.05
    )
    assert (np.diff(arrays["motion_energy_j"]) >= 0.0).all()
    assert arrays["track_count"].sum() == len(arrays["tracks"])
    driven = np.hypot(*np.diff(arrays["odometry"][:, :2], axis=0).T).sum()
    assert driven == pytest.approx(delivery.row["distance_m"], rel=0.1)


def test_belief_and_truth_of_a_row_are_of_one_moment(deliveries):
    delivery = deliveries["full"]
    assert delivery.recording is not None
    trace = delivery.recording["trace"]
    off = np.hypot(*(trace[:, 6:8] - trace[:, 1:3]).T)
    assert 0.0 < off.mean() < 1.3 * delivery.row["localization_error_mean_m"]


def test_scans_and_plans_are_those_of_the_delivery(deliveries):
    arrays = deliveries["full"].recording
    assert arrays is not None
    assert (np.diff(arrays["scan_stamp"]) > 0.0).all()
    assert arrays["scan_mm"].shape == (len(arrays["scan_stamp"]), 360)
    returned = arrays["scan_mm"][arrays["scan_mm"] != NO_RETURN] / 1000.0
    assert len(returned) and returned.max() <= arrays["scan_geometry"][3] + 0.5
    assert arrays["plan_size"].sum() == len(arrays["plan_xy"]) > 0
    assert len(arrays["plan_stamp"]) >= deliveries["full"].row["plans"]
    last = (
        arrays["plan_xy"][-1] if arrays["plan_size"][-1] else arrays["plan_xy"].reshape(-1, 2)[-1]
    )
    assert math.hypot(last[0] + 67.875, last[1] + 66.0) < 0.5


def test_options_are_the_motions_weighed_the_chosen_one_first(deliveries):
    arrays = deliveries["full"].recording
    assert arrays is not None
    counts, totals = arrays["option_count"], arrays["option_total"]
    assert len(counts) == len(arrays["trace"]) and counts[-1] >= 2
    assert counts.sum() == len(totals) == len(arrays["option_size"])
    ways = np.split(arrays["option_xy"], np.cumsum(arrays["option_size"])[:-1])
    first = np.cumsum(counts) - counts
    for row in np.flatnonzero(counts):
        chosen, others = totals[first[row]], totals[first[row] + 1 : first[row] + counts[row]]
        assert (np.diff(others) >= 0.0).all() and (others >= chosen - 0.1 - 0.5 * abs(chosen)).all()
        begins = np.array([way[0] for way in ways[first[row] : first[row] + counts[row]]])
        np.testing.assert_allclose(
            begins, arrays["trace"][row, 6:8] * np.ones((counts[row], 1)), atol=0.3
        )


def test_ranges_become_millimetres():
    given = np.array([0.0, 1.2344, math.inf, math.nan, 65.534, 65.535, 80.0])
    assert millimetres(given).tolist() == [
        0,
        1234,
        NO_RETURN,
        NO_RETURN,
        65534,
        NO_RETURN,
        NO_RETURN,
    ]
