"""With how many missions does an objective tell which of two stacks earns more?

Usage: python benchmarks/objective_power.py [RUN] [--base STACK] [--missions N ...] [--draws N] [--seed S]

RUN is a folder of ``navbench run`` with several stacks on the same missions (default: results/baseline/controllers).
Missions are drawn from it with replacement; shares are those of the draws in which the mean of an objective says of a
stack and the base what the mean margin of the whole run says. What is asked of is each accounting of contacts
(docs/money.md) as it is and with no delivery losing more than the cap of ``capped_margin`` and ``shared_margin``, and
measures of near misses. The means at the end of a row tell of its bias: they are that objective's own order of stacks.
"""

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq

from harness.economics.accountings import ACCOUNTINGS, accounted
from harness.economics.cost_model import running
from harness.economics.prices import Prices
from harness.economics.valuation import deliveries
from harness.episode.factory import prices_of
from harness.metrics import Row
from harness.report.markdown import table
from harness.tuning.objective import MOST_LOSS
from navstack.types import FloatArray

PUBLISHED = "published"
NEAR_MISSES = {"-intimate_intrusion_s": -1.0, "-personal_intrusion_s": -1.0}  # objective -> its sign


def margins(rows: Sequence[Row], events: Sequence[Row], accounting: str, prices: Prices) -> FloatArray:
    """Contribution margin [USD] of each delivery under an accounting, shape (n,)."""
    each = accounted(deliveries(rows, prices.rolling_resistance_force), rows, events, accounting, prices)
    return np.asarray(running(each, prices).contribution_margin, dtype=np.float64)


def objectives(rows: Sequence[Row], events: Sequence[Row], prices: Prices) -> dict[str, FloatArray]:
    """Scores of one stack's deliveries by the name of the objective, shape (n,) each."""
    found = {}
    for name in ACCOUNTINGS:
        values = margins(rows, events, name, prices)
        found[name] = values
        found[f"{name}, capped"] = np.maximum(values, -MOST_LOSS)
    for name, sign in NEAR_MISSES.items():
        found[name] = sign * np.array([row[name[1:]] for row in rows], dtype=np.float64)
    return found


def agreement(differences: FloatArray, truth: float, count: int, draws: int, rng: np.random.Generator) -> float:
    """Share of draws of so many missions whose mean has the sign of the truth; none counts half."""
    means = differences[rng.integers(0, len(differences), (draws, count))].mean(axis=1) * np.sign(truth)
    return float(np.mean(means > 0.0) + 0.5 * np.mean(means == 0.0))


def study(run: Path, base: str, counts: Sequence[int], draws: int, seed: int) -> str:
    """The table as Markdown."""
    rows, events = (pq.read_table(run / f"{name}.parquet").to_pylist() for name in ("episodes", "events"))
    prices = prices_of(str(run / "params" / "prices.yaml"))
    stacks = list(dict.fromkeys(row["stack"] for row in rows))
    if base not in stacks:
        sys.exit(f"'{base}' is none of the run's stacks; it has {', '.join(stacks)}")
    by_stack: dict[str, dict[str, FloatArray]] = {}
    for stack in stacks:
        own = sorted((row for row in rows if row["stack"] == stack), key=lambda row: row["episode"])
        by_stack[stack] = objectives(own, [event for event in events if event["stack"] == stack], prices)
    others = [stack for stack in stacks if stack != base]
    mean: Callable[[str, str], float] = lambda stack, name: float(by_stack[stack][name].mean())  # noqa: E731
    rng = np.random.default_rng(seed)
    lines = []
    for name in by_stack[base]:
        cells = []
        for other in others:
            truth = mean(other, PUBLISHED) - mean(base, PUBLISHED)
            differences = by_stack[other][name] - by_stack[base][name]
            shares = (agreement(differences, truth, count, draws, rng) for count in counts)
            cells.append(" ".join(f"{share:.2f}" for share in shares))
        lines.append([name, *cells, " ".join(f"{mean(stack, name):.2f}" for stack in (base, *others))])
    sizes = " ".join(map(str, counts))
    return table(["objective", *(f"{other}, {sizes}" for other in others), f"means: {base}, others"], lines)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, nargs="?", default=Path("results/baseline/controllers"))
    parser.add_argument("--base", default="nav2-gps-ekf")
    parser.add_argument("--missions", type=int, nargs="+", default=[16, 32, 64, 128])
    parser.add_argument("--draws", type=int, default=4000)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    print(study(asked.run, asked.base, asked.missions, asked.draws, asked.seed))


if __name__ == "__main__":
    main()
