"""Which delivery a command shows where none, or no stack, was named."""

from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from harness.analysis.dearest import Dear
    from navbench.api.runs import Run


def chosen(run: str, episode: int | None, stack: str | None = None) -> "tuple[Run, int]":
    """A run with one stack, and the number of a delivery; what was chosen is said on stderr.

    Args:
        run: a run folder, or ``FOLDER:stack``.
        episode: number of the delivery; None: the one that lost most.
        stack: of a run with several; None: the one that lost most.

    Raises:
        InputError: there is no such run, stack or delivery.
    """
    from navbench.api.runs import load

    loaded = load(run)
    if stack is not None:
        loaded = loaded[stack]
    if episode is not None and len(loaded.stacks) == 1:
        return loaded, episode
    dear = loaded.dearest(episode)
    if episode is None:
        click.echo(f"note: {_why(dear, len(loaded.stacks))}", err=True)
    else:
        click.echo(f"note: {dear.stack} lost most on episode {episode}; --stack chooses", err=True)
    return loaded[dear.stack], dear.episode


def _why(dear: "Dear", stacks: int) -> str:
    """Which delivery was chosen of the runs of some stacks, and why that one."""
    from harness.explain.moments import costly_episodes

    of = ""
    if stacks > 1:
        of = f" of {stacks} stacks"
    name = f"{dear.stack} episode {dear.episode}"
    if dear.margin is not None:
        name += f" ({dear.margin:+.2f} USD)"
    if dear.episode in costly_episodes(dear.run):
        return f"the dearest delivery{of}: {name}"
    return f"nothing was lost in the delivery that earned least{of}: {name}"
