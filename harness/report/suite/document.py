"""The page of a suite as Markdown: what was found, on how much it rests, and what is missing."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from harness.economics.accountings import PUBLISHED
from harness.report.markdown import wrapped
from harness.report.numbers import counted
from harness.report.repriced import SHOWN
from harness.report.suite.figures import FOLDER, MOST_PANELS, draw_figures
from harness.report.suite.other_prices import at_other_prices, template
from harness.report.suite.results import Results, Standing
from harness.report.suite.tables import (
    counts,
    margins,
    margins_under,
    of_condition,
    write_quantities,
)
from harness.storage.files import write_text, writing
from harness.storage.texts import name_of
from harness.study.stored_run import StoredRun
from harness.study.suite import Condition, cells
from harness.study.suite_log import Session

PAGE = "index.md"
DIGITS = 12  # of a digest that are shown


def write_results(results: Results, folder: Path) -> list[Path]:
    """Write the page, the figures and the table of a suite into a folder; returns their paths.

    Raises:
        InputError: it cannot be written.
    """
    figures = draw_figures(results, folder)
    quantities = write_quantities(results, folder)
    with writing(folder):
        write_text(folder / PAGE, page(results))
    return [folder / PAGE, quantities, *figures]


def page(results: Results) -> str:
    """The page; same folder, same text.

    Args:
        results: of the suite folder.
    """
    paragraphs = [
        f"# {results.suite.title}",
        _progress(results),
        "## How much it rests on",
        "Finished deliveries per stack and condition"
        + _seeds(results)
        + "; – where nothing has been driven:",
        counts(results),
    ]
    if any(each.valuation for each in results.standings):
        paragraphs.append(_found(results))
    paragraphs += ["## What it was driven with", *_basis(results)]
    return wrapped("\n\n".join(paragraphs)) + "\n"


def _progress(results: Results) -> str:
    """How far the study is, in a sentence or two."""
    standings = results.standings
    done = sum(each.n + each.errors for each in standings)
    declared = sum(each.declared for each in standings)
    if done >= declared:
        return f"Complete: {counted(declared, 'delivery')}, as the suite declares."
    missing = [each for each in standings if each.side is None]
    partial = [each for each in standings if each.side is not None and not each.is_complete]
    text = f"**Not complete: {done} of {declared} declared deliveries are driven.**"
    if partial:
        part = f"{len(partial)} of {len(standings)} cells"
        text += f" {part} have some of theirs; every figure says how many."
    if missing:
        names = _names(results, missing)
        text += (
            f" {len(missing)} of {len(standings)} cells have none and are missing below: {names}."
        )
    return f"{text} `navbench suite --resume DIR`, DIR being the suite's folder, goes on."


def _names(results: Results, standings: Sequence[Standing]) -> str:
    """Cells in words; a stack that drove nowhere is named once."""
    own = {
        each.stack: [other for other in standings if other.stack == each.stack]
        for each in standings
    }
    places = {
        stack: " and ".join(results.label(other.condition) for other in each)
        for stack, each in own.items()
    }
    everywhere = len(results.conditions)
    return "; ".join(
        stack if len(own[stack]) == everywhere else f"{stack} on {places[stack]}" for stack in own
    )


def _seeds(results: Results) -> str:
    seeds = results.suite.seeds
    if len(seeds) == 1:
        return f", seed {seeds[0]}"
    return f", seeds {', '.join(map(str, seeds))} together"


def _found(results: Results) -> str:
    """Tables and pictures, and how to read them."""
    shown = len(results.conditions)
    conditions: list[str] = []
    for each in results.conditions:
        if any(standing.valuation for standing in results.under(each)):
            conditions += [
                f"### {results.label(each)}",
                of_condition(results, each),
                *_warnings(results, each),
            ]
    text = template("page.md").substitute(
        margins=margins(results),
        figures=FOLDER,
        cut=f"The figures show the first {MOST_PANELS} of {shown} conditions."
        if shown > MOST_PANELS
        else "",
        liability=_liability(results),
        prices=at_other_prices(results),
        first=name_of(results.suite.stacks[0]),
        conditions="\n\n".join(conditions),
    )
    return re.sub("\n{3,}", "\n\n", text).rstrip()


def _liability(results: Results) -> str:
    """What the robot would earn if it paid for other contacts.

    Nothing where that changes nothing.
    """
    known = [each for each in results.accounted.values() if each]
    if not any(each[name] != each[PUBLISHED] for each in known for name in SHOWN):
        return ""
    return template("liability.md").substitute(
        {name: margins_under(results, name) for name in SHOWN}
    )


def _warnings(results: Results, condition: Condition) -> list[str]:
    """What else than the stack may be behind a difference under a condition."""
    known = [
        (stack, each) for (where, stack), each in results.differences.items() if where == condition
    ]
    lines = [f"- `{stack}`: {warning}" for stack, each in known for warning in each.warnings]
    if lines:
        return ["Beside the stack, these differ from the first in:\n\n" + "\n".join(lines)]
    return []


def _basis(results: Results) -> list[str]:
    """Conditions, versions, and when what was driven."""
    suite, runs = results.suite, results.runs
    people = ", ".join(
        "the world's own number" if n is None else str(n) for n in suite.pedestrians or (None,)
    )
    sensors = ""
    if suite.sensors:
        sensors = f"sensors: {', '.join(map(name_of, suite.sensors))}; "
    lines = [
        f"- worlds {', '.join(Path(world).stem for world in suite.worlds)}; people: {people}; "
        f"{sensors}missions: "
        f"{suite.missions}; rules {Path(suite.rules).stem}; prices {Path(suite.prices).stem}",
        f"- seeds {', '.join(map(str, suite.seeds))}: the same missions, people and noise for "
        "every stack" + _but(results.sessions),
    ]
    lines += [f"- map {name}: SHA-256 {digest}" for name, digest in _maps(runs)]
    lines += [f"- versions: {text}" for text in _versions(results.sessions)]
    if results.strangers:
        lines.append(
            "- run folders here that are not of this suite, and not shown: "
            f"{', '.join(results.strangers)}"
        )
    return ["\n".join(lines), *_log(results)]


def _but(sessions: Sequence[Session]) -> str:
    """What limits a comparison of stacks that several states of the program drove."""
    if len({session.program for session in sessions}) < 2:
        return ""
    return (
        "; where different states of the program drove two stacks, that is in their difference, too"
    )


def _maps(runs: Sequence[StoredRun]) -> list[tuple[str, str]]:
    return sorted(
        {(run.map_name, str(run.about.get("map_sha256", "unknown"))[:DIGITS]) for run in runs}
    )


def _versions(sessions: Sequence[Session]) -> list[str]:
    """Every set of versions that drove some of it, once."""
    return list(
        dict.fromkeys(
            ", ".join(f"{name} {text}" for name, text in each.versions.items()) for each in sessions
        )
    )


def _log(results: Results) -> list[str]:
    """When how much was driven, and by which state of the program."""
    if not results.sessions:
        return []
    programs = len({session.program for session in results.sessions})
    states = "one state"
    if programs != 1:
        states = f"{programs} states"
    lines = [
        f"- {each.date}: {counted(each.deliveries, 'delivery')}, program "
        f"{each.program[:DIGITS]}{_driven(results, each)}"
        for each in results.sessions
    ]
    done = sum(each.n + each.errors for each in results.standings)
    rest = done - sum(session.deliveries for session in results.sessions)
    if rest > 0:
        lines.append(f"- {rest} more by calls that were killed before they could say so")
    return [
        f"Driven by {states} of the program (SHA-256 of its code, parameters and maps). What a run "
        "folder holds is "
        "kept; its `params/` say what it was driven with, whatever the files that come with the "
        "program say today.",
        "\n".join(lines),
    ]


def _driven(results: Results, session: Session) -> str:
    """Of which cells a session has deliveries: by condition the stacks.

    Empty: it was not noted down.
    """
    found: dict[str, dict[str, int]] = {}
    for cell in cells(results.suite):
        if count := session.cells.get(cell.name):
            own = found.setdefault(results.label(cell.condition), {})
            own[cell.stack_name] = own.get(cell.stack_name, 0) + count
    text = "; ".join(f"{label}: {_counted(own)}" for label, own in found.items())
    if text:
        return f" ({text})"
    return ""


def _counted(deliveries: Mapping[str, int]) -> str:
    return ", ".join(f"{stack} {count}" for stack, count in deliveries.items())
