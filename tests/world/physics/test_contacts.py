"""The accounting of contacts, on made-up contact points."""

import pytest

from harness.world.physics.contacts import ContactBook, ContactPoint, Motion, Touched
from harness.world.physics.params import ContactParams
from harness.world.truth import Partner
from navstack.errors import UnknownNameError

DT = 1.0 / 120.0
PERSON = Touched(Partner.PEDESTRIAN, "pedestrian", 3)
MAILBOX = Touched(Partner.PROPERTY, "mailbox", 7)
STILL = Motion((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
ROBOT = Motion((0.0, 0.0, 0.45), (1.5, 0.2, 0.0), (0.0, 0.0, 0.5))


LEAVING = Motion((0.0, 0.0, 0.0), (1.5, 0.0, 0.0))  # as fast as the robot at y = 0


def point(impulse, touched=PERSON, partner=STILL, position=(0.4, 0.0, 0.3), distance=0.0):
    return ContactPoint(touched, position, (-1.0, 0.0, 0.0), impulse, partner, distance)


def feed(book, steps, first=1, robot=ROBOT):
    """Record a list of contact points per physics step; an empty list is a step without contact."""
    for number, points in enumerate(steps, first):
        book.record(number * DT, points, robot)
        book.close_old(number * DT)


@pytest.fixture
def book():
    return ContactBook(ContactParams(), DT, robot_mass=50.0)


def test_the_points_of_one_partner_count_as_one(book):
    feed(book, [[point(20.0), point(30.0), point(90.0, MAILBOX)]])
    (counted,) = book.counted
    assert (counted.impulse, counted.kind) == (50.0, "pedestrian")


def test_partners_are_not_added_to_each_other(book):
    feed(book, [[point(30.0), point(40.0, MAILBOX)]])
    assert book.counted == ()


def test_the_first_strong_partner_of_a_step_counts_alone(book):
    feed(book, [[point(20.0), point(30.0), point(90.0, MAILBOX)]])
    (counted,) = book.counted
    assert (counted.impulse, counted.kind, counted.partner_id, counted.stamp) == (
        50.0,
        "pedestrian",
        3,
        DT,
    )


def test_steps_below_the_threshold_never_add_up(book):
    feed(book, [[point(49.9)]] * 5)
    assert book.counted == ()


def test_nothing_counts_during_thirty_reports_whoever_it_is(book):
    feed(book, [[point(60.0)]] + [[point(200.0, MAILBOX)]] * 30)
    assert len(book.counted) == 1
    feed(book, [[point(200.0, MAILBOX)]], first=32)
    assert [contact.kind for contact in book.counted] == ["pedestrian", "mailbox"]


def test_steps_without_contact_do_not_shorten_the_cool_down(book):
    feed(book, [[point(60.0)]] + [[]] * 200 + [[point(60.0)]] * 30)
    assert len(book.counted) == 1
    feed(book, [[point(60.0)]], first=232)
    assert len(book.counted) == 2


def test_a_touch_without_force_is_a_report(book):
    feed(book, [[point(60.0)]] + [[point(0.0)]] * 30 + [[point(60.0)]])
    assert len(book.counted) == 2


def test_an_event_sums_the_impact_and_not_the_push_after_it(book):
    feed(book, [[point(30.0), point(10.0)], [point(5.0)], [point(2.0)], [point(3.0)], [point(3.0)]])
    book.close_all()
    (event,) = book.finished
    assert event.impulse == pytest.approx(40.0)
    assert event.delta_v == pytest.approx(40.0 / 50.0)
    assert event.impacts == 1
    assert event.peak_step_impulse == 40.0
    assert event.stamp == DT
    assert event.duration == pytest.approx(5 * DT)


def test_an_impact_lasts_until_the_bodies_touch(book):
    """The engine brakes bodies that would meet within the step to just meet.

    They still come together in the next.
    """
    feed(
        book,
        [[point(30.0, distance=0.004)], [point(12.0, distance=0.0)], [point(3.0, distance=-1e-5)]],
    )
    book.close_all()
    (event,) = book.finished
    assert (event.impulse, event.impacts) == (pytest.approx(42.0), 1)


def test_bodies_that_stay_together_push(book):
    feed(book, [[point(4.0, partner=LEAVING)]] * 3)
    book.close_all()
    (event,) = book.finished
    assert (event.impulse, event.impacts, event.delta_v) == (0.0, 0, 0.0)
    assert event.peak_step_impulse == 4.0


def test_the_weakest_push_is_an_event_and_a_touch_without_force_is_none(book):
    feed(book, [[point(0.0), point(0.25, MAILBOX, LEAVING)], [], [point(0.0)]])
    assert book.is_waiting
    book.close_all()
    (event,) = book.finished
    assert (event.kind, event.peak_step_impulse, event.impulse, event.impacts) == (
        "mailbox",
        0.25,
        0.0,
        0,
    )
    assert event.duration == pytest.approx(DT)


def test_a_second_impact_of_the_same_contact_counts_too(book):
    feed(book, [[point(30.0)], [point(2.0)], [], [point(20.0)]])
    book.close_all()
    (event,) = book.finished
    assert (event.impulse, event.impacts) == (pytest.approx(50.0), 2)


def test_another_corner_that_strikes_while_the_first_one_touches_is_an_impact(book):
    feed(book, [[point(30.0)], [point(2.0)], [point(1.0), point(25.0, position=(0.4, 0.5, 0.3))]])
    book.close_all()
    (event,) = book.finished
    assert (event.impulse, event.impacts) == (pytest.approx(55.0), 2)


def test_an_event_ends_after_a_quarter_second_apart_and_then_begins_anew(book):
    feed(book, [[point(30.0)]] + [[]] * 29 + [[point(4.0)]] + [[]] * 31 + [[point(8.0)]])
    book.close_all()
    assert [event.impulse for event in book.finished] == [34.0, 8.0]
    assert book.finished[0].duration == pytest.approx(31 * DT)


def test_partners_have_events_of_their_own(book):
    feed(book, [[point(30.0), point(11.0, MAILBOX)], [point(1.0, MAILBOX)]])
    book.close_all()
    assert {event.kind: event.impulse for event in book.finished} == {
        "pedestrian": 30.0,
        "mailbox": 11.0,
    }


def test_it_says_who_moved_into_whom(book):
    walker = Motion((0.7, 0.0, 0.0), (-1.0, 0.3, 0.0))
    feed(book, [[point(30.0, partner=walker, position=(0.4, -0.2, 0.3))]])
    book.close_all()
    (event,) = book.finished
    # Velocity of the robot's surface: v + w x r = 1.5 + 0.5 * 0.2 along x.
    assert event.robot_speed == pytest.approx(1.6)
    assert event.partner_speed == pytest.approx(1.0)
    assert event.robot_speed + event.partner_speed == pytest.approx(2.6)
    assert (event.x, event.y) == (0.4, -0.2)


def test_spin_about_any_axis_moves_the_surface():
    spinning = Motion((1.0, 2.0, 3.0), (0.0, 0.0, 0.0), (0.3, -0.4, 0.5))
    point_there = (1.5, 2.2, 2.6)
    # w x r with w = (0.3, -0.4, 0.5), r = (0.5, 0.2, -0.4), by hand.
    expected = (0.06, 0.37, 0.26)
    axes = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    assert [spinning.along(axis, point_there) for axis in axes] == pytest.approx(expected)


def test_per_point_the_threshold_looks_at_single_points():
    book = ContactBook(ContactParams(per="point"), DT, robot_mass=50.0)
    feed(
        book,
        [[point(20.0), point(49.9)], [point(45.0, MAILBOX), point(60.0), point(90.0, MAILBOX)]],
    )
    (counted,) = book.counted
    assert (counted.impulse, counted.kind, counted.stamp) == (60.0, "pedestrian", 2 * DT)


def test_events_are_the_same_whatever_counts():
    books = [
        ContactBook(ContactParams(per=per), DT, robot_mass=50.0) for per in ("partner", "point")
    ]
    for each in books:
        feed(each, [[point(30.0), point(40.0)], [point(5.0)]])
        each.close_all()
    assert [len(each.counted) for each in books] == [1, 0]
    assert books[0].finished == books[1].finished


def test_an_unknown_way_of_counting_is_refused():
    with pytest.raises(UnknownNameError, match="contacts: per 'points'"):
        ContactParams(per="points")
