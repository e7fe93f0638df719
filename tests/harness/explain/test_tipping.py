"""Why a robot tipped over: what the contacts, the ground and the commands show."""

import numpy as np
import pytest

from harness.explain.seconds import seconds_before
from harness.explain.words import paragraph
from harness.world.map.scene import Scene, Zone

from .made_up import END, STAMPS, contact, evidence, moment_at

TIPPED = {"outcome": "physical_assistance", "reason": "orientation", "navigator_history": ""}


def words_of(**more):
    row = TIPPED | more.pop("row", {})
    given = evidence(row=row, **more)
    return paragraph(given, seconds_before(given, moment_at(END, "physical_assistance"), 5.0))


def event(kind, number, stamp, impulse, fault, duration, what="contact_event"):
    row = contact(stamp, None, number) | {"kind": kind, "impulse_ns": impulse, "fault": fault}
    partner = "pedestrian" if kind == "pedestrian" else "property"
    return row | {"type": what, "partner": partner, "duration_s": duration}


def street(turn=0.0):
    """A sidewalk beside a road that lies 0.12 m lower, ahead of the end of the drive."""
    square = np.array(((-100.0, -100.0), (100.0, -100.0), (100.0, 100.0), (-100.0, 100.0)))
    lower = square + (100.0 + END - turn, 0.0)
    return Scene("made", (), (Zone("sidewalk", square), Zone("road", lower, -0.12)), None, None)


def test_who_pushed_it_against_what_is_told_in_order():
    stays = event("building_glass", 15, 1.0, 46.0, "robot_into_property", END - 2.2)
    counted = event(
        "building_glass", 15, END - 1.2, 74.0, "robot_into_property", None, "counted_contact"
    )
    push = event("pedestrian", 12, END - 1.1, 173.0, "person_into_standing_robot", 0.04)
    words = words_of(events=(stays, push, counted))
    assert (
        "it tipped over. Before it tipped over, it moved into the building glass (74 N s, " in words
    )
    assert (
        "touching it for 18 s until 1.2 s before) and person 12 walked into it as it stood" in words
    )
    assert "as it stood (173 N s, 1.1 s before)." in words


@pytest.mark.parametrize(
    ("events", "said"),
    [
        ((), "It had touched nobody and nothing on its way."),
        (
            (event("pedestrian", 1, 8.0, 60.0, "person_into_robot", 0.1),),
            "It touched nobody and nothing in the last 12 s.",
        ),
    ],
)
def test_that_nothing_touched_it_is_told_too(events, said):
    assert said in words_of(events=events)


def test_the_step_below_it_is_told_with_the_side_that_was_lower():
    words = words_of(scene=street(turn=-0.05))
    assert "It was over a step of 0.12 m from 0.4 s before: its front over the road" in words
    assert "the rest over the sidewalk." in words
    assert "It was on level ground (sidewalk)." in words_of(scene=street(turn=-5.0))
    assert "ground" not in words_of()  # without a map nothing is said of it


def test_why_it_stood_is_told():
    gave_up = {"gave_up": "all retries", "navigator_error": "NO_VALID_PATH"}
    history = {"navigator_history": "3.0 s no plan (NO_VALID_PATH); 9.0 s gave up: all retries"}
    assert (
        "At 9.0 s the navigator gave up and let it stand: all retries (NO_VALID_PATH)."
        in words_of(row=gave_up | history)
    )
    again = {"navigator_history": "9.0 s gave up: all retries; 19.0 s the goal is sent again"}
    assert "gave up" not in words_of(row=gave_up | again), "and it drove on"
    twice = {"navigator_history": f"{again['navigator_history']}; 29.0 s gave up: no way"}
    assert "At 29.0 s the navigator gave up" in words_of(row=gave_up | twice)
    standing = evidence().trace.copy()
    standing[STAMPS > END - 3.05, 9:11] = 0.0
    assert "It was commanded to stand for the last 3.1 s." in words_of(trace=standing)
    assert "commanded to stand" not in words_of()


LATE = {"outcome": "timeout", "gave_up": "", "off_walkable_time_s": 31.0, "goal_distance_m": 9.0}


def late(**more):
    given = evidence(row=LATE, **more)
    return paragraph(given, seconds_before(given, moment_at(END, "timeout"), 5.0))


def test_what_held_a_late_robot_up_is_told():
    push = event("pedestrian", 12, END - 1.1, 45.0, "person_into_standing_robot", 0.04)
    after = event("pedestrian", 13, END + 1.0, 45.0, "person_into_standing_robot", 0.04)
    words = late(events=(push, after), scene=street(turn=-0.05))
    assert "Before that, person 12 walked into it as it stood (45 N s, 1.1 s before)." in words
    assert "It was over a step of 0.12 m" in words and "person 13" not in words
    assert "It spent 31 s off the walkable ground." in words
    plain = late(events=(), scene=street(turn=-5.0))
    assert "Before that" not in plain and "level ground" not in plain


def test_a_robot_that_stands_all_the_while_says_since_when_and_what_refused():
    trace = evidence().trace.copy()
    trace[STAMPS > END - 8.05, 4] = 0.0
    trace[STAMPS > END - 8.05, 9:11] = 0.0
    rows = tuple(
        row | {"rejected": row["samples"], "total_score": None, "BaseObstacle_rejected": 7}
        for row in evidence().decisions
        if row["stamp_s"] < END - 6.0
    )
    words = late(events=(), trace=trace, decisions=rows)
    assert "It stood still for the whole 5.0 s. It had stood since 11.9 s; " in words
    assert "DWBLocalPlanner rejected every command from 11.9 to 14.0 s (BaseObstacle 7)" in words
    trace[:, 4] = 0.0
    assert "It never moved." in late(events=(), trace=trace)
