"""How often 95 % intervals hold the truth.

On simulated costs of deliveries, and on margins that were really driven.

Of these, the bootstrap's and the one that admits a loss that has not happened yet
(harness.statistics.unseen).

The simulated costs are those of a robot that meets people, without disasters. Real ones have a few:
a loss of hundreds of dollars once in some hundred deliveries. For them every run folder is taken as
all deliveries that there are, and runs of fewer deliveries are drawn from it: what is rarer than
once in its deliveries is not in it either.

Usage: python -m tools.check_intervals [--replications 1000] [--runs FOLDER]...
"""

import argparse
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import numpy as np
from rich import box
from rich.console import Console
from rich.table import Table

from harness.ablation.precision import FIRST, count_wanted, half_width
from harness.analysis.evaluator import profits
from harness.analysis.rare import reach_of
from harness.analysis.repricing import choose
from harness.economics.valuation import CENT
from harness.statistics.bootstrap import bootstrap_cvar, bootstrap_mean
from harness.statistics.interval import Interval
from harness.statistics.unseen import Reach, admit_unseen
from harness.study.stored_run import load_run
from navstack.types import FloatArray

FEW = (2, 3, 5, 10)  # normally distributed values
SIZES = (20, 50, 100, 200, 500)  # deliveries of a run, simulated costs
DRAWN = (20, 100, 400)  # deliveries of a run, drawn from real ones
DISASTER = 400.0  # [USD] loss of a delivery
LEAST = 400  # deliveries of a folder that stands for all
DRAWS = 500  # bootstrap draws per interval
WITHIN = 3.0  # [USD] of margins that are driven until they are known
MOST = 5000  # deliveries of such a run
TRUTH_FROM = 4_000_000  # deliveries
BASELINE = Path(__file__).resolve().parents[1] / "results" / "baseline"


def costs(rng: np.random.Generator, n: int) -> FloatArray:
    """Costs [USD] of deliveries: contacts with people, repairs, refunds."""
    people, repair = 32.0 * rng.poisson(0.3, n), 36.0 * (rng.random(n) < 0.2)
    late, spoiled = 3.5 * (rng.random(n) < 0.1), 32.0 * (rng.random(n) < 0.1)
    return people + repair + late + spoiled


def simulated(replications: int, rng: np.random.Generator) -> Table:
    """Share of intervals that hold the truth, per number of deliveries."""
    table = Table(
        "deliveries", "mean", "worst 5 %", title="simulated costs: held by", box=box.SIMPLE_HEAD
    )
    all_costs = np.sort(costs(rng, TRUTH_FROM))
    mean, worst = all_costs.mean(), all_costs[-TRUTH_FROM // 20 :].mean()
    for n in SIZES:
        held = np.zeros(2)
        for _ in range(replications):
            sample = costs(rng, n)
            spans = bootstrap_mean(sample, rng, DRAWS), bootstrap_cvar(sample, rng, DRAWS)
            for i, (span, truth) in enumerate(zip(spans, (mean, worst), strict=True)):
                held[i] += (
                    span.low is not None
                    and span.high is not None
                    and span.low <= truth <= span.high
                )
        shares = held / replications
        table.add_row(
            str(n), f"{shares[0]:.3f}", f"{shares[1]:.3f}" if spans[1].low is not None else "--"
        )
    return table


def normal(replications: int) -> Table:
    """The same for the mean of few values that are as kind as can be."""
    table = Table(
        "values", "mean", title="normally distributed values: held by", box=box.SIMPLE_HEAD
    )
    for n in FEW:
        draw = np.random.default_rng((n, 1))
        spans = [_bootstrap(draw.normal(size=n), draw) for _ in range(replications)]
        held = sum(
            span.low is not None and span.high is not None and span.low <= 0.0 <= span.high
            for span in spans
        )
        table.add_row(str(n), f"{held / replications:.2f}")
    return table


Draw = Callable[[FloatArray, np.random.Generator], Interval]  # an interval from a sample


def driven(folders: list[Path]) -> Iterator[tuple[str, FloatArray, Draw]]:
    """Each stack with enough deliveries, their margins [USD], and the wider interval."""
    for folder in folders:
        for file in sorted(folder.rglob("run.json")):
            run = load_run(str(file.parent))
            for stack in run.stacks:
                if len(stack.rows) >= LEAST:
                    place = "/".join(file.parent.relative_to(folder.parent).parts[-2:])
                    yield (
                        f"{place}: {stack.name}",
                        profits(run, stack, choose(run, None, {}, ())),
                        partial(_with_unseen, reach=reach_of(run)),
                    )


def _bootstrap(sample: FloatArray, rng: np.random.Generator) -> Interval:
    return bootstrap_mean(sample, rng, DRAWS)


def _with_unseen(sample: FloatArray, rng: np.random.Generator, reach: Reach) -> Interval:
    return admit_unseen(sample, max(float(sample.max()), reach.least), reach, None, rng, DRAWS)


def resampled(
    folders: list[Path],
    replications: int,
    rng: np.random.Generator,
) -> tuple[Table, Table]:
    """Share of intervals that hold the mean margin of real deliveries, of each run and in short."""
    table = Table(
        "run",
        "worst [USD]",
        title="real margins: held by bootstrap, with unseen loss",
        box=box.SIMPLE_HEAD,
    )
    brief = Table(
        "runs",
        "worst [USD]",
        "interval",
        title="held by: least to most, median",
        box=box.SIMPLE_HEAD,
    )
    for n in DRAWN:
        table.add_column(f"n = {n}", justify="right")
        brief.add_column(f"n = {n}", justify="right")
    # by whether a disaster is among them
    groups: dict[bool, list[tuple[float, FloatArray]]] = {False: [], True: []}
    for name, margins, with_unseen in driven(folders):
        worst = float(margins.min())
        shares = np.array(
            [_shares(margins, n, (_bootstrap, with_unseen), replications, rng) for n in DRAWN]
        )
        table.add_row(
            name, f"{worst:.0f}", *(f"{plain:.2f}, {wider:.2f}" for plain, wider in shares)
        )
        groups[worst < -DISASTER].append((worst, shares))
    for group in filter(None, groups.values()):
        lowest, held = [each for each, _ in group], np.array([shares for _, shares in group])
        for kind, title in enumerate(("bootstrap", "with unseen loss")):
            cells = [
                f"{column.min():.2f} to {column.max():.2f}, {np.median(column):.2f}"
                for column in held[:, :, kind].T
            ]
            brief.add_row(str(len(group)), f"{max(lowest):.0f} to {min(lowest):.0f}", title, *cells)
    return table, brief


def _shares(
    margins: FloatArray,
    n: int,
    kinds: tuple[Draw, ...],
    replications: int,
    rng: np.random.Generator,
) -> list[float]:
    """How often intervals of each kind hold the mean of all ``margins``, from ``n`` resampled."""
    truth, held = float(margins.mean()), [0] * len(kinds)
    for _ in range(replications):
        sample = rng.choice(margins, n)
        for kind, interval in enumerate(kinds):
            span = interval(sample, rng)
            held[kind] += (
                span.low is not None
                and span.high is not None
                and span.low <= truth + CENT / 100
                and (truth - CENT / 100 <= span.high)
            )
    return [count / replications for count in held]


def stopped(folders: list[Path], replications: int, rng: np.random.Generator) -> Table:
    """The same of runs that end once their interval is narrow, as ``navbench ablate --within``."""
    table = Table(
        *("run", "held by", "deliveries"),
        title=f"real margins, driven until known to within {WITHIN:g} USD",
        box=box.SIMPLE_HEAD,
    )
    for name, margins, with_unseen in driven(folders):
        truth, held, counts = float(margins.mean()), 0, []
        for _ in range(replications):
            span, count = _until_known(margins, with_unseen, rng)
            held += (
                span.low is not None and span.high is not None and span.low <= truth <= span.high
            )
            counts.append(count)
        told = f"{min(counts)} to {max(counts)}, {np.median(counts):.0f}"
        table.add_row(name, f"{held / replications:.3f}", told)
    return table


def _until_known(
    margins: FloatArray, interval: Draw, rng: np.random.Generator
) -> tuple[Interval, int]:
    """The interval of deliveries drawn until it is narrow enough, and how many they are."""
    sample = rng.choice(margins, FIRST)
    while True:
        span = interval(sample, rng)
        width = half_width(span)
        assert width is not None
        wanted = count_wanted(len(sample), width, WITHIN, MOST)
        if wanted == len(sample):
            return span, wanted
        sample = np.append(sample, rng.choice(margins, wanted - len(sample)))


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--replications", type=int, default=1000)
    parser.add_argument(
        "--runs",
        type=Path,
        action="append",
        help="folder of run folders; default: results/baseline",
    )
    asked = parser.parse_args()
    rng = np.random.default_rng(0)
    console = Console(file=sys.stdout, width=140)
    console.print(simulated(asked.replications, rng))
    console.print(normal(asked.replications))
    for table in resampled(asked.runs or [BASELINE], asked.replications, rng):
        console.print(table)
    of_its_own = np.random.default_rng(1)  # the tables before take as much chance as they need
    console.print(stopped(asked.runs or [BASELINE], asked.replications, of_its_own))


if __name__ == "__main__":
    main()
