"""Objectives: what they count, and what they refuse."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.audit.pairs import EVENTS
from harness.economics.contact_costs import injury_costs
from harness.economics.prices import load_prices
from harness.metrics.columns import EPISODE_COLUMNS
from harness.storage.tables import read_rows
from harness.tuning.evaluation import MARGIN, SHARED_MARGIN
from harness.tuning.objective import UndefinedError, parse_objectives, score_text
from harness.tuning.progress import expected_gain
from harness.tuning.stack_evaluator import SHARED_FAULT, margin_of
from navstack.errors import InputError

STORED = Path(__file__).parents[3] / "results" / "baseline" / "urban" / "sidewalk_1"
RNG = np.random.default_rng(3)
ROWS: list[dict[str, Any]] = [
    {
        MARGIN: float(margin),
        "outcome": "sla" if margin > 0.0 else "timeout",
        "duration_s": 10.0 + number,
        "spl": None,
    }
    for number, margin in enumerate(
        np.where(RNG.random(40) < 0.2, RNG.uniform(-45.0, -27.0, 40), 3.49)
    )
]
MARGINS = np.array([row[MARGIN] for row in ROWS])


def value(name: str, total: int = 40) -> float:
    return parse_objectives(name)[0].value(ROWS, total)


def test_values_are_their_formulas() -> None:
    assert value("margin") == pytest.approx(MARGINS.mean())
    assert value("cvar") == pytest.approx(0.5 * MARGINS.mean() + 0.5 * np.sort(MARGINS)[:4].mean())
    error = MARGINS.std(ddof=1) / np.sqrt(40)
    assert value("lower_bound") == pytest.approx(MARGINS.mean() - 1.68488 * error, abs=1e-3)
    assert value("lower_bound", 160) > value("lower_bound")
    assert value("duration_s") == value("-duration_s") == -29.5 and value("+duration_s") == 29.5
    share = np.mean([row["outcome"] == "sla" for row in ROWS])
    assert value("sla") == pytest.approx(share)
    assert value("margin@sla>=0.1") == pytest.approx(MARGINS.mean())
    assert (
        parse_objectives("margin")[0].shortfall(ROWS)
        == 0.0
        < parse_objectives("margin@sla>=0.99")[0].shortfall(ROWS)
    )
    assert value("margin@sla>=0.99") == pytest.approx(MARGINS.mean() - 1000.0 * (0.99 - share))


def test_a_score_that_rounds_to_nothing_has_no_sign() -> None:
    assert score_text("margin", -0.001) == "0.00"
    assert score_text("margin", -0.01) == "-0.01"


def test_a_lower_bound_needs_two_deliveries() -> None:
    """Student's t of one degree of freedom is 6.3138 at 95 % one-sided."""
    bound = parse_objectives("lower_bound")[0]
    rows = [{**ROWS[0], MARGIN: 3.0}, {**ROWS[0], MARGIN: 1.0}]
    assert bound.value(rows[:1], 1) == 3.0
    assert bound.value(rows, 2) == pytest.approx(
        2.0 - 6.3138 * np.sqrt(2.0) / np.sqrt(2.0), abs=1e-3
    )


def test_scores_have_the_objective_as_their_mean() -> None:
    for name in ("margin", "cvar", "duration_s", "sla"):
        objective = parse_objectives(name)[0]
        assert objective.scores(ROWS, ROWS).mean() == pytest.approx(objective.value(ROWS, 40))
    objective = parse_objectives("cvar")[0]
    assert objective.scores(ROWS[:20], ROWS).mean() <= objective.value(ROWS[:20], 20) + 1e-9


def test_side_condition_is_hopeless_only_when_it_is() -> None:
    objective = parse_objectives("margin@sla>=0.9")[0]
    late = [{**ROWS[0], "outcome": "timeout"}] * 8
    assert objective.is_hopeless(late) and not objective.is_hopeless(
        [{**ROWS[0], "outcome": "sla"}] * 8
    )


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("margn", "did you mean 'margin'?"),
        ("--duration_s", "unknown objective"),
        ("margin,margin", "twice"),
        ("margin@sla>=1.5", "give a share"),
        ("margin@spoiled>=0.5", "give a share"),
    ],
)
def test_unknown_ones_are_refused(name: str, said: str) -> None:
    with pytest.raises(InputError, match="objective") as raised:
        parse_objectives(name)
    assert said in str(raised.value)


def test_undefined_values_are_said_to_be() -> None:
    with pytest.raises(UndefinedError, match="no delivery has a value of spl"):
        value("spl")
    with pytest.raises(UndefinedError, match="nobody models its cargo"):
        parse_objectives("margin")[0].value([{MARGIN: None}], 1)


def test_expected_gain_is_that_of_the_normal_distribution() -> None:
    values = list(np.random.default_rng(0).normal(0.0, 1.0, 2000))
    later = np.array(values[1000:])
    draws = (
        np.random.default_rng(1).normal(later.mean(), later.std(ddof=1), (200_000, 10)).max(axis=1)
    )
    assert expected_gain(values, 1.5, 0.0, 10) == pytest.approx(
        np.maximum(draws - 1.5, 0.0).mean(), rel=0.02
    )
    only = np.maximum(
        np.random.default_rng(1).normal(later.mean(), later.std(ddof=1), 400_000) - 0.5, 0.0
    ).mean()
    assert expected_gain(values, 0.5, 0.0, 1) == pytest.approx(only, rel=0.02)
    for scale in (0.1, 10.0):
        scaled = [scale * value for value in values]
        gain = expected_gain(scaled, 1.5 * scale, 0.0, 10)
        assert gain == pytest.approx(scale * (expected_gain(values, 1.5, 0.0, 10) or 0.0), rel=1e-6)
    assert (
        expected_gain(values[:9], 1.5, 0.0, 10) is None
        and expected_gain(values[:10], 1.5, 0.0, 10) is not None
    )
    assert (
        expected_gain(values[:5], 1.5, 0.0, 10) is None
        and expected_gain(values, 1.5, 0.0, 0) == 0.0
    )
    assert (expected_gain(values, 1.5, 2.0, 10) or 0.0) == 0.0, "all of the spread is noise"


def test_capped_margins_count_no_delivery_for_more_than_the_cap() -> None:
    rows = [{MARGIN: margin, SHARED_MARGIN: margin - 20.0} for margin in (3.49, -900.0, -40.0)]
    assert parse_objectives("capped_margin")[0].value(rows, 3) == pytest.approx(
        (3.49 - 100.0 - 40.0) / 3.0
    )
    assert parse_objectives("shared_margin")[0].value(rows, 3) == pytest.approx(
        (-16.51 - 100.0 - 60.0) / 3.0
    )
    with pytest.raises(UndefinedError, match="'shared_margin' needs a margin"):
        parse_objectives("shared_margin")[0].value([{MARGIN: None, SHARED_MARGIN: None}], 1)


def test_shared_margin_pays_for_soft_contacts_by_the_share_of_the_fault() -> None:
    prices = load_prices("costnav")
    row: dict[str, Any] = read_rows(STORED / "episodes.parquet", EPISODE_COLUMNS)[0]
    row |= {"pedestrian_injury_usd": 0.0, "pedestrian_contacts": 0, "outcome": "sla"}
    row[MARGIN] = margin_of(row, prices)
    assert row[MARGIN] is not None
    touch = {
        "type": "contact_event",
        "kind": "pedestrian",
        "impulse_ns": 20.0,
        "fault": "robot_into_person",
    }
    touch |= {"robot_speed_mps": 1.5, "partner_speed_mps": 0.5}
    standing = {**touch, "fault": "person_into_standing_robot", "robot_speed_mps": 0.0}
    cost = float(injury_costs(20.0, prices))
    assert margin_of({**row, EVENTS: [touch, standing]}, prices, SHARED_FAULT) == pytest.approx(
        row[MARGIN] - 0.75 * cost
    )
    assert margin_of({**row, EVENTS: []}, prices, SHARED_FAULT) == pytest.approx(row[MARGIN])
    assert (
        margin_of({"error": "its worker died", MARGIN: None, EVENTS: []}, prices, SHARED_FAULT)
        is None
    )
