"""Meetings are driven from copies of a delivery among nobody, the same for both sides."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from harness.episode.episode import RunningDelivery
from harness.execution.copies import PausedCopy
from harness.meetings import crowd, estimate, results
from harness.meetings.allowed import why_no_meetings
from harness.meetings.drive import NOT_MET
from harness.meetings.meet import stage_of
from harness.meetings.mission import MissionDrive, MissionTask, drive_mission
from harness.meetings.strata import PRIOR
from harness.storage.shipped import shipped
from harness.task.study import EpisodeTask, make_study
from tests.rules import short_rules


@pytest.fixture(scope="module")
def task(tmp_path_factory: pytest.TempPathFactory, hall: Path) -> EpisodeTask:
    rules = tmp_path_factory.mktemp("rules") / "rules.yaml"
    rules.write_text(short_rules(12.0))
    study = make_study(
        stacks=["nav2-gps-ekf"], episodes=1, map_name=str(hall), rules=str(rules), workers=1
    )
    return study.template


def driven(task: EpisodeTask, long: float = 130.0) -> MissionDrive:
    """A mission of two alike arms, with few meetings from a short record [s]."""
    other = dataclasses.replace(task, stack_number=1)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(crowd, "LONG", long)
        return drive_mission(MissionTask((task, other), tuple(PRIOR.tolist()), 4.0))


@pytest.fixture(scope="module")
def mission(task: EpisodeTask) -> MissionDrive:
    return driven(task)


def test_a_copy_ends_as_the_delivery_does(task: EpisodeTask) -> None:
    stage = stage_of(task)
    delivery = RunningDelivery(task, world=stage.world)

    def finish(_: None) -> dict[str, object]:
        while delivery.verdict is None:
            delivery.drive_tick()
        return dict(delivery.finish().row)

    for _ in range(60):
        delivery.drive_tick()
    copy = PausedCopy(finish)
    assert copy.ask([None]) == [finish(None)]
    stage.world.close()


@pytest.mark.slow
def test_arms_that_drive_alike_come_to_the_same_each_time(
    task: EpisodeTask, mission: MissionDrive
) -> None:
    old, new = mission.arms
    assert (old.met, old.margin) == (new.met, new.margin)
    assert mission.margins[0] == mission.margins[1]
    assert 2 <= len(mission.strata) <= 6
    met = [each for each in old.met if each != NOT_MET]
    assert met and all(each.weight > 0.0 for each in met)
    again = driven(task)
    assert again.arms == mission.arms
    assert np.array_equal(again.strata, mission.strata)


@pytest.mark.slow
def test_people_who_make_way_are_met_too(task: EpisodeTask, tmp_path: Path) -> None:
    shipped_world = shipped("params") / "worlds" / "measured.yaml"
    text = shipped_world.read_text(encoding="utf-8")
    world = tmp_path / "world.yaml"
    world.write_text(text.replace("people:\n", "people:\n  beginning: stationary\n", 1))
    studies = [
        make_study(stacks=["nav2-gps-ekf"], episodes=1, map_name=task.map_name, world=str(file))
        for file in (world, shipped_world)
    ]
    assert why_no_meetings(studies[0]) == ""
    assert "all set out at once" in why_no_meetings(studies[1])
    first, second = driven(dataclasses.replace(task, world=str(world)), long=160.0).arms
    assert len(first.met) > 0
    assert (first.met, first.margin) == (second.met, second.margin)


def test_spreads_are_learned_from_what_meetings_cost(mission: MissionDrive) -> None:
    old, new = mission.arms
    dear = dataclasses.replace(old.met[0], weight=float(mission.stands_for[0]), loss=1000.0)
    hit = dataclasses.replace(new, met=(dear, *new.met[1:]))
    changed = dataclasses.replace(mission, arms=(old, hit))
    spreads = estimate.learned_spreads([changed])
    stratum = int(mission.strata[0])
    assert spreads[stratum] > 10.0 * PRIOR[stratum]
    others = np.delete(np.arange(len(PRIOR)), stratum)
    assert (spreads[others] <= PRIOR[others]).all()


def test_a_rate_without_an_event_admits_one_in_the_heaviest_meeting() -> None:
    weights, none = [np.array([0.5, 0.1]), np.array([0.2])], [np.array([0, 0]), np.array([0])]
    found = results.weighted_rate(weights, none, np.array([1.0, 3.0]))
    assert (found.value, found.low, found.n) == (0.0, 0.0, 2)
    assert found.high == pytest.approx(-math.log(0.025) * 0.5 / 4.0)
    nobody = [np.zeros(0), np.zeros(0)]
    missing = results.weighted_rate(nobody, [each.astype(int) for each in nobody], np.ones(2))
    assert (missing.value, missing.low, missing.high) == (0.0, None, None)


def test_a_rate_of_who_never_moved_is_undefined() -> None:
    found = results.weighted_rate([np.array([0.5])] * 2, [np.array([1])] * 2, np.zeros(2))
    assert (found.value, found.low, found.high, found.n) == (None, None, None, 2)


def test_a_rate_with_events_has_the_wider_end() -> None:
    weights = [np.array([0.1]), np.array([0.1]), np.array([0.1])]
    counts = [np.array([2]), np.array([0]), np.array([1])]
    found = results.weighted_rate(weights, counts, np.ones(3))
    alone = results.ratio_interval(np.array([0.2, 0.0, 0.1]), np.ones(3))
    assert found.value == alone.value == pytest.approx(0.1)
    assert alone.high is not None and found.high > alone.high


def test_a_mission_without_a_meeting_counts_as_one_without_a_hit(mission: MissionDrive) -> None:
    arms = []
    for arm in mission.arms:
        hit = dataclasses.replace(arm.met[0], weight=0.5, people_hit=1)
        arms.append(dataclasses.replace(arm, met=(hit, *arm.met[1:])))
    mission = dataclasses.replace(mission, arms=tuple(arms))
    nobody = tuple(dataclasses.replace(arm, met=()) for arm in mission.arms)
    strata = np.zeros(0, dtype=np.int64)
    empty = dataclasses.replace(mission, strata=strata, stands_for=np.zeros(0), arms=nobody)
    found, alone = results.result_of([mission, empty]), results.result_of([mission, mission])
    for arm, whole in zip(found.arms, alone.arms, strict=True):
        assert arm.hits.value is not None and whole.hits.value is not None
        assert arm.hits.value == pytest.approx(0.5 * whole.hits.value) and whole.hits.value > 0.0


def test_a_margin_admits_what_the_greatest_loss_costs_once_more(mission: MissionDrive) -> None:
    """Missions that all earn alike have an interval, from the meetings that they lost by."""
    dear = dataclasses.replace(mission.arms[0].met[0], weight=0.1, loss=60.0)
    arm = dataclasses.replace(mission.arms[0], margin=9.0, met=(dear,))
    strata, stands_for = mission.strata[:1], mission.stands_for[:1]
    alike = dataclasses.replace(mission, strata=strata, stands_for=stands_for, arms=(arm,))
    found = results.result_of([alike] * 9).arms[0].margin
    # nine events: Garwood's interval of their number is 4.1 to 17.1
    assert found.value == pytest.approx(3.0)
    assert found.low == pytest.approx(9.0 - 6.0 * 17.085 / 9.0, abs=0.01)
    assert found.high == pytest.approx(9.0 - 6.0 * 4.115 / 9.0, abs=0.01)


def test_a_ratio_has_the_interval_of_its_missions() -> None:
    found = results.ratio_interval(np.array([1.0, 3.0]), np.array([1.0, 1.0]))
    assert found.value == 2.0 and found.n == 2
    assert found.high == pytest.approx(2.0 + 1.96, abs=0.01)
    assert results.ratio_interval(np.ones(1), np.ones(1)).low is None
