"""What ``navbench explain`` tells of a delivery: words and tables, figures, a document."""

import json
import sys
from io import StringIO
from pathlib import Path

import click

from harness.analysis.compare import side_of
from harness.explain.document import Explained, Saving, explained, explanation_document
from harness.explain.evidence import (
    Evidence,
    decisions_file,
    delivery_row,
    drive_again,
    events_of,
    recorded,
)
from harness.explain.moments import (
    Moment,
    costliest,
    costly_episodes,
    costs_of,
    is_costly,
    moments_of,
)
from harness.explain.rewind import rewind
from harness.explain.seconds import seconds_before
from harness.report.explain import explanation_blocks
from harness.report.explain_figure import FORMATS, draw_seconds
from harness.report.page.recording_code import load_recording
from harness.report.tables import print_blocks, report_console
from harness.storage.files import require_writable, write_text, writing
from harness.study.stored_run import StoredRun, load_run
from harness.world.outcome import Rules
from navbench.cli.replay import map_of
from navstack.errors import InputError
from navstack.params.strict import load_dataclass


def explain_delivery(
    run: str,
    episode: int,
    stack: str | None,
    event: int | None,
    before: float,
    again: bool,
    settings: tuple[str, ...],
    plot: Path | None,
    out: Path | None,
    as_json: bool,
) -> None:
    """Tell why a delivery cost what it cost, as the options of the command say.

    Raises:
        InputError: something that was given cannot be used.
    """
    if plot is not None:
        require_writable("figure", plot, FORMATS)
    stored = load_run(run)
    stored = stored if stack is None else stored.only(stack)
    side_of(stored)  # one stack
    evidence = _evidence(stored, episode, again)
    if evidence is None:
        _say_nothing_to_tell(stored, episode, as_json)
        return
    moments = moments_of(
        evidence, load_dataclass(Rules, stored.folder / "params" / "rules.yaml"), stored.prices()
    )
    if event is not None and event > len(moments):
        raise InputError(
            f"--event {event}: the delivery has {len(moments)}; give 1 to {len(moments)}"
        )
    chosen = moments if event is None else [moments[event - 1]]
    told = explained(evidence, [seconds_before(evidence, moment, before) for moment in chosen])
    saving = _saving(stored, evidence, chosen, settings, before) if settings else None
    figures = _draw(stored, evidence, told, plot, out)
    content = {
        **explanation_document(evidence, told, saving),
        "figures": [str(figure) for figure in figures],
    }
    document_text = json.dumps(content, indent=2, allow_nan=False) + "\n"
    blocks = explanation_blocks(evidence, told, saving, figures)
    if out is not None:
        plain = StringIO()
        print_blocks(blocks, report_console(plain))
        with writing(out):
            write_text(out / "explanation.json", document_text)
            write_text(out / "explanation.txt", plain.getvalue())
    if as_json:
        sys.stdout.write(document_text)
        return
    print_blocks(blocks, report_console())


def _evidence(run: StoredRun, episode: int, again: bool) -> Evidence | None:
    """What there is to tell; None: nothing cost anything."""
    row, stack = delivery_row(run, episode), run.stacks[0].name
    if not is_costly(row, events_of(run, episode)):
        return None
    file = run.folder / "recordings" / f"{stack}-{episode}.npz"
    if not again and file.is_file() and decisions_file(run, episode).is_file():
        return recorded(run, episode, load_recording(file))
    click.echo(f"episode {episode} of {stack} is driven again", err=True)
    return drive_again(run, episode)


def _say_nothing_to_tell(run: StoredRun, episode: int, as_json: bool) -> None:
    """Say so, and which other episodes have something to tell."""
    others = costly_episodes(run)
    if as_json:
        sys.stdout.write(
            json.dumps({"schema": 1, "episode": episode, "events": [], "costly_episodes": others})
            + "\n"
        )
        return
    some = (
        f"episodes that have some: {', '.join(map(str, others))}"
        if others
        else "nor in any other episode"
    )
    click.echo(f"episode {episode} of {run.stacks[0].name} has no event that cost anything; {some}")


def _saving(
    run: StoredRun,
    evidence: Evidence,
    moments: list[Moment],
    settings: tuple[str, ...],
    before: float,
) -> Saving:
    """What the costliest moment would have cost with other parameters from some seconds before it on."""
    moment, prices = costliest(moments), run.prices()
    rewound = rewind(run, evidence, settings, max(moment.stamp - before, 0.0))
    costs, new_costs = costs_of(evidence.row, prices), costs_of(rewound.delivery.row, prices)
    return Saving(rewound, moment, before, evidence.row, costs, new_costs)


def _draw(
    run: StoredRun, evidence: Evidence, told: list[Explained], plot: Path | None, out: Path | None
) -> list[Path]:
    """Draw what was asked for; returns the files."""
    if plot is None and out is None:
        return []
    if out is not None:
        with writing(out):
            out.mkdir(parents=True, exist_ok=True)
    scene, files = map_of(run, "the figure"), []
    costly = costliest([each.seconds.moment for each in told])
    for each in told:
        number = each.seconds.moment.number
        wanted = [plot] if plot is not None and each.seconds.moment is costly else []
        wanted += (
            [out / f"event-{number}{suffix}" for suffix in (".pdf", ".png")]
            if out is not None
            else []
        )
        if wanted:
            draw_seconds(evidence, each.seconds, scene, wanted)
            files += wanted
    return files
