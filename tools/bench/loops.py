"""The closed loops that are timed.

A stack in the world, brain and physics together, delivery by delivery.

This module also runs as a program, which drives what it is told on standard input: then it needs
nothing of the package that it is in, so that it can drive other versions of the program (see
``tools/check_speed.py``).
"""

import dataclasses
import json
import os
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.episode.episode import run_episode
from harness.episode.factory import Parts
from harness.task.study import EpisodeTask, make_study
from navstack.errors import ParameterError

# harness.storage.shipped.DEFAULT_WORLD, by name: other versions drive the same one
WORLD = "published_3"  # its name in the other versions
NAVFN = "nav2_navfn_planner::NavfnPlanner"
INCREMENTAL = "navstack::IncrementalNavfn"


@dataclass(frozen=True, slots=True)
class Loop:
    """A stack as it is shipped, or with another planner."""

    name: str
    stack: str  # of params/stacks
    incremental: bool  # with IncrementalNavfn in place of NavFn, all its parameters kept
    target: float  # x real time on one core


LOOPS = {
    loop.name: loop
    for loop in (
        Loop("paper-gps", "paper-gps", False, 80.0),
        Loop("paper-gps incremental", "paper-gps", True, 100.0),
        Loop("nav2-amcl", "nav2-amcl", False, 60.0),
        Loop("nav2-amcl incremental", "nav2-amcl", True, 80.0),
        Loop("nav2-stock incremental", "nav2-stock", True, 150.0),
        Loop("mpc-gps-ekf", "mpc-gps-ekf", False, 60.0),
        Loop("evasive-gps-ekf", "evasive-gps-ekf", False, 60.0),
    )
}


@dataclass(frozen=True, slots=True)
class Driven:
    """A delivery and what it took."""

    simulated: float  # [s]
    # [s] from the world's reset to the finished rows; the set-up before is kept between deliveries
    processor: float
    wall: float  # [s] the same
    row: dict[str, Any]  # of episodes.parquet

    @property
    def factor(self) -> float:
        """Simulated seconds per second of processor time."""
        return self.simulated / self.processor


class Course:
    """A loop's deliveries of seed 0 on the shipped map in the default world.

    Whole ones, or cut off after some seconds.
    """

    def __init__(self, loop: Loop, folder: Path, seconds: float | None = None) -> None:
        """Write the parameter files that differ from the shipped ones.

        Args:
            loop: what drives.
            folder: where those files are kept, as long as the course is driven.
            seconds: simulated time after which a delivery ends; None: when it ends.
        """
        changes: dict[str, Any] = {}
        study = make_study(stacks=[loop.stack], episodes=1, workers=1, world=WORLD)
        task = next(study.tasks())
        if loop.incremental:
            nav2 = _changed(folder, Path(task.stack.nav2_file), NAVFN, INCREMENTAL)
            changes["stack"] = dataclasses.replace(task.stack, nav2_file=nav2)
        if seconds is not None:
            changes["rules"] = _changed(
                folder, Path(task.rules), "\ntimeout: 241.0", f"\ntimeout: {seconds}"
            )
        self._task: EpisodeTask = dataclasses.replace(task, **changes)

    def task(self, episode: int) -> EpisodeTask:
        """One delivery."""
        return dataclasses.replace(self._task, episode=episode)


def drive(task: EpisodeTask) -> Driven:
    """Drive one delivery and time it.

    Raises:
        NavstackError: it cannot be set up.
    """
    world = Parts(task).world()
    Parts(task).brain(world)
    began: list[float] = []
    reset = world.reset

    def noted(*given: Any) -> Any:
        began.extend((time.process_time(), time.perf_counter()))
        return reset(*given)

    world.reset = noted  # type: ignore[method-assign, assignment]
    try:
        row = run_episode(task).row
    finally:
        del world.reset  # the method of the class again
    processor, wall = time.process_time() - began[0], time.perf_counter() - began[1]
    return Driven(float(row["duration_s"]), processor, wall, dict(row))


def _changed(folder: Path, file: Path, old: str, new: str) -> str:
    """A copy of a shipped file with one text replaced; returns its path.

    Raises:
        ParameterError: the file does not hold the text.
    """
    text = file.read_text(encoding="utf-8")
    if old not in text:
        raise ParameterError(
            f"{file} no longer holds '{old.strip()}'; the closed loops of the benchmark must "
            "follow it"
        )
    copy = folder / file.parent.name / file.name
    copy.parent.mkdir(parents=True, exist_ok=True)
    copy.write_text(text.replace(old, new), encoding="utf-8")
    return str(copy)


def serve() -> None:
    """Answer requests, a line of JSON each: ``loop``, ``episode``, ``seconds`` (or null).

    The answer is a delivery, and the folder of the version that drove it.
    """
    program = str(Path(run_episode.__code__.co_filename).resolve().parents[2])
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)  # what C code prints must not get between the answers
    courses: dict[tuple[str, float | None], Course] = {}
    with tempfile.TemporaryDirectory() as folder:
        for line in sys.stdin:
            asked = json.loads(line)
            key = (asked["loop"], asked["seconds"])
            if key not in courses:
                place = Path(folder) / str(len(courses))
                courses[key] = Course(LOOPS[asked["loop"]], place, seconds=asked["seconds"])
            driven = drive(courses[key].task(asked["episode"]))
            print(
                json.dumps({**dataclasses.asdict(driven), "program": program}),
                file=answers,
                flush=True,
            )  # noqa: T201


if __name__ == "__main__":
    serve()
