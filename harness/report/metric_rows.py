"""The rows of the table of further metrics, made from their catalog."""

from harness.metrics.catalog import GROUPS
from harness.metrics.metric import Metric
from harness.report.table_rows import Layout, Row, Section


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
