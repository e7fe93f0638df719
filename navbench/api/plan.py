"""Planners asked for a path."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.episode.factory import Parts
from harness.execution.process_cache import forget_changed
from harness.plan.question import Answer, PlanningMap, ask_all, task_of
from harness.report.plan import draw_plan, plan_document
from harness.storage.files import require_no_input, require_writable
from harness.study.preflight import masks_missing
from harness.task.study import EpisodeTask
from harness.world.map.scene_io import map_files
from navbench.api.progress import count_shown, say
from navstack.types import Pose2D

PICTURES = (".png", ".pdf", ".svg")  # suffixes


@dataclass(frozen=True)
class Answers:
    """What planners made of one question; ``answers["NavFn"]`` is one planner's."""

    task: EpisodeTask
    ends: tuple[Pose2D, Pose2D]
    ground: PlanningMap
    each: list[Answer]

    def __getitem__(self, planner: str) -> Answer:
        """The answer of one planner."""
        return {answer.planner: answer for answer in self.each}[planner]

    def as_json(self) -> dict[str, Any]:
        """As ``navbench plan --json`` prints it."""
        about = {"map": self.task.map_name, "seed": self.task.seed}
        return plan_document(self.ends, self.each) | about


def plan(
    map: str = "sidewalk",  # noqa: A002 - as the option is called
    planners: Sequence[str] = ("NavFn", "SmacHybrid", "BITstar"),
    *,
    start: Sequence[float] | None = None,
    goal: Sequence[float] | None = None,
    seed: int = 0,
    params: str | None = None,
    smoother: str | None = None,
    seconds: float = 0.0,
    picture: Path | None = None,
    allow_unknown: bool = True,
) -> Answers:
    """Ask planners for a path.

    Args:
        map: a built-in map or a map_server YAML file.
        planners: their names, as in docs/planning.md.
        start: x [m], y [m], yaw [rad]; None: drawn.
        goal: likewise.
        seed: of what is drawn.
        params: a Nav2 parameter file, or a name of params/nav2; None: the tuned one.
        smoother: of every path; None: none.
        seconds: wall time for each of OMPL's planners; 0: their number of iterations.
        picture: file to draw the paths in; None: none.
        allow_unknown: whether keys unknown to Nav2 are let pass.

    Raises:
        InputError: an unknown name, or a pose or file that cannot be used.
    """
    if picture is not None:
        require_writable("--picture", picture, PICTURES)
        require_no_input("--picture", picture, map_files(map))
    forget_changed()
    task = task_of(map, start, goal, seed, params, allow_unknown)
    for notice in masks_missing(Parts(task).nav2):
        say(f"note: {notice}")
    with count_shown("planners", len(planners)) as tell:
        ends, ground, answers = ask_all(task, planners, smoother, seconds, tell)
    if picture is not None:
        draw_plan(ground.costmap, ends, answers, ground.footprint, picture)
    return Answers(task, ends, ground, answers)
