"""What a meeting counts: scripted deliveries whose answers are known by hand."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from harness.meetings import meet as module
from harness.meetings.crowd import Record
from harness.meetings.draw import Meeting
from harness.meetings.meet import NOTHING, PATIENCE, Job, Met, meet
from harness.world.truth import Partner
from navstack.types import BoolArray, Pose2D

BEGIN, PASSING = 10.0, 16.0  # [s] of the copy and the meeting
CLEARANCE = 1.0  # [m] in which nobody begins
# [m] ahead of the robot when people appear; the first is the person of the meeting
PLACES = (8.0, 1.5, 4.0, 9.0)


def touch(stamp: float, person: int) -> SimpleNamespace:
    return SimpleNamespace(stamp=stamp, partner=Partner.PEDESTRIAN, partner_id=person)


class Scripted:
    """A robot that stands, and is touched as written down: soft touches with their end [s]."""

    def __init__(
        self,
        soft: tuple[tuple[float, float, int], ...] = (),
        hits: tuple[tuple[float, int], ...] = (),
        begin: float = BEGIN,
        leave: float = 19.0,
        drives_from: float = 1000.0,
    ) -> None:
        self._soft, self._hits, self._now = soft, hits, begin
        self._leave = leave  # [s] until which people stand there
        self._end = leave + 3.0  # [s] of the delivery
        self._drives_from = drives_from  # [s] at 2 m/s
        people = SimpleNamespace(start_clearance=CLEARANCE)
        self.parts: Any = SimpleNamespace(params=SimpleNamespace(people=people), prices=None)

    @property
    def truth(self) -> Any:
        states = np.zeros((len(PLACES), 4))
        states[:, 0] = np.array(PLACES) + max(self._now - self._leave, 0.0)
        return SimpleNamespace(
            stamp=self._now,
            pose=Pose2D(x=2.0 * max(self._now - self._drives_from, 0.0)),
            pedestrians=states,
            contacts=tuple(touch(at, who) for at, end, who in self._soft if end <= self._now),
            counted_contacts=tuple(touch(at, who) for at, who in self._hits if at <= self._now),
            cargo=None,
        )

    @property
    def verdict(self) -> str | None:
        return "arrived" if self._now >= self._end else None

    def drive_tick(self) -> None:
        self._now += 0.5

    def finish(self) -> Any:
        return SimpleNamespace(row={})


class Stage:
    """Notes who stays away."""

    def __init__(self) -> None:
        self.people = self
        self.hidden: list[bool] = []
        self.shown_at = 0.0  # steps of the record
        self.is_empty = False

    def show(self, record: Record, moment: float, hidden: BoolArray) -> None:
        self.hidden, self.shown_at = hidden.tolist(), moment

    def leave(self) -> None:
        self.is_empty = True


def met(delivery: Scripted, person: int = 0, stage: Stage | None = None, moment: int = 200) -> Met:
    states = np.zeros((400, len(PLACES), 4))
    states[:, :, 0] = PLACES
    job = Job(0, Meeting(moment, person, 50, -1.0, 0, 1.0), PASSING)
    given: Any = (delivery, stage or Stage(), Record(states), job)
    return meet(*given)


@pytest.fixture(autouse=True)
def no_prices(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "margin_of", lambda row, prices: -60.0)


def test_nobody_is_hit_twice_in_two_meetings_or_in_none() -> None:
    """One touches softly and another is hit then: it counts in one of their meetings."""
    script = dict(soft=((15.0, 15.5, 0),), hits=((17.0, 3), (18.0, 3), (19.0, 0)))
    assert met(Scripted(**script), 0) == Met(-60.0, 2, 3)
    assert met(Scripted(**script), 3) == NOTHING


def test_a_touch_that_ends_after_a_hit_takes_it_from_nobody() -> None:
    script = dict(soft=((15.0, 18.0, 0),), hits=((17.0, 3),))
    assert met(Scripted(**script), 3) == Met(-60.0, 1, 1)
    assert met(Scripted(**script), 0) == NOTHING


def test_who_hits_a_robot_that_somebody_holds_up_counts_there() -> None:
    late = PASSING + PATIENCE
    held = Scripted(hits=((late + 1.0, 3),), leave=late + 5.0)
    assert met(held, 0) == Met(-60.0, 1, 1)
    early = Scripted(hits=((late - 1.0, 3),), leave=late + 5.0)
    assert met(early, 0) == NOTHING


@pytest.mark.parametrize(
    ("drives_from", "end", "is_empty"),
    [(1000.0, 40.0, False), (17.0, 21.0, False), (17.0, 22.5, True)],
)
def test_people_leave_when_the_robot_is_away_from_where_it_was_touched(
    drives_from: float, end: float, is_empty: bool
) -> None:
    """Known at 15.5 s, it is 6 s later and 6 m farther at 22 s."""
    script = dict(soft=((15.0, 15.5, 0),), leave=end - 3.0, drives_from=drives_from)
    stage = Stage()
    assert met(Scripted(**script), 0, stage) == Met(-60.0, 0, 0)
    assert stage.is_empty == is_empty


def test_people_stay_with_a_robot_that_somebody_holds_up() -> None:
    late = PASSING + PATIENCE
    for drives_from, is_empty in ((1000.0, False), (late + 1.0, True)):
        stage = Stage()
        assert met(Scripted(leave=late + 7.0, drives_from=drives_from), 0, stage).people_hit == 0
        assert stage.is_empty == is_empty


@pytest.mark.parametrize(("moment", "shown_at"), [(20, 0.0), (42, 2.0), (60, 0.0)])
def test_people_appear_as_soon_as_the_record_has_begun(moment: int, shown_at: float) -> None:
    """A copy may be older: it is 6 s before the meeting and drives in ticks of 0.5 s."""
    stage = Stage()
    met(Scripted(), 0, stage, moment)
    assert stage.shown_at == pytest.approx(shown_at)


def test_who_is_not_touched_costs_nothing() -> None:
    assert met(Scripted()) == NOTHING


def test_others_do_not_appear_right_before_the_robot() -> None:
    stage = Stage()
    met(Scripted(), 0, stage)
    assert stage.hidden == [False, True, True, False]
    met(Scripted(), 1, stage)
    assert stage.hidden == [False, False, True, False]


def test_at_the_start_of_a_delivery_all_are_there_who_can_be() -> None:
    stage = Stage()
    met(Scripted(begin=0.0), 0, stage)
    assert stage.hidden == [False] * 4
