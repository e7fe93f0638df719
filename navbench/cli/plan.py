"""The command ``navbench plan``."""

import json
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click

from harness.storage.files import require_writable
from navbench.cli.options import JSON, STRICT, Finite
from navstack.errors import InputError

AUTO = "auto"
PICTURES = (".png", ".pdf", ".svg")  # suffixes


# fmt: off
@click.command()
@click.option("--map", "map_name", default="sidewalk", show_default=True,
              help="A built-in map or a map_server YAML file.")
@click.option("--start", default=AUTO, show_default=True, metavar="x,y,yaw|auto", help="[m, m, rad]; auto: drawn.")
@click.option("--goal", default=AUTO, show_default=True, metavar="x,y,yaw|auto", help="[m, m, rad]; auto: drawn.")
@click.option("--planner", "planners", multiple=True, metavar="NAME[,NAME]", show_default=True,
              default=("NavFn,SmacHybrid,BITstar",), help="NavFn, IncrementalNavfn, Smac2D, SmacHybrid, "
              "SmacLattice, ThetaStar, RRTConnect, RRTstar, InformedRRTstar, BITstar, PRMstar, FMT; repeatable.")
@click.option("--smoother", help="Smooth every path: SimpleSmoother.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of mission and planners.")
@click.option("--time", "seconds", type=Finite(min=0.0, max=3600.0, min_open=True), metavar="SECONDS",
              help="Wall time for each of OMPL's planners; default: a number of iterations, which is repeatable.")
@click.option("--params", help="A Nav2 parameter file, or a name of params/nav2; default: the tuned one.")
@click.option("--picture", type=click.Path(path_type=Path), metavar="FILE.png", help="Draw the paths on the costmap.")
@STRICT
@JSON
# fmt: on
def plan(**choices: Any) -> None:
    """Ask several planners for a path from one pose to another, and compare what they find.

    Clearance is the least distance between the robot's body, turns on the way included, and what it must not touch;
    cost counts a path through costs as longer, as NavFn does. docs/planning.md describes the planners.

    \b
    Examples:
      navbench plan --planner NavFn,RRTstar,InformedRRTstar --seed 3 --time 1 --picture plan.png
      navbench plan --start=-67.9,-71.9,0 --goal=-89.7,-63.5,0 --planner NavFn --smoother SimpleSmoother
      navbench plan --map my_map.yaml --params my_nav2.yaml --start 1,2,0 --goal 9,4,1.57 --planner PRMstar,FMT --json

    Exit status: 0 a planner found a path; 1 none did, or bad input.
    """
    sys.exit(plan_command(**choices))


def plan_command(
    map_name: str,
    start: str,
    goal: str,
    planners: tuple[str, ...],
    smoother: str | None,
    seed: int,
    seconds: float | None,
    params: str | None,
    picture: Path | None,
    allow_unknown: bool,
    as_json: bool,
) -> int:
    """Ask every planner, then print and draw what they found.

    Returns:
        The exit status: 0 where a planner found a path, else 1.

    Raises:
        InputError: an unknown name, a pose that cannot be used, a file that cannot be read or
            written.
    """
    from harness.plan.question import ask_all, task_of
    from harness.report.plan import draw_plan, plan_blocks, plan_document
    from harness.report.tables import print_blocks, report_console

    if picture is not None:
        require_writable("--picture", picture, PICTURES)
    begin, end = (None if pose == AUTO else pose for pose in (start, goal))
    task = task_of(map_name, begin, end, seed, params, allow_unknown)
    ends, ground, answers = ask_all(task, _names(planners), smoother, seconds or 0.0)
    if picture is not None:
        draw_plan(ground.costmap, ends, answers, ground.footprint, picture)
    if as_json:
        document = plan_document(ends, answers) | {"map": task.map_name, "seed": seed}
        sys.stdout.write(json.dumps(document, allow_nan=False) + "\n")
    else:
        console = report_console()
        print_blocks(plan_blocks(ends, answers, smoother), console)
        if picture is not None:
            console.print(f"picture: {picture}", soft_wrap=True)
    return 0 if any(answer.path is not None for answer in answers) else 1


def _names(planners: Sequence[str]) -> list[str]:
    """The planners, one by one.

    Raises:
        InputError: none is given, or one twice.
    """
    names = [name.strip() for group in planners for name in group.split(",") if name.strip()]
    twice = next((name for name in names if names.count(name) > 1), None)
    if not names or twice is not None:
        problem = "names no planner" if twice is None else f"names {twice} twice"
        raise InputError(f"--planner '{','.join(planners)}' {problem}; give each once, e.g. NavFn,RRTstar")
    return names
