"""The command ``navbench plan``."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from navbench.cli.options import JSON, STRICT, path_option
from navbench.cli.values import Finite, Pose
from navstack.errors import InputError

AUTO = "auto"


class PoseOrAuto(Pose):
    """A pose; ``auto``: none."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The numbers; None: auto."""
        return None if value == AUTO else super().convert(value, param, ctx)


@click.command()
@click.option(
    "--map", default="sidewalk", show_default=True, help="A built-in map or a map_server YAML file."
)
@click.option(
    "--start",
    type=PoseOrAuto(),
    default=AUTO,
    show_default=True,
    metavar="x,y,yaw|auto",
    help="[m, m, rad]; auto: drawn.",
)
@click.option(
    "--goal",
    type=PoseOrAuto(),
    default=AUTO,
    show_default=True,
    metavar="x,y,yaw|auto",
    help="[m, m, rad]; auto: drawn.",
)
@click.option(
    "--planner",
    "planners",
    multiple=True,
    metavar="NAME[,NAME]",
    show_default=True,
    default=("NavFn,SmacHybrid,BITstar",),
    help="NavFn, IncrementalNavfn, Smac2D, SmacHybrid, "
    "SmacLattice, ThetaStar, RRTConnect, RRTstar, InformedRRTstar, BITstar, PRMstar, "
    "FMT; repeatable.",
)
@click.option("--smoother", help="Smooth every path: SimpleSmoother.")
@click.option(
    "--seed",
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    help="Of mission and planners.",
)
@click.option(
    "--time",
    "seconds",
    type=Finite(min=0.0, max=3600.0, min_open=True),
    metavar="SECONDS",
    help=(
        "Wall time for each of OMPL's planners; default: a number of iterations, which is "
        "repeatable."
    ),
)
@click.option(
    "--params", help="A Nav2 parameter file, or a name of params/nav2; default: the tuned one."
)
@path_option("--picture", "FILE.png", "Draw the paths on the costmap.")
@STRICT
@JSON
def plan(
    planners: tuple[str, ...],
    smoother: str | None,
    seconds: float | None,
    picture: Path | None,
    as_json: bool,
    **choices: Any,
) -> None:
    """Ask several planners for a path from one pose to another, and compare what they find.

    Clearance is the least distance between the robot's body, turns on the way included, and what it
    must not touch; cost counts a path through costs as longer, as NavFn does. docs/planning.md
    describes the planners.

    \b
    Examples:
      navbench plan --planner NavFn,RRTstar,InformedRRTstar --seed 3 --time 1 --picture plan.png
      navbench plan --start=-67.9,-71.9,0 --goal=-89.7,-63.5,0 --smoother SimpleSmoother
      navbench plan --map my_map.yaml --params my_nav2.yaml --planner PRMstar,FMT --json

    Exit status: 0 a planner found a path; 1 none did, or bad input.
    """
    from harness.report.plan import plan_blocks
    from harness.report.tables import print_blocks, report_console
    from navbench.api import plan as api

    choices |= {"planners": _names(planners), "smoother": smoother, "picture": picture}
    found = api.plan(seconds=seconds or 0.0, **choices)
    if as_json:
        sys.stdout.write(json.dumps(found.as_json(), allow_nan=False) + "\n")
    else:
        console = report_console()
        print_blocks(plan_blocks(found.ends, found.each, smoother), console)
        if picture is not None:
            console.print(f"picture: {picture}", soft_wrap=True)
    sys.exit(0 if any(answer.path is not None for answer in found.each) else 1)


def _names(planners: Sequence[str]) -> list[str]:
    """The planners, one by one.

    Raises:
        InputError: none is given, or one twice.
    """
    names = [name.strip() for group in planners for name in group.split(",") if name.strip()]
    twice = next((name for name in names if names.count(name) > 1), None)
    if not names or twice is not None:
        problem = "names no planner" if twice is None else f"names {twice} twice"
        raise InputError(
            f"--planner '{','.join(planners)}' {problem}; give each once, e.g. NavFn,RRTstar"
        )
    return names
