"""The report of ``navbench tune``: on a console, and as ``report.md`` in the study's folder."""

from collections.abc import Sequence
from pathlib import Path

from harness.metrics.columns import Row
from harness.report.blocks import Block, Chart, Text
from harness.report.markdown import markdown_text
from harness.report.numbers import counted
from harness.report.texts import TEXTS
from harness.report.tuning.decision import KEEP, OPEN, TAKE, as_nav2, decision
from harness.report.tuning.figures import draw_tuning
from harness.report.tuning.summary import summary
from harness.report.tuning.tables import sheets, trials_sheet
from harness.storage.files import write_text, writing
from harness.tuning.explanation import Explanation
from harness.tuning.output import DIFF, TUNED
from harness.tuning.result import StudyResult
from navstack.params.strict import read_text

REPORT = "report.md"
FILE_IS = {
    TAKE: "tuned file",
    OPEN: "best trial, not proved better",
    KEEP: "best trial, not to be taken",
}


def tuning_blocks(
    study: StudyResult,
    scores: Row,
    explanation: Explanation,
    command: Sequence[str],
    folder: Path,
) -> list[Block]:
    """What the study found.

    Args:
        study: what was searched.
        scores: of :func:`harness.tuning.scores.scores_document`.
        explanation: what the study says.
        command: ``navbench run`` with the tuned file, without seed and number of deliveries.
        folder: of the study.
    """
    page = (folder / REPORT).with_suffix(".html")
    return [
        *sheets(study, scores, explanation, command),
        *map(Text, summary(study, explanation)),
        Text(f"report: {page}, as text in {REPORT}", "whole"),
    ]


def short_tuning(
    study: StudyResult,
    scores: Row,
    explanation: Explanation,
    about: str,
    folder: Path,
) -> list[Block]:
    """What was tuned, whether to take it, why, and where its page is.

    Args:
        study: what was searched.
        scores: of :func:`harness.tuning.scores.scores_document`.
        explanation: what the study says.
        about: of :func:`harness.report.tuning.decision.setup_of`.
        folder: of the study.
    """
    page = (folder / REPORT).with_suffix(".html")
    advice = decision(study, scores, explanation)
    lines = [about, str(advice), *summary(study, explanation)]
    if study.incumbent.values:
        lines += [
            f"{FILE_IS[advice.verdict]}: {folder / TUNED}, difference: {DIFF}",
            as_nav2(folder / TUNED),
        ]
    return [Text(line, "whole") for line in (*lines, f"page: {page}")]


def write_tuning(
    study: StudyResult,
    scores: Row,
    explanation: Explanation,
    about: str,
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
        about: of :func:`harness.report.tuning.decision.setup_of`.
        command: as in :func:`tuning_blocks`.
        folder: of the study.
        again: the line that drives its test again.
        lint: of the tuned file, as in ``tune.json``.

    Raises:
        InputError: it cannot be written.
    """
    figures = [
        Chart(figure.relative_to(folder), TEXTS.tuning_figures[figure.stem])
        for figure in draw_tuning(study, explanation, folder)
        if figure.suffix == ".png"
    ]
    blocks: list[Block] = [
        Text(f"**{decision(study, scores, explanation)}**"),
        Text(about),
        *map(Text, summary(study, explanation)),
        *map(Text, [as_nav2(folder / TUNED)] if study.incumbent.values else []),
        *_what_differs(folder),
        *sheets(study, scores, explanation, command),
        *figures,
        trials_sheet(study),
    ]
    if study.incumbent.values:
        blocks += [
            Text("Lint of the tuned file", "heading"),
            Text("\n".join(f"- {line}" for line in lint_lines(lint))),
            Text("Its test, driven again", "heading"),
            Text(again, "code"),
        ]
    with writing(folder / REPORT):
        write_text(
            folder / REPORT, f"# Tuned: {about.partition(';')[0]}\n\n{markdown_text(blocks)}"
        )
    return folder / REPORT


def _what_differs(folder: Path) -> list[Block]:
    """The tuned file's lines that are new; none: both are alike."""
    difference = read_text(folder / DIFF).rstrip("\n")
    if not difference:
        return []
    return [Text("What differs", "heading"), Text(difference, "diff")]


def lint_lines(lint: Row) -> list[str]:
    """What the check of the tuned file finds: how much, and what of it is new or gone."""
    counts = f"{counted(lint['errors'], 'error')}, {counted(lint['warnings'], 'warning')}"
    new = (f"new: {each}" for each in lint["new"])
    gone = (f"gone: {each}" for each in lint["gone"])
    return [counts, *new, *gone]
