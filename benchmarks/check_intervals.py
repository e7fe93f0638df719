"""How often 95 % intervals hold the truth, on simulated costs of deliveries like those of a robot that meets people.

Usage: python benchmarks/check_intervals.py [REPLICATIONS]
"""

import sys

import numpy as np

from harness.statistics import bootstrap_cvar, bootstrap_mean
from navstack.types import FloatArray

SIZES = (20, 50, 100, 200, 500)  # deliveries of a run
DRAWS = 500  # bootstrap draws per interval
TRUTH_FROM = 4_000_000  # deliveries


def costs(rng: np.random.Generator, n: int) -> FloatArray:
    """Costs [USD] of deliveries: contacts with people, repairs, refunds of the fee and of the food."""
    people, repair = 32.0 * rng.poisson(0.3, n), 36.0 * (rng.random(n) < 0.2)
    late, spoiled = 3.5 * (rng.random(n) < 0.1), 32.0 * (rng.random(n) < 0.1)
    return people + repair + late + spoiled


def main() -> None:
    """Print the share of intervals that hold the truth, per number of deliveries."""
    replications = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    rng = np.random.default_rng(0)
    all_costs = np.sort(costs(rng, TRUTH_FROM))
    mean, worst = all_costs.mean(), all_costs[-TRUTH_FROM // 20 :].mean()
    sys.stdout.write(f"{'deliveries':>10} {'mean':>7} {'worst 5 %':>10}\n")
    for n in SIZES:
        held = np.zeros(2)
        for _ in range(replications):
            sample = costs(rng, n)
            spans = bootstrap_mean(sample, rng, DRAWS), bootstrap_cvar(sample, rng, DRAWS)
            for i, (span, truth) in enumerate(zip(spans, (mean, worst), strict=True)):
                held[i] += span.low is not None and span.high is not None and span.low <= truth <= span.high
        shares = held / replications
        worst_text = f"{shares[1]:.3f}" if spans[1].low is not None else "--"
        sys.stdout.write(f"{n:>10} {shares[0]:>7.3f} {worst_text:>10}\n")


if __name__ == "__main__":
    main()
