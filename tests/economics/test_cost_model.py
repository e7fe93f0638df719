"""The cost model against the paper's own tables."""

import dataclasses
import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from harness.economics.break_even import break_even_days, break_even_runs, thresholds
from harness.economics.cost_model import price
from harness.economics.measured import Measured
from harness.economics.prices import load_prices
from harness.report.published import load_published
from navstack.errors import UnknownNameError

FACTS = json.loads((Path(__file__).parent / "facts.json").read_text(encoding="utf-8"))
METHODS = tuple(FACTS["economics_usd_per_run"])
PRICES = load_prices("costnav")
PUBLISHED = load_published()

NOTHING = Measured(
    sla=1.0,
    spoiled=0.0,
    timeout=0.0,
    physical_assistance=0.0,
    avg_velocity_mps=1.0,
    avg_mechanical_power_kw=0.0,
    avg_collision_impulse_ns=0.0,
    avg_collision_delta_v_mps=0.0,
    pedestrian_injury_usd_per_run=0.0,
    avg_runtime_h=0.02,
    avg_distance_km=0.1,
)


def economics_of(method):
    return price(method.measured, method.sensors, method.data_collection, PRICES).as_json()


def assert_equal(actual, expected):
    for key, value in expected.items():
        if value is None:
            assert actual[key] is None, key
        else:
            assert actual[key] == pytest.approx(value, rel=1e-9, abs=0.0), key


@pytest.mark.parametrize("name", METHODS)
def test_published_economics(name):
    assert_equal(economics_of(PUBLISHED.methods[name]), FACTS["economics_usd_per_run"][name])


def test_published_economics_of_the_real_robot():
    assert_equal(
        economics_of(PUBLISHED.real_world_canvas.method), FACTS["real_world_canvas_economics"]
    )


def test_published_methods_are_all_there():
    assert tuple(PUBLISHED.methods) == METHODS
    assert len(METHODS) == 7


@pytest.mark.parametrize("name", METHODS)
def test_published_measurements(name):
    method = PUBLISHED.methods[name]
    assert_equal(dataclasses.asdict(method.measured), FACTS["simulation"][name])
    assert method.episodes == FACTS["cost_parameters"]["evaluation_episodes"]


def test_published_real_robot_agrees_with_its_scenarios():
    real, facts = PUBLISHED.real_world_canvas, FACTS["real_world_canvas"]
    measured = dataclasses.asdict(real.method.measured)
    assert_equal(measured, {k: v for k, v in facts.items() if k not in ("episodes", "scenarios")})
    assert real.method.episodes == len(real.scenarios) == facts["episodes"]
    for ours, theirs in zip(real.scenarios, facts["scenarios"], strict=True):
        assert_equal(dataclasses.asdict(ours), theirs)
    for outcome in ("sla", "spoiled", "timeout", "physical_assistance"):
        assert sum(s.outcome == outcome for s in real.scenarios) / 8 == measured[outcome]
    for thing in ("plant", "fence"):
        assert sum(s.contact == thing for s in real.scenarios) / 8 == measured[f"{thing}_contacts"]
    impulses = [s.impulse_ns for s in real.scenarios if s.impulse_ns is not None]
    assert sum(impulses) / len(impulses) == pytest.approx(
        measured["avg_collision_impulse_ns"], abs=0.005
    )
    assert sum(s.duration_s for s in real.scenarios) / 8 / 3600 == pytest.approx(
        measured["avg_runtime_h"], rel=1e-4
    )
    assert sum(s.distance_m for s in real.scenarios) / 8000 == pytest.approx(
        measured["avg_distance_km"], rel=1e-4
    )


def test_thresholds_round_to_the_printed_ones():
    limits = thresholds(PRICES)
    assert [round(100 * r, 2) for r in (limits.ais1_contact_rate, limits.ais2_contact_rate)] == [
        3.73,
        0.52,
    ]
    assert round(100 * limits.ais3_contact_rate, 2) == 0.12
    assert round(100 * limits.property_contact_rate, 1) == 3.0
    assert round(100 * limits.physical_assistance_rate, 1) == 10.6


LIMITS = thresholds(PRICES)


@pytest.mark.parametrize(
    ("rate", "effect"),
    [
        (LIMITS.spoilage_rate, lambda r: {"sla": 1 - r, "spoiled": r}),
        (LIMITS.timeout_and_physical_assistance_rate, lambda r: {"sla": 1 - r, "timeout": r}),
        (LIMITS.pedestrian_safety_usd_per_run, lambda r: {"pedestrian_injury_usd_per_run": r}),
        (
            LIMITS.property_contact_rate,
            lambda r: {
                f"{k}_contacts": r / 4
                for k in ("mailbox", "trash_bin", "building_glass", "bollard")
            },
        ),
    ],
)
def test_at_a_threshold_the_margin_is_zero(rate, effect):
    def margin(at):
        return price(
            dataclasses.replace(NOTHING, **effect(at)), (), False, PRICES
        ).contribution_margin

    assert margin(rate) == pytest.approx(0.0, abs=1e-12)
    assert margin(0.99 * rate) > 0.0 > margin(1.01 * rate)


def test_at_the_repair_threshold_repair_equals_the_fee():
    measured = dataclasses.replace(NOTHING, physical_assistance=LIMITS.physical_assistance_rate)
    assert price(measured, (), False, PRICES).running.terms["repair"] == pytest.approx(
        PRICES.delivery_fee.value
    )


def test_break_even_of_a_perfect_robot():
    economics = price(NOTHING, ("lidar", "gps"), True, PRICES)
    assert economics.contribution_margin == pytest.approx(3.49)
    assert economics.break_even_runs == pytest.approx((13000 + 2165.79) / 3.49)
    assert economics.break_even_days == pytest.approx(economics.break_even_runs / 25)


@pytest.mark.parametrize("margin", [None, 0.0, -1.0])
def test_no_break_even_without_a_margin(margin):
    runs = break_even_runs(13000.0, margin)
    assert runs is None
    assert break_even_days(runs, PRICES) is None


def test_cargo_not_modelled_leaves_dependent_terms_undefined():
    economics = price(
        dataclasses.replace(NOTHING, sla=None, spoiled=None, timeout=0.1), ("gps",), False, PRICES
    )
    undefined = {key for key, value in economics.as_json().items() if value is None}
    assert undefined == {
        "service_compensation",
        "opex",
        "revenue",
        "contribution_margin",
        "break_even_runs",
        "break_even_days",
    }
    assert economics.hardware_usd == 10000


def test_sensors_are_paid_once_each_and_must_be_known():
    assert price(NOTHING, ["gps", "gps"], False, PRICES).hardware_usd == 10000
    assert price(NOTHING, frozenset({"lidar"}), False, PRICES).hardware_usd == 11000
    with pytest.raises(UnknownNameError, match="did you mean 'lidar'"):
        price(NOTHING, ["lidr"], False, PRICES)


share = st.floats(0.0, 1.0)


@given(
    st.lists(st.tuples(share, share, share, st.floats(0.0, 500.0), share), min_size=1, max_size=20)
)
def test_pricing_deliveries_one_by_one_gives_the_same_mean(deliveries):
    def measured(sla, spoiled, late, injury, mailbox):
        return dataclasses.replace(
            NOTHING,
            sla=sla,
            spoiled=spoiled,
            timeout=late / 2,
            physical_assistance=late / 3,
            pedestrian_injury_usd_per_run=injury,
            mailbox_contacts=mailbox,
        )

    mean = [sum(values) / len(deliveries) for values in zip(*deliveries, strict=True)]
    one_by_one = [price(measured(*d), (), False, PRICES).contribution_margin for d in deliveries]
    whole = price(measured(*mean), (), False, PRICES).contribution_margin
    assert whole == pytest.approx(sum(one_by_one) / len(deliveries), abs=1e-9)


@given(st.lists(st.floats(0.0, 100.0), min_size=4, max_size=4))
def test_opex_is_the_sum_of_its_terms(values):
    pedestrian, power, glass, assistance = values
    measured = dataclasses.replace(
        NOTHING,
        pedestrian_injury_usd_per_run=pedestrian,
        avg_mechanical_power_kw=power,
        building_glass_contacts=glass,
        physical_assistance=assistance / 100,
    )
    e = price(measured, (), False, PRICES)
    assert e.opex == pytest.approx(sum(e.running.terms.values()))
    assert e.contribution_margin == pytest.approx(e.revenue - e.opex)
