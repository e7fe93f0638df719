"""The audit of a study: planted exploits are flagged as what they are, honest optima left alone."""

import dataclasses
import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from harness.audit.auditor import OF_PARAMETERS
from harness.audit.findings import FAMILY_LEVEL, GAPS, LEAST_PAIRS, LEVEL
from harness.audit.hidden import UNKNOWN
from harness.audit.pairs import EVENTS, Conditions
from harness.economics.prices import load_prices
from harness.tuning import study_audit
from harness.tuning.evaluation import Candidate
from harness.tuning.result import StudyResult, trial_table
from harness.tuning.study_audit import audit_study, edges
from tools.auditor_exploits import EXPLOITS
from tools.auditor_studies import drawn_deliveries, exploiting_study, honest_study

PRICES = load_prices("costnav")
MISSIONS = 200
STACKS = drawn_deliveries(np.random.default_rng(3), 100)
OF_EVENTS = {"accounting", "harm", "property", "fault"}


def exploiting(key: str) -> StudyResult:
    return exploiting_study(STACKS, key, MISSIONS, PRICES, 0)[1]


def honest(number: int = 0) -> StudyResult:
    return honest_study(STACKS, number, MISSIONS, PRICES, 0)[1]


def driven(study: StudyResult, change: Callable[[int, dict[str, Any]], Any]) -> StudyResult:
    """The study with other rows of its incumbent."""
    original, incumbent = study.test_rows
    rows = [change(number, dict(row)) for number, row in enumerate(incumbent)]
    return dataclasses.replace(study, test_rows=(original, rows))


def states(study: StudyResult) -> dict[str, str]:
    return {check.key: check.state for check in audit_study(study, PRICES, Conditions()).checks}


@pytest.mark.parametrize("key", EXPLOITS)
def test_a_planted_exploit_is_flagged(key: str) -> None:
    found = audit_study(exploiting(key), PRICES, Conditions())
    flagged = {check.key: check for check in found.flagged}
    document = json.loads(json.dumps(found.as_json(), allow_nan=False))
    assert document["flagged"] == list(flagged)
    named = set(EXPLOITS[key].checks) & flagged.keys()
    assert named and all(flagged[check].evidence for check in named)
    if key == "softened":
        assert found.scores["published"].rises(0.01)
        assert found.scores["no_threshold"].difference.value == pytest.approx(0.0)


def test_who_pays_for_it_exploits_nothing() -> None:
    """Twice as near to people, but at a loss: the margin tells, and nobody has to."""
    study = exploiting("close_by")
    poorer = driven(study, lambda _, row: {**row, "pedestrian_injury_usd": 50.0})
    assert (states(study)["nearness"], states(poorer)["nearness"]) == ("flagged", "passed")


def test_hard_missions_are_hard_for_both() -> None:
    """Who fails where the other hurts somebody, and as often the other way, dodges nothing."""
    study = exploiting("timed_out")
    assert states(study)["dodging"] == "flagged"
    pairs = enumerate(zip(*study.test_rows, strict=True))
    sides = zip(*(pair if number % 2 else pair[::-1] for number, pair in pairs), strict=True)
    assert states(dataclasses.replace(study, test_rows=tuple(sides)))["dodging"] == "passed"


def test_a_value_at_the_end_of_its_range_is_to_be_looked_at() -> None:
    study = honest()
    parameter = next(each for each in study.space.parameters if not each.choices)
    near = parameter.high - 0.02 * (parameter.high - parameter.low)
    values = dict(study.incumbent.values) | {path: near for path in parameter.paths}
    study = dataclasses.replace(study, incumbent=Candidate("incumbent", values))
    check = audit_study(study, PRICES, Conditions()).checks[-1]
    assert check.state == "look"
    assert f"{parameter.name} = {near:g} is 2 % of its range from the upper end" in check.look


@pytest.mark.parametrize("number", range(0, 18, 3))  # of each kind two
def test_honest_studies_raise_no_alarm(number: int) -> None:
    assert not audit_study(honest(number), PRICES, Conditions()).flagged


def test_a_file_held_against_itself_passes_every_check() -> None:
    study = honest()
    found = states(dataclasses.replace(study, test_rows=(study.test_rows[0],) * 2))
    assert list(found) == list(GAPS)
    missing = {"delay", "jerk", "cargo", "truth", "ground"}  # columns that these rows lack
    of_deliveries = found.keys() - OF_PARAMETERS - missing
    assert {found[key] for key in of_deliveries} == {"passed"}
    assert {found[key] for key in missing} == {"not examined"}


def test_what_cannot_find_anything_does_not_say_that_it_passed() -> None:
    study = honest()
    unchanged = dataclasses.replace(study, incumbent=Candidate("incumbent", {}))
    short = tuple(rows[: LEAST_PAIRS - 1] for rows in study.test_rows)
    few = dataclasses.replace(study, test_rows=short, trials=study.trials[:5])
    lost = driven(few, lambda _, row: {**row, "error": "the controller died"})
    told = ("unchanged", "10 of the 11 missions that it needs", "no mission was finished by both")
    for each, said in zip((unchanged, few, lost), told, strict=True):
        checks = audit_study(each, PRICES, Conditions()).checks
        assert {check.state for check in checks} == {"not examined"} and said in checks[0].says
    assert "too few to tell a trend" in checks[-1].says
    varied = len(trial_table(study.space, study.trials).varied)
    for spare, is_told in ((9, True), (10, False)):  # of them, beyond two for each other parameter
        part = dataclasses.replace(study, trials=study.trials[: 2 * (varied - 1) + spare])
        assert ("too few to tell a trend" in edges(part).says) == is_told


def test_missions_without_result_are_an_early_end() -> None:
    error = {"error": "the controller died"}
    study = driven(exploiting("edge"), lambda i, row: row if i % 10 else row | error)
    found = audit_study(study, PRICES, Conditions())
    assert "early_end" in {check.key for check in found.flagged}
    assert found.missions == MISSIONS - len(range(0, MISSIONS, 10))


@pytest.mark.slow
def test_what_needs_single_contacts_is_not_examined_where_nobody_kept_them() -> None:
    study = exploiting("squeezed")
    bare = driven(study, lambda _, row: {key: row[key] for key in row if key != EVENTS})
    found = audit_study(bare, PRICES, Conditions())
    assert {check.key for check in found.checks if check.says == UNKNOWN} == OF_EVENTS
    assert list(found.scores) == ["published"]
    assert "not examined" not in {states(study)[key] for key in OF_EVENTS}
    below = "impulse exchanged with people below the threshold"
    for each, is_told in ((bare, False), (study, True)):
        checks = audit_study(each, PRICES, Conditions()).checks
        assert any(part.what == below for check in checks for part in check.evidence) is is_told


def test_rows_of_different_missions_are_refused() -> None:
    study = exploiting("edge")
    other = driven(study, lambda number, row: row | {"episode": number + 1})
    with pytest.raises(ValueError, match="different missions"):
        audit_study(other, PRICES, Conditions())


def test_training_rows_are_audited_where_there_is_no_test() -> None:
    study = exploiting("frozen")
    study = dataclasses.replace(study, train_rows=study.test_rows, test_rows=())
    assert not study.is_tested and states(study)["freezing"] == "flagged"


def test_the_tests_share_the_level_of_the_family() -> None:
    of_two = {"threshold", "early_end", "property", "ground"}
    tests = {key: 1 + (key in of_two) for key in GAPS} | {"freezing": 3, "compute": 0}
    assert sum(tests.values()) * LEVEL == pytest.approx(FAMILY_LEVEL) == 0.02
    assert 2.0**-LEAST_PAIRS < LEVEL < 2.0 ** (1 - LEAST_PAIRS)


@pytest.mark.parametrize(
    ("objectives", "by_fault"),
    [(("margin",), False), (("shared_margin",), True), (("-duration_s", "shared_margin"), True)],
)
def test_the_auditor_knows_what_was_tuned_for(
    monkeypatch: pytest.MonkeyPatch,
    objectives: tuple[str, ...],
    by_fault: bool,
) -> None:
    asked: list[Any] = []
    real = study_audit.audit

    def audit(*given: Any) -> Any:
        asked.append(given[1:])
        return real(*given)

    monkeypatch.setattr(study_audit, "audit", audit)
    study = dataclasses.replace(exploiting("edge"), objectives=objectives)
    checks = audit_study(study, PRICES, Conditions(threshold=40.0)).checks
    assert asked == [(Conditions(threshold=40.0), by_fault)]
    assert checks[0].says.startswith("touches close to 40 N s: ")
