"""The auditor: planted exploits are flagged as what they are, honest optima are left alone."""

import dataclasses
import json
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from harness.economics.accountings import EVENT, PERSON
from harness.economics.prices import load_prices
from harness.statistics.interval import Interval
from harness.tuning.audit.auditor import OF_PARAMETERS, audit
from harness.tuning.audit.checks import timeouts
from harness.tuning.audit.findings import FAMILY_LEVEL, GAPS, LEVEL, AuditEvidence, Check
from harness.tuning.audit.hidden import UNKNOWN
from harness.tuning.audit.pairs import PairedSide, pair_up
from harness.tuning.audit.search import edges
from harness.tuning.evaluation import EVENTS, Candidate
from harness.tuning.result import StudyResult, trial_table

PRICES = load_prices("costnav")
MISSIONS = 200
KEYS = (
    "softened",
    "left_standing",
    "ended_early",
    "frozen",
    "edge",
    "over_the_cliff",
    "squeezed",
    "pushed_long",
    "scratches",
    "called_for_help",
    "timed_out",
    "half_pace",
    "waited",
    "close_by",
    "braked",
    "computes",
)
Deliveries = dict[str, list[dict[str, Any]]]


@pytest.fixture(scope="module")
def stacks(auditor_studies: ModuleType) -> Deliveries:
    drawn: Deliveries = auditor_studies.drawn_deliveries(np.random.default_rng(3), 100)
    return drawn


@pytest.fixture
def exploiting(auditor_studies: ModuleType, stacks: Deliveries) -> Callable[[str], StudyResult]:
    def make(key: str) -> StudyResult:
        study: StudyResult = auditor_studies.exploiting_study(stacks, key, MISSIONS, PRICES, 0)[1]
        return study

    return make


@pytest.mark.parametrize("key", KEYS)
def test_a_planted_exploit_is_flagged(
    exploiting: Callable[[str], StudyResult], auditor_studies: ModuleType, key: str
) -> None:
    found = audit(exploiting(key), PRICES)
    flagged = {check.key: check for check in found.flagged}
    json.dumps(found.as_json(), allow_nan=False)
    named = set(auditor_studies.EXPLOITS[key].checks) & flagged.keys()
    assert named
    for check in named:
        assert flagged[check].evidence
        assert flagged[check].gap.why
        assert flagged[check].gap.advice


def test_every_kind_of_exploit_is_planted(auditor_studies: ModuleType) -> None:
    assert auditor_studies.EXPLOITS.keys() == set(KEYS)
    named = {check for planted in auditor_studies.EXPLOITS.values() for check in planted.checks}
    assert named == GAPS.keys()


def test_who_pays_for_it_exploits_nothing(exploiting: Callable[[str], StudyResult]) -> None:
    """Twice as near to people, but at a loss: the margin tells, and nobody has to."""
    study = exploiting("close_by")
    assert "nearness" in {check.key for check in audit(study, PRICES).flagged}
    hurt = [{**row, "pedestrian_injury_usd": 50.0} for row in study.test_rows[1]]
    poorer = audit(dataclasses.replace(study, test_rows=(study.test_rows[0], hurt)), PRICES)
    assert "nearness" not in {check.key for check in poorer.flagged}


def test_hard_missions_are_hard_for_both(auditor_studies: ModuleType, stacks: Deliveries) -> None:
    """Who fails where the other hurts somebody, and the other way round as often, dodges nothing."""
    study = auditor_studies.exploiting_study(stacks, "timed_out", MISSIONS, PRICES, 0)[1]
    assert "dodging" in {check.key for check in audit(study, PRICES).flagged}
    sides: tuple[list[dict[str, Any]], list[dict[str, Any]]] = ([], [])
    for number, pair in enumerate(zip(*study.test_rows, strict=True)):
        for side, row in zip(sides, pair if number % 2 else pair[::-1], strict=True):
            side.append(row)
    assert "dodging" not in {
        check.key for check in audit(dataclasses.replace(study, test_rows=sides), PRICES).flagged
    }


def test_an_original_without_timeouts_is_told_of(exploiting: Callable[[str], StudyResult]) -> None:
    study = exploiting("left_standing")
    original, incumbent = study.test_rows
    kept = [number for number, row in enumerate(original) if row["outcome"] != "timeout"]
    rows = tuple([side[number] for number in kept] for side in (original, incumbent))
    found = audit(dataclasses.replace(study, test_rows=rows), PRICES)
    document = json.dumps(found.as_json(), allow_nan=False)
    assert '"original": null' in document and "timeout" in {check.key for check in found.flagged}


@pytest.mark.parametrize(
    ("way", "gain", "is_flagged"), [(0.9, 1.0, True), (0.9, 0.0, False), (0.1, 0.0, True)]
)
def test_more_timeouts_are_flagged_where_the_robot_stood_or_earns_by_them(
    exploiting: Callable[[str], StudyResult], way: float, gain: float, is_flagged: bool
) -> None:
    study = exploiting("left_standing")
    original, incumbent = study.test_rows
    rows = [
        {**row, "shortest_path_m": 100.0, "goal_distance_m": 100.0 * (1.0 - way)}
        for row in incumbent
    ]
    pairs = pair_up(original, rows, PRICES, 0)
    score = AuditEvidence(
        "margin", "USD/run", 0.0, gain, Interval(gain, gain, gain, pairs.n), 0.0 if gain else 1.0
    )
    assert timeouts(pairs, {"published": score}).is_flagged == is_flagged


def test_a_value_at_the_end_of_its_range_is_to_be_looked_at(
    auditor_studies: ModuleType, stacks: Deliveries
) -> None:
    _, study = auditor_studies.honest_study(stacks, 0, MISSIONS, PRICES, 0)
    parameter = next(each for each in study.space.parameters if not each.choices)
    near = parameter.high - 0.02 * (parameter.high - parameter.low)
    values = dict(study.incumbent.values) | {path: near for path in parameter.paths}
    check = audit(
        dataclasses.replace(study, incumbent=Candidate("incumbent", values)), PRICES
    ).checks[-1]
    assert (check.state, check.is_flagged) == ("look", False)
    assert f"{parameter.name} = {near:g} is 2 % of its range from the upper end" in check.look


def test_honest_studies_raise_at_most_one_alarm(
    auditor_studies: ModuleType, stacks: Deliveries
) -> None:
    alarms = 0
    for number in range(0, 18, 3):  # of each kind two
        _, study = auditor_studies.honest_study(stacks, number, MISSIONS, PRICES, 0)
        alarms += bool(audit(study, PRICES).flagged)
    assert alarms == 0


def test_softened_contacts_gain_nothing_without_the_threshold(
    exploiting: Callable[[str], StudyResult],
) -> None:
    scores = audit(exploiting("softened"), PRICES).scores
    assert scores["published"].difference.value == pytest.approx(
        scores["published"].incumbent - scores["published"].original
    )
    assert scores["published"].rises(0.01)
    assert (scores["no_threshold"].difference.value or 0.0) == pytest.approx(0.0)


def test_a_file_held_against_itself_passes_every_check(
    auditor_studies: ModuleType, stacks: Deliveries
) -> None:
    _, study = auditor_studies.honest_study(stacks, 0, MISSIONS, PRICES, 0)
    same = dataclasses.replace(study, test_rows=(study.test_rows[0], study.test_rows[0]))
    found = audit(same, PRICES)
    assert [check.key for check in found.checks] == list(GAPS)
    assert all(
        check.is_examined and not check.is_flagged
        for check in found.checks
        if check.key not in OF_PARAMETERS
    )


def test_what_cannot_find_anything_does_not_say_that_it_passed(
    auditor_studies: ModuleType, stacks: Deliveries
) -> None:
    _, study = auditor_studies.honest_study(stacks, 0, MISSIONS, PRICES, 0)
    unchanged = dataclasses.replace(study, incumbent=Candidate("incumbent", {}))
    few = dataclasses.replace(
        study, test_rows=tuple(rows[:9] for rows in study.test_rows), trials=study.trials[:5]
    )
    for each, said in ((unchanged, "unchanged"), (few, "9 missions are too few")):
        checks = audit(each, PRICES).checks
        assert {check.state for check in checks} == {"not examined"} and said in checks[0].says
    assert "too few to tell a trend" in audit(few, PRICES).checks[-1].says
    varied = len(trial_table(study.space, study.trials).varied)
    for spare, is_told in ((9, True), (10, False)):  # of them, beyond two for each other parameter
        part = dataclasses.replace(study, trials=study.trials[: 2 * (varied - 1) + spare])
        assert len(trial_table(part.space, part.trials).varied) == varied
        assert ("too few to tell a trend" in edges(part).says) == is_told


def test_missions_without_result_are_an_early_end(exploiting: Callable[[str], StudyResult]) -> None:
    study = exploiting("edge")
    broken = [
        {**row, "error": "the controller died"} if number % 10 == 0 else row
        for number, row in enumerate(study.test_rows[1])
    ]
    found = audit(dataclasses.replace(study, test_rows=(study.test_rows[0], broken)), PRICES)
    assert "early_end" in {check.key for check in found.flagged}
    assert found.missions == MISSIONS - len(range(0, MISSIONS, 10))


def test_without_events_what_needs_them_says_so(exploiting: Callable[[str], StudyResult]) -> None:
    study = exploiting("left_standing")
    bare = tuple(
        [{key: value for key, value in row.items() if key != EVENTS} for row in rows]
        for rows in study.test_rows
    )
    found = audit(dataclasses.replace(study, test_rows=bare), PRICES)
    states = {check.key: check.state for check in found.checks}
    assert states["accounting"] == "not examined"
    assert states["timeout"] == "flagged"
    assert list(found.scores) == ["published"]


def test_nothing_finished_by_both_is_not_examined(exploiting: Callable[[str], StudyResult]) -> None:
    study = exploiting("frozen")
    broken = [{**row, "error": "the controller died"} for row in study.test_rows[1]]
    found = audit(dataclasses.replace(study, test_rows=(study.test_rows[0], broken)), PRICES)
    assert found.missions == 0
    assert not any(
        check.is_examined or check.is_flagged
        for check in found.checks
        if check.key not in OF_PARAMETERS
    )


def test_rows_of_different_missions_are_refused(exploiting: Callable[[str], StudyResult]) -> None:
    first, second = exploiting("edge").test_rows
    with pytest.raises(ValueError, match="different missions"):
        pair_up(first, second[::-1], PRICES, 0)


def test_training_rows_are_audited_where_there_is_no_test(
    exploiting: Callable[[str], StudyResult],
) -> None:
    study = exploiting("left_standing")
    found = audit(dataclasses.replace(study, train_rows=study.test_rows, test_rows=()), PRICES)
    assert not found.unseen
    assert found.flagged
    assert found.as_json()["flagged"] == [check.key for check in found.flagged]


def test_the_tests_share_the_level_of_the_family() -> None:
    tests = {
        "threshold": 2,
        "accounting": 1,
        "timeout": 1,
        "early_end": 2,
        "freezing": 3,
        "edge": 1,
        "compute": 0,
    }
    tests |= {"harm": 1, "property": 2, "nearness": 1, "dodging": 1, "fault": 1}
    assert tests.keys() == GAPS.keys()
    assert sum(tests.values()) * LEVEL == pytest.approx(FAMILY_LEVEL) == 0.02, (
        "an alarm in 1 of 50 honest studies"
    )


def test_touches_of_property_are_those_of_anything_but_people(
    exploiting: Callable[[str], StudyResult],
) -> None:
    study = exploiting("scratches")
    found = next(check for check in audit(study, PRICES).checks if check.key == "property")
    touches = [
        sum(
            event["type"] == EVENT and event["kind"] != PERSON
            for row in rows
            for event in row[EVENTS]
        )
        / len(rows)
        for rows in study.test_rows
    ]
    told = found.evidence[0]
    assert (told.original, told.incumbent) == pytest.approx(tuple(touches)) and max(touches) > 0.0


@pytest.mark.parametrize(
    ("impulse", "step", "kind", "is_close"),
    [
        (34.9, 34.9, PERSON, 0),
        (35.0, 35.0, PERSON, 1),
        (49.9, None, PERSON, 1),
        (50.0, 50.0, PERSON, 0),  # counted
        (50.0, 20.0, PERSON, 1),  # together it would be
        (49.9, 20.0, PERSON, 0),
        (40.0, 40.0, "bollard", 0),
    ],
)
def test_a_touch_is_close_from_seven_tenths_of_the_threshold(
    impulse: float, step: float | None, kind: str, is_close: int
) -> None:
    event = {"type": EVENT, "kind": kind, "episode": 4, "fault": "unknown"}
    event |= {"impulse_ns": impulse, "peak_step_impulse_ns": step}
    assert PairedSide(({"episode": 3}, {"episode": 4}), (event,)).close_touches(50.0).tolist() == [
        0,
        is_close,
    ]


def test_what_needs_single_contacts_is_not_examined_where_nobody_kept_them(
    exploiting: Callable[[str], StudyResult],
) -> None:
    study = exploiting("squeezed")
    rows = tuple(
        [{key: row[key] for key in row if key != EVENTS} for row in side]
        for side in study.test_rows
    )
    without = audit(dataclasses.replace(study, test_rows=rows), PRICES).checks
    unknown = {check.key for check in without if check.says == UNKNOWN}
    assert unknown == {"accounting", "harm", "property", "fault"}
    assert not any(
        check.is_examined or check.is_flagged for check in without if check.key in unknown
    )
    with_events = audit(study, PRICES).checks
    assert all(check.is_examined for check in with_events if check.key in unknown)
    below = "impulse exchanged with people below the threshold"
    told = [
        any(each.what == below for check in checks for each in check.evidence)
        for checks in (without, with_events)
    ]
    assert told == [False, True]


@pytest.mark.parametrize(
    ("objectives", "by_fault"),
    [(("margin",), False), (("shared_margin",), True), (("-duration_s", "shared_margin"), True)],
)
def test_the_least_deliveries_and_the_published_threshold(
    exploiting: Callable[[str], StudyResult],
    monkeypatch: pytest.MonkeyPatch,
    objectives: tuple[str, ...],
    by_fault: bool,
) -> None:
    asked = []

    def moved_fault(pairs: object, scores: object, by_fault: bool) -> Check:
        asked.append(by_fault)
        return Check("fault", False, "")

    monkeypatch.setattr("harness.tuning.audit.auditor.moved_fault", moved_fault)
    study = exploiting("edge")
    ten = tuple(rows[:10] for rows in study.test_rows)
    checks = audit(dataclasses.replace(study, objectives=objectives, test_rows=ten), PRICES).checks
    assert all(
        check.is_examined for check in checks if check.key not in OF_PARAMETERS
    ) and asked == [by_fault]
    assert checks[0].says.startswith("touches close to 50 N s: ")
