"""The rows of the printed tables: which quantity, under which label, with how many decimals."""

import tomllib
from dataclasses import dataclass
from pathlib import Path

from harness.metrics.catalog import GROUPS
from harness.metrics.metric import Metric
from navstack.params.strict import from_mapping


@dataclass(frozen=True, slots=True)
class Row:
    """One quantity."""

    label: str
    key: str  # field of Measured or Economics
    decimals: int
    bold: bool = False
    absent: str = "--"  # what stands where the quantity is undefined


@dataclass(frozen=True, slots=True)
class Section:
    """Rows under one heading."""

    title: str
    rows: tuple[Row, ...]


@dataclass(frozen=True, slots=True)
class Layout:
    """One table."""

    title: str
    sections: tuple[Section, ...]


LAYOUTS = tuple(
    from_mapping(Layout, layout, "table_rows.toml")
    for layout in tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))["layouts"]
)


def further_metrics() -> Layout:
    """Means over deliveries that the paper's tables do not have, group by group."""
    sections = (
        (title, tuple(_row(metric) for metric in group if _is_printed(metric))) for title, group in GROUPS.items()
    )
    return Layout(
        "Further metrics (means over deliveries)", tuple(Section(*section) for section in sections if section[1])
    )


def _is_printed(metric: Metric) -> bool:
    return metric.decimals is not None and not metric.is_published


def _row(metric: Metric) -> Row:
    unit = f" ({metric.unit})" if metric.unit else ""
    return Row(f"{metric.title}{unit}", metric.mean_key or "", metric.decimals or 0)
