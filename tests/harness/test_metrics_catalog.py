"""Each metric is declared once, and everything else is made from that."""

import pytest

from harness.economics.measured import Measured
from harness.metrics.catalog import EPISODE_METRICS, FACTS, RUN_METRICS
from harness.metrics.columns import EPISODE_COLUMNS
from harness.metrics.summary import summarize
from harness.report.table_rows import LAYOUTS, further_metrics
from harness.world.outcome import OUTCOMES


def test_no_column_and_no_mean_is_declared_twice():
    keys = [*FACTS, *(metric.key for metric in EPISODE_METRICS)]
    means = [metric.mean_key for metric in EPISODE_METRICS if metric.mean_key]
    assert len(set(keys)) == len(keys) == len(EPISODE_COLUMNS)
    assert len(set(means)) == len(means)


@pytest.mark.parametrize("metric", [*EPISODE_METRICS, *RUN_METRICS], ids=lambda metric: metric.key)
def test_a_metrics_words_are_there(metric):
    assert metric.title and metric.source and metric.meaning.endswith(".")


def test_the_papers_table_is_whole():
    row = {metric.key: 1.0 for metric in EPISODE_METRICS} | {"outcome": "sla"}
    summary = summarize([row, row], 20.0)
    Measured(**summary)  # refuses a missing or an unknown key
    assert summary["avg_runtime_h"] == 1.0 / 3600.0
    assert summary["avg_distance_km"] == 1.0 / 1000.0
    assert summary["avg_mechanical_power_kw"] == 0.02
    assert summary["sla"] == 1.0


def test_every_row_of_the_tables_is_declared():
    declared = {metric.key for metric in RUN_METRICS} | {
        metric.mean_key for metric in EPISODE_METRICS
    }
    for layout in (LAYOUTS[0], further_metrics()):
        assert {row.key for section in layout.sections for row in section.rows} <= declared
    assert {metric.key for metric in RUN_METRICS} >= set(OUTCOMES)
