"""The command ``navbench explain``."""

import sys
from typing import TYPE_CHECKING, Any

import click

from harness.storage.texts import quoted
from navbench.cli.common.dearest import chosen
from navbench.cli.options import FULL, JSON, path_option
from navbench.cli.streams import print_json
from navbench.cli.values import Finite

if TYPE_CHECKING:
    from harness.explain.legs import ToldLeg
    from navbench.api.runs import Run

MOST_OTHERS = 8  # episodes that are named beside the one that is explained


@click.command()
@click.argument("run", metavar="RUN")
@click.argument("episode", type=click.IntRange(min=0), required=False)
@click.option("--stack", help="Of a run of several.")
@click.option(
    "--event",
    type=click.IntRange(min=1),
    help="Number of the event; default: the costliest.",
)
@click.option(
    "--leg",
    type=click.IntRange(min=0),
    help="Number of the leg of a mission on a district; default: the costliest.",
)
@click.option(
    "--before",
    type=Finite(min=0.2, max=60.0),
    help="Seconds shown before the event, and rewound; default: since the robot was held up, 5 to "
    "20.",
)
@click.option(
    "--again",
    is_flag=True,
    help="Drive it again even if it was recorded: also shows DWB's alternatives.",
)
@click.option(
    "--rewind",
    multiple=True,
    metavar="PATH=VALUE",
    help="What a parameter of the Nav2 file would have saved, e.g. "
    "controller_server.FollowPath.max_vel_x=1.5; repeatable.",
)
@path_option("--plot", "FILE", "Figure (PNG, PDF or SVG).")
@path_option(
    "--out",
    "FOLDER",
    "Folder for explanation.json, explanation.txt and a figure (PDF and PNG) of each event.",
)
@FULL
@JSON
def explain(
    run: str,
    episode: int | None,
    stack: str | None,
    as_json: bool,
    is_full: bool,
    **choices: Any,
) -> None:
    """Tell why a delivery cost what it cost: the seconds before each event that had to be paid for.

    RUN is a run folder, or RUN:STACK; EPISODE is the number of the delivery, by default the one
    that lost most. Where it was not recorded (--record full), it is driven again. With --rewind it
    is driven once more, with another parameter from some seconds before the event on. Of a mission
    on a district one leg is told of.

    \b
    Examples:
      navbench explain results/latest
      navbench explain results/latest 7 --stack nav2-gps --event 2 --before 8 --plot event.png
      navbench explain results/latest 7 --rewind controller_server.FollowPath.max_vel_x=1.5
    """
    from harness.report.explain import explanation_blocks
    from harness.report.short.explain import short_explanation
    from harness.report.short.setup import delivery_line
    from harness.report.tables import print_blocks, report_console
    from navbench.api import explain as api

    asked = episode
    loaded, episode = chosen(run, asked, stack)
    found = api.explain(loaded, episode, **choices)
    if found is None and as_json:
        print_json(_nothing_to_tell(loaded, asked))
    elif found is None:
        _say_nothing_to_tell(loaded, episode)
    elif as_json:
        sys.stdout.write(api.document_text(found))
    else:
        blocks = explanation_blocks if is_full else short_explanation
        told = found.evidence, found.told, found.saving, found.figures, found.activities
        click.echo(delivery_line(loaded.stored, episode))
        if found.leg is not None:
            click.echo(_leg_line(found.leg))
        print_blocks(blocks(*told), report_console())
        if others := _others(loaded, episode):
            click.echo(f"other episodes that lost something, the dearest first: {others}")
        click.echo(f"next: {_next(loaded, episode)}")


def _leg_line(leg: "ToldLeg") -> str:
    """Which leg is told of, and in which others something was lost."""
    line = f"leg {leg.number} (0 to {leg.count - 1} were driven), from {leg.begin:.0f} s on"
    if others := [str(each) for each in leg.costly if each != leg.number]:
        line += f"; --leg tells others that lost something: {', '.join(others)}"
    return line


def _next(run: "Run", episode: int) -> str:
    """The command that shows the same."""
    if run.stored.has_legs:
        return f"navbench map losses {quoted(_place(run))}"
    return f"navbench replay {quoted(_place(run))} {episode}"


def _others(run: "Run", episode: int) -> str:
    """The other deliveries of the stack that have something to tell, the dearest first."""
    from harness.analysis.dearest import dearest
    from harness.explain.moments import costly_episodes

    costly = costly_episodes(run.stored)
    ordered = dearest([run.stored], len(run.stored.stacks[0].rows))
    found = [each.episode for each in ordered if each.episode in costly]
    others = [str(each) for each in found if each != episode]
    shown = ", ".join(others[:MOST_OTHERS])
    if len(others) > MOST_OTHERS:
        return f"{shown} and {len(others) - MOST_OTHERS} more"
    return shown


def _place(run: "Run") -> str:
    """A run and its stack by the folder's own name: a link may point elsewhere soon."""
    from harness.storage.files import nearby

    return f"{nearby(run.folder.resolve())}:{run.stacks[0]}"


def _nothing_to_tell(run: "Run", asked: int | None) -> dict[str, Any]:
    """The JSON document. ``asked``: for this episode; None: the dearest lost nothing."""
    from harness.explain.moments import costly_episodes

    return {
        "schema": 1,
        "stack": run.stacks[0],
        "episode": asked,
        "events": [],
        "costly_episodes": costly_episodes(run.stored),
    }


def _say_nothing_to_tell(run: "Run", episode: int) -> None:
    """Say so, and which other episodes have something to tell."""
    from harness.report.short.setup import delivery_line

    some = "nor in any other episode"
    if others := _others(run, episode):
        some = f"episodes that have some: {others}"
    click.echo(delivery_line(run.stored, episode))
    click.echo(f"episode {episode} of {run.stacks[0]} has no event that cost anything; {some}")
    click.echo(f"next: {_next(run, episode)}")
