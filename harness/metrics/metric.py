"""What a metric is."""

from dataclasses import dataclass
from enum import Enum

PAPER = "CostNav, arXiv:2511.20216"
OURS = "ours"


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
    unit: str  # empty: a number
    better: Better
    meaning: str  # one or two sentences, source of a formula included
    source: str  # section of the paper, literature with its year, or "ours"
    undefined: str = ""  # when it is null; empty: never
    is_count: bool = False  # a whole number
    mean_key: str | None = None  # of the mean over deliveries in the JSON document; None: it has none
    mean_divisor: float = 1.0  # by which the mean is divided, for another unit
    decimals: int | None = None  # of the mean in the printed table of further metrics; None: not printed
    is_published: bool = False  # whether that mean is part of the paper's table

    @property
    def arrow_type(self) -> str:
        """Type of the column."""
        return "int64" if self.is_count else "double"


def count(key: str, title: str, meaning: str, source: str, better: Better = Better.LOWER, mean: bool = True) -> Metric:
    """A metric that counts something and is always defined."""
    mean_key, decimals = (f"avg_{key}", 2) if mean else (None, None)
    return Metric(key, title, "", better, meaning, source, is_count=True, mean_key=mean_key, decimals=decimals)
