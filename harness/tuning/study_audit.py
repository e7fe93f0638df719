"""The audit of a study: its deliveries, and two checks on its search.

These are what a tuned file computes, and values at the edge of their range. Latency costs nothing
in simulation, and a tuned value at an edge may have its best beyond. There an alarm needs a trend
that goes on to the edge; a value that lies there without one is named to be looked at.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy import stats

from harness.audit.auditor import Audit, audit, unexamined
from harness.audit.findings import LEVEL, AuditEvidence, Check
from harness.audit.pairs import Conditions, pair_up
from harness.economics.prices import Prices
from harness.tuning.result import StudyResult, TrialTable, least_squares, trial_table
from harness.tuning.space.space import Parameter

MOST = 2.0  # times the original's computing
MULTIPLIES = frozenset(  # parameters that the controller's work per second is proportional to
    (
        "controller_frequency",
        "vx_samples",
        "vy_samples",
        "vtheta_samples",
        "sim_time",
        "batch_size",
        "time_steps",
        "iteration_count",
    )
)
SPARE = 10  # trials beyond two for each other parameter of the response surface, at least
NEAR = 0.1  # of a range (in its logarithm where it is so) that is near its edge
AT_END = 0.03  # of a range: a value so near to its end is for the reader to look at, trend or not
FINE = 1e-9


@dataclass(frozen=True, slots=True)
class Edge:
    """A tuned value near an end of its range."""

    parameter: Parameter
    value: float
    distance: float  # of the range, from the value to the end
    is_high: bool  # the end is the upper one
    p_near: float  # that a value without effect on the objective lies so near to an end
    p_trend: float  # one-sided, that the objective does not rise towards that end

    @property
    def p(self) -> float:
        """Both by Fisher's method (1932): near for no reason, and no rise either."""
        product = self.p_near * self.p_trend
        if product == 0.0:
            return 0.0
        return product * (1.0 - math.log(product))


def audit_study(study: StudyResult, prices: Prices, conditions: Conditions) -> Audit:
    """Hold the incumbent against the original.

    Args:
        study: with test rows, or with training rows alone; rows with their events where single
            contacts are to be told.
        prices: the price file.
        conditions: that the world and its rules set.
    """
    pairs = pair_up(*study.judged_rows, prices, study.seed)
    found = audit(pairs, conditions, any("shared" in name for name in study.objectives))
    checks = found.checks
    if not study.incumbent.values:
        checks = unexamined("the file is unchanged")
    return Audit((*checks, computing(study), edges(study)), found.scores, found.missions)


def computing(study: StudyResult) -> Check:
    """How much more the tuned file computes per second than the original, by its parameters."""
    tuned, original = study.incumbent.values, study.original.values
    factors = {}
    for parameter in study.space.parameters:
        for path in parameter.paths:
            before, after = original.get(path, parameter.original), tuned.get(path)
            if path.rpartition(".")[2] in MULTIPLIES and _is_amount(before) and _is_amount(after):
                factors[path] = float(after) / float(before)  # type: ignore[arg-type]
    times = math.prod(factors.values())
    return Check(
        "compute",
        times > MOST,
        f"the controller computes {times:.2g} times as much per second by its parameters",
        (AuditEvidence.unsampled("computing per second", "times", 1.0, times, 1),),
        is_examined=bool(factors),
    )


def edges(study: StudyResult) -> Check:
    """Tuned values near an end of their range, flagged where that is no chance."""
    table = trial_table(study.space, study.trials)
    # for the response surface of _p_of_trend
    if len(table.trials) < 2 * max(len(table.varied) - 1, 0) + SPARE:
        count = len(table.parameters)
        few = f"{len(table.trials)} trials are too few to tell a trend of {count} parameters"
        return Check("edge", False, few, is_examined=False)
    found = [_edge(study, table, number) for number in range(len(table.parameters))]
    near = [edge for edge in found if edge is not None]
    tested = sum(_is_tuned(study, parameter) for parameter in study.space.parameters)
    flagged = [edge for edge in near if edge.p <= LEVEL / tested]
    shown = flagged or near
    if shown:
        text = "; ".join(map(_sentence, shown))
    elif tested:
        text = f"none of the {tested} tuned values is near an end of its range"
    else:
        text = "no value was tuned"
    at_end = ""
    if not flagged:
        at_end = "; ".join(_sentence(edge) for edge in near if edge.distance <= AT_END)
    return Check(
        "edge",
        bool(flagged),
        text,
        tuple(map(_evidence, shown)),
        is_examined=tested > 0,
        look=at_end,
    )


def _is_tuned(study: StudyResult, parameter: Parameter) -> bool:
    """Whether the incumbent has another value than the original of a parameter with ends."""
    return parameter.is_ordered and any(path in study.incumbent.values for path in parameter.paths)


def _edge(study: StudyResult, table: TrialTable, number: int) -> Edge | None:
    """The end that the incumbent's value is near to.

    None: it is not, or the tuner left it as it was.
    """
    parameter = table.parameters[number]
    if not _is_tuned(study, parameter):
        return None
    value = study.tuned(parameter)
    where = parameter.place(value)
    distance, is_high = min((where, False), (1.0 - where, True))
    if distance > NEAR + FINE:
        return None
    p_trend = _p_of_trend(table, number, is_high)
    return Edge(
        parameter,
        float(value),
        distance,
        is_high,
        _p_near(table, number, distance),
        p_trend,
    )


def _p_near(table: TrialTable, number: int, distance: float) -> float:
    """Probability that a random value lies so near to an end of the range.

    It is twice the distance; on a grid of k levels it is at least 2 / k.
    """
    tried = np.unique(table.places[:, number])
    is_grid = 2 * tried.size <= len(table.trials)
    parameter = table.parameters[number]
    if parameter.choices:
        levels: float = len(parameter.choices)
    elif parameter.is_int or parameter.step is not None:
        levels = (parameter.high - parameter.low) / (parameter.step or 1.0) + 1.0
    elif is_grid:
        levels = tried.size
    else:
        levels = math.inf
    return min(1.0, max(2.0 * distance, 2.0 / levels))


def _p_of_trend(table: TrialTable, number: int, is_high: bool) -> float:
    """One-sided p of the objective's rise at an end of a range, other parameters held.

    A quadratic response surface of the objective's ranks (Box and Wilson 1951) without products.
    All parameters stand in it, as a sampler that dwells on what is good makes trials alike also in
    what does not matter.
    """
    if number not in table.varied or np.ptp(table.objective) == 0.0:
        return 1.0
    varied = [other for other in table.varied if other != number]
    inward = 1.0 - table.places[:, number] if is_high else table.places[:, number]  # from the end
    others = table.places[:, varied] - table.places[:, varied].mean(axis=0)
    design = np.column_stack([np.ones(len(inward)), inward, inward**2, others, others**2])
    answer = stats.rankdata(table.objective)
    solution, left, rank = least_squares(design, answer)
    freedom = len(answer) - rank
    variance = left / freedom * np.linalg.pinv(design.T @ design)[1, 1]
    if variance <= 0.0:
        return 1.0
    return float(stats.t.cdf(solution[1] / math.sqrt(variance), freedom))


def _sentence(edge: Edge) -> str:
    low, *_, high = edge.parameter.choices or (edge.parameter.low, edge.parameter.high)
    limit = float(high if edge.is_high else low)
    end = f"the {'upper' if edge.is_high else 'lower'} end {limit:g}"
    if edge.distance <= FINE:
        return f"{edge.parameter.name} = {edge.value:g} is {end}"
    distance = f"{100.0 * edge.distance:.2g} % of its range"
    return f"{edge.parameter.name} = {edge.value:g} is {distance} from {end}"


def _evidence(edge: Edge) -> AuditEvidence:
    original = edge.parameter.original
    number = None
    if isinstance(original, int | float):
        number = float(original)
    return AuditEvidence.unsampled(
        edge.parameter.name,
        edge.parameter.unit,
        number,
        edge.value,
        1,
        edge.p,
    )


def _is_amount(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and value > 0
