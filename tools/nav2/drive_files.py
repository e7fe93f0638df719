"""Drives Nav2 parameter files, one short delivery each, on the robots that they describe.

    python -m tools.nav2.drive_files FOLDER_OR_FILE ... [--seed 7] [--number 52]

Without a folder those of NAVSTACK_DATA are driven: nav2_defaults, nav2_params, nav2_params_wild.
A file that is refused with an offered ``--substitute`` is driven with it. Printed is a Markdown
table with one row a file, then the shares with their Wilson intervals. ``lint`` must call an error
what is refused; the exit status is 1 where it does not, or where a file ends in a traceback.
"""

import argparse
import dataclasses
import os
import re
import sys
import time
import traceback
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from harness.episode.episode import run_episode
from harness.metrics.columns import Row
from harness.statistics.interval import wilson_interval
from harness.study import preflight
from harness.task.study import Study, make_study
from harness.world.outcome import ARRIVALS
from navbench.api.lint import lint
from navstack.errors import NavstackError
from tools.options import parsed

FOLDERS = ("nav2_defaults", "nav2_params", "nav2_params_wild")
OFFER = re.compile(r"--substitute ([^\s;,=]+=[\w:/]+)")
HEAD = "| file | driven | lint | outcome | simulated [s] | path [m] | wall [s] | why |"
RULE = "| --- | --- | --- | --- | ---: | ---: | ---: | --- |"
AS_IT_IS, SUBSTITUTED, REFUSED, FAILED = "as it is", "substituted", "refused", "traceback"
ARRIVED = frozenset(outcome.value for outcome in ARRIVALS)


@dataclass(frozen=True)
class Driven:
    """What came of one file."""

    name: str
    how: str  # one of the four above
    has_errors: bool  # according to lint
    is_refused: bool  # by run, without substitutes
    wall: float  # [s]
    why: str = ""  # substitutes, a refusal or a traceback
    row: Row = dataclasses.field(default_factory=dict)  # of the delivery

    @property
    def agrees(self) -> bool:
        """Whether lint calls an error what run refuses."""
        return self.has_errors == self.is_refused

    @property
    def outcome(self) -> str:
        """How the delivery ended; empty: there was none."""
        return str(self.row.get("outcome", ""))

    def line(self) -> str:
        """As a row of the table."""
        agreement = "agrees" if self.agrees else "DIFFERS"
        seconds, metres = self.row.get("duration_s", ""), self.row.get("shortest_path_m", "")
        reason = self.row.get("assistance_reason") or ""
        why = " ".join(f"{self.why} {reason}".split()).replace("|", "/")
        cells = (self.name, self.how, agreement, self.outcome, seconds, metres, self.wall, why)
        return f"| {' | '.join(map(_cell, cells))} |"


def _cell(value: object) -> str:
    return f"{value:.1f}" if isinstance(value, float) else str(value)


def drive(file: Path, seed: int = 7, number: int = 52) -> Driven:
    """Drive a file, with what is offered in place of plugins that do not run here.

    Args:
        file: Nav2 parameters.
        seed: of the study.
        number: of its delivery; 52 of seed 7 has a shortest path of 20 m.
    """
    begin = time.perf_counter()
    has_errors = bool(lint(str(file)).errors)
    substitutes: list[str] = []
    row: Row = {}
    while True:
        how, why = (SUBSTITUTED, ", ".join(substitutes)) if substitutes else (AS_IT_IS, "")
        try:
            row = _deliver(file, seed, number, substitutes)
        except NavstackError as error:
            why = str(error).removeprefix(f"{file}: ")
            offered = new_offers(why, substitutes)
            if offered:
                substitutes += offered
                continue
            how = REFUSED
        except Exception:
            how, why = FAILED, traceback.format_exc().strip()[-400:]
        is_refused = how == REFUSED or bool(substitutes)
        wall = time.perf_counter() - begin
        return Driven(file.stem, how, has_errors, is_refused, wall, why, row)


def _deliver(file: Path, seed: int, number: int, substitutes: Sequence[str]) -> Row:
    """The row of one delivery.

    Raises:
        NavstackError: the file is refused.
    """
    study: Study = make_study(
        stacks=[str(file)],
        episodes=1,
        only=[number],
        workers=1,
        seed=seed,
        substitutes=substitutes,
    )
    preflight.check(study)
    return run_episode(next(study.tasks())).row


def new_offers(message: str, known: Iterable[str]) -> list[str]:
    """The first substitute that a message offers for each plugin that has none yet."""
    taken = {each.partition("=")[0] for each in known}
    offers: dict[str, str] = {}
    for offer in OFFER.findall(message):
        name = offer.partition("=")[0]
        if name not in taken:
            offers.setdefault(name, offer)
    return list(offers.values())


def files_of(places: Sequence[Path]) -> Iterator[Path]:
    """The parameter files of folders, in their order; files as they are.

    Raises:
        SystemExit: one of them does not exist.
    """
    for place in places:
        if place.is_file():
            yield place
        elif place.is_dir():
            yield from sorted((*place.rglob("*.yaml"), *place.rglob("*.yml")))
        else:
            sys.exit(f"{place} does not exist; give folders or files of Nav2 parameters")


def summary(driven: Sequence[Driven]) -> Iterator[str]:
    """Shares of all files with their Wilson intervals."""
    counts = Counter(each.how for each in driven)
    counts["arrived"] = sum(each.outcome in ARRIVED for each in driven)
    counts["lint agrees with run"] = sum(each.agrees for each in driven)
    for name in (AS_IT_IS, SUBSTITUTED, REFUSED, FAILED, "arrived", "lint agrees with run"):
        yield f"- {name}: {counts[name]} = {wilson_interval(counts[name], len(driven))}"


def main() -> None:
    """Drive what was asked for and print the table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("places", type=Path, nargs="*", metavar="FOLDER_OR_FILE")
    arguments = parsed(__doc__, parser, seed=7, number=52)
    places = arguments.places
    if not places:
        data = os.environ.get("NAVSTACK_DATA")
        if data is None:
            sys.exit("NAVSTACK_DATA is not set; set it, or give folders or files")
        places = [Path(data, folder) for folder in FOLDERS]
    print(f"{HEAD}\n{RULE}")
    driven = []
    for file in files_of(places):
        driven.append(drive(file, arguments.seed, arguments.number))
        print(driven[-1].line(), flush=True)
    print("", *summary(driven), sep="\n")
    sys.exit(any(each.how == FAILED or not each.agrees for each in driven))


if __name__ == "__main__":
    main()
