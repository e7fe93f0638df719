"""What the commands that drive meetings have in common."""

import contextlib
import math
from collections.abc import Callable
from pathlib import Path

from harness.episode.factory import Parts
from harness.execution.executors import ParentProcess
from harness.execution.workers import Workers
from harness.meetings.allowed import INSTEAD
from harness.meetings.estimate import missions_driven
from harness.meetings.kept import KeptMissions
from harness.meetings.mission import MissionDrive
from harness.report.numbers import counted
from harness.report.short.setup import nearest
from harness.study.places import Where
from harness.task.study import Study
from navbench.api.driving import say_interrupted
from navbench.api.progress import Bar, say, shown
from navstack.errors import InputError

FEWEST_FAILED = 5  # missions without one that succeeds, after which none is tried any more


def require_local(where: Where) -> None:
    """Check that missions are to be driven on this machine.

    Raises:
        InputError: they are not.
    """
    if not where.is_local:
        raise InputError(
            f"meetings are driven on this machine only; leave out --executor, or {INSTEAD}"
        )


def is_interrupted(
    study: Study,
    kept: KeptMissions,
    where: Where,
    bar: Bar,
    is_enough: Callable[[MissionDrive], bool],
    until: float = math.inf,
) -> bool:
    """Drive missions after those that are kept, and keep them; returns whether it was interrupted.

    Args:
        study: whose stacks are the arms.
        kept: missions of before.
        where: they are driven.
        bar: that shows how far it is.
        is_enough: whether no mission is needed after this one.
        until: [s] of the monotonic clock.

    Raises:
        InputError: the first missions all end in an error.
    """
    try:
        _drive(study, kept, where, bar, is_enough, until)
    except KeyboardInterrupt:
        say_interrupted(kept.number, counted(kept.number, "mission"), kept.file.parent)
        return True
    return False


def _drive(
    study: Study,
    kept: KeptMissions,
    where: Where,
    bar: Bar,
    is_enough: Callable[[MissionDrive], bool],
    until: float,
) -> None:
    with (
        Workers(study.workers, ParentProcess, where.time_limit) as workers,
        shown(bar),
        contextlib.closing(
            missions_driven(study, workers, until, kept.drives, kept.number)
        ) as missions,
    ):
        for finished in missions:
            kept.add(finished.result)
            if finished.result is None:
                say(f"mission {finished.task.arms[0].episode}: {finished.error}")
                if kept.errors == kept.number >= FEWEST_FAILED:
                    raise InputError(
                        f"all {kept.number} missions ended in an error, the last one in "
                        f"'{finished.error}'; --estimator deliveries drives them whole"
                    )
            elif is_enough(finished.result):
                return


def place_of(study: Study) -> str:
    """World, map, people and the first stack's sensors of a study, in words."""
    task = study.template
    people = Parts(task).params.people
    world, place = nearest("worlds", Path(task.world)).name, Path(task.map_name).stem
    sensors = nearest("sensors", Path(task.stack.sensors))
    where = f"world {world}, map {place}, {people.count} people, sensors {sensors}"
    return f"{where}; seed {task.seed}"
