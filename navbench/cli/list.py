"""The command ``navbench list``."""

import dataclasses

import click

from navbench.cli.options import JSON
from navbench.cli.streams import print_json

GAP = 2  # [characters] between columns


@click.command()
@click.argument("kind", required=False)
@click.option("--all", "is_all", is_flag=True, help="Also stacks for special uses.")
@JSON
def list(kind: str | None, is_all: bool, as_json: bool) -> None:
    """List what comes with the program, with a line each.

    KIND is stacks, worlds, robots, sensors, localizers, spaces, prices or maps; without it the
    kinds are listed. A name goes behind the option of its kind, e.g. --world easy.

    \b
    Examples:
      navbench list
      navbench list stacks --all
      navbench list worlds --json
    """
    from navbench.api.listing import KINDS
    from navbench.api.listing import listing as find

    kinds = KINDS if kind is None else [kind]
    found = {name: find(name, is_all) for name in kinds}
    if as_json:
        known = {name: [dataclasses.asdict(each) for each in found[name]] for name in found}
        print_json({"schema": 1, **known})
        return
    lines = [(each.name, each.what) for each in found[next(iter(found))]]
    if kind is None:
        lines = [
            (name, f"{KINDS[name].option}: {', '.join(each.name for each in entries)}")
            for name, entries in found.items()
        ]
    width = max(len(name) for name, _ in lines) + GAP
    for name, what in lines:
        click.echo(f"{name:<{width}}{what}")
    if kind == "stacks" and not is_all:
        click.echo("next: navbench list stacks --all")
