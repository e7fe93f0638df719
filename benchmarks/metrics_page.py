"""docs/metrics.md, made from the catalog.

Usage: python benchmarks/metrics_page.py > docs/metrics.md
"""

import sys
from collections.abc import Sequence

from harness.metrics.catalog import FACTS, GROUPS, RUN_METRICS
from harness.metrics.metric import Metric

HEAD = """\
# Metrics

Made from `harness/metrics/catalog.toml` by `python benchmarks/metrics_page.py > docs/metrics.md`; a test keeps both
together.

Each delivery is one row of `episodes.parquet`. A unit is at the end of its column's name; a column without one is a
number. What is undefined is null, never 0. "mean as" names the mean over deliveries in the JSON document of
`navbench run`, under `measured`, with its 95 % interval and its number of deliveries under `intervals`. Means of the
paper's table are undefined where a delivery's value is; all others are over the deliveries where the value is defined.

Everything is measured on the true state of the world at the end of every tick, none of it on what the robot
believes; only localization errors compare both. A tick is the longest time after which every part of the brain can run
when it is due: 1/60 s for most shipped Nav2 files, 1/20 s for `stock.yaml`, 1/30 s for `mpc.yaml`. "ours" marks
definitions that are not taken from elsewhere.

The delay of people needs a second crowd, which takes time where people make way; all else costs next to nothing.
"""


def page() -> str:
    """The document."""
    parts = [HEAD]
    for group, metrics in GROUPS.items():
        parts += [f"## {group}", "", *_table(metrics), ""]
    parts += ["## Of a run only", "", *_table(RUN_METRICS), ""]
    parts += ["## Columns that are no metrics", "", "| column | meaning |", "| --- | --- |"]
    parts += [f"| `{key}` | {meaning} |" for key, (_, meaning) in FACTS.items()]
    return "\n".join(parts) + "\n"


def _table(metrics: Sequence[Metric]) -> list[str]:
    rows = ["| metric | unit | better | definition | source | null when | mean as |", "| --- " * 7 + "|"]
    for metric in metrics:
        mean = f"`{metric.mean_key}`" if metric.mean_key else ""
        cells = (metric.unit, metric.better.value, metric.meaning, metric.source, metric.undefined or "never", mean)
        rows.append(f"| `{metric.key}` | {' | '.join(cells)} |")
    return rows


if __name__ == "__main__":
    sys.stdout.write(page())
