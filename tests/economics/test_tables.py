"""The printed tables: what stands in them, and how they fit."""

import dataclasses
import io
import json

import pytest

from harness.economics.cost_model import price
from harness.economics.prices import load_prices
from harness.report.paper_tables import Column, paper_blocks, values_of
from harness.report.published import load_published, published_columns
from harness.report.table_rows import LAYOUTS
from harness.report.tables import PLAIN_WIDTH, print_blocks, report_console
from harness.statistics.interval import Interval
from navbench.api.paper import paper as read_paper
from navbench.cli.paper import paper, print_paper

PRICES = load_prices("costnav")
PUBLISHED = load_published()
GPS = PUBLISHED.methods["nav2_gps"]


def printed(columns):
    stream = io.StringIO()
    print_blocks(paper_blocks(columns), report_console(stream))
    return stream.getvalue()


def row(text, label, table=0):
    """The entries of the n-th row of this label."""
    lines = [line for line in text.splitlines() if line.strip().startswith(label)]
    return lines[table].split(label, 1)[1].split()


def own(intervals=None, **changes):
    measured = dataclasses.replace(GPS.measured, **changes)
    return Column(
        "mine",
        values_of(measured, price(measured, GPS.sensors, False, PRICES)),
        50,
        intervals or {},
    )


def test_paper_fits_the_plain_width_in_one_block():
    stream = io.StringIO()
    print_paper(report_console(stream), read_paper())
    text = stream.getvalue()
    assert max(map(len, text.splitlines())) <= PLAIN_WIDTH
    assert "\x1b" not in text
    assert text.count("Simulation evaluation") == text.count("Economic performance") == 1


def test_paper_has_every_row_in_order():
    text = printed(published_columns(PUBLISHED, PRICES))
    labels = [
        entry.label for layout in LAYOUTS for section in layout.sections for entry in section.rows
    ]
    places = [text.index(f"\n  {label} ") for label in labels]
    assert places == sorted(places)


def test_paper_shows_the_published_figures():
    text = printed(published_columns(PUBLISHED, PRICES))
    assert row(text, "SLA Compliance") == [
        "0.430",
        "0.460",
        "0.000",
        "0.100",
        "0.010",
        "0.000",
        "0.700",
        "0.625",
    ]
    margins = ["-44.07", "-37.34", "-24.04", "-50.52", "-32.08", "-15.75", "-28.40", "-19.65"]
    assert row(text, "Contribution Margin ($/run)") == margins
    assert row(text, "BEP (runs)") == ["--"] * 8
    assert row(text, "Plant Contact") == ["--"] * 7 + ["0.250"]


def test_own_rates_carry_wilson_intervals_and_published_ones_do_not():
    text = printed([own(), *published_columns(PUBLISHED, PRICES)[:1]])
    assert row(text, "SLA Compliance") == ["0.460", "[0.330,", "0.596]", "0.430"]
    assert "n=50" in text


def test_given_intervals_stand_beside_their_values():
    text = printed(
        [own({"opex": Interval(38.9, 30.0, 50.5, 50), "repair": Interval(7.2, None, None, 1)})]
    )
    assert row(text, "Total OPEX Cost") == ["38.95", "[30.00,", "50.50]"]
    assert row(text, "Repair") == ["7.23"]


def test_cargo_not_modelled_is_never_zero():
    text = printed([own(sla=None, spoiled=None)])
    assert row(text, "SLA Compliance") == row(text, "Spoiled") == ["not", "modelled"]
    for label in (
        "Service Compensation",
        "Total OPEX Cost",
        "Revenue ($/run)",
        "Contribution Margin ($/run)",
    ):
        assert row(text, label) == ["undefined"]
    assert row(text, "BEP (runs)") == ["--"]
    assert "not modelled: " in text


def test_break_even_is_shown_where_there_is_one():
    measured = dict.fromkeys(
        ("spoiled", "timeout", "physical_assistance", "pedestrian_injury_usd_per_run"), 0.0
    )
    column = own(sla=1.0, mailbox_contacts=0.0, **measured)
    text = printed([column])
    assert row(text, "BEP (runs)") == [f"{column.values['break_even_runs']:,.0f}"]
    assert "BEP --" not in text


def test_columns_that_do_not_fit_continue_below():
    columns = [dataclasses.replace(own(), title=f"stack-{i}") for i in range(9)]
    text = printed(columns)
    assert max(map(len, text.splitlines())) <= PLAIN_WIDTH
    assert text.count("Simulation evaluation") > 1
    assert all(f"stack-{i}" in text for i in range(9))


def test_titles_are_no_markup():
    assert "[bold]" in printed([dataclasses.replace(own(), title="[bold]")])


def test_a_rounded_zero_has_no_sign():
    text = printed([own({"revenue": Interval(1.6, -0.001, 1.0, 50)})])
    assert row(text, "Revenue ($/run)")[1:] == ["[0.00,", "1.00]"]


def test_an_ascii_stream_does_not_stop_the_report():
    stream = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    print_paper(report_console(stream), read_paper())
    stream.seek(0)
    assert "Avg Collision ?v" in stream.read()


def test_json_document(capsys):
    paper.callback("costnav", as_json=True)
    document = json.loads(capsys.readouterr().out)
    assert document == read_paper().as_json()
    assert list(document) == ["methods", "real_world_canvas", "thresholds"]
    assert document["methods"]["nav2_amcl"]["economics"]["break_even_runs"] is None
    assert document["methods"]["nav2_amcl"]["economics"]["capex_usd"] == 13000
    assert document["thresholds"]["spoilage_rate"] == pytest.approx(3.49 / 35.42)
