"""Arms and what is worked out of them, on deliveries whose answers are known."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from harness.ablation.analysis import (
    Ablation,
    AblationDeclaration,
    analyse,
    break_even_interval,
    compared_pairs,
    error_price,
    points,
)
from harness.ablation.arms import arms_of, drives_by_scan
from harness.ablation.precision import counts_wanted
from harness.analysis.rare import margin_with_unseen
from harness.economics.prices import load_prices
from harness.economics.valuation import value
from harness.episode.files import nav2_parameters
from harness.report.ablations.screen import (
    ablation_blocks,
    deciding,
    investment_of,
    next_command,
    price_sentence,
    sentence,
)
from harness.report.audit import audit_sentence
from harness.report.blocks import Text
from harness.report.short.findings import known_within
from harness.statistics.interval import NO_INTERVAL, Interval
from harness.storage.shipped import shipped
from harness.study.drive import StackResult
from harness.study.stored_run import load_run
from harness.task.stack import Stack, load_stack, localizer_names
from navstack.errors import InputError

WriteRun = Callable[..., Path]
LEVELS = {"ground_truth": 0.0, "position=0.5": 0.5, "position=2": 2.0}
PRICE = 0.7  # [USD/run] per metre of what `costly` charges


def arms(
    *localizers: str,
    errors: tuple[str, ...] = (),
    stack: str = "nav2-amcl",
) -> tuple[Stack, ...]:
    return arms_of(load_stack(stack), localizers, errors)


def analysed(folder: Path, stacks: tuple[Stack, ...], against: str | None = None) -> Ablation:
    """What a run folder of arms says."""
    run, prices = load_run(str(folder)), load_prices("costnav")
    stored = {each.name: each for each in run.stacks}
    results = []
    for stack in stacks:
        rows, errors = stored[stack.name].rows, stored[stack.name].errors
        found = value(rows, stack, prices, run.seed, left_out=errors) if rows else None
        results.append(StackResult(stack, len(rows), errors, found, 1.0, 1.0))
    return analyse(
        AblationDeclaration("nav2-amcl", against or stacks[0].name), results, run, prices, 40
    )


def cheap(row: dict[str, Any]) -> None:
    """Every delivery earns its fee, less a dollar or two."""
    row["outcome"], row["pedestrian_contacts"], row["mailbox_contacts"] = "sla", 0, 0
    row["pedestrian_injury_usd"] = float(row["episode"] % 3)


def costly(row: dict[str, Any]) -> None:
    """Every delivery earns its fee and costs an amount of its own.

    Each metre of injected error costs 0.7 USD more.
    """
    row["outcome"] = "sla"
    own = np.random.default_rng(row["episode"]).uniform(0.0, 2.0)
    row["pedestrian_injury_usd"] = own + PRICE * LEVELS[row["stack"]]
    row["distance_m"], row["duration_s"], row["average_speed_mps"] = 50.0, 100.0, 0.5
    for key in [key for key in row if key.endswith("_contacts")]:
        row[key] = 0
    row["localization_error_median_m"] = LEVELS[row["stack"]] + 0.001 * row["episode"]
    row["localization_error_p95_m"] = 2.0 * row["localization_error_median_m"]


def test_arms_are_named_by_what_differs_and_carry_what_they_need() -> None:
    made = arms("gps", "amcl", "amcl@navigation_mesh", errors=("position=0.1,1 heading=2",))
    assert [arm.name for arm in made] == [
        "ground_truth",
        "gps",
        "amcl",
        "amcl@navigation_mesh",
        "position=0.1",
        "position=1",
        "heading=2",
    ]
    carried = {arm.name: arm.carries for arm in made}
    # to see obstacles
    assert carried["ground_truth"] == carried["amcl"] == carried["heading=2"] == ("lidar",)
    assert carried["gps"] == ("lidar", "gps")
    assert [arm.localization_map for arm in made[2:4]] == ["geometry", "navigation_mesh"]
    assert [arm.injected.position_rms for arm in made[-3:]] == [0.1, 1.0, 0.0]
    assert made[-1].injected.heading_rms == 2.0 and made[-1].localizer == "ground_truth"
    assert {arm.nav2_file for arm in made} == {load_stack("nav2-amcl").nav2_file}


def test_without_a_choice_all_localizers_are_arms() -> None:
    assert tuple(arm.name for arm in arms()) == localizer_names()


def test_who_reads_no_scan_needs_no_lidar(tmp_path: Path) -> None:
    file = shipped("params") / "nav2" / "tuned.yaml"
    text = file.read_text(encoding="utf-8")
    by_monitor = tmp_path / "by_monitor.yaml"
    by_monitor.write_text(text.replace("observation_sources: scan", 'observation_sources: ""'))
    nodes = yaml.safe_load(by_monitor.read_text())
    del nodes["collision_monitor"]
    blind = tmp_path / "blind.yaml"
    blind.write_text(yaml.safe_dump(nodes))
    assert drives_by_scan(nav2_parameters(str(file), False))
    assert drives_by_scan(nav2_parameters(str(by_monitor), True))
    assert not drives_by_scan(nav2_parameters(str(blind), True))


@pytest.mark.parametrize(
    ("names", "errors", "words"),
    [
        (("gps", "amlc"), (), ("'amlc'", "did you mean 'amcl'", "ground_truth")),
        (("gps", "gps"), (), ("localizer 'gps'", "more than once")),
        (("gps",), (), ("'gps' alone", "at least two")),
        (("amcl", "amcl@geometry"), (), ("'amcl' and 'amcl@geometry'", "the same")),
        (("gps", "amcl@mesh"), (), ("'mesh'", "navigation_mesh", "geometry")),
        (("gps@geometry", "amcl"), (), ("gps uses no map", "amcl")),
        ((), ("position=-1",), ("position: '-1'", "above 0")),
        ((), ("heading=abc",), ("heading: 'abc'", "a number above 0")),
        ((), ("heading=nan",), ("heading: 'nan'", "180 deg")),
        ((), ("position=0",), ("position: '0'", "ground_truth")),
        ((), ("position=1e9",), ("position: '1e9'", "100 m")),
        ((), ("postion=1",), ("'postion'", "did you mean 'position'")),
        ((), ("position",), ("'position' is not KIND=SIZE",)),
        ((), ("position=0.1,0.10",), ("'position=0.1'", "more than once")),
        ((), ("position=0.1234561,0.1234564",), ("'position=0.123456'", "more than once")),
    ],
)
def test_what_is_no_arm_is_refused(
    names: tuple[str, ...],
    errors: tuple[str, ...],
    words: tuple[str, ...],
) -> None:
    with pytest.raises(InputError) as complaint:
        arms(*names, errors=errors)
    assert all(word in str(complaint.value) for word in words), str(complaint.value)


def test_arms_that_can_be_built_are_audited_against_the_reference(write_run: WriteRun) -> None:
    made = arms("gps", "amcl", "ground_truth")
    run = write_run("run", tuple(arm.name for arm in made), episodes=12)
    assert list(analysed(run, made).audits) == ["amcl"]
    found = analysed(run, made, "amcl")
    assert [*found.audits] == ["gps"] and found.audits["gps"].missions == 12
    told = [each.text for each in ablation_blocks(found, (), run) if isinstance(each, Text)]
    assert f"gps: {audit_sentence(found.audits['gps'])}" in told


def test_who_does_not_drive_has_no_arms() -> None:
    with pytest.raises(InputError, match="does not drive"):
        arms("gps", "amcl", stack="parked")


def test_the_price_of_an_error_is_recovered(write_run: WriteRun) -> None:
    ablation = analysed(
        write_run("run", tuple(LEVELS), change=costly), arms(errors=("position=0.5,2",))
    )
    (price,) = ablation.prices
    assert (price.kind, price.levels) == ("position", (0.0, 0.5, 2.0))
    assert price.price.value == pytest.approx(PRICE, abs=1e-9) and price.price.n == 40
    by_arm = {each.arm: each for each in ablation.of("contribution_margin")}
    assert by_arm["position=2"].paired.difference.value == pytest.approx(-2.0 * PRICE)
    assert by_arm["position=2"].paired.is_significant
    told = (
        "position=2 earned 1.4 [-50.9, 53.6] USD a delivery less than ground_truth: significant ("
    )
    said = sentence(by_arm["position=2"])
    assert said.startswith(told), "all missions alike: what is unseen is no less likely"
    assert said.endswith("an unseen loss could undo that.")
    assert "0.7" in price_sentence(price) and "USD per run per metre" in price_sentence(price)


def test_a_level_that_lost_missions_leaves_them_out_everywhere(write_run: WriteRun) -> None:
    def some_fail(row: dict[str, Any]) -> None:
        costly(row)
        if row["stack"] == "position=2" and row["episode"] % 2:
            row["error"] = "it broke"

    ablation = analysed(
        write_run("run", tuple(LEVELS), change=some_fail), arms(errors=("position=0.5,2",))
    )
    assert ablation.prices[0].price.value == pytest.approx(PRICE, abs=1e-9)
    assert ablation.prices[0].price.n == 20


def test_errors_are_quantiles_over_the_deliveries(write_run: WriteRun) -> None:
    ablation = analysed(
        write_run("run", tuple(LEVELS), change=costly), arms(errors=("position=0.5,2",))
    )
    errors = ablation.arms[1].errors
    # 20th of 0.500, 0.501 ...
    assert errors["localization_error_median_m"].value == pytest.approx(0.519)
    assert errors["localization_error_p95_m"].value == pytest.approx(2.0 * 0.537)  # 38th of 40
    assert (
        errors["localization_error_median_m"].low is not None
        and errors["localization_error_p95_m"].low is None
    )


def test_money_is_that_of_the_sensors_each_arm_needs(write_run: WriteRun) -> None:
    names = ("ground_truth", "gps", "amcl")
    ablation = analysed(write_run("run", names, change=cheap), arms(*names))
    assert [arm.capex_usd for arm in ablation.arms] == [None, 13_000.0, 11_000.0]
    amcl = ablation.arms[2]
    assert ablation.arms[0].break_even == Interval(None, None, None, 0)
    assert amcl.margin.value is not None and amcl.margin.value > 0.0
    assert amcl.break_even.value == pytest.approx(11_000.0 / amcl.margin.value)


def test_break_even_of_an_interval() -> None:
    assert break_even_interval(100.0, Interval(2.0, 1.0, 4.0, 9)) == Interval(50.0, 25.0, 100.0, 9)
    assert break_even_interval(100.0, Interval(2.0, -1.0, 4.0, 9)) == Interval(50.0, 25.0, None, 9)
    assert break_even_interval(100.0, Interval(-1.0, -2.0, -0.5, 9)) == Interval(
        None, None, None, 9
    )


@pytest.mark.slow
def test_the_wrong_map_is_held_against_the_right_one_too(write_run: WriteRun) -> None:
    names = ("gps", "amcl", "amcl@navigation_mesh")
    ablation = analysed(write_run("run", names), arms(*names))
    pairs = [(each.arm, each.against) for each in ablation.of("contribution_margin")]
    assert pairs == [
        ("amcl", "gps"),
        ("amcl@navigation_mesh", "gps"),
        ("amcl@navigation_mesh", "amcl"),
    ]
    other = analysed(load_run(str(write_run("other", names))).folder, arms(*names), "amcl")
    pairs = [(each.arm, each.against) for each in other.of("contribution_margin")]
    assert pairs == [("gps", "amcl"), ("amcl@navigation_mesh", "amcl")]
    reverse = compared_pairs(arms(*names), "amcl@navigation_mesh")
    assert reverse == [("gps", "amcl@navigation_mesh"), ("amcl", "amcl@navigation_mesh")]


def test_p_values_are_adjusted_for_all_comparisons_of_a_metric(write_run: WriteRun) -> None:
    names = ("ground_truth", "gps", "amcl")
    ablation = analysed(write_run("run", names), arms(*names))
    found = ablation.of("contribution_margin")
    plain = sorted(each.paired.p for each in found)
    adjusted = sorted(each.paired.p_holm for each in found)
    assert adjusted[0] == pytest.approx(min(1.0, 2.0 * plain[0]))
    assert adjusted[1] == pytest.approx(max(adjusted[0], plain[1]))
    for each in found:
        words = ": significant" if each.paired.is_significant else ": not significant"
        assert words in sentence(each)
        assert each.paired.is_significant or "missions would decide" in sentence(each)
    open_ones = [each.paired.needed for each in found if not each.paired.is_significant]
    command = f"navbench run --resume {ablation.run.folder} --episodes {max(open_ones)}"
    assert deciding(ablation) == [f"to decide every margin: {command}"]


def test_what_is_alike_to_a_cent_is_not_called_different(write_run: WriteRun) -> None:
    def cheap(row: dict[str, Any]) -> None:
        costly(row)
        row["pedestrian_injury_usd"] = 1.0 + 0.001 * LEVELS[row["stack"]] * (row["episode"] % 3)

    ablation = analysed(
        write_run("run", tuple(LEVELS), change=cheap), arms(errors=("position=0.5,2",))
    )
    for each in ablation.of("contribution_margin"):
        # always the same sign, but nothing to speak of
        assert not each.paired.is_significant and each.paired.detectable is None
        assert "earned the same as ground_truth on all 40 missions" in sentence(each)
    assert ablation.prices[0].price.low is None and "nothing about rare events" in price_sentence(
        ablation.prices[0]
    )


def test_a_constant_difference_is_significant(write_run: WriteRun) -> None:
    def dear(row: dict[str, Any]) -> None:
        costly(row)
        row["pedestrian_injury_usd"] = 1.0 + LEVELS[row["stack"]]

    ablation = analysed(
        write_run("run", tuple(LEVELS), change=dear), arms(errors=("position=0.5,2",))
    )
    assert all(each.paired.is_significant for each in ablation.of("contribution_margin"))


@pytest.mark.parametrize(
    ("injury", "comes_next"),
    [(0.0, "navbench ablate --resume "), (1.0, "navbench explain ")],
)
def test_where_nothing_was_lost_more_missions_come_next(
    write_run: WriteRun, injury: float, comes_next: str
) -> None:
    def once(row: dict[str, Any]) -> None:
        costly(row)
        row["pedestrian_injury_usd"] = injury * (row["episode"] == 2)

    folder = write_run("run", tuple(LEVELS), episodes=6, change=once)
    ablation = analysed(folder, arms(errors=("position=0.5,2",)))
    assert next_command(ablation, folder).startswith(comes_next)


@pytest.mark.parametrize(
    ("share", "most", "wanted"),
    [(1.01, 1000, 40), (1.0 / 1.2, 1000, 58), (0.1, 1000, 80), (0.1, 60, 60), (0.1, 40, 40)],
)
def test_an_arm_drives_until_its_margin_is_known(
    write_run: WriteRun, share: float, most: int, wanted: int
) -> None:
    """Of 40 deliveries, where the margin is asked for to a share of how well it is known."""

    def twice(row: dict[str, Any]) -> None:
        costly(row)
        row["pedestrian_injury_usd"] = 20.0 * (row["episode"] in (3, 30))

    run = load_run(str(write_run("run", ("ground_truth",), episodes=40, change=twice)))
    margin = margin_with_unseen(run, run.stacks[0])
    assert margin and margin.value and margin.low and margin.high
    width = margin.value - margin.low
    assert width > margin.high - margin.value
    assert counts_wanted(run, share * width, most) == {"ground_truth": wanted}


def test_an_arm_whose_margin_is_undefined_drives_no_more(write_run: WriteRun) -> None:
    def fail(row: dict[str, Any]) -> None:
        row["error"] = "it broke" if row["stack"] == "amcl" else None

    folder = write_run("run", ("gps", "amcl"), episodes=3, change=fail)
    found = counts_wanted(load_run(str(folder)), 0.1, 100)
    assert (found["gps"], found["amcl"]) == (6, 3)


@pytest.mark.parametrize(("most", "wanted"), [(99, 24), (100, 48)])
def test_an_error_among_few_deliveries_stops_no_arm(
    write_run: WriteRun, most: int, wanted: int
) -> None:
    """Among 100 it leaves the margin defined."""

    def fail(row: dict[str, Any]) -> None:
        row["error"] = "it broke" if row["episode"] == 3 else None

    run = load_run(str(write_run("run", ("gps",), episodes=24, change=fail)))
    assert counts_wanted(run, 0.1, most) == {"gps": wanted}


def test_which_margins_are_known_is_told(write_run: WriteRun) -> None:
    ablation = analysed(
        write_run("run", tuple(LEVELS), change=costly), arms(errors=("position=0.5,2",))
    )
    assert known_within(ablation) == []
    asked = dataclasses.replace(ablation.declaration, within=1000.0)
    (line,) = known_within(dataclasses.replace(ablation, declaration=asked))
    assert line == "every margin is known to within 1000 USD"
    asked = dataclasses.replace(ablation.declaration, within=0.01)
    ablation = dataclasses.replace(ablation, declaration=asked)
    (line,) = known_within(ablation)
    assert line.startswith("not known to within 0.01 USD after at most 40 deliveries: ground_truth")
    assert deciding(ablation) == [], "arms that are known drive no further"


def test_break_even_is_by_the_margin_that_is_told_beside_it(write_run: WriteRun) -> None:
    """Which admits an unseen loss; the bootstrap, that knows of none, has a sure end."""
    ablation = analysed(write_run("run", ("gps", "amcl"), change=cheap), arms("gps", "amcl"))
    gps, shown = ablation.arms[0], ablation.arms[0].unseen
    assert shown is not None and shown.low is not None and shown.high is not None
    assert shown.low < 0.0 and gps.margin.low is not None and gps.margin.low > 0.0
    told = investment_of(gps)[2]
    assert told == f"{gps.break_even.value:,.0f} [{13_000.0 / shown.high:,.0f}, never]"
    assert gps.break_even.low == 13_000.0 / shown.high and gps.break_even.high is None
    assert points(ablation)[0][2] == shown, "in the figure, too"


def test_a_margin_that_is_undefined_is_so_wherever_it_is_told(write_run: WriteRun) -> None:
    """As where too many deliveries have no result."""

    def fail(row: dict[str, Any]) -> None:
        if row["stack"] == "amcl" and row["episode"] % 2:
            row["error"] = "it broke"

    ablation = analysed(write_run("run", ("gps", "amcl"), change=fail), arms("gps", "amcl"))
    gps, amcl = ablation.arms
    assert gps.unseen is not None
    assert amcl.unseen is None and amcl.margin == NO_INTERVAL
    assert investment_of(amcl)[2] == "--"
    asked = dataclasses.replace(ablation.declaration, within=1000.0)
    (line,) = known_within(dataclasses.replace(ablation, declaration=asked))
    assert line.endswith("amcl (undefined, 20 errors: --resume DIR --retry-errors)")


def test_before_the_first_delivery_there_is_nothing_to_tell(write_run: WriteRun) -> None:
    stacks = arms("ground_truth", "gps", errors=("heading=2",))
    names = tuple(stack.name for stack in stacks)
    ablation = analysed(write_run("run", names, episodes=0), stacks)
    assert ablation.differences == () and points(ablation) == []
    assert "undefined" in price_sentence(ablation.prices[0])


def test_an_arm_without_a_delivery_is_told_as_such(write_run: WriteRun) -> None:
    def fail(row: dict[str, Any]) -> None:
        row["error"] = "it broke" if row["stack"] == "amcl" else None

    names = ("ground_truth", "gps", "amcl")
    ablation = analysed(write_run("run", names, episodes=3, change=fail), arms(*names))
    lost = ablation.arms[2]
    assert lost.margin.value is None and lost.capex_usd is None and lost.break_even.value is None
    assert {each.arm for each in ablation.differences} == {"gps"}


@pytest.mark.parametrize(("noise", "has_bounds"), [(1e-5, False), (0.5, True)])
def test_a_price_that_is_the_same_on_all_missions_has_no_interval(
    noise: float, has_bounds: bool
) -> None:
    """As where an error makes every delivery time out: what is rare has not been seen."""
    margin = np.random.default_rng(0).normal((3.49, -3.49), noise, (20, 2))
    levels = {"ground_truth": 0.0, "position=1": 1.0}
    price = error_price("position", levels, margin, np.arange(20), 0).price
    assert price.value == pytest.approx(6.98, abs=4.0 * noise)
    assert (price.low is not None) == has_bounds
