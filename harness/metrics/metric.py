"""What a metric is."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

import numpy as np

from navstack.types import FloatArray

UNITS = {  # by the end of a key
    "m": "m",
    "s": "s",
    "mps": "m/s",
    "mps2": "m/s2",
    "mps3": "m/s3",
    "rad": "rad",
    "radpm": "rad/m",
    "kwh": "kWh",
    "kw": "kW",
    "ns": "N s",
    "usd": "USD",
    "percent": "%",
}
STATISTICS: Mapping[str, Callable[[FloatArray], Any]] = {
    "min": np.min,
    "mean": np.mean,
    "median": lambda values: np.percentile(values, 50.0),
    "p95": lambda values: np.percentile(values, 95.0),
    "max": np.max,
}


class Better(Enum):
    """Which way a metric is better."""

    HIGHER = "higher"
    LOWER = "lower"
    NEITHER = "–"  # a fact, not a merit


@dataclass(frozen=True, slots=True)
class Metric:
    """One measured quantity of a delivery."""

    key: str  # column of episodes.parquet; the unit is at its end
    title: str  # in a table
    better: Better
    meaning: str  # one or two sentences, source of a formula included
    source: str  # section of the paper, literature with its year, or "ours"
    undefined: str = ""  # when it is null; empty: never
    is_count: bool = False  # a whole number
    # of the mean over deliveries in the JSON document; None: it has none
    mean_key: str | None = None
    mean_divisor: float = 1.0  # by which the mean is divided, for another unit
    # of the mean in the printed table of further metrics; None: not printed
    decimals: int | None = None
    is_published: bool = False  # whether that mean is part of the paper's table
    series: str = ""  # recorded series that it is a statistic of; empty: it is measured otherwise
    statistic: str = ""  # of STATISTICS
    # over the recorded series; None: it is measured otherwise
    formula: Callable[[Mapping[str, FloatArray]], float | None] | None = None

    @property
    def unit(self) -> str:
        """Of the column; empty: it is a number."""
        return UNITS.get(self.key.rpartition("_")[2], "")

    @property
    def arrow_type(self) -> str:
        """Type of the column."""
        if self.is_count:
            return "int64"
        return "double"

    @property
    def is_of_series(self) -> bool:
        """Whether :meth:`measured` works it out."""
        return bool(self.series) or self.formula is not None

    def measured(self, series: Mapping[str, FloatArray]) -> float | None:
        """Its formula, or the statistic of its series; None where that is empty."""
        if self.formula is not None:
            return self.formula(series)
        values = series[self.series]
        if not len(values):
            return None
        return float(STATISTICS[self.statistic](values))
