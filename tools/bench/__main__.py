"""The command ``python -m tools.bench``."""

import json
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from harness.storage.files import require_writable, writing
from navbench.cli.app import main
from navbench.cli.options import JSON
from navbench.cli.streams import print_json
from navstack.errors import InputError

if TYPE_CHECKING:
    from tools.bench.measure import Effort


Row = dict[str, Any]


@click.command("python -m tools.bench")
@click.option(
    "--only",
    multiple=True,
    metavar="NAME",
    help="A name, a part of one, components or loops; "
    "several with commas between them, or repeated.",
)
@click.option(
    "--runs",
    type=click.IntRange(min=1),
    help="Readings per component and deliveries per closed loop; default: 40 and 10.",
)
@click.option(
    "--quick",
    is_flag=True,
    help="Few readings and the first 15 s of few deliveries: a look, no figures.",
)
@click.option(
    "--history",
    type=click.Path(path_type=Path),
    metavar="FILE.md",
    help="Add a row to this table.",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="FILE.json",
    help="Write the document of --json here.",
)
@JSON
def bench(
    only: tuple[str, ...],
    runs: int | None,
    quick: bool,
    history: Path | None,
    out: Path | None,
    as_json: bool,
) -> None:
    """Measure how fast everything is.

    Components are compared with plain numpy and with recorded times of Nav2's C++,
    whole deliveries with real time. The breakdown shows the parts of one simulated second.

    Times are processor time of one core; readings of ours and the reference alternate.
    docs/speed.md explains them.

    \b
    Examples:
      python -m tools.bench
      python -m tools.bench --only "DWB cycle" --only paper-gps --json
      python -m tools.bench --quick
      python -m tools.bench --history tools/bench/history.md
    """
    import dataclasses

    from tools.bench.history import append, load, machine, read_history
    from tools.bench.measure import FULL, QUICK, chosen

    names = chosen(only)
    effort = QUICK if quick else FULL
    if runs is not None:
        effort = dataclasses.replace(effort, runs=runs, deliveries=runs)
    for option, file in (("--history", history), ("--out", out)):
        if file is not None:
            require_writable(option, file)
    if history is not None:
        read_history(history)
    before = load()
    rows: list[Row] = []
    try:
        for found in _measured(names, effort):
            rows += found
    except KeyboardInterrupt:
        _show(rows, [], out, as_json)  # what is finished is kept
        raise
    if not rows:
        raise InputError("nothing could be measured; why stands above")
    notes = _notes(
        rows, f"machine: {machine()}; {before:.1f} processes wanted a core when it began"
    )
    if history is not None:
        append(history, rows)
    _show(rows, notes, out, as_json)


def _show(rows: Sequence[Row], notes: Sequence[str], out: Path | None, as_json: bool) -> None:
    """Write and print the document, or print tables."""
    from harness.report.tables import report_console
    from tools.bench.tables import print_bench

    if out is not None:
        with writing(out):
            out.write_text(json.dumps(rows, indent=2, allow_nan=False) + "\n", encoding="utf-8")
    if as_json:
        print_json(rows)
    else:
        print_bench(rows, notes, report_console())


def _measured(names: Sequence[str], effort: "Effort") -> Iterator[list[Row]]:
    """The rows of one name after the other.

    What needs golden vectors is left out where there are none.
    """
    from tools.bench.measure import measure
    from tools.parity.golden import GoldenError

    with tempfile.TemporaryDirectory() as folder:
        for number, name in enumerate(names, 1):
            click.echo(f"{number}/{len(names)} {name}", err=True)
            try:
                rows = measure(name, effort, Path(folder))
            except GoldenError as error:
                click.echo(f"left out: {name}: {error}", err=True)
                continue
            if not rows:
                click.echo(f"left out: {name}: this process may use one core only", err=True)
            yield rows


def _notes(rows: Sequence[Row], about: str) -> list[str]:
    from tools.bench.component import SOURCE
    from tools.bench.measure import CPP, TWO_WORKERS

    notes = [about]
    if any(row.get("reference") == CPP for row in rows):
        notes.append(f"{CPP}: {SOURCE}; the target is for the median.")
    if any("real_time_factor" in row for row in rows):
        notes.append(
            "x real time: median over deliveries, from the world's reset to the rows; "
            "quartiles beside it."
        )
    if any(row["name"] == TWO_WORKERS for row in rows):
        notes.append("two workers: wall time, which another load on the machine spoils.")
    return notes


if __name__ == "__main__":
    main(program=bench)
