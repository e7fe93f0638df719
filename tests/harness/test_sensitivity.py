"""Which prices a stored run's profit depends on."""

import json
import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from harness.analysis.evaluator import profits
from harness.analysis.repricing import choose, reprice, repricing_document
from harness.analysis.sensitivity import TornadoBar, break_even_spread, sensitivities
from harness.economics.accountings import ACCOUNTINGS
from harness.economics.price import price_keys, with_values
from harness.report.sensitivity import _tornado
from harness.study.stored_run import load_run
from navbench.cli.price import price
from navbench.cli.values import names_of, pairs_of, settings_of
from navstack.errors import InputError


def print_sensitivity(
    run,
    settings=None,
    terms=(),
    maps=(),
    out=None,
    as_json=False,
):
    """Print what the command does."""
    choices = {"maps": maps, "out": out, "is_full": True, "as_json": as_json}
    price.callback(str(run), None, settings or {}, terms, is_sensitivity=True, **choices)


@pytest.fixture
def varied(write_run, capsys):
    def vary(*maps, settings=(), terms=()):
        run = write_run("run")
        values = settings_of(settings), names_of(terms), pairs_of(maps)
        print_sensitivity(run, *values, as_json=True)
        return run, json.loads(capsys.readouterr().out)

    return vary


def margin_and_profit(run, settings):
    """The slow way: price the whole run again."""
    stored = load_run(str(run))
    choices = choose(stored, None, settings_of(settings), ())
    economics = repricing_document(stored, reprice(stored, choices), choices)["runs"][0][
        "economics"
    ]
    margin = economics["contribution_margin"]
    return margin, margin - economics["capex_usd"] / choices.prices.robot_life_runs


def test_the_tornado_has_every_price_the_widest_first(varied):
    run, result = varied()
    bars = result["runs"][0]["tornado"]
    assert {bar["price"] for bar in bars} == set(price_keys(load_run(str(run)).prices()))
    swings = [abs(np.diff(bar["profit_usd_per_run"])[0]) for bar in bars]
    assert swings == sorted(swings, reverse=True)
    by_key = {bar["price"]: bar for bar in bars}
    assert (by_key["annual_repair_rate"]["low"], by_key["annual_repair_rate"]["high"]) == (0.1, 0.2)
    assert by_key["annual_repair_rate"]["range"] == "source"
    assert (by_key["delivery_fee"]["low"], by_key["delivery_fee"]["range"]) == (
        pytest.approx(2.792),
        "20 %",
    )
    assert by_key["charge_efficiency"]["high"] == 1.0  # no more than all


@pytest.mark.parametrize(
    "key", ["delivery_fee", "robot_mass", "injury.costs.mais_1", "robot_life", "electricity"]
)
def test_its_ends_are_those_of_the_run_priced_again(varied, key):
    run, result = varied()
    bar = next(bar for bar in result["runs"][0]["tornado"] if bar["price"] == key)
    for end, place in (("low", 0), ("high", 1)):
        expected = margin_and_profit(run, (f"{key}={bar[end]}",))
        assert (
            bar["contribution_margin"][place],
            bar["profit_usd_per_run"][place],
        ) == pytest.approx(expected)


@pytest.mark.parametrize("accounting", ACCOUNTINGS)
def test_profit_and_its_ends_are_by_the_accounting_of_the_prices(write_run, accounting):
    run = load_run(str(write_run("run", episodes=30, crowd=3.0)))
    published = choose(run, None, {}, ())
    chosen = replace(published, prices=replace(published.prices, accounting=accounting))
    (found,) = sensitivities(run, chosen, [])

    def margin_at(key, number):
        prices = with_values(chosen.prices, {key: number})
        (result,) = reprice(run, replace(chosen, prices=prices))
        return result.accountings[accounting].intervals["contribution_margin"].value

    today = pytest.approx(margin_at("refund", 35.42), abs=1e-3)
    assert found.economics.contribution_margin == today
    assert np.mean(profits(run, run.stacks[0], chosen)) == today
    bars = {bar.price: bar for bar in found.bars}
    for key in ("robot_mass", "injury.costs.mais_1", "property_damage.mailbox"):
        bar = bars[key]
        ends = [margin_at(key, number) for number in (bar.low, bar.high)]
        assert bar.contribution_margin == pytest.approx(ends, abs=1e-3), key  # electricity


def test_too_many_deliveries_without_a_result_have_no_profit_to_vary(write_run, navbench):
    def fail(row):
        if row["episode"] == 3:
            row["error"] = "world: gone"

    run = write_run("run", episodes=10, change=fail)
    status, told, said = navbench("price", run, "--sensitivity")
    assert (status, told) == (1, "")
    assert "mine: the margin is undefined, because 1 of 10 deliveries have no result" in said
    assert "navbench run --resume DIR --retry-errors" in said
    _, told, _ = navbench("price", run)
    assert "depends most on" not in told
    assert told.splitlines()[-1] == f"next: navbench report {run}"


def test_a_map_is_the_run_priced_again_at_both_prices(varied):
    run, result = varied("delivery_fee,property_damage.mailbox", "robot_cost,injury.costs")
    first, second = result["runs"][0]["maps"]
    i, j = 12, 7
    x, y = first["x"]["values"][j], first["y"]["values"][i]
    settings = (f"delivery_fee={x}", f"property_damage.mailbox={y}")
    assert first["profit_usd_per_run"][i][j] == pytest.approx(margin_and_profit(run, settings)[1])
    assert (second["y"]["unit"], second["y"]["values"][-1]) == ("factor", 3.0)
    x, factor = second["x"]["values"][j], second["y"]["values"][i]
    costs = {"mais_0": 380, "mais_1": 8487, "mais_2": 60464, "mais_3": 261200}
    settings = (
        f"robot_cost={x}",
        *(f"injury.costs.{key}={factor * cost}" for key, cost in costs.items()),
    )
    assert second["profit_usd_per_run"][i][j] == pytest.approx(margin_and_profit(run, settings)[1])


def test_optional_terms_bring_their_prices(varied):
    _, result = varied(terms=("battery_wear",))
    bars = {bar["price"]: bar for bar in result["runs"][0]["tornado"]}
    assert (bars["battery_cycles"]["low"], bars["battery_cycles"]["high"]) == (500, 3000)
    assert (
        bars["battery_cycles"]["profit_usd_per_run"][0]
        < bars["battery_cycles"]["profit_usd_per_run"][1]
    )
    assert "survey_time" not in bars


def test_break_even_never_comes_for_a_run_that_loses(varied):
    _, result = varied()
    spread = result["runs"][0]["break_even"]
    assert spread["never"] == 1.0
    assert spread["runs"] == {"value": None, "low": None, "high": None}
    assert max(spread["probability"]) < 1e-6


def test_break_even_spread_of_known_means():
    means = np.linspace(0.5, 1.5, 1001)
    spread = break_even_spread(1000.0, means, np.full(1001, 0.1))
    assert np.median(spread.runs) == pytest.approx(1000.0)
    assert spread.never == 0.0
    assert np.interp(1000.0, spread.curve_runs, spread.curve_probability) == pytest.approx(
        0.5, abs=0.08
    )


@pytest.mark.parametrize(
    ("maps", "message"),
    [
        (("delivery_fee",), "is not two prices X,Y"),
        (("delivery_fee,delivery_fee",), "delivery_fee on both axes"),
        (("injury.costs,injury.costs.mais_1",), "mais_1 on both axes"),
        (("delivery_fee,injury.cost",), "unknown price 'injury.cost'; did you mean 'injury.costs'"),
    ],
)
def test_a_map_of_nothing_is_refused(write_run, maps, message):
    run = write_run("run", episodes=2)
    with pytest.raises(InputError, match=message):
        print_sensitivity(run, maps=pairs_of(maps), as_json=True)


def test_a_group_is_varied_as_far_as_every_price_of_it_may_be(varied):
    _, result = varied("injury,delivery_fee")
    (found,) = result["runs"][0]["maps"]
    assert min(found["x"]["values"]) == pytest.approx(0.3), (
        "a mass that formulas divide by is never 0"
    )
    assert all(value is not None for value in found["profit_usd_per_run"][0])


def test_a_refund_below_its_fee_is_no_price(write_run, capsys):
    run = write_run("run", episodes=2)
    print_sensitivity(run, {"delivery_fee": 30.0}, maps=[("delivery_fee", "refund")], as_json=True)
    result = json.loads(capsys.readouterr().out)["runs"][0]
    bars = {bar["price"]: bar for bar in result["tornado"]}
    assert bars["refund"]["low"] == 30.0 and bars["delivery_fee"]["high"] == bars["refund"]["value"]
    profit = result["maps"][0]["profit_usd_per_run"]
    fees, refunds = (result["maps"][0][axis]["values"] for axis in "xy")
    for refund, row in zip(refunds, profit, strict=True):
        assert [value is None for value in row] == [fee > refund for fee in fees]


@pytest.mark.slow
def test_one_delivery_or_deliveries_all_alike_tell_nothing_of_break_even(
    write_run,
    capsys,
    tmp_path,
):
    def alike(row):
        row.update(
            {"outcome": "sla", "pedestrian_injury_usd": 0.0, "distance_m": 50.0, "duration_s": 40.0}
        )

    for run in (
        write_run("one", episodes=1),
        write_run("alike", episodes=6, crowd=0.0, change=alike),
    ):
        figures = tmp_path / f"{run.name}-figures"
        print_sensitivity(run, out=figures, as_json=True)
        assert json.loads(capsys.readouterr().out)["runs"][0]["break_even"] is None, run.name
        assert not list(figures.glob("*break-even*"))
        print_sensitivity(run)
        assert "tell nothing of how sure break-even is" in capsys.readouterr().out


def test_cargo_not_modelled_has_no_profit_to_vary(write_run):
    def arrive(row):
        row["outcome"] = "arrived"

    run = write_run("run", episodes=2, change=arrive)
    with pytest.raises(InputError, match="cargo was not simulated"):
        print_sensitivity(run, as_json=True)


def test_a_profit_that_rounds_to_nothing_has_no_sign():
    bar = TornadoBar("USD", 1.0, 2.0, 3.0, "source", "fee", (0.0, 0.0), (-1e-6, 1e-6))
    result = SimpleNamespace(bars=[bar], stack=SimpleNamespace(name="mine"), profit=-1e-6)
    table = _tornado(result)
    assert table.title.startswith("mine: profit 0.000 $/run")
    assert table.rows[0][-3:] == ("0.0000", "0.0000", "0.0000")


def test_figures_and_tables(write_run, tmp_path, capsys, rendering):
    run = write_run("run", episodes=6)
    print_sensitivity(run, maps=[("delivery_fee", "refund")], out=tmp_path / "figures")
    text = capsys.readouterr().out
    assert "mine: profit" in text
    assert re.search(r"in 9\d\.\d % of the resamples of 6 deliveries never", text)
    names = {path.name for path in (tmp_path / "figures").iterdir()}
    stems = ("mine-tornado", "mine-map-delivery_fee-refund", "mine-break-even")
    assert names == {f"{stem}{suffix}" for stem in stems for suffix in (".pdf", ".png")}
    assert max(len(line) for line in text.splitlines() if "figure:" not in line) <= 120
