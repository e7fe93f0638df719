"""Studies of params/suites that this project publishes.

Measured people, bad fixes, many people; tools/frozen_world has every stack in the default world.

Usage: python -m tools.published_study [--suite measured|urban|crowds] [--episodes N]
           [--stack NAME] [--map NAME] [--world NAME] [--workers N] [--out FOLDER] [--render]

What FOLDER (of results/baseline) holds is kept and added to, so a
study can be driven in pieces, on one checkout after the other: --episodes 100 drives the first
hundred deliveries of every cell, --stack and --map some cells only; without them the rest is
driven. Deliveries are independent of what was driven before them. --render drives nothing.

The folder gets its page, figures and tables; docs/hooks.py puts their pages into the site.
"""

import argparse
import sys
from pathlib import Path

from harness.storage.shipped import shipped
from harness.study.places import Where
from harness.study.suite import Portion, load_suite
from harness.study.suite_folder import DECLARATION, declare
from navbench.api.suite import suite, write_overview
from navbench.cli.driving import exit_status
from navbench.cli.signals import run_script
from navstack.errors import NavstackError

ROOT = Path(__file__).resolve().parents[1]
SUITES = ("measured", "urban", "crowds")  # each has a folder in results/baseline
BASELINE = ROOT / "results" / "baseline"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--episodes", type=int, help="of each cell; default: all that the suite declares"
    )
    parser.add_argument(
        "--stack",
        action="append",
        default=[],
        help="of the suite, repeatable; default: all",
    )
    parser.add_argument(
        "--map",
        action="append",
        default=[],
        help="of the suite, repeatable; default: all",
    )
    parser.add_argument(
        "--world", help="a name of params/worlds or a file; default: the suite's own"
    )
    parser.add_argument("--workers", type=int)
    parser.add_argument("--suite", choices=SUITES, default=SUITES[0])
    parser.add_argument(
        "--out", type=Path, help="default: the study's own folder in results/baseline"
    )
    parser.add_argument(
        "--render", action="store_true", help="drive nothing: page, figures and tables anew"
    )
    asked = parser.parse_args()
    status = 0
    out = asked.out or BASELINE / asked.suite
    try:
        if asked.render:
            if not (out / DECLARATION).is_file():
                declare(out, load_suite(shipped("params") / "suites" / f"{asked.suite}.yaml"))
            write_overview(out)
        else:
            portion = Portion(tuple(asked.stack), tuple(asked.map), asked.episodes)
            where = Where(workers=asked.workers)
            found = suite(asked.suite, portion=portion, world=asked.world, where=where, out=out)
            status = exit_status(found.is_interrupted, found.has_errors)
    except (NavstackError, ValueError) as error:
        sys.exit(str(error))
    sys.exit(status)


if __name__ == "__main__":
    run_script(main)
