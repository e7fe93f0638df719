"""What planners made of one query: a table, and the document of ``--json``."""

from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.text import Text

from harness.plan.question import COST_WEIGHT, Answer
from harness.report.markdown import number_text
from harness.report.sheet import declared, print_sheet
from navstack.types import Pose2D

DECIMALS = 6  # of numbers in the document


def plan_document(ends: Sequence[Pose2D], answers: Sequence[Answer]) -> dict[str, Any]:
    """The query and its answers as a JSON document; ``improvement`` is wall time [s] and the planner's own cost [m]."""
    start, goal = ends
    return {
        "schema": 1,
        "start": start.as_array().tolist(),
        "goal": goal.as_array().tolist(),
        "planners": [_row(answer) for answer in answers],
    }


def _row(answer: Answer) -> dict[str, Any]:
    found = answer.path is not None
    return {
        "planner": answer.planner,
        "found": found,
        "why": answer.why,
        "length_m": round(answer.path.length, DECIMALS) if answer.path is not None else None,
        "clearance_m": _rounded(answer.clearance),
        "touches": answer.clearance == 0.0 if found else None,
        "cost": _rounded(answer.cost),
        "time_ms": round(1e3 * answer.seconds, 3),
        "improvement": [[round(seconds, DECIMALS), round(cost, DECIMALS)] for seconds, cost in answer.improvement],
        "path": answer.path.poses.round(DECIMALS).tolist() if answer.path is not None else [],
    }


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, DECIMALS)


def render_plan(ends: Sequence[Pose2D], answers: Sequence[Answer], smoother: str | None, console: Console) -> None:
    """Print a table, and below it why a planner found nothing."""
    start, goal = ends
    rows = [(answer.planner, *_cells(answer)) for answer in answers]
    smoothed = "" if smoother is None else f", paths smoothed by {smoother}"
    print_sheet(declared("plan", rows, start=start, goal=goal, smoothed=smoothed), console)
    for answer in answers:
        if answer.why:
            console.print(Text(f"{answer.planner}: {answer.why.removeprefix(f'{answer.planner}: ')}"), soft_wrap=True)
    if any(answer.clearance == 0.0 for answer in answers):
        console.print(Text("clearance 0: the robot's body touches something on the way.", style="dim"))
    console.print(
        Text(f"cost: each piece of the path counts 1 + {COST_WEIGHT:g} x its costmap cost / 252.", style="dim")
    )


def _cells(answer: Answer) -> tuple[str, ...]:
    seconds, cost = answer.improvement[0] if answer.improvement else (None, None)
    length = "none" if answer.path is None else number_text(answer.path.length)
    after = None if seconds is None else 1e3 * seconds
    own = (length, number_text(answer.clearance), number_text(answer.cost, 1), number_text(1e3 * answer.seconds, 1))
    return (*own, number_text(cost), number_text(after, 1))
