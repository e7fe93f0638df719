"""The command ``navbench explain``."""

import json
import sys
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import click

from harness.cli.options import JSON, Finite
from harness.cli.replay import map_of
from harness.storage.files import require_writable, write_text, writing
from navstack.errors import InputError

if TYPE_CHECKING:
    from harness.explain.document import Explained, Saving
    from harness.explain.evidence import Evidence
    from harness.explain.moments import Moment
    from harness.study.stored_run import StoredRun


# fmt: off
@click.command()
@click.argument("run", metavar="RUN")
@click.argument("episode", type=click.IntRange(min=0))
@click.option("--stack", help="Of a run of several.")
@click.option("--event", type=click.IntRange(min=1), help="Number of the event; default: all, and the costliest for "
              "--plot and --rewind.")
@click.option("--before", type=Finite(min=0.2, max=60.0), default=5.0, show_default=True,
              help="Seconds shown before the event, and rewound.")
@click.option("--again", is_flag=True, help="Drive it again even if it was recorded: also shows DWB's alternatives.")
@click.option("--rewind", "settings", multiple=True, metavar="PATH=VALUE",
              help="What a parameter of the Nav2 file would have saved, e.g. "
              "controller_server.FollowPath.max_vel_x=1.5; repeatable.")
@click.option("--plot", type=click.Path(path_type=Path), metavar="FILE", help="Figure (PNG, PDF or SVG).")
@click.option("--out", type=click.Path(path_type=Path), metavar="FOLDER",
              help="Folder for explanation.json, explanation.txt and a figure (PDF and PNG) of each event.")
@JSON
# fmt: on
def explain(
    run: str, episode: int, stack: str | None, event: int | None, before: float, again: bool,
    settings: tuple[str, ...], plot: Path | None, out: Path | None, as_json: bool,
) -> None:  # fmt: skip
    """Tell why a delivery cost what it cost: the seconds before each event that had to be paid for.

    RUN is a run folder, or RUN:STACK; EPISODE is the number of the delivery. Where it was not recorded (--record full),
    it is driven again. With --rewind it is driven once more, with another parameter from some seconds before the event
    on.

    \b
    Examples:
      navbench explain results/latest 7
      navbench explain results/latest 7 --stack nav2-gps --event 2 --before 8 --plot event.png
      navbench explain results/latest 7 --rewind controller_server.FollowPath.max_vel_x=1.5
    """
    from harness.analysis.compare import side_of
    from harness.explain.document import document, explained
    from harness.explain.seconds import seconds_before
    from harness.report.explain import print_explanation
    from harness.report.explain_figure import FORMATS
    from harness.report.tables import report_console
    from harness.study.stored_run import load_run

    if plot is not None:
        require_writable("figure", plot, FORMATS)
    stored = load_run(run)
    stored = stored if stack is None else stored.only(stack)
    side_of(stored)  # one stack
    evidence = _evidence(stored, episode, again)
    if evidence is None:
        _say_nothing_to_tell(stored, episode, as_json)
        return
    moments = _moments(stored, evidence)
    chosen = moments if event is None else [_numbered(moments, event)]
    told = explained(evidence, [seconds_before(evidence, moment, before) for moment in chosen])
    saving = _saving(stored, evidence, chosen, settings, before) if settings else None
    figures = _draw(stored, evidence, told, plot, out)
    content = {**document(evidence, told, saving), "figures": [str(figure) for figure in figures]}
    document_text = json.dumps(content, indent=2, allow_nan=False) + "\n"
    if out is not None:
        plain = StringIO()
        print_explanation(evidence, told, saving, figures, report_console(plain))
        with writing(out):
            write_text(out / "explanation.json", document_text)
            write_text(out / "explanation.txt", plain.getvalue())
    if as_json:
        sys.stdout.write(document_text)
        return
    print_explanation(evidence, told, saving, figures, report_console())


def _evidence(run: "StoredRun", episode: int, again: bool) -> "Evidence | None":
    """What there is to tell; None: nothing cost anything."""
    from harness.explain.evidence import decisions_file, delivery_row, drive_again, events_of, recorded
    from harness.explain.moments import is_costly
    from harness.report.page.recording_code import load_recording

    row, stack = delivery_row(run, episode), run.stacks[0].name
    if not is_costly(row, events_of(run, episode)):
        return None
    file = run.folder / "recordings" / f"{stack}-{episode}.npz"
    if not again and file.is_file() and decisions_file(run, episode).is_file():
        return recorded(run, episode, load_recording(file))
    click.echo(f"episode {episode} of {stack} is driven again", err=True)
    return drive_again(run, episode)


def _say_nothing_to_tell(run: "StoredRun", episode: int, as_json: bool) -> None:
    from harness.explain.moments import costly_episodes

    others = costly_episodes(run)
    if as_json:
        sys.stdout.write(json.dumps({"schema": 1, "episode": episode, "events": [], "costly_episodes": others}) + "\n")
        return
    some = f"episodes that have some: {', '.join(map(str, others))}" if others else "nor in any other episode"
    click.echo(f"episode {episode} of {run.stacks[0].name} has no event that cost anything; {some}")


def _moments(run: "StoredRun", evidence: "Evidence") -> "list[Moment]":
    from harness.explain.moments import moments_of
    from harness.world.outcome import Rules
    from navstack.params.strict import load_dataclass

    return moments_of(evidence, load_dataclass(Rules, run.folder / "params" / "rules.yaml"), run.prices())


def _numbered(moments: "list[Moment]", number: int) -> "Moment":
    if number > len(moments):
        raise InputError(f"--event {number}: the delivery has {len(moments)}; give 1 to {len(moments)}")
    return moments[number - 1]


def _saving(
    run: "StoredRun", evidence: "Evidence", moments: "list[Moment]", settings: tuple[str, ...], before: float
) -> "Saving":
    from harness.explain.document import saving_of
    from harness.explain.moments import costliest
    from harness.explain.rewind import rewind

    moment = costliest(moments)
    rewound = rewind(run, evidence, settings, max(moment.stamp - before, 0.0))
    return saving_of(rewound, moment, before, evidence.row, run.prices())


def _draw(
    run: "StoredRun", evidence: "Evidence", told: "list[Explained]", plot: Path | None, out: Path | None
) -> list[Path]:
    """Draw what was asked for; returns the files."""
    if plot is None and out is None:
        return []
    from harness.explain.moments import costliest
    from harness.report.explain_figure import draw_seconds

    if out is not None:
        with writing(out):
            out.mkdir(parents=True, exist_ok=True)
    scene, files = map_of(run, "the figure"), []
    costly = costliest([each.seconds.moment for each in told])
    for each in told:
        number = each.seconds.moment.number
        wanted = [plot] if plot is not None and each.seconds.moment is costly else []
        wanted += [out / f"event-{number}{suffix}" for suffix in (".pdf", ".png")] if out is not None else []
        if wanted:
            draw_seconds(evidence, each.seconds, scene, wanted)
            files += wanted
    return files
