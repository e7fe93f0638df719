"""The tests against the published rows, on made-up readings and against scipy."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binomtest, fisher_exact

from harness.calibration.reading import INJURY, MEANS, Reading, read_run
from harness.calibration.verification import count_tests, predictions, share_tests
from harness.report.published import load_published
from harness.statistics import Interval, fisher_p, rates_p
from harness.stored_run import load_run
from harness.valuation import OUTCOMES

PUBLISHED = load_published()
AS_PUBLISHED = {"paper-gps": (184, 116, 12, 88), "paper-amcl": (172, 48, 48, 132)}  # the published shares of 400


def reading(stack, counts, n=400, property_contacts=0, injury_rate=0.05, **means):
    values = {key: Interval(means.get(key, 1.0), None, None, n) for key in MEANS}
    rate = Interval(injury_rate, None, None, n)
    by_outcome = dict(zip(OUTCOMES, counts, strict=True))
    return Reading(Path(stack), stack, 0, n, 0, by_outcome, values, rate, rate, property_contacts, {})


def both(**counts):
    return {stack: reading(stack, counts.get(stack, known)) for stack, known in AS_PUBLISHED.items()}


def test_fisher_knows_the_lady_tasting_tea():
    assert fisher_p(3, 4, 1, 4) == pytest.approx(34 / 70)  # Fisher 1935
    assert fisher_p(4, 4, 0, 4) == pytest.approx(2 / 70)


@given(st.integers(1, 60), st.integers(1, 60), st.data())
def test_fisher_agrees_with_scipy(n, m, data):
    a, b = data.draw(st.integers(0, n)), data.draw(st.integers(0, m))
    assert fisher_p(a, n, b, m) == pytest.approx(fisher_exact([[a, n - a], [b, m - b]])[1], abs=1e-9)


@given(st.integers(0, 30), st.integers(0, 30), st.integers(1, 400), st.integers(1, 400))
def test_rates_agree_with_the_binomial_test(a, b, n, m):
    expected = binomtest(a, a + b, n / (n + m)).pvalue if a + b else 1.0
    assert rates_p(a, n, b, m) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("counts", [(5, 4, 1, 4), (-1, 4, 1, 4)])
def test_impossible_counts_are_refused(counts):
    with pytest.raises(ValueError, match="successes must lie in"):
        fisher_p(*counts)


def test_the_published_shares_themselves_are_not_rejected():
    tests = share_tests(both(), PUBLISHED)
    assert len(tests) == 8
    assert [(test.ours.value, test.theirs / test.theirs_n) for test in tests if test.stack == "paper-gps"] == [
        (0.46, 0.46), (0.29, 0.29), (0.03, 0.03), (0.22, 0.22)]  # fmt: skip
    assert all(test.p == pytest.approx(1.0) and not test.is_rejected for test in tests)


def test_one_wrong_share_is_rejected_and_the_others_pay_for_the_family():
    tests = {(t.stack, t.outcome): t for t in share_tests(both(**{"paper-gps": (240, 60, 12, 88)}), PUBLISHED)}
    spoiled, sla = tests["paper-gps", "spoiled"], tests["paper-gps", "sla"]
    assert spoiled.p == pytest.approx(fisher_exact([[60, 340], [29, 71]])[1])
    assert spoiled.p_holm == pytest.approx(8 * spoiled.p)
    assert sla.p_holm == pytest.approx(7 * sla.p)
    assert spoiled.is_rejected
    assert sla.p < 0.05
    assert not sla.is_rejected  # 0.6 against 0.46: alone it would be


def test_a_stack_that_was_not_driven_is_not_tested():
    assert {test.stack for test in share_tests({"paper-gps": both()["paper-gps"]}, PUBLISHED)} == {"paper-gps"}


@pytest.mark.parametrize(
    ("quantity", "value", "holds"),
    [
        (INJURY, 20.58 * 1.49, True),
        (INJURY, 20.58 * 1.51, False),
        (INJURY, 20.58 / 1.49, True),
        (INJURY, 20.58 / 1.51, False),
        ("avg_collision_impulse_ns", 82.42 * 1.29, True),
        ("avg_collision_impulse_ns", 82.42 * 0.69, False),
        ("avg_distance_km", 0.08623 * 0.76, True),
        ("avg_distance_km", 0.08623 * 1.26, False),
        ("avg_runtime_h", 1.0, None),
        ("avg_velocity_mps", 9.0, None),
    ],
)
def test_predictions_hold_within_their_gates(quantity, value, holds):
    readings = {"paper-gps": reading("paper-gps", AS_PUBLISHED["paper-gps"], **{quantity: value})}
    (found,) = (each for each in predictions(readings, PUBLISHED) if each.quantity == quantity)
    assert found.holds is holds


def test_the_distance_of_amcl_has_no_gate():
    found = {(each.stack, each.quantity): each.holds for each in predictions(both(), PUBLISHED)}
    assert found["paper-amcl", "avg_distance_km"] is None


@pytest.mark.parametrize(("cost", "holds"), [(9.30, True), (9.30 * 1.49, True), (9.30 * 1.51, False)])
def test_standing_is_compared_over_the_time_that_navdp_stands(cost, holds):
    seconds = 0.047675 * 3600.0  # of NavDP
    (found,) = predictions({"parked": reading("parked", (0, 0, 400, 0), injury_rate=cost / seconds)}, PUBLISHED)
    assert found.ours.value == pytest.approx(cost)
    assert found.holds is holds


def test_contacts_with_property_are_tested_as_rates():
    readings = {"paper-gps": reading("paper-gps", AS_PUBLISHED["paper-gps"], property_contacts=8)}
    (alike,) = count_tests(readings, PUBLISHED)
    assert (alike.ours, alike.ours_n, alike.theirs, alike.theirs_n) == (8, 400, 2, 100)
    assert not alike.is_rejected
    readings = {"paper-gps": reading("paper-gps", AS_PUBLISHED["paper-gps"], property_contacts=80)}
    assert count_tests(readings, PUBLISHED)[0].is_rejected


def test_a_run_is_read(write_world_run):
    run = load_run(str(write_world_run("run", episodes=30, seed=3)))
    rows = run.stacks[0].rows
    found = read_run(run)
    assert (found.stack, found.n, found.seed, found.settings) == ("paper-gps", 30, 3, {})
    assert found.counts["sla"] == sum(row["outcome"] == "sla" for row in rows)
    cost, seconds = (sum(row[key] for row in rows) for key in ("pedestrian_injury_usd", "duration_s"))
    assert found.injury_per_second.value == pytest.approx(cost / seconds)
    assert found.injury_per_second.low < cost / seconds < found.injury_per_second.high
    assert found.means[INJURY].value == pytest.approx(cost / 30)
    assert found.property_contacts == sum(row["mailbox_contacts"] for row in rows)
