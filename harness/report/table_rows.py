"""The rows of the printed tables: which quantity, under which label, with how many decimals."""

from dataclasses import dataclass

from harness.economics.cost_terms import COUNTED_TERMS
from harness.economics.rates import MARGIN_PER_KM, RATE_TITLES
from harness.metrics.catalog import GROUPS
from harness.metrics.metric import Metric
from harness.report.texts import read_data


@dataclass(frozen=True, slots=True)
class TableRow:
    """One quantity."""

    label: str
    key: str  # field of Measured or Economics
    decimals: int
    bold: bool = False
    absent: str = "--"  # what stands where the quantity is undefined


@dataclass(frozen=True, slots=True)
class TableSection:
    """Rows under one heading."""

    title: str
    rows: tuple[TableRow, ...]
    starts_with_terms: bool = False  # the rows of COST_TERMS come first

    @property
    def all_rows(self) -> tuple[TableRow, ...]:
        """Its rows with those of the cost terms."""
        if not self.starts_with_terms:
            return self.rows
        terms = (
            TableRow(term.title, key, term.decimals, absent="undefined")
            for key, term in COUNTED_TERMS.items()
        )
        return (*terms, *self.rows)


@dataclass(frozen=True, slots=True)
class TableLayout:
    """One table."""

    title: str
    sections: tuple[TableSection, ...]


@dataclass(frozen=True, slots=True)
class Layouts:
    """The file's content."""

    layouts: tuple[TableLayout, ...]


LAYOUTS = read_data(Layouts, "table_rows.toml").layouts

RATES = {**RATE_TITLES, MARGIN_PER_KM: "Contribution Margin ($/km)"}  # key -> label
RATE_LAYOUT = TableLayout(
    "Rates (exact Poisson bounds)",
    (
        TableSection(
            "Events and earnings over the way and the time driven",
            (
                *(TableRow(title, key, 1) for key, title in RATE_TITLES.items()),
                TableRow(RATES[MARGIN_PER_KM], MARGIN_PER_KM, 2, absent="undefined"),
            ),
        ),
    ),
)


def further_metrics() -> TableLayout:
    """Means over deliveries that the paper's tables do not have, group by group."""
    sections = (
        (title, tuple(_row(metric) for metric in group if _is_printed(metric)))
        for title, group in GROUPS.items()
    )
    return TableLayout(
        "Further metrics (means over deliveries)",
        tuple(TableSection(*section) for section in sections if section[1]),
    )


def _is_printed(metric: Metric) -> bool:
    return metric.decimals is not None and not metric.is_published


def _row(metric: Metric) -> TableRow:
    unit = ""
    if metric.unit:
        unit = f" ({metric.unit})"
    return TableRow(f"{metric.title}{unit}", metric.mean_key or "", metric.decimals or 0)
