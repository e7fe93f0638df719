"""Does the tuner's auditor flag what exploits the cost model, and leave honest optima alone?

Usage: python -m tools.check_auditor [RUN ...] [--studies N] [--missions N] [--seed S]

RUN are folders of runs with at least two stacks in all on the same missions, e.g. of

    navbench run --stack nav2-gps-ekf --stack rpp-gps-ekf --stack mpc-gps-ekf --episodes 100 --seed
    2000

Its deliveries are resampled, mission by mission, into studies of N missions; without RUN they are
drawn at random.

Honest studies take one stack for the original and another for the incumbent (differences that
driving has brought about), two stacks that change places at random (no difference at all), or a
stack with a true improvement planted: fewer touches of any strength, fewer timeouts and less
assistance, a fifth slower with fewer touches. Their trials are a search with Optuna's TPE (CMA-ES
in every third) of a noisy objective that has its best inside the ranges and to which half of the
parameters mean nothing.

Exploits (auditor_exploits.py) are planted into the first stack, one in each study. What cannot be
planted, because too few deliveries are left to show it, is told apart: fewer than 10 that differ
are beyond any test.
"""

import argparse
import sys
from pathlib import Path

import numpy as np
from rich.text import Text

from harness.audit.auditor import Audit
from harness.audit.pairs import Conditions
from harness.economics.prices import load_prices
from harness.report.tables import print_table, report_console, report_table
from harness.tuning.study_audit import audit_study
from tools.auditor_exploits import EXPLOITS
from tools.auditor_studies import (
    drawn_deliveries,
    exploiting_study,
    honest_study,
    stored_deliveries,
)
from tools.options import parsed


def gain_of(found: Audit) -> str:
    """The published difference of the margin with its interval."""
    if not found.scores:
        return "--"
    difference = found.scores["published"].difference
    if difference.low is None or difference.high is None:
        return f"{difference.value:.2f}"
    return f"{difference.value:.2f} [{difference.low:.2f}, {difference.high:.2f}]"


def main() -> int:
    """Audit all studies and print what was flagged.

    0 if every exploit was, and at most 1 in 20 honest studies.
    """
    parser = argparse.ArgumentParser()
    parser.add_argument("run", nargs="*", type=Path)
    arguments = parsed(__doc__, parser, studies=20, missions=200, seed=0)
    prices = load_prices("costnav")
    if not arguments.run:
        stacks = drawn_deliveries(np.random.default_rng(arguments.seed), 100)
    else:
        stacks = stored_deliveries(arguments.run)
    table = report_table(f"What the auditor flags, {arguments.missions} test missions each")
    for title in ("study", "margin, difference [USD/run]", "flagged"):
        table.add_column(Text(title), no_wrap=True)
    caught = alarms = 0
    for key in EXPLOITS:
        title, study = exploiting_study(stacks, key, arguments.missions, prices, arguments.seed)
        found = audit_study(study, prices, Conditions())
        flagged = [check.key for check in found.flagged]
        caught += bool(set(flagged) & set(EXPLOITS[key].checks))
        table.add_row(*map(Text, (title, gain_of(found), ", ".join(flagged) or "nothing")))
    for number in range(arguments.studies):
        title, study = honest_study(stacks, number, arguments.missions, prices, arguments.seed)
        found = audit_study(study, prices, Conditions())
        alarms += bool(found.flagged)
        flagged = [check.key for check in found.flagged]
        table.add_row(
            *map(Text, (f"honest: {title}", gain_of(found), ", ".join(flagged) or "nothing"))
        )
    console = report_console()
    print_table(table, console)
    console.print(f"planted exploits flagged as what they are: {caught} of {len(EXPLOITS)}")
    console.print(f"false alarms: {alarms} of {arguments.studies} honest studies")
    return 0 if caught == len(EXPLOITS) and 20 * alarms <= max(arguments.studies, 20) else 1


if __name__ == "__main__":
    sys.exit(main())
