"""The cost model's page holds the prices that are shipped."""

import re

import pytest

from harness.economics.optional_prices import load_optional_prices
from harness.economics.price import price_keys
from harness.economics.prices import load_prices

from .blocks import ROOT

PAGE = (ROOT / "docs" / "money.md").read_text(encoding="utf-8")
ROWS = dict(re.findall(r"(?m)^\| `(\w+)` \| ([\d.]+)", PAGE))
KINDS = re.findall(r"(?m)^\| ([a-z ]+) \| (\d+)[^|]* \| [a-z]", PAGE)


def test_every_plain_price_is_on_the_page() -> None:
    for prices in (load_prices(), load_optional_prices()):
        for key in price_keys(prices):
            if "." not in key:
                assert float(ROWS[key]) == getattr(prices, key).value, key


def test_property_and_injuries_are_on_the_page() -> None:
    prices = load_prices()
    damage = {kind.replace(" ", "_"): float(value) for kind, value in KINDS}
    assert (
        damage == {kind: getattr(prices.property_damage, kind).value for kind in damage}
        and len(damage) == 6
    )
    for cost in prices.mais_costs:
        assert f"{cost:,.0f} |" in PAGE
    for curve in prices.injury.logistic.curves:
        intercept, slope = curve.intercept, curve.slope_per_mph
        assert f"| {intercept:.4f} | {slope:.4f} |" in PAGE


def test_what_is_worked_out_on_the_page_is_so() -> None:
    prices = load_prices()
    assert f"= {prices.electro_mechanical_efficiency:.3f}" in PAGE
    assert f"= {prices.repair_per_physical_assistance:.2f} USD" in PAGE
    assert f"= {prices.robot_life_runs:,.0f}." in PAGE
    assert f"{prices.injury.reference_vehicle_mass.value} kg" in PAGE
    assert prices.food_price == pytest.approx(31.93) and "31.93 USD" in PAGE
