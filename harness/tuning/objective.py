"""What a study makes as large as it can.

``margin``: the mean contribution margin [USD/run]. ``cvar``: half the mean, half the mean of the
worst 10 % of the deliveries (conditional value at risk: Rockafellar and Uryasev 2000, "Optimization
of conditional value-at-risk"): the one without the rare disaster of two files that earn alike.
``capped_margin``: the mean margin where no delivery loses more than 100 USD. ``shared_margin``: the
same where the robot pays for every contact with a person, however soft, by its share of the fault
(accounting ``no_threshold_shared_fault``). ``lower_bound``: the one-sided 95 % lower confidence
bound of the mean margin by Student's t. ``margin@sla>=0.9``: the mean margin, of those whose share
of deliveries in time and intact is at least 0.9. The name of any metric of ``docs/metrics.md``: its
mean, in the direction that is better; where none is, or the other is wanted, ``-name`` for small
and ``+name`` for large values.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from harness.economics.valuation import CENT, column
from harness.metrics.catalog import EPISODE_METRICS
from harness.metrics.columns import Row
from harness.metrics.metric import Better
from harness.statistics.bootstrap import cvar
from harness.statistics.interval import wilson_interval
from harness.tuning.evaluation import MARGIN, SHARED_MARGIN
from harness.world.outcome import OUTCOMES, Outcome
from navstack.errors import InputError, UnknownNameError
from navstack.types import FloatArray

TAIL = 0.10  # share of the deliveries that are the worst
TAIL_WEIGHT = 0.5  # of their mean in ``cvar``
CONFIDENCE = 0.95
# [USD/run] that missing the whole SLA costs in the sampler's eyes: 10 USD per per cent
USD_PER_SHARE = 1000.0
MOST_LOSS = 100.0  # [USD] of a delivery that ``capped_margin`` and ``shared_margin`` count
NEED_CARGO = ("sla", "spoiled")  # outcomes that nobody knows where the cargo is not modelled


class UndefinedError(InputError):
    """Deliveries have no value of an objective."""


@dataclass(frozen=True, slots=True)
class Objective:
    """What is maximized: by default the mean of one number per delivery."""

    name: str  # as the user gave it
    column: str = MARGIN
    sign: float = 1.0  # -1: small values are wanted

    @property
    def resolution(self) -> float:
        """A gain up to this is none: a cent of money is a few metres of electricity."""
        if self.column in (MARGIN, SHARED_MARGIN):
            return CENT
        return 0.0

    def value(self, rows: Sequence[Row], total: int) -> float:
        """The value of deliveries that stand for ``total`` of their kind.

        Raises:
            UndefinedError: it has none.
        """
        known = [score for score in self.scores(rows, rows) if not math.isnan(score)]
        if not known:
            raise UndefinedError(
                f"objective '{self.name}': no delivery has a value of {self.column}; choose another"
            )
        return float(np.mean(known))

    def scores(self, rows: Sequence[Row], reference: Sequence[Row]) -> FloatArray:
        """One number per delivery, shape (n,), of which the objective is, or all but is, the mean.

        For paired tests.

        NaN where undefined. ``reference`` are deliveries that give a level where one is needed, the
        same for both sides of a pair.
        """
        if self.column == MARGIN:
            return self.sign * margins(rows, self.name)
        if self.column in OUTCOMES:
            if self.column in NEED_CARGO and any(
                row["outcome"] == Outcome.ARRIVED.value for row in rows
            ):
                raise UndefinedError(
                    f"objective '{self.name}' is undefined: the cargo was not simulated"
                )
            return np.array([self.sign * (row["outcome"] == self.column) for row in rows])
        return self.sign * column(rows, self.column)

    @property
    def measured(self) -> "Objective":
        """What reports show: the quantity alone, without the penalty of a missed side condition."""
        return self

    def shortfall(self, rows: Sequence[Row]) -> float:
        """By how much a side condition is missed, 0: it is kept, or there is none."""
        return 0.0

    def is_hopeless(self, rows: Sequence[Row]) -> bool:
        """Whether the side condition is out of reach."""
        return False


class CappedMean(Objective):
    """The mean of a column of margins, none of which counts for less than -:data:`MOST_LOSS`."""

    __slots__ = ()

    def scores(self, rows: Sequence[Row], reference: Sequence[Row]) -> FloatArray:
        """See the base class (winsorized: e.g. Wilcox 2012, section 3.3)."""
        return np.maximum(margins(rows, self.name, self.column), -MOST_LOSS)


class MeanAndTail(Objective):
    """Half the mean margin, half the mean of the worst."""

    __slots__ = ()

    def value(self, rows: Sequence[Row], total: int) -> float:
        """See the base class."""
        values = margins(rows, self.name)
        return float((1.0 - TAIL_WEIGHT) * values.mean() - TAIL_WEIGHT * cvar(-values, 1.0 - TAIL))

    def scores(self, rows: Sequence[Row], reference: Sequence[Row]) -> FloatArray:
        """Rockafellar and Uryasev's linear form about the reference's quantile t.

        T - max(t - margin, 0) / share.

        Its mean is the mean of the worst for the reference, and for others a bound from below.
        """
        values, level = (
            margins(rows, self.name),
            float(np.quantile(margins(reference, self.name), TAIL)),
        )
        worst = level - np.maximum(level - values, 0.0) / TAIL
        return np.asarray((1.0 - TAIL_WEIGHT) * values + TAIL_WEIGHT * worst)


class LowerBound(Objective):
    """The lower confidence bound of the mean margin."""

    __slots__ = ()

    def value(self, rows: Sequence[Row], total: int) -> float:
        """See the base class; one delivery has no bound but its margin."""
        values = margins(rows, self.name)
        if len(values) < 2:
            return float(values.mean())
        factor = float(student.ppf(CONFIDENCE, total - 1)) / math.sqrt(total)
        return float(values.mean() - factor * values.std(ddof=1))


@dataclass(frozen=True, slots=True)
class MarginAtSla(Objective):
    """The mean margin where the SLA is kept."""

    least: float = 0.9  # share of deliveries

    @property
    def measured(self) -> Objective:
        """The mean margin."""
        return Objective(self.name)

    def value(self, rows: Sequence[Row], total: int) -> float:
        """The mean margin less a penalty in proportion to the missing share (Fletcher 1987)."""
        return float(margins(rows, self.name).mean()) - USD_PER_SHARE * self.shortfall(rows)

    def scores(self, rows: Sequence[Row], reference: Sequence[Row]) -> FloatArray:
        """The margins, with the penalty of each delivery where the reference misses the SLA."""
        penalty = 0.0
        if self.shortfall(reference) > 0.0:
            penalty = USD_PER_SHARE
        return margins(rows, self.name) - penalty * np.array(
            [row["outcome"] != "sla" for row in rows]
        )

    def shortfall(self, rows: Sequence[Row]) -> float:
        """Of the share."""
        return max(0.0, self.least - sum(bool(row["outcome"] == "sla") for row in rows) / len(rows))

    def is_hopeless(self, rows: Sequence[Row]) -> bool:
        """Whether even the upper end of the share's interval lies below."""
        high = wilson_interval(sum(row["outcome"] == "sla" for row in rows), len(rows)).high
        return high is not None and high < self.least


OF_MONEY = {
    each.name: each
    for each in (
        Objective("margin"),
        CappedMean("capped_margin"),
        CappedMean("shared_margin", SHARED_MARGIN),
        MeanAndTail("cvar"),
        LowerBound("lower_bound"),
    )
}
NAMES = (*OF_MONEY, "margin@sla>=0.9")


def parse_objectives(text: str) -> tuple[Objective, ...]:
    """The objectives of a text such as ``margin`` or ``margin,-pedestrian_delay_s``.

    Raises:
        UnknownNameError: one that there is not; the message offers the nearest.
        InputError: one given twice, or a share that is none.
    """
    names = [name.strip() for name in text.split(",")]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"--objective names '{twice}' twice; name each once")
    return tuple(_parse(name) for name in names)


def is_money(name: str) -> bool:
    """Whether an objective is in [USD/run]."""
    return name in OF_MONEY or name.startswith("margin@")


def score_text(name: str, value: float) -> str:
    """An objective's value: money to a cent, metrics of whatever size to four digits."""
    if is_money(name):
        return f"{value:z.2f}"
    return f"{value:.4g}"


def margins(rows: Sequence[Row], name: str, key: str = MARGIN) -> FloatArray:
    """Contribution margins [USD], shape (n,).

    Raises:
        UndefinedError: the cargo is not modelled, so that there are none.
    """
    values = [row[key] for row in rows]
    if any(value is None for value in values):
        raise UndefinedError(
            f"objective '{name}' needs a margin, which this world has not: nobody models its "
            "cargo; choose a metric"
        )
    return np.array(values, dtype=np.float64)


def _parse(name: str) -> Objective:
    if name in OF_MONEY:
        return OF_MONEY[name]
    if name.startswith("margin@"):
        return _parse_sla(name)
    metric = name.lstrip("+-")
    directions = {each.key: each.better for each in EPISODE_METRICS}
    directions |= {
        outcome: Better.HIGHER if outcome == "sla" else Better.LOWER for outcome in OUTCOMES
    }
    if metric not in directions or len(name) - len(metric) > 1:
        raise UnknownNameError("objective", name, (*NAMES, *directions))
    if name == metric and directions[metric] not in (Better.HIGHER, Better.LOWER):
        raise InputError(
            f"objective '{name}': neither small nor large values are better; give -{name} or "
            f"+{name}"
        )
    is_small = name.startswith("-") or (name == metric and directions[metric] is Better.LOWER)
    return Objective(name, metric, -1.0 if is_small else 1.0)


def _parse_sla(name: str) -> Objective:
    condition = name.removeprefix("margin@").replace(" ", "")
    try:
        least = float(condition.removeprefix("sla>="))
    except ValueError:
        least = -1.0
    if not condition.startswith("sla>=") or not 0.0 < least <= 1.0:
        raise InputError(
            f"objective '{name}' is not margin@sla>=SHARE; give a share above 0, at most 1, e.g. "
            "0.9"
        )
    return MarginAtSla(name, least=least)
