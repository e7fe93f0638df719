"""The report of ``navbench tune``.

Printed, and as ``report.md`` with figures in the study's folder.
"""

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.text import Text

from harness.metrics.columns import Row
from harness.report.markdown import counted
from harness.report.sheet import markdown_lines, print_sheet
from harness.report.texts import TEXTS
from harness.report.tuning_figures import draw_tuning
from harness.report.tuning_sheets import sheets, summary, trials_sheet
from harness.storage.files import write_text, writing
from harness.tuning.explanation import Explanation
from harness.tuning.output import DIFF
from harness.tuning.result import StudyResult
from navstack.params.strict import read_text

REPORT = "report.md"


def print_tuning(
    study: StudyResult,
    scores: Row,
    explanation: Explanation,
    command: Sequence[str],
    folder: Path,
    console: Console,
) -> None:
    """Print the report.

    Args:
        study: what was searched.
        scores: of :func:`harness.tuning.scores.scores_document`.
        explanation: what the study says.
        command: ``navbench run`` with the tuned file, without seed and number of deliveries.
        folder: of the study.
        console: where to.
    """
    for sheet in sheets(study, scores, explanation, command):
        print_sheet(sheet, console)
    for line in summary(study, explanation):
        console.print(Text(line))
    console.print(
        f"report: {(folder / REPORT).with_suffix('.html')}, as text in {REPORT}", soft_wrap=True
    )


def write_tuning(
    study: StudyResult,
    scores: Row,
    explanation: Explanation,
    command: Sequence[str],
    folder: Path,
    again: str,
    lint: Row,
) -> Path:
    """Write ``report.md`` and its figures into the study's folder; returns the report's path.

    Args:
        study: what was searched.
        scores: of :func:`harness.tuning.scores.scores_document`.
        explanation: what the study says.
        command: as in :func:`print_tuning`.
        folder: of the study.
        again: the line that drives its test again.
        lint: of the tuned file, as in ``tune.json``.

    Raises:
        InputError: it cannot be written.
    """
    lines = [f"# {study.space.title}", ""]
    lines += [f"{line}\n" for line in summary(study, explanation)]
    for sheet in sheets(study, scores, explanation, command):
        lines += markdown_lines(sheet)
    for figure in draw_tuning(study, explanation, folder):
        if figure.suffix == ".png":
            caption = TEXTS.tuning_figures[figure.stem]
            lines += [f"![{caption}]({figure.relative_to(folder)})", "", f"*{caption}*", ""]
    lines += markdown_lines(trials_sheet(study))
    lines += ["## What differs", "", "```diff", read_text(folder / DIFF).rstrip("\n"), "```", ""]
    lines += ["## Lint of the tuned file", "", *(f"- {line}" for line in lint_lines(lint)), ""]
    lines += ["## Its test, driven again", "", "```", again, "```", ""]
    with writing(folder / REPORT):
        write_text(folder / REPORT, "\n".join(lines))
    return folder / REPORT


def lint_lines(lint: Row) -> list[str]:
    """What the check of the tuned file finds: how much, and what of it is new or gone."""
    counts = f"{counted(lint['errors'], 'error')}, {counted(lint['warnings'], 'warning')}"
    return [
        counts,
        *(f"new: {each}" for each in lint["new"]),
        *(f"gone: {each}" for each in lint["gone"]),
    ]
