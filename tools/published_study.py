"""The studies that this project publishes, of params/suites.

Every stack, the best on fresh missions, measured people.

Usage: python -m tools.published_study [--suite published|evasive|measured] [--episodes N]
           [--stack NAME] [--map NAME] [--world NAME] [--workers N] [--out FOLDER] [--render]

What FOLDER (results/baseline/study, evasive_study or measured) holds is kept and added to, so a
study can be driven in pieces, on one checkout after the other: --episodes 100 drives the first
hundred deliveries of every cell, --stack and --map some cells only; without them the rest is
driven. Deliveries are independent of what was driven before them. --render drives nothing.

The folder gets its page, figures and tables; docs/hooks.py puts their pages into the site. The
margins of the suite evasive are README's table as soon as every cell has deliveries.
"""

import argparse
import sys
from pathlib import Path

from harness.report.markdown import wrapped
from harness.report.suite.results import Results
from harness.report.suite.tables import margins
from harness.storage.shipped import shipped
from harness.study.places import Where
from harness.study.suite import DECLARATION, Portion, declare, load_suite
from navbench.api.suite import suite, write_overview
from navbench.cli.driving import exit_status
from navbench.cli.signals import run_script
from navstack.errors import NavstackError

ROOT = Path(__file__).resolve().parents[1]
# suite -> folder in results/baseline
FOLDERS = {"published": "study", "evasive": "evasive_study", "measured": "measured"}
README_SHOWS = "evasive_study"
BASELINE = ROOT / "results" / "baseline"
BEGIN, END = (
    "<!-- study: tools/published_study.py writes what follows -->",
    "<!-- study ends -->",
)


def headline(results: Results) -> str:
    """What README says of the study: how much there is, and the margins."""
    done = sum(each.n for each in results.standings)
    declared = sum(each.declared for each in results.standings)
    state = f"{done} deliveries" if done == declared else f"so far {done} of {declared} deliveries"
    names = ", ".join(f"`{Path(name).stem}`" for name in results.suite.maps)
    text = (
        f"**What three stacks earn** on the maps {names} ({state}, seed {results.suite.seeds[0]}, "
        "world "
        f"`{Path(results.suite.worlds[0]).stem}`): contribution margin [USD/delivery], 95 % "
        "bootstrap intervals over "
        "missions; in round brackets those that admit [a loss that has not happened "
        "yet](docs/money.md#intervals). "
        "Costs, outcomes, break-even and paired differences: "
        f"[the study](results/baseline/{README_SHOWS}/index.md)."
    )
    return f"{wrapped(text)}\n\n{margins(results)}\n"


def filled(text: str, content: str) -> str:
    """A text with other content between the marks.

    Raises:
        ValueError: it has no marks.
    """
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(
            f"has no '{BEGIN}' with '{END}' after it; put both where the table is to stand"
        )
    return f"{before}{begin}\n\n{content}\n{end}{after}"


def publish(results: Results, readme: Path) -> None:
    """Put the margins into README."""
    missing = sum(each.valuation is None for each in results.standings)
    if missing:
        print(
            f"README.md is left as it is: {missing} of {len(results.standings)} cells have no "
            "delivery yet"
        )
        return
    text = filled(readme.read_text(encoding="utf-8"), headline(results))
    readme.write_text(text, encoding="utf-8")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--episodes", type=int, help="of each cell; default: all that the suite declares"
    )
    parser.add_argument(
        "--stack", action="append", default=[], help="of the suite, repeatable; default: all"
    )
    parser.add_argument(
        "--map", action="append", default=[], help="of the suite, repeatable; default: all"
    )
    parser.add_argument(
        "--world", help="a name of params/worlds or a file; default: the suite's own"
    )
    parser.add_argument("--workers", type=int)
    parser.add_argument("--suite", choices=tuple(FOLDERS), default="published")
    parser.add_argument(
        "--out", type=Path, help="default: the study's own folder in results/baseline"
    )
    parser.add_argument(
        "--render", action="store_true", help="drive nothing: page, figures and tables anew"
    )
    asked = parser.parse_args()
    status, name = 0, FOLDERS[asked.suite]
    out = asked.out or BASELINE / name
    try:
        if asked.render:
            if not (out / DECLARATION).is_file():
                declare(out, load_suite(shipped("params") / "suites" / f"{asked.suite}.yaml"))
            results = write_overview(out)
        else:
            portion = Portion(tuple(asked.stack), tuple(asked.map), asked.episodes)
            where = Where(workers=asked.workers)
            found = suite(asked.suite, portion=portion, world=asked.world, where=where, out=out)
            status, results = exit_status(found.is_interrupted, found.has_errors), found.results
        if out.resolve() == BASELINE / README_SHOWS:
            publish(results, ROOT / "README.md")
    except (NavstackError, ValueError) as error:
        sys.exit(str(error))
    sys.exit(status)


if __name__ == "__main__":
    run_script(main)
