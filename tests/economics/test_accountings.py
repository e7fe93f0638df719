"""Contacts accounted for in other ways, one by one and by hand."""

import dataclasses

import numpy as np
import pytest

from harness.economics.accountings import (
    COUNTED,
    EVENT,
    PERSON,
    at_fault_only,
    contacts_of,
    is_grave,
    shared,
    whole,
)
from harness.economics.contact_limits import beyond_limit, limit_speed
from harness.economics.prices import load_prices
from harness.statistics.interval import wilson_interval

PRICES = load_prices("costnav")
ROWS = [{"stack": "mine", "episode": episode} for episode in (4, 7)]


def event(kind, robot=1.0, partner=0.0, fault="robot_into_person", **more):
    speeds = {"robot_speed_mps": robot, "partner_speed_mps": partner}
    return {
        "stack": "mine",
        "episode": 7,
        "type": EVENT,
        "kind": kind,
        "fault": fault,
        "impulse_ns": 9.0,
        **speeds,
        **more,
    }


@pytest.mark.parametrize(
    ("kind_of_row", "kind", "cost", "matters"),
    [
        (COUNTED, PERSON, 31.0, True),
        (COUNTED, PERSON, 0.0, True),
        (COUNTED, "mailbox", 50.0, True),
        (COUNTED, "mailbox", 0.0, False),
        (EVENT, PERSON, None, False),
    ],
)
def test_contacts_matter_where_they_cost_or_are_with_people(kind_of_row, kind, cost, matters):
    assert is_grave({"type": kind_of_row, "kind": kind, "cost_usd": cost}) is matters


def test_contacts_are_those_of_the_deliveries_and_of_one_type():
    others = ({"stack": "other"}, {"episode": 5}, {"type": COUNTED})
    events = [
        event(PERSON, episode=4),
        *(event(PERSON, **each) for each in others),
        event("fence", 0.5, 0.25),
    ]
    found = contacts_of(ROWS, events, EVENT)
    assert [column.tolist() for column in dataclasses.astuple(found)] == [
        *([0, 1], [PERSON, "fence"], [9.0, 9.0], [1.0, 0.5], [0.0, 0.25]),
        ["robot_into_person", "robot_into_person"],
    ]
    assert found.with_people.tolist() == [True, False]
    assert contacts_of(ROWS, events, COUNTED).delivery.tolist() == [1]


def test_the_robots_share_of_what_a_contact_costs():
    events = [
        event(PERSON, 1.5, 0.5),
        event(PERSON, 1.5, -0.5),
        event(PERSON, -1.0, 0.5, "person_into_robot"),
        event(PERSON, 0.0, 0.0),
        event(PERSON, 0.5, 1.5, "person_into_standing_robot"),
        event("fence", 0.5, 1.5, "robot_into_property"),
        event("fence", 0.5, 1.5, "property_into_robot"),
    ]
    contacts = contacts_of(ROWS, events, EVENT)
    assert shared(contacts).tolist() == [0.75, 1.0, 0.0, 1.0, 0.0, 1.0, 1.0]
    assert at_fault_only(contacts).tolist() == [1.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.0]
    assert whole(contacts).tolist() == [1.0] * 7


def test_the_limit_is_that_of_a_lower_leg():
    """260 N over the root of 60 kN/m times the reduced mass of 50 kg and 75 kg, which is 30 kg."""
    limit = limit_speed(PRICES)
    assert limit == pytest.approx(260.0 / np.sqrt(60_000.0 * 30.0), rel=1e-12)
    speeds = (
        (limit, 0.0),
        (0.0, limit),
        (np.nextafter(limit, 1.0), 0.0),
        (limit, 0.25),
        (0.5 * limit, 0.25 * limit),
    )
    events = [*(event(PERSON, *each) for each in speeds), event("fence", 9.0)]
    assert beyond_limit(ROWS, events, PRICES) == wilson_interval(2, 5)
