"""OMPL's algorithms on one query, within a budget, and how the best path improved meanwhile."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import ompl.base as ob
import ompl.geometric as og
import ompl.util as ou
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from navstack.planning.ompl_problem import Query, make_problem, reader
from navstack.types import FloatArray

# [s]; a benchmark on a busy machine may take another
clock: Callable[[], float] = time.perf_counter
WATCH_EVERY = 50  # checks of the budget between two looks at the best cost so far
WORTH_IT = 1e-3  # of the cost, by which a path must get better for the search to go on
FEWEST_SAMPLES = 1000  # of the first of FMT's searches against the clock
# of FMT's budget: about one in five samples is free, and each is expanded once
CHECKS_PER_SAMPLE = 8
# of PRM*, times the logarithm of the number of states (Karaman and Frazzoli, 2011)
NEIGHBOURS = 2.0 * math.e

ou.setLogLevel(ou.LOG_NONE)  # it writes to standard output otherwise


@dataclass(frozen=True, slots=True, eq=False)
class OmplResult:
    """What came of a search."""

    states: FloatArray | None  # (N, 2) or (N, 3) in [cells]; None: no path
    # wall time [s] and cost [cells] whenever the best path got better
    improvement: tuple[tuple[float, float], ...]


class Budget:
    """How often OMPL may ask whether to stop, and for how long.

    It looks at the best cost while it is asked.
    """

    def __init__(self, checks: int, seconds: float, patience: int) -> None:
        """Begin.

        Args:
            checks: how often it may be asked.
            seconds: of wall time; 0: no limit. A limit makes plans depend on the machine.
            patience: checks without an improvement worth it, after which it ends; 0: all of them.
        """
        self._left = checks
        self._patience = patience
        # the last cost that was worth it, checks left then
        self._worth: tuple[float, int] = (math.inf, checks)
        self._begin = clock()
        self._end = self._begin + (seconds or math.inf)
        self.best_cost: Callable[[], float] | None = None  # asked now and then
        self.improvement: list[tuple[float, float]] = []

    def __call__(self) -> bool:
        """Whether to stop."""
        self._left -= 1
        if self._left % WATCH_EVERY == 0 and self.best_cost is not None:
            self.note(self.best_cost())
        return self._left < 0 or self.is_late or self._is_settled

    @property
    def is_late(self) -> bool:
        """Whether the time is over."""
        return self._end < math.inf and clock() > self._end

    @property
    def has_time_limit(self) -> bool:
        """Whether time is what is limited."""
        return self._end < math.inf

    @property
    def _is_settled(self) -> bool:
        cost, left = self._worth
        return self._patience > 0 and cost < math.inf and left - self._left > self._patience

    def note(self, cost: float) -> None:
        """Take down a cost, where it is the lowest so far."""
        if math.isfinite(cost) and (
            not self.improvement or cost < self.improvement[-1][1] * (1.0 - 1e-9)
        ):
            self.improvement.append((clock() - self._begin, cost))
            if cost < self._worth[0] * (1.0 - WORTH_IT):
                self._worth = (cost, self._left)


def _solve(
    query: Query,
    make: Any,
    reach: float,
    budget: Budget,
    samples: int = 0,
) -> FloatArray | None:
    """Let OMPL search until it is done or the budget is used up.

    The states of the path, or None.
    """
    information, definition = make_problem(query)
    planner = make(information)
    if hasattr(planner, "setRange"):
        planner.setRange(reach)
    if samples:
        planner.setNumSamples(samples)
    planner.setProblemDefinition(definition)
    planner.setup()
    if hasattr(planner, "bestCost"):
        budget.best_cost = lambda: float(planner.bestCost().value())
    planner.solve(ob.PlannerTerminationCondition(budget))
    budget.best_cost = None
    if not definition.hasExactSolution():
        return None
    read = reader(query)
    return np.array([read(state) for state in definition.getSolutionPath().getStates()])


def _grow(name: str) -> Callable[[Query, float, int, Budget], FloatArray | None]:
    """A search that grows trees until the budget is spent or, with no optimum, until they meet."""
    return lambda query, reach, _, budget: _solve(query, getattr(og, name), reach, budget)


def _bit_star(query: Query, reach: float, _: int, budget: Budget) -> FloatArray | None:
    """BIT* without pruning its graph, which may end the process (OMPL's issues 949 and 1317)."""

    def make(information: Any) -> Any:
        planner = og.BITstar(information)
        planner.setPruning(False)
        return planner

    return _solve(query, make, reach, budget)


def _fmt(query: Query, reach: float, checks: int, budget: Budget) -> FloatArray | None:
    """FMT*.

    Against the clock with twice the samples again and again, for it has no path before it is done.
    """
    if not budget.has_time_limit:
        samples = max(1, checks // CHECKS_PER_SAMPLE)
        return _solve(query, og.FMT, reach, Budget(20 * checks, 0.0, 0), samples)
    best = None
    lowest = math.inf
    samples = FEWEST_SAMPLES
    while not budget.is_late:
        states = _solve(query, og.FMT, reach, budget, samples)
        if states is not None and (cost := path_cost(query, states)) < lowest:
            best = states
            lowest = cost
            budget.note(cost)
        samples *= 2
    return best


def _prm_star(query: Query, _: float, checks: int, budget: Budget) -> FloatArray | None:
    """PRM*: OMPL grows the road map, the way through it is found here.

    OMPL looks for the way in a second thread, which waits for ever where checks are written in
    Python, and alternates between growing and expanding by the clock, which would make plans
    differ.
    """
    information, definition = make_problem(query)
    planner = og.PRMstar(information)
    planner.setProblemDefinition(definition)
    planner.setup()
    planner.growRoadmapPtc(ob.PlannerTerminationCondition(budget))
    data = ob.PlannerData(information)
    planner.getPlannerData(data)
    read = reader(query)
    states = [read(data.getVertex(i).getState()) for i in range(data.numVertices())]
    edges = [(i, int(j)) for i in range(len(states)) for j in data.getEdges(i) if i < int(j)]
    nodes = np.array([*states, query.first, query.last], dtype=np.float64)
    for end in (len(states), len(states) + 1):
        nearest = np.argsort(np.hypot(*(nodes - nodes[end]).T), kind="stable")
        near = nearest[1 : 1 + math.ceil(NEIGHBOURS * math.log(len(nodes)))]
        edges += [(end, int(j)) for j in near if query.can_drive(nodes[end], nodes[j])]
    return _shortest(query, nodes, edges)


def _shortest(query: Query, nodes: FloatArray, edges: list[tuple[int, int]]) -> FloatArray | None:
    """The cheapest way from the last but one of the nodes (N, 2) to the last one, or None."""
    if not edges:
        return None
    pairs = np.array(edges)
    costs = [query.cost(nodes[pair]) for pair in pairs]
    graph = csr_array((costs, (pairs[:, 0], pairs[:, 1])), shape=(len(nodes), len(nodes)))
    _, before = dijkstra(graph, directed=False, indices=len(nodes) - 2, return_predecessors=True)
    way = [len(nodes) - 1]
    while way[-1] != len(nodes) - 2:
        if before[way[-1]] < 0:
            return None
        way.append(int(before[way[-1]]))
    return nodes[way[::-1]]


# Which search an algorithm's name stands for: of a query, the longest extension [cells], the checks
# allowed, a budget.
ALGORITHMS: dict[str, Callable[[Query, float, int, Budget], FloatArray | None]] = {
    "BITstar": _bit_star,
    "FMT": _fmt,
    "InformedRRTstar": _grow("InformedRRTstar"),
    "PRMstar": _prm_star,
    "RRTConnect": _grow("RRTConnect"),
    "RRTstar": _grow("RRTstar"),
}


def search(
    query: Query,
    algorithm: str,
    reach: float,
    checks: int,
    seconds: float,
    patience: int,
    seed: int,
) -> OmplResult:
    """Search with an algorithm of :data:`ALGORITHMS`.

    Args:
        query: what is asked.
        algorithm: its name.
        reach: longest extension of a tree [cells].
        checks: how often OMPL may ask whether to stop.
        seconds: wall time after which it has to; 0: none.
        patience: how often it may ask without a path getting better; 0: as often as ``checks``
            says.
        seed: of all chance in OMPL.
    """
    ou.RNG.setSeed(seed)  # what OMPL creates from here on draws its own seed from this one
    budget = Budget(checks, seconds, patience)
    states = ALGORITHMS[algorithm](query, reach, checks, budget)
    if states is not None:
        budget.note(path_cost(query, states))
    return OmplResult(states, tuple(budget.improvement))


def path_cost(query: Query, states: FloatArray) -> float:
    """Of a path through states (N, 2) or (N, 3), in [cells]."""
    return sum(query.way_cost(a, b) for a, b in zip(states[:-1], states[1:], strict=True))
