"""The price file: complete, sourced, and strictly read."""

import dataclasses
import json
from pathlib import Path

import pytest

from harness.economics.prices import Price, load_prices
from harness.storage.shipped import shipped
from navstack.errors import InputError, ParameterError

FACTS = json.loads((Path(__file__).parent / "facts.json").read_text(encoding="utf-8"))[
    "cost_parameters"
]
PRICES = load_prices("costnav")
SHIPPED = (shipped("params") / "prices" / "costnav.yaml").read_text(encoding="utf-8")


def all_prices(group):
    for entry in dataclasses.fields(group):
        value = getattr(group, entry.name)
        if isinstance(value, Price):
            yield entry.name, value
        elif dataclasses.is_dataclass(value):
            yield from all_prices(value)


@pytest.mark.parametrize(
    ("name", "fact"),
    [
        ("robot_cost", "robot_cost_usd"),
        ("lidar_cost", "lidar_cost_usd"),
        ("gps_cost", "gps_cost_usd"),
        ("robot_life", "robot_life_years"),
        ("deliveries_per_day", "deliveries_per_day"),
        ("data_collector_wage", "data_collector_wage_usd_per_h"),
        ("data_collection_time", "data_collector_working_time_h"),
        ("delivery_fee", "delivery_fee_usd_per_run"),
        ("refund", "refund_usd_per_run"),
        ("physical_assistance_baseline", "physical_assistance_baseline_rate"),
        ("annual_repair_rate", "annual_repair_rate"),
        ("electricity", "electricity_usd_per_kwh"),
        ("robot_mass", "robot_mass_kg"),
        ("rolling_resistance_coefficient", "rolling_resistance_coefficient"),
    ],
)
def test_values_are_the_papers(name, fact):
    assert getattr(PRICES, name).value == FACTS[fact]


def test_derived_values_are_the_papers():
    assert PRICES.robot_life_runs == FACTS["robot_life_runs"]
    assert PRICES.food_price == pytest.approx(FACTS["food_price_usd_per_run"], rel=1e-12)
    assert PRICES.electro_mechanical_efficiency == pytest.approx(
        FACTS["efficiency"]["electro_mechanical"], rel=1e-12
    )
    assert PRICES.injury_mass_factor == pytest.approx(FACTS["injury_mass_adjustment"], rel=1e-12)
    assert PRICES.rolling_resistance_force == pytest.approx(
        FACTS["rolling_resistance_force_n"], rel=1e-12
    )
    assert dict(zip("0123", PRICES.mais_costs, strict=True)) == FACTS["mais_cost_usd"]
    damage = PRICES.property_damage
    assert {f.name: getattr(damage, f.name).value for f in dataclasses.fields(damage)} == FACTS[
        "property_damage_usd"
    ]


def test_every_price_names_the_papers_symbol_and_a_source():
    entries = list(all_prices(PRICES))
    assert len(entries) == 29
    for name, entry in entries:
        symbol, _, source = entry.source.partition(": ")
        assert symbol and source, name


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("robot_cost:", "robot_cots:", "unknown key 'robot_cots'; did you mean 'robot_cost'"),
        (
            "    mais_3:\n      value: 261200",
            "    mais_3:\n      valeu: 261200",
            "costs: mais_3.*did you mean 'value'",
        ),
        (
            "unit: USD/kWh",
            "unit: EUR/kWh",
            "electricity: is given in 'EUR/kWh'; convert it to 'USD/kWh'",
        ),
        ("value: 0.002", "value: 0", "physical_assistance_baseline: 0 lies outside 1e-09"),
        ("value: 0.99", "value: 1.2", "inverter_efficiency: 1.2 lies outside 1e-09..1"),
        ("value: 3000", "value: -3000", "lidar_cost: -3000 lies outside 0"),
        ("value: 35.42", "value: 0", "refund: 0 lies outside 1e-09"),
        ("value: 35.42", "value: 2", "refund 2 USD is less than the delivery_fee 3.49 USD"),
        ("value: 8000", "value: .inf", "robot_cost: value: inf is not a finite number"),
    ],
)
def test_a_wrong_price_file_is_refused_in_one_line(tmp_path, old, new, message):
    assert SHIPPED.count(old) == 1
    file = tmp_path / "mine.yaml"
    file.write_text(SHIPPED.replace(old, new), encoding="utf-8")
    with pytest.raises(ParameterError, match=message) as caught:
        load_prices(str(file))
    assert "\n" not in str(caught.value)


def test_an_unknown_name_offers_the_nearest():
    with pytest.raises(InputError, match="did you mean 'costnav'"):
        load_prices("cosnav")


@pytest.mark.parametrize("base", ["costnav", "europe"])  # the second one builds on the first
def test_a_file_that_builds_on_another_says_what_differs(tmp_path, base):
    """A price is replaced as a whole, its bounds too; a group of prices entry by entry."""
    file, own = tmp_path / "own.yaml", "value: 3.0\n{0}  unit: {1}\n{0}  source: own\n"
    lines = (
        "delivery_fee:\n  " + own.format("", "USD/run"),
        "injury:\n  costs:\n    mais_2:\n      ",
    )
    file.write_text(
        f"as_in: {base}\n{lines[0]}{lines[1]}{own.format('    ', 'USD/event')}", encoding="utf-8"
    )
    before = load_prices(base)
    costs = dataclasses.replace(before.injury.costs, mais_2=Price(3.0, "USD/event", "own"))
    injury = dataclasses.replace(before.injury, costs=costs)
    assert load_prices(str(file)) == dataclasses.replace(
        before, delivery_fee=Price(3.0, "USD/run", "own"), injury=injury
    )
    assert before.injury.costs.mais_2.value != 3.0 != before.delivery_fee.value


@pytest.mark.parametrize(
    ("text", "message"), [("as_in: cosnav\n", "did you mean 'costnav'"), ("- 3\n", "own.yaml")]
)
def test_what_builds_on_nothing_known_is_refused(tmp_path, text, message):
    file = tmp_path / "own.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        load_prices(str(file))
