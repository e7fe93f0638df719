"""The frozen world against the published rows: drives what results/baseline lacks, prints docs/calibration.md's tables.

Usage: python benchmarks/frozen_world.py [--tables] [--workers N]

Stacks paper-gps, paper-amcl and parked drive world ``published``: 400 deliveries of seed 0 each, then 100 each on two
other maps and among social_force people. Nothing is fitted to them. --tables drives nothing.
"""

import argparse
import sys
from collections.abc import Callable
from pathlib import Path

from scipy.stats import binomtest, fisher_exact

from harness.cli.driving import begin_run, resume_run
from harness.cli.signals import run_script
from harness.economics.valuation import OUTCOMES, Valuation, value
from harness.report.markdown import interval_text, table
from harness.report.published import PublishedMethod, load_published
from harness.statistics.interval import wilson_interval
from harness.statistics.paired import holm
from harness.study.places import Where
from harness.study.stored_run import load_run
from harness.task.study import make_study
from navstack.errors import NavstackError

KEPT = Path(__file__).resolve().parents[1] / "results" / "baseline"
METHODS = {"paper-gps": "nav2_gps", "paper-amcl": "nav2_amcl"}  # stack -> published method that it stands for
STACKS = (*METHODS, "parked")
ELSEWHERE = {
    "sidewalk_1": {"map_name": "sidewalk_1"},
    "sidewalk_2": {"map_name": "sidewalk_2"},
    "social_force": {"people": "social_force"},
}
LEVEL = 0.05  # p below which equality is rejected
PROPERTY = ("mailbox_contacts", "trash_bin_contacts", "building_glass_contacts", "bollard_contacts")
PREDICTED = (  # key, name, unit, decimals, allowed ours / published; None: reported
    ("pedestrian_injury_usd_per_run", "pedestrian injury cost", "USD/run", 2, (1 / 1.5, 1.5)),
    ("avg_collision_impulse_ns", "total impulse", "N s/run", 1, (0.7, 1.3)),
    ("avg_distance_km", "distance", "km", 4, (0.75, 1.25)),
    ("avg_runtime_h", "run time", "h", 4, None),
    ("avg_velocity_mps", "speed", "m/s", 2, None),
)
NO_GATE = {("paper-amcl", "avg_distance_km")}


def p_text(p: float) -> str:
    """A p value with as many digits as matter."""
    return f"{p:.3f}" if p >= 0.001 else f"{p:.1g}"


def drive(folder: Path, stack: str, episodes: int, workers: int | None, **conditions: str) -> None:
    """Drive what a folder lacks of a stack's deliveries; leaves the program where that does not end well."""
    where = Where(workers=workers)
    if (folder / "run.json").exists():
        status = resume_run(folder, where, as_json=False)
    else:
        study = make_study(stacks=[stack], episodes=episodes, world="published", workers=workers, **conditions)
        status = begin_run(study, folder, where, as_json=False)
    if status:
        sys.exit(status)


def read(folder: Path) -> tuple[list[str], Valuation]:
    """The outcomes of a run's deliveries, and what they come to."""
    run = load_run(str(folder))
    (stack,) = run.stacks
    return [row["outcome"] for row in stack.rows], value(stack.rows, stack, run.prices(), run.seed)


def verdict(p: float) -> str:
    return "**rejected**" if p < LEVEL else "not rejected"


def compared(row: Callable[[str, PublishedMethod, list[str], Valuation], list[list[str]]]) -> list[list[str]]:
    """Rows of every stack that stands for a published method."""
    published = load_published().methods
    return [line for stack, name in METHODS.items() for line in row(stack, published[name], *read(KEPT / stack))]


def shares() -> str:
    """Fisher's exact test of every outcome share, adjusted together (Holm)."""

    def tested(stack: str, method: PublishedMethod, outcomes: list[str], _: Valuation) -> list[list[str]]:
        rows = []
        for outcome in OUTCOMES:
            ours, n, share = outcomes.count(outcome), len(outcomes), getattr(method.measured, outcome)
            theirs = round(share * method.episodes)
            p_values.append(float(fisher_exact([[ours, n - ours], [theirs, method.episodes - theirs]]).pvalue))
            text = f"{interval_text(wilson_interval(ours, n), 3)} (n = {n})"
            rows.append([stack, outcome, text, f"{share:.2f} (n = {method.episodes})"])
        return rows

    p_values: list[float] = []
    rows = compared(tested)
    judged = zip(rows, p_values, holm(p_values), strict=True)
    lines = [[*row, p_text(p), p_text(adjusted), verdict(adjusted)] for row, p, adjusted in judged]
    return table(["stack", "outcome", "ours", "published", "p", "p (Holm)", ""], lines)


def predictions() -> str:
    """What the published rows tell beyond outcomes, within stated factors."""

    def predicted(stack: str, method: PublishedMethod, _: list[str], came_to: Valuation) -> list[list[str]]:
        rows = []
        for key, name, unit, decimals, gate in PREDICTED:
            ours, theirs = came_to.intervals[key], getattr(method.measured, key)
            ratio = ours.value / theirs
            allowed = None if (stack, key) in NO_GATE else gate
            said = ["--", "reported"]
            if allowed is not None:
                is_within = allowed[0] <= ratio <= allowed[1]
                said = [f"{allowed[0]:.2f} to {allowed[1]:.2f}", "within" if is_within else "**missed**"]
            texts = interval_text(ours, decimals), f"{theirs:.{decimals}f}", f"{ratio:.2f}"
            rows.append([stack, name, unit, *texts, *said])
        return rows

    return table(["stack", "quantity", "unit", "ours", "published", "ratio", "allowed", ""], compared(predicted))


def property_contacts() -> str:
    """Exact test of two Poisson rates (Przyborowski and Wilenski 1940)."""

    def counted(stack: str, method: PublishedMethod, outcomes: list[str], came_to: Valuation) -> list[list[str]]:
        n, episodes = len(outcomes), method.episodes
        ours = round(n * sum(came_to.measured[key] or 0.0 for key in PROPERTY))
        theirs = round(episodes * sum(getattr(method.measured, key) or 0.0 for key in PROPERTY))
        p = binomtest(ours, ours + theirs, n / (n + episodes)).pvalue if ours + theirs else 1.0
        return [[stack, f"{ours} in {n}", f"{theirs} in {episodes}", p_text(p), verdict(p)]]

    return table(["stack", "ours", "published", "p", ""], compared(counted))


def elsewhere() -> str:
    """The same world on other maps and with other people."""
    rows = []
    for condition in ELSEWHERE:
        for stack in STACKS:
            outcomes, came_to = read(KEPT / "elsewhere" / condition / stack)
            n = len(outcomes)
            means = (came_to.intervals[key] for key in (PREDICTED[0][0], "contribution_margin"))
            parts = [*(wilson_interval(outcomes.count(outcome), n) for outcome in OUTCOMES), *means]
            rows.append([condition, stack, str(n), *(interval_text(part, 2) for part in parts)])
    heading = ["where", "stack", "n", "SLA", "spoiled", "timeout", "assistance", "injuries [USD]", "margin [USD]"]
    return table(heading, rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tables", action="store_true", help="drive nothing")
    parser.add_argument("--workers", type=int)
    asked = parser.parse_args()
    try:
        for stack in () if asked.tables else STACKS:
            drive(KEPT / stack, stack, 400, asked.workers)
            for condition, choice in ELSEWHERE.items():
                drive(KEPT / "elsewhere" / condition / stack, stack, 100, asked.workers, **choice)
        print("\n\n".join((shares(), predictions(), property_contacts(), elsewhere())))
    except NavstackError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    run_script(main)
