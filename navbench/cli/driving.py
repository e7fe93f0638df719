"""What the commands that drive print, and the exit status that they leave."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING

from harness.storage.texts import quoted
from navbench.cli.streams import print_json

if TYPE_CHECKING:
    import click

    from harness.metrics.columns import Row
    from harness.study.stored_run import StoredRun
    from navbench.api.driving import Driven

INTERRUPTED, SOME_ERRORS = 130, 3
PAGE = "report.html"  # of a run, in its folder
DIGITS = 16  # of a run's checksum that a screen shows; the JSON document and verify have all


def exit_status(is_interrupted: bool, has_errors: bool) -> int:
    """What the program leaves with."""
    if is_interrupted:
        return INTERRUPTED
    if has_errors:
        return SOME_ERRORS
    return 0


def asked_deliveries(context: "click.Context") -> int | None:
    """How many deliveries a stack were asked for; None: --episodes was not given."""
    from click.core import ParameterSource

    if context.get_parameter_source("episodes") is ParameterSource.DEFAULT:
        return None
    episodes: int = context.params["episodes"]
    return episodes


def print_driven(
    driven: "Driven", as_json: bool, is_full: bool = False, has_page: bool = False
) -> int:
    """Print what deliveries came to, before a page is written, which takes a while.

    Args:
        driven: the run.
        as_json: one JSON document instead of text.
        is_full: whether all tables are printed.
        has_page: whether a page is written into the run folder; one that is there is in any case.

    Returns:
        The exit status.
    """
    from harness.study.stored_run import load_run

    status = exit_status(driven.is_interrupted, driven.has_errors)
    run = load_run(str(driven.folder))
    if as_json:
        print_json({"schema": 1, "runs": _documents(run, driven)})
    else:
        _print_answer(run, driven, is_full)
    if driven.is_interrupted:
        say_how_to_go_on("run", driven.folder, " --page" if has_page else "")
        return status
    page = None
    if has_page or (driven.folder / PAGE).is_file():  # one that is there has fewer deliveries
        page = write_page(driven)
    if not as_json:
        _print_next(run, driven, page)
    return status


def _documents(run: "StoredRun", driven: "Driven") -> list["Row"]:
    """What each stack's deliveries came to, with the interval that the screen shows."""
    from harness.analysis.rare import margin_with_unseen
    from harness.statistics.interval import interval_json
    from harness.study.drive import run_document

    stacks = {stack.name: stack for stack in run.stacks}
    found = []
    for result in driven.results:
        document = run_document(result, driven.study, driven.folder)
        unseen = margin_with_unseen(run, stacks[result.stack.name])
        found.append({**document, "margin_with_unseen": interval_json(unseen)})
    return found


def say_how_to_go_on(command: str, folder: Path, options: str = "") -> None:
    """After an interrupt: the one command that comes next, on standard error.

    Args:
        command: of navbench, that drove.
        folder: in which is what was finished.
        options: of the command that goes on, with a blank before each.
    """
    from navbench.api.progress import say

    sys.stdout.flush()
    say(f"next: navbench {command} --resume {quoted(folder)}{options}")


def write_page(driven: "Driven") -> Path | None:
    """Write a run's page into its folder; None: no delivery finished."""
    from navbench.api.report import report
    from navbench.api.runs import load

    if not any(result.episodes for result in driven.results):
        return None
    page = driven.folder / PAGE
    report([load(driven.folder)], page)
    return page


def _print_answer(run: "StoredRun", driven: "Driven", is_full: bool) -> None:
    from harness.episode.files import prices_of
    from harness.report.blocks import Block
    from harness.report.run_tables import run_blocks
    from harness.report.short.run import summary_blocks
    from harness.report.tables import print_blocks, report_console

    folder = driven.folder
    blocks: list[Block] = summary_blocks(run)
    if is_full:
        prices = prices_of(driven.study.template.prices)
        blocks = [*blocks[:1], *run_blocks(driven.results, driven.study, prices, folder)]
    print_blocks(blocks, report_console())
    sys.stdout.flush()


def _print_next(run: "StoredRun", driven: "Driven", page: Path | None) -> None:
    from harness.explain.moments import costly_episodes
    from harness.report.blocks import Text
    from harness.report.tables import print_blocks, report_console
    from harness.storage.checksums import root_digest

    folder = driven.folder
    where, following = f"run folder: {folder}", f"report {quoted(folder)}"
    if page is not None:
        where, following = f"page: {page}", f"replay {quoted(folder)}"
        if any(costly_episodes(run.only(stack.name)) for stack in run.stacks):
            following = f"explain {quoted(folder)}"
    if page is not None and run.has_legs:
        following = f"map losses {quoted(run.first_stack)}"
    checksum = (root_digest(folder) or "")[:DIGITS]
    last = f"{where}; checksum {checksum}; next: navbench {following}"
    print_blocks([Text(last, "whole")], report_console())
