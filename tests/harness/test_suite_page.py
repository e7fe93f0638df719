"""The page of a suite tells what its runs hold, how much that is, and what is missing."""

import dataclasses
import io
import json
import re
import shutil
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from rich.console import Console

from harness.analysis.compare import compare
from harness.analysis.price_sets import NO_INTERVAL, Money, money_of, order, under_curves
from harness.analysis.repricing import FORGIVEN, accounted_margins, choose, reprice
from harness.analysis.side import Side
from harness.economics.accountings import ACCOUNTINGS, PUBLISHED
from harness.economics.contact_limits import beyond_limit
from harness.economics.cost_terms import MARGIN
from harness.economics.prices import price_sets
from harness.economics.valuation import margins, value
from harness.metrics.columns import EVENT_COLUMNS
from harness.report.numbers import interval_text
from harness.report.repriced import SHOWN
from harness.report.suite.document import page, write_results
from harness.report.suite.figures import FIGURES, _margin
from harness.report.suite.other_prices import _moves, earns
from harness.report.suite.results import overview, read_results
from harness.report.suite.tables import COLUMNS
from harness.report.suite.tables import margins as margins_table
from harness.report.tables import print_blocks
from harness.statistics.interval import Interval
from harness.storage.shipped import DEFAULT_WORLD
from harness.storage.tables import read_rows, write_table
from harness.study.stored_run import load_run
from harness.study.suite import Suite
from harness.study.suite_folder import declare
from harness.study.suite_log import Session, note_session
from navbench.cli.suite import _sheet
from navstack.errors import InputError

ROOT = Path(__file__).parents[2]
SUITE = Suite("Made up", ("mine", "other", "absent"), 30, maps=("sidewalk", "sidewalk_1"))
EPISODES = {
    f"{name}-{DEFAULT_WORLD}-seed0-{stack}": count
    for name, stack, count in (
        ("sidewalk", "mine", 30),
        ("sidewalk", "other", 12),
        ("sidewalk_1", "mine", 20),
    )
}


@pytest.fixture
def study(write_run, tmp_path):
    """A suite of six cells, of which one is complete, two have some deliveries, and three none."""
    declare(tmp_path / "study", SUITE)
    for name, episodes in EPISODES.items():
        write_run(f"study/{name}", stacks=(name.rpartition("-")[2],), episodes=episodes)
    return tmp_path / "study"


def flat(text):
    """A text without its line breaks and the padding of its tables."""
    return " ".join(text.split())


def test_the_page_says_how_much_there_is_and_what_is_missing(study):
    text = flat(page(read_results(study)))
    assert (
        "**Not complete: 62 of 180 declared deliveries are driven.** 2 of 6 cells have some of "
        "theirs" in text
    )
    assert "3 of 6 cells have none and are missing below: absent; other on sidewalk_1." in text
    assert (
        "| mine | 30 | 20 of 30 |" in text
        and "| other | 12 of 30 | – |" in text
        and "| absent | – | – |" in text
    )
    assert "| `absent` | not driven | not driven |" in text
    (study / "stranger").mkdir()
    shutil.copy(study / next(iter(EPISODES)) / "run.json", study / "stranger")
    assert "not of this suite, and not shown: stranger" in flat(page(read_results(study)))


def test_the_figures_are_those_of_the_runs(study):
    results = read_results(study)
    run = load_run(str(study / f"sidewalk-{DEFAULT_WORLD}-seed0-mine"))
    other = load_run(str(study / f"sidewalk-{DEFAULT_WORLD}-seed0-other"))
    expected = value(run.stacks[0].rows, run.stacks[0], run.prices(), 0)
    first = results.standings[0]
    assert first.valuation is not None and first.valuation.economics == expected.economics
    compared = (
        compare(Side(run, run.stacks[0]), Side(other, other.stacks[0]), [MARGIN])
        .differences[MARGIN]
        .paired
    )
    difference = results.differences[first.condition, "other"]
    assert (difference.pairs, difference.paired) == (12, compared)
    text = flat(page(results))
    assert f"| {interval_text(expected.intervals[MARGIN], 2)} ([" in text
    assert interval_text(compared.difference, 2) in text
    rows = overview(results)["rows"]
    assert [(row["stack"], row["map"], row["episodes"], row["declared"]) for row in rows] == [
        ("mine", "sidewalk", 30, 30),
        ("other", "sidewalk", 12, 30),
        ("mine", "sidewalk_1", 20, 30),
    ]


def test_the_table_has_every_quantity_and_figures_are_the_same_every_time(study, rendering):
    results = read_results(study)
    written = write_results(results, study)
    rows = read_rows(study / "table.parquet", COLUMNS)
    keys = [(row["map"], row["stack"], row["quantity"]) for row in rows]
    assert len(keys) == len(set(keys))
    (margin,) = (
        row for row, key in zip(rows, keys, strict=True) if key == ("sidewalk", "other", MARGIN)
    )
    stored = results.standings[1].interval(MARGIN)
    assert (margin["value"], margin["low"], margin["high"], margin["n"]) == (
        stored.value,
        stored.low,
        stored.high,
        12,
    )
    assert {"sla", "capex_usd", "break_even_probability"} <= {key[2] for key in keys}
    figures = {path: path.read_bytes() for path in written if path.parent.name == "figures"}
    assert {path.name for path in figures} == {
        f"{name}.{kind}" for name in FIGURES for kind in ("png", "pdf")
    }
    write_results(results, study)
    assert {path: path.read_bytes() for path in figures} == figures


def test_margins_under_other_accountings_are_those_of_price(study):
    results = read_results(study)
    run = load_run(str(study / f"sidewalk-{DEFAULT_WORLD}-seed0-other"))
    (expected,) = reprice(run, choose(run, None, {}, ()))
    standing = results.standings[1]
    found = results.accounted[standing.condition, "other"]
    own = {name: each.intervals[MARGIN] for name, each in expected.accountings.items()}
    assert found == {**own, FORGIVEN: expected.forgiven}
    assert found[PUBLISHED] == standing.interval(MARGIN) != found["robot_at_fault"]
    section = (
        flat(page(results))
        .partition("## Who pays for contacts")[2]
        .partition("## At other prices")[0]
    )
    for text, name in zip(section.split("**: ")[1:], SHOWN[1:], strict=True):
        assert f"| `other` | {interval_text(found[name], 2)}, n = 12 | not driven |" in text
    write_results(results, study)
    rows = {
        row["quantity"]: row
        for row in read_rows(study / "table.parquet", COLUMNS)
        if row["stack"] == "other"
    }
    assert {f"{MARGIN}_{name}" for name in ACCOUNTINGS if name != PUBLISHED} <= set(rows)
    assert rows[f"{MARGIN}_shared_fault"]["low"] == found["shared_fault"].low


def test_other_prices_are_told_of_stacks_that_drove_everywhere(study):
    text = flat(page(read_results(study)))
    section = text.partition("## At other prices")[2].partition("## How deliveries end")[0]
    runs = [
        load_run(str(study / f"{place}-{DEFAULT_WORLD}-seed0-mine"))
        for place in ("sidewalk", "sidewalk_1")
    ]
    parts = [(run, run.stacks[0]) for run in runs]
    money = [money_of(parts, choose(runs[0], name, {}, ())) for name in price_sets()]
    curves = under_curves(parts)
    ranked = " | ".join(f"1. {interval_text(each.profit)}" for each in money)
    assert f"| `mine` | {ranked} |" in section and "`other`" not in section
    assert "- `campus`: the order of `costnav`" in section
    assert all(interval_text(each) in section for each in curves.values())
    assert curves["published"].value == pytest.approx(money[0].margin.value)
    counts = [
        round(each.value * each.n)
        for each in (beyond_limit(s.rows, r.events, r.prices()) for r, s in parts)
    ]
    assert f" | {sum(counts)} of " in section


def test_who_is_ahead_and_who_earns_depends_on_the_set():
    def money(margin, capex):
        return Money(Interval(margin, margin - 0.5, margin + 0.5, 9), capex, 1000.0)

    found = {
        "costnav": {"a": money(3.0, 0.0), "b": money(2.0, 0.0)},
        "campus": {"a": money(3.0, 1500.0), "b": money(2.0, 0.0)},
    }
    assert [order(each) for each in found.values()] == [("a", "b"), ("b", "a")], (
        "profit, not margin"
    )
    assert _moves(found, "campus").endswith(
        "1 of 1 pairs of stacks change places against `costnav`: `b` before `a`"
    )
    assert (
        earns(Interval(1.0, 0.1, 2.0, 9))
        and not earns(Interval(1.0, -0.1, 2.0, 9))
        and not earns(NO_INTERVAL)
    )


def test_stacks_that_earn_the_same_to_the_cent_change_no_places():
    def money(margin):
        return Money(Interval(margin, margin - 0.5, margin + 0.5, 9), 0.0, 1000.0)

    found = {
        "costnav": {"a": money(2.7801), "b": money(2.7804), "c": money(2.8)},
        "campus": {"a": money(1.6803), "b": money(1.6802), "c": money(1.7)},
    }
    assert [order(each) for each in found.values()] == [("c", "a", "b")] * 2
    assert _moves(found, "campus") == "- `campus`: the order of `costnav`"


def test_an_undefined_margin_has_no_interval_beside_it(write_run, tmp_path):
    def fail(row):
        row["error"] = "it broke" if row["episode"] < 2 else None

    declare(tmp_path / "study", Suite("Made up", ("mine",), 20, maps=("sidewalk",), seeds=(0,)))
    write_run(f"study/sidewalk-{DEFAULT_WORLD}-seed0-mine", episodes=20, change=fail)
    assert "| `mine` | --, n = 18 |" in flat(margins_table(read_results(tmp_path / "study")))


def test_seeds_are_accounted_together(write_run, tmp_path):
    declare(tmp_path / "study", Suite("Made up", ("mine",), 20, maps=("sidewalk",), seeds=(0, 1)))
    for seed, episodes in ((0, 20), (1, 5)):
        write_run(f"study/sidewalk-{DEFAULT_WORLD}-seed{seed}-mine", episodes=episodes, seed=seed)
    results = read_results(tmp_path / "study")
    (standing,) = results.standings
    runs = [
        load_run(str(tmp_path / "study" / f"sidewalk-{DEFAULT_WORLD}-seed{seed}-mine"))
        for seed in (0, 1)
    ]
    alone = [accounted_margins(run, [(run, run.stacks[0])])["robot_at_fault"].value for run in runs]
    assert None not in alone
    found = results.accounted[standing.condition, "mine"]["robot_at_fault"]
    assert (found.value, found.n) == (pytest.approx((20 * alone[0] + 5 * alone[1]) / 25), 25)
    together = results.accounted[standing.condition, "mine"][PUBLISHED]
    told = standing.interval(MARGIN)
    assert together.value == pytest.approx(told.value)
    assert (together.low, together.high, together.n) == (told.low, told.high, told.n), (
        "one bootstrap for all that is said of a stack"
    )


def test_contacts_of_another_state_are_refused(study):
    path = study / f"sidewalk-{DEFAULT_WORLD}-seed0-mine" / "events.parquet"
    events = read_rows(path, EVENT_COLUMNS)
    write_table(path, EVENT_COLUMNS, events[: len(events) // 2])
    with pytest.raises(InputError, match="different states of the run"):
        page(read_results(study))


def test_where_nobody_was_touched_nobody_pays(write_run, tmp_path):
    declare(tmp_path / "study", Suite("Made up", ("mine",), 9, maps=("sidewalk",)))
    write_run(f"study/sidewalk-{DEFAULT_WORLD}-seed0-mine", episodes=9, crowd=0.0)
    results = read_results(tmp_path / "study")
    assert set(results.accounted[results.standings[0].condition, "mine"]) == {
        *ACCOUNTINGS,
        FORGIVEN,
    }
    assert "Who pays" not in page(results)


def test_without_cargo_no_accounting_has_a_margin(write_run, tmp_path):
    def arrive(row):
        row["outcome"] = "arrived"

    declare(tmp_path / "study", Suite("Made up", ("mine",), 9, maps=("sidewalk",)))
    write_run(f"study/sidewalk-{DEFAULT_WORLD}-seed0-mine", episodes=9, change=arrive)
    results = read_results(tmp_path / "study")
    assert results.accounted == {(results.standings[0].condition, "mine"): {}}
    assert "Who pays" not in page(results)


def test_what_else_differs_is_said_beside_the_differences(study):
    name = f"sidewalk-{DEFAULT_WORLD}-seed0-other"
    about = json.loads((study / name / "run.json").read_text())
    (study / name / "run.json").write_text(json.dumps({**about, "versions": {"navbench": "0.0.9"}}))
    pieces = [
        Session("2026-01-01", 30, digest, {}, {cell: 30})
        for digest, cell in (("a" * 64, name), ("b" * 64, "gone"))
    ]
    for piece in pieces:
        note_session(study, piece)
    text = flat(page(read_results(study)))
    assert "- `other`: other versions: navbench 0.1.0 and 0.0.9" in text
    assert "where different states of the program drove two stacks" in text
    assert "30 deliveries, program aaaaaaaaaaaa (sidewalk: other 30)" in text
    assert "30 deliveries, program bbbbbbbbbbbb -" in f"{text} -", "older logs name no cells"


def test_a_stack_is_named_as_it_is(study):
    results = read_results(study)
    (first, *_) = results.standings
    odd = tuple(dataclasses.replace(first, stack=name) for name in ("mpc[v2]", "x[/b]"))
    console = Console(width=200, file=io.StringIO())
    print_blocks([_sheet(dataclasses.replace(results, standings=odd))], console)
    assert isinstance(console.file, io.StringIO)
    assert "mpc[v2]" in console.file.getvalue() and "x[/b]" in console.file.getvalue()


def test_an_axis_for_disasters_shows_what_earns_much(study):
    results = read_results(study)
    ends = {0: (-900.0, -500.0, -300.0), 1: (20.0, 25.0, 40.0)}

    def with_margin(number, each):
        if each.valuation is None:
            return each
        low, mean, high = ends[number % 2]
        intervals = {**each.valuation.intervals, MARGIN: Interval(mean, low, high, each.n)}
        return dataclasses.replace(
            each, valuation=dataclasses.replace(each.valuation, intervals=intervals)
        )

    standings = tuple(with_margin(number, each) for number, each in enumerate(results.standings))
    figure = Figure()
    _margin(figure, dataclasses.replace(results, standings=standings))
    low, high = figure.axes[0].get_xlim()
    assert low < -900.0 and high > 40.0


def test_nothing_driven_is_a_page_without_figures(tmp_path):
    declare(tmp_path, SUITE)
    results = read_results(tmp_path)
    assert len(write_results(results, tmp_path)) == 2 and not (tmp_path / "figures").exists()
    text = flat(page(results))
    assert "0 of 180" in text and "figures/" not in text and results.ranked == list(SUITE.stacks)


def test_a_published_study_counts_every_row_that_is_stored():
    folder = ROOT / "results" / "baseline" / "measured"
    stored = sum(
        len(read_rows(path, {"episode": "int64"})) for path in folder.glob("*/episodes.parquet")
    )
    text = (folder / "index.md").read_text(encoding="utf-8")
    assert all((folder / figure).is_file() for figure in re.findall(r"\((figures/[^)]+)\)", text))
    assert f"Complete: {stored:,d} deliveries" in text or f"{stored} of" in text


def test_partings_are_the_missions_on_which_all_stacks_earn_most_unlike_sums(study):
    (parting,) = read_results(study).partings  # on the other map one stack alone has driven
    sides = [
        load_run(str(study / f"sidewalk-{DEFAULT_WORLD}-seed0-{stack}"))
        for stack in ("mine", "other")
    ]
    mine, other = (margins(run.stacks[0].rows, run.prices()) for run in sides)
    assert mine is not None and other is not None
    apart = abs(mine[: len(other)] - other)  # missions that both have
    assert parting.episodes == tuple((-apart).argsort(kind="stable")[:2].tolist())
    assert parting.spread == pytest.approx(apart.max())
    assert {run.folder.name for run in parting.runs} == set(EPISODES) - {
        f"sidewalk_1-{DEFAULT_WORLD}-seed0-mine"
    }
