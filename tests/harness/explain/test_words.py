"""The words say what the record shows."""

import dataclasses

import numpy as np
import pytest

from harness.economics.prices import load_prices
from harness.explain.decision_words import deciding_critics, rejected_by, shares_of
from harness.explain.moments import is_costly, moments_of
from harness.explain.seconds import seconds_before
from harness.explain.words import paragraph
from harness.metrics.decisions import CRITIC_COLUMNS
from harness.world.outcome import Rules
from navstack.control.decision import RUNNER_UP, SLOWER, Alternative, CriticScore
from navstack.types import Twist2D

from .made_up import CRITICS, END, HIT, STAMPS, contact, decision, evidence, moment_at


def test_the_words_say_what_the_record_shows():
    given = evidence()
    words = paragraph(given, seconds_before(given, moment_at(), 5.0))
    for said in (
        "Event 1, 8.0 s, 20.00 USD: it hit person 1 with 80 N s",
        "the robot came with 1.00 m/s, the person with 0.50 m/s: the robot moved into the person",
        "drove 1.00 m/s and in the last second neither braked nor sped up",
        "was 7.5 m away at first and 0.00 m at the least; the gap closed at up to 1.5 m/s",
        "DWBLocalPlanner 101",
        "7 of 100 were rejected (BaseObstacle 7)",
        "PathDist 83 %, BaseObstacle 17 %",
        "What else it weighed is not in the recording",
        "0.50 m from the truth on average",
        "had the person without a gap for the last 2.9 s",
        "no piece was lost",
    ):
        assert said in words, (said, words)


def test_before_the_first_moment_there_is_nothing_to_tell():
    given = evidence()
    words = paragraph(given, seconds_before(given, moment_at(0.0), 5.0))
    assert "stood still" not in words and "-0.0 s" not in words and "before, it" not in words


def test_the_words_follow_other_records():
    braking = evidence()
    braking.trace[STAMPS > 7.05, 9] = 0.2
    none = tuple(np.empty((0, 6)) for _ in STAMPS)
    illegal = tuple(
        decision(t, total_score=None, rejected=100, monitor_action="slowdown", health="lost")
        for t in np.arange(0.0, END, 0.05)
    )
    told = dataclasses.replace(braking, tracks=none, decisions=illegal)
    words = paragraph(told, seconds_before(told, moment_at(), 5.0))
    for said in (
        "in the last second braked",
        "This stack tracked nothing that moves",
        "every trajectory was rejected",
    ):
        assert said in words, words
    assert "rejected every command (BaseObstacle 7)" in words
    assert "Collision monitor: slowdown in 101" in words
    assert "it called itself lost" in words
    nobody = dataclasses.replace(told, crowd=np.empty((len(STAMPS), 0, 2)), decisions=())
    words = paragraph(nobody, seconds_before(nobody, moment_at(12.0, "spoiled"), 5.0))
    assert "Nobody was within 10 m" in words
    assert "Nothing decided in these seconds" in words


@pytest.mark.parametrize(("stamp", "before"), [(8.0, 0.6), (0.8, 5.0)])
def test_less_than_a_second_is_not_called_one(stamp, before):
    given = evidence()
    words = paragraph(given, seconds_before(given, moment_at(stamp), before))
    assert "s before, it drove 1.00 m/s and neither braked nor sped up" in words
    assert "in the last second" not in words


def alternative(kind, speed, path, obstacle):
    scores = (
        CriticScore("PathDist", path, path, 0),
        CriticScore("BaseObstacle", obstacle, obstacle, 0),
    )
    return Alternative(kind, Twist2D(speed), path + obstacle, scores)


def test_what_decided_are_the_critics_that_speak_against_slower_most_first():
    slower, second = alternative(SLOWER, 0.4, 1.1, 0.9), alternative(RUNNER_UP, 0.9, 1.3, 0.2)
    assert list(deciding_critics(decision(0.0), slower).items()) == [
        ("BaseObstacle", pytest.approx(0.7)),
        ("PathDist", pytest.approx(0.1)),
    ]
    given = evidence()
    stamp = given.decisions[140]["stamp_s"]
    given = dataclasses.replace(given, weighed={stamp: (second, slower)})
    words = paragraph(given, seconds_before(given, moment_at(), 5.0))
    assert (
        "at most half as fast (0.40 m/s) would have scored 0.8 more; what decided: BaseObstacle "
        "+0.7, Path" in words
    )
    assert "Second came 0.90 m/s" in words
    only = dataclasses.replace(given, weighed={stamp: (second,)})
    assert "All that were at most half as fast were rejected" in paragraph(
        only, seconds_before(only, moment_at(), 5.0)
    )


@pytest.mark.parametrize(
    ("monitor", "speed", "turn", "said"),
    [
        ("none", 0.95, 0.05, "chose 1.00 m/s, +0.00 rad/s; 7 of 100"),
        ("none", 0.5, 0.0, ", of which the velocity smoother let 0.50 m/s, +0.00 rad/s reach"),
        ("none", 1.0, -0.2, ", of which the velocity smoother let 1.00 m/s, -0.20 rad/s reach"),
        ("slowdown", 0.5, 0.0, "the velocity smoother and the collision monitor let 0.50 m/s"),
    ],
)
def test_what_did_not_reach_the_wheels_is_told(monitor, speed, turn, said):
    made = {"command_linear_x_mps": speed, "command_angular_z_radps": turn}
    rows = (decision(t, monitor_action=monitor, **made) for t in np.arange(0.0, END, 0.05))
    told = evidence(decisions=tuple(rows))
    assert said in paragraph(told, seconds_before(told, moment_at(), 5.0))


def test_shares_and_rejections_come_largest_first():
    row = decision(0.0, PathDist_weighted=-3.0, BaseObstacle_weighted=1.0, PathDist_rejected=9)
    assert shares_of(row) == {"PathDist": 0.75, "BaseObstacle": 0.25}
    assert list(rejected_by(row).items()) == [("PathDist", 9), ("BaseObstacle", 7)]


def test_controllers_without_scores_or_samples_are_told_as_they_are():
    plain = {f"{name}_{end}": None for name in CRITICS for end in CRITIC_COLUMNS}
    for row, said in (
        (
            {"samples": 1, "rejected": 0},
            "RegulatedPurePursuitController chose 1.00 m/s, +0.00 rad/s. It",
        ),
        (
            {"samples": 1, "rejected": 1, "CollisionAhead_rejected": 1},
            "rejected every command (CollisionAhead 1)",
        ),
        (
            {"samples": 1, "rejected": 1, "status": "failed"},
            "rejected every command (its optimiser failed)",
        ),
        ({"samples": 1, "rejected": 1, "status": "failed"}, "Optimiser: failed in 101."),
    ):
        row = {**plain, "total_score": None, "decided_by": "RegulatedPurePursuitController", **row}
        told = evidence(
            decisions=tuple(decision(stamp, **row) for stamp in np.arange(0.0, END, 0.05))
        )
        assert said in paragraph(told, seconds_before(told, moment_at(), 5.0))


def test_whoever_was_shoved_hit_nobody():
    shoved = dict(contact(HIT, 20.0), fault="person_into_standing_robot")
    moment = dataclasses.replace(moment_at(), event=shoved)
    given = evidence(events=(shoved,))
    words = paragraph(given, seconds_before(given, moment, 5.0))
    assert "20.00 USD: person 1 hit it with 80 N s" in words and "it hit person" not in words


def test_of_a_navigation_that_was_given_up_no_critic_is_blamed():
    row = {"outcome": "timeout", "reason": "timeout", "gave_up": "all retries are used up"}
    given = evidence(row={**row, "navigator_error": "NO_VALID_PATH", "goal_distance_m": 12.0})
    words = paragraph(given, seconds_before(given, moment_at(kind="timeout"), 5.0))
    assert (
        f"the navigator gave up: all retries are used up (NO_VALID_PATH); at {END:.0f} s time was "
        "up" in words
    )
    assert "Cycles decided" not in words and "PathDist" not in words


def test_a_robot_that_was_fetched_from_the_way_back_cost_a_repair():
    given = evidence()
    row = {**given.row, "outcome": "arrived", "way_back": "physical_assistance"}
    assert is_costly(row, ()) and not is_costly({**row, "way_back": "arrived"}, ())
    prices = load_prices()
    told = dataclasses.replace(given, row=row, events=())
    (moment,) = moments_of(told, Rules(2.0, 241.0, 0.5, 177.78, 0.05), prices)
    assert moment.cost == pytest.approx(prices.repair_per_physical_assistance)
    assert moment.stamp == row["duration_s"]
