"""The injury model against a plain Python twin and the known costs."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.economics.contact_costs import (
    SEVERITIES,
    injury_cost,
    injury_costs,
    mais_probabilities,
    monotone_injury_costs,
)
from harness.economics.prices import Logistic, load_prices

MODEL = load_prices("costnav")
WANG_2022 = (
    (-1.3925, 0.0815),
    (-5.1331, 0.1479),
    (-6.9540, 0.1637),
    (-8.2070, 0.1564),
    (-8.7927, 0.1598),
    (-8.9819, 0.1603),
)


CURVES = MODEL.injury.logistic.curves
CROSSING = [
    Logistic(intercept, 0.1) for intercept in (-1.0, 1.0, -2.0, -3.0, -4.0, -5.0)
]  # the second is above the first


def twin(delta_v):
    """Probabilities of MAIS 0..5 and fatal, by hand."""
    if delta_v <= 0:
        return [1.0, 0, 0, 0, 0, 0, 0]
    at_least = [1.0] + [1 / (1 + math.exp(-(b0 + b1 * 2.23694 * delta_v))) for b0, b1 in WANG_2022]
    for k in range(1, 7):
        at_least[k] = min(at_least[k], at_least[k - 1])
    return [at_least[k] - (at_least[k + 1] if k < 6 else 0.0) for k in range(7)]


def test_cost_of_the_least_contact_that_counts():
    assert float(injury_cost(1.0, MODEL)) == pytest.approx(31.3, abs=0.05)


def test_cost_at_the_robots_top_speed():
    assert float(injury_cost(3.56, MODEL)) == pytest.approx(48.7, abs=0.1)


@pytest.mark.parametrize("delta_v", [0.0, -2.0])
def test_no_change_of_velocity_is_mais_0_with_certainty(delta_v):
    assert mais_probabilities(delta_v, CURVES).tolist() == [1, 0, 0, 0, 0, 0, 0]
    assert float(injury_cost(delta_v, MODEL)) == pytest.approx(50 / 4535.924 * 380)


@given(st.floats(-5.0, 60.0))
def test_probabilities_equal_the_twin(delta_v):
    np.testing.assert_allclose(mais_probabilities(delta_v, CURVES), twin(delta_v), atol=1e-12)


def test_arrays_keep_their_shape():
    delta_v = np.array([[0.5, 1.0, 0.0], [2.0, 10.0, -1.0]])
    probabilities = mais_probabilities(delta_v, CURVES)
    assert probabilities.shape == (2, 3, len(SEVERITIES))
    np.testing.assert_allclose(probabilities[1, 1], twin(10.0), atol=1e-12)
    costs = (380, 8487, 60464, 261200)
    expected = [
        [50 / 4535.924 * sum(p * c for p, c in zip(twin(v), costs, strict=False)) for v in row]
        for row in delta_v
    ]
    np.testing.assert_allclose(injury_cost(delta_v, MODEL), expected, rtol=1e-12)
    assert injury_cost([], MODEL).shape == (0,)


@given(st.floats(0.01, 100.0))
def test_crossing_curves_are_cut_down(delta_v):
    probabilities = mais_probabilities(delta_v, CROSSING)
    assert (probabilities >= 0.0).all()
    assert probabilities.sum() == pytest.approx(1.0)
    assert probabilities[1] == 0.0  # MAIS >= 2 was cut down to MAIS >= 1


def test_risk_and_cost_rise_with_speed_in_the_robots_range():
    speeds = np.linspace(0.0, 10.0, 201)
    at_least = 1.0 - np.cumsum(mais_probabilities(speeds, CURVES), axis=-1)[:, :-1]
    assert (np.diff(at_least, axis=0) >= -1e-15).all()
    assert (np.diff(injury_cost(speeds, MODEL)) > 0.0).all()


def test_what_is_not_a_number_does_not_pass_for_harmless():
    assert math.isnan(float(injury_cost(math.nan, MODEL)))


def test_the_monotone_cost_is_the_published_one_up_to_its_peak():
    impulses = np.linspace(0.0, 1041.0, 500)
    np.testing.assert_array_equal(
        monotone_injury_costs(impulses, MODEL), injury_costs(impulses, MODEL)
    )


def test_the_monotone_cost_never_falls_and_grows_by_that_of_severe_injuries():
    impulses = np.linspace(0.0, 5000.0, 20_000)
    costs = monotone_injury_costs(impulses, MODEL)
    assert (np.diff(costs) >= 0.0).all()
    peak = impulses[injury_costs(impulses, MODEL).argmax()] / 50.0
    # MAIS 4, 5 and fatal in shares of a statistical life
    prices = np.array([0.266, 0.593, 1.0]) * 13.2e6
    severe = (np.array(twin(40.0)[4:]) - np.array(twin(peak)[4:])) @ prices
    expected = 50.0 / 4535.924 * severe + float(injury_cost(40.0, MODEL))
    assert float(monotone_injury_costs(2000.0, MODEL)) == pytest.approx(expected, rel=1e-3)
