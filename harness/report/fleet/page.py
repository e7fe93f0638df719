"""A fleet's day as a page: Markdown, and the same as one HTML file."""

from collections.abc import Sequence
from pathlib import Path

from harness.economics.cost_terms import COST_TERMS
from harness.economics.price import price_keys
from harness.fleet.day_metrics import DAY_METRICS
from harness.fleet.result import FleetResult
from harness.fleet.study import DAYS_EACH, CurvePoint
from harness.report.blocks import Block, Chart, Table, Text
from harness.report.fleet.figures import MOST_STRIPS, draw_fleet_figures
from harness.report.fleet.screen import answers, curve_rows, estimate_cells, setup, worth
from harness.report.markdown import markdown_text
from harness.report.numbers import counted, number_text
from harness.report.page.document import write_study_page
from harness.storage.files import write_text, writing

PAGE = "index.md"
ENTRIES = {  # of the ledger that are no cost terms
    "revenue": "Fees",
    "operators": "Operators' shifts",
    "field_workers": "Field workers' shifts",
    "robots": "Robots over their life",
}
CURVE_HEAD = (
    *("Robots", "Operators", "Profit per robot ($/day)", "Profit of the fleet ($/day)"),
    *("Robots busy (%)", "Customers wait (min)", "Robots wait for an operator (min)"),
)


def write_fleet_page(result: FleetResult, folder: Path, date: str) -> Path:
    """Write page and figures of a day into a folder; returns the HTML page.

    Raises:
        InputError: the folder cannot be written.
    """
    with writing(folder):
        figures = draw_fleet_figures(result, folder)
        write_text(folder / PAGE, page_text(result, figures, folder))
    return write_study_page(folder / PAGE, [], date)


def page_text(result: FleetResult, figures: Sequence[Path], folder: Path) -> str:
    """The page as Markdown."""
    *strips, sizes = [str(path.relative_to(folder)) for path in figures]
    blocks: list[Block] = [Text(setup(result))]
    for found in result.libraries:
        blocks += [Text(line) for line in answers(found)]
    if result.difference is not None:
        blocks.append(Text(worth(result)))
    blocks += [_quantities(result), _money(result), *_strips(result, strips)]
    blocks += [Text("What a fleet of another size earns", "heading")]
    blocks += [Chart(sizes, "profit per robot and day; bars: 95 % intervals over days")]
    for found in result.libraries:
        name = found.study.library.title
        blocks.append(_curve(f"{name}: as many robots per operator", found.by_robots))
        blocks.append(_curve(f"{name}: the same robots", found.by_operators))
    blocks.append(_settings(result))
    return f"# A day of {counted(result.robots, 'robot')}\n\n{markdown_text(blocks)}"


def _names(result: FleetResult) -> list[str]:
    return [found.study.library.title for found in result.libraries]


def _quantities(result: FleetResult) -> Table:
    head = ["", *(cell for name in _names(result) for cell in (name, "95 % of days"))]
    if result.difference is not None:
        head += ["difference", "95 % of days"]
    rows = []
    for key, metric in DAY_METRICS.items():
        cells = [metric.title]
        for found in result.libraries:
            cells += estimate_cells(found.study.estimates[key], metric.decimals)
        if result.difference is not None:
            cells += estimate_cells(result.difference[key], metric.decimals)
        rows.append(cells)
    note = (
        f"In brackets: 95 % of means over libraries of resampled legs, {DAYS_EACH} days each, so "
        "that they hold what these days differ by, too; beside: between which values 95 % of "
        "single days lie."
    )
    return Table("What a day comes to", head, rows, notes=(note,))


def _money(result: FleetResult) -> Table:
    ledgers = [found.money for found in result.libraries]
    rows = [[_entry(key), *(number_text(ledger[key]) for ledger in ledgers)] for key in ledgers[0]]
    rows.append(["Profit", *(number_text(sum(ledger.values())) for ledger in ledgers)])
    note = (
        "Where on the map money is lost is not shown: legs are drawn by people and hour, and rows "
        "do not say which street they were driven on."
    )
    title = "Where the money goes [USD per robot and day]"
    return Table(title, ["", *_names(result)], rows, notes=(note,))


def _entry(key: str) -> str:
    if key in ENTRIES:
        return ENTRIES[key]
    return COST_TERMS[key].title


def _strips(result: FleetResult, pictures: Sequence[str]) -> list[Block]:
    shown = "each robot does"
    if result.robots > MOST_STRIPS:
        shown = f"the first {MOST_STRIPS} robots do"
    charts = [
        Chart(picture, f"{name}: what {shown} on the first day")
        for name, picture in zip(_names(result), pictures, strict=True)
    ]
    return [Text("One day", "heading"), *charts]


def _curve(title: str, points: Sequence[CurvePoint]) -> Table:
    return Table(title, CURVE_HEAD, curve_rows(points))


def _settings(result: FleetResult) -> Table:
    rows = [
        [key, f"{each.value:g} {each.unit}", each.source]
        for key, each in price_keys(result.settings).items()
    ]
    return Table("Settings and their sources", ["", "value", "source"], rows, texts=3)
