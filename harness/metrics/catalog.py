"""Every metric and column, declared in ``catalog.toml`` and, with formulas, in ``formulas.py``.

Means, tables and docs/metrics.md are made from it.

A new statistic of a recorded series is one entry of the former, a new formula over such series one
of the latter; any other metric needs one value in the episode's row besides.
"""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from harness.metrics.formulas import FORMULAS
from harness.metrics.metric import Better, Metric


def _metrics(entries: Mapping[str, Mapping[str, Any]]) -> tuple[Metric, ...]:
    return tuple(
        Metric(key=key, **{**entry, "better": Better[entry["better"].upper()]})
        for key, entry in entries.items()
    )


CATALOG = tomllib.loads(Path(__file__).with_name("catalog.toml").read_text(encoding="utf-8"))

# Columns that are no metrics: which delivery it was, and how it ended in words. Name -> Arrow type,
# meaning.
FACTS: dict[str, tuple[str, str]] = {
    key: (kind, meaning) for key, (kind, meaning) in CATALOG["facts"].items()
}
GROUPS = {
    title: FORMULAS.get(title, ()) + _metrics(entries)
    for title, entries in CATALOG["groups"].items()
}
EPISODE_METRICS = tuple(metric for group in GROUPS.values() for metric in group)
RUN_METRICS = _metrics(CATALOG["run"])  # what only a run has, over its finished deliveries
