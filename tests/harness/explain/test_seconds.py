"""Moments of a delivery and the seconds before them."""

import dataclasses

import numpy as np
import pytest

from harness.economics.prices import load_prices
from harness.explain.document import Explained
from harness.explain.moments import costliest, costs_of, moments_of
from harness.explain.seconds import seconds_before, since_cause
from harness.explain.words import paragraph
from harness.report.explain_figure import draw_seconds
from harness.report.short.explain import MOST_INSTANTS, short_explanation
from navstack.errors import InputError

from .made_up import END, HIT, RULES, STAMPS, arrays, contact, evidence, moment_at


def test_the_seconds_before_hold_what_was_done_met_seen_and_believed():
    seconds = seconds_before(evidence(), moment_at(), 5.0)
    assert (seconds.at[0], seconds.at[-1]) == (pytest.approx(-5.0), pytest.approx(0.0))
    assert seconds.person == 1
    np.testing.assert_allclose(seconds.distance, -1.5 * seconds.at, atol=1e-9)
    np.testing.assert_allclose(seconds.closing, 1.5, atol=1e-6)
    np.testing.assert_allclose(seconds.position_error, 0.5, atol=1e-9)
    # belief's error taken out
    np.testing.assert_allclose(seconds.track_error[seconds.at > -2.9], 0.0, atol=1e-5)
    assert seconds.tracked_since == pytest.approx(2.9, abs=0.11)
    assert [round(float(seconds.at[place]), 1) for place in seconds.instants()] == [
        -0.5 * k for k in range(10, -1, -1)
    ]
    assert seconds.telling is not None
    assert seconds.telling["stamp_s"] == pytest.approx(HIT - 1.0)


def test_what_comes_early_is_told_from_the_start():
    seconds = seconds_before(evidence(), moment_at(1.0), 5.0)
    assert (seconds.since, seconds.at[0]) == (0.0, pytest.approx(-0.9))
    assert seconds_before(evidence(), moment_at(0.0), 5.0).at.size == 2


def test_a_delivery_that_was_over_at_once_is_not_told():
    given = evidence()
    with pytest.raises(InputError, match="over within 0.1 s"):
        seconds_before(dataclasses.replace(given, trace=given.trace[:1]), moment_at(0.05), 5.0)


def test_a_belief_that_is_turned_still_sees_the_person_where_he_is():
    given = evidence()
    turn = 0.3
    trace = given.trace.copy()
    trace[:, 8] = turn
    rotation = np.array(((np.cos(turn), np.sin(turn)), (-np.sin(turn), np.cos(turn))))
    tracks = tuple(
        np.column_stack((one[:, :1], (crowd[1:] - row[1:3]) @ rotation + row[6:8], one[:, 3:]))
        if len(one)
        else one
        for one, crowd, row in zip(given.tracks, given.crowd, trace, strict=True)
    )
    seconds = seconds_before(
        dataclasses.replace(given, trace=trace, tracks=tracks), moment_at(), 2.0
    )
    np.testing.assert_allclose(seconds.track_error, 0.0, atol=1e-9)


def test_moments_are_the_paid_contacts_and_the_costed_outcome():
    prices = load_prices("costnav")
    events = (contact(HIT, 20.0), contact(9.0, 0.0), {**contact(9.5, 5.0), "type": "contact_event"})
    spoiled = evidence(events=events, row={"outcome": "spoiled", "reason": "cargo lost"})
    found = moments_of(spoiled, RULES, prices)
    assert [(each.number, each.kind) for each in found] == [(1, "contact"), (2, "spoiled")]
    assert found[1].stamp == pytest.approx(12.1)  # the third of 50 pieces is more than 5 %
    assert found[1].cost == pytest.approx(prices.food_price)
    assert costliest(found) is max(found, key=lambda each: each.cost or 0.0)
    assert moments_of(evidence(events=()), RULES, prices) == []


def test_a_timeout_is_told_since_the_robot_was_stuck_or_from_its_end():
    prices, late = load_prices("costnav"), {"outcome": "timeout", "reason": "timeout"}
    (on_its_way,) = moments_of(evidence(events=(), row=late), RULES, prices)
    assert on_its_way.stamp == END
    trace = evidence().trace.copy()
    trace[trace[:, 0] > 6.0, 1] = 6.0
    (stuck,) = moments_of(evidence(events=(), row=late, trace=trace), RULES, prices)
    # when it came to within 2 m of where it stayed
    assert stuck.stamp == pytest.approx(4.0, abs=0.11)
    assert stuck.cost == pytest.approx(prices.delivery_fee.value)


@pytest.mark.parametrize("outcome", ["timeout", "physical_assistance"])
def test_without_cargo_what_depends_on_it_has_no_cost(outcome):
    prices, row = (
        load_prices("costnav"),
        {"outcome": outcome, "reason": "timeout", "pieces_at_start": None},
    )
    told = evidence(events=(), row=row)
    (moment,) = moments_of(told, RULES, prices)
    assert moment.cost is None
    assert "cost undefined without cargo" in paragraph(told, seconds_before(told, moment, 5.0))
    money = costs_of(told.row, prices)
    undefined = {"service_compensation", "opex", "revenue", "contribution_margin"}
    assert {name for name, value in money.items() if value is None} == undefined


def test_needing_help_costs_the_fee_and_the_repair():
    prices = load_prices("costnav")
    hit = evidence(
        row={"outcome": "physical_assistance", "reason": "impulse", "collision_impulse_ns": 180.0}
    )
    both = moments_of(hit, RULES, prices)
    assert [each.kind for each in both] == ["contact", "physical_assistance"]
    money = costs_of(hit.row, prices)
    assert both[1].cost == pytest.approx(money["service_compensation"] + money["repair"])
    assert both[1].person == 1  # the last contact used up what was left
    assert "needed help" in paragraph(hit, seconds_before(hit, both[1], 5.0))


def test_who_is_absent_at_first_is_met_all_the_same(tmp_path, rendering):
    crowd = arrays()["crowd"]
    crowd[STAMPS < 6.05, 1] = np.inf
    crowd[:, 0] = np.nan
    told = evidence(crowd=crowd)
    seconds = seconds_before(told, moment_at(), 5.0)
    assert seconds.person == 1
    assert "was 2.7 m away at first and 0.00 m at the least" in paragraph(told, seconds)
    draw_seconds(told, seconds, None, [tmp_path / "a.png"])
    assert (tmp_path / "a.png").stat().st_size > 10_000


def held_up(*spans):
    """A robot that is under way at 1 m/s but for spans [s] in which it stands."""
    given = evidence()
    trace = given.trace.copy()
    trace[:, 4] = 1.0
    for begin, end in spans:
        trace[(trace[:, 0] >= begin - 1e-6) & (trace[:, 0] < end - 1e-6), 4] = 0.0
    return dataclasses.replace(given, trace=trace)


@pytest.mark.parametrize(
    ("spans", "before"),
    [
        ([], 5.0),
        ([(HIT - 2.0, HIT)], 5.0),
        ([(HIT - 8.0, HIT)], 9.0),
        ([(HIT - 7.5, HIT - 7.0), (HIT - 3.0, HIT - 1.0)], 8.5),  # it got away for four seconds
        ([(0.0, HIT - 7.0), (HIT - 1.0, HIT)], 5.0),  # for six
        ([(0.0, HIT)], min(HIT + 1.0, 20.0)),
        ([(0.0, 1.0)], 5.0),  # at the start
    ],
)
def test_the_seconds_begin_before_the_robot_was_held_up(spans, before):
    given = held_up(*spans)
    assert since_cause(given, moment_at()) == pytest.approx(before, abs=0.11)
    told = seconds_before(given, moment_at())
    assert told.at[0] == pytest.approx(-min(before, HIT), abs=0.11)
    stood = sum(min(end, HIT) - begin for begin, end in spans if begin >= HIT - before)
    if 1.0 <= stood < before - 1.0:
        assert f"it stood for {stood:.1f} s, else drove 1.00 m/s" in paragraph(given, told)


def test_the_short_table_has_the_event_and_the_second_before_it():
    given, moment = evidence(), moment_at()
    seconds = seconds_before(given, moment, 5.0)
    told = Explained(seconds, "It drove.", None)
    (table,) = (each for each in short_explanation(given, [told], None, ()) if has_rows(each))
    times = [row[0] for row in table.rows]
    assert times[-1] == "0.0" and "-1.0" in times and len(times) <= MOST_INSTANTS + 1
    assert times == sorted(times, key=float)


def has_rows(block):
    return bool(getattr(block, "rows", ()))
