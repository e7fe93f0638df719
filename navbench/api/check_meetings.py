"""Whether a changed Nav2 file earns more or less, by meetings with people."""

import contextlib
from pathlib import Path
from typing import Any

from harness.analysis.check import ALIKE, SIDES, CheckDeclaration, Looks
from harness.analysis.meetings_check import REACH, MeetingsChecked
from harness.episode.factory import Parts
from harness.execution.executors import ParentProcess
from harness.execution.workers import Workers
from harness.meetings.allowed import INSTEAD, require_meetings
from harness.meetings.estimate import missions_driven, result_of
from harness.meetings.mission import MissionDrive
from harness.study.places import Where
from harness.study.preflight import check as notes_of
from harness.task.study import Study
from navbench.api.check import BUDGET, CheckResult, Watch, is_run, is_same, study_of
from navbench.api.progress import say, shown
from navstack.errors import InputError


def check_by_meetings(
    old: str,
    new: str,
    *,
    within: float = ALIKE,
    budget: float = BUDGET,
    where: Where | None = None,
    map: str = "sidewalk",  # noqa: A002 - as the option is called
    **options: Any,
) -> MeetingsChecked | CheckResult:
    """Tell whether NEW earns more or less than OLD, by the same meetings of both with people.

    Args:
        old: a name of params/stacks, a stack file or a Nav2 parameter file.
        new: another one.
        within: [USD] a delivery; a difference that is surely no larger makes them alike.
        budget: [s] of wall time.
        where: on this machine; None: there.
        map: a built-in map or a map_server YAML file.
        options: as of :func:`navbench.run`, without ``episodes``.

    Returns:
        The verdict; where both drive by the same parameters, that of :func:`check`.

    Raises:
        InputError: as of :func:`check`; or finished runs, people who react to the robot, or
            deliveries that cannot be copied.
    """
    declaration, where = CheckDeclaration(old, new, within), where or Where()
    for given in (old, new):
        if is_run(given):
            raise InputError(f"'{given}' is a finished run, which holds no meetings; {INSTEAD}")
    if within >= REACH:
        raise InputError(
            f"--within {within:g} is no question for meetings, where a mission's difference counts "
            f"up to {REACH:g} USD; give less"
        )
    if not where.is_local:
        raise InputError(
            f"meetings are driven on this machine only; leave out --executor, or {INSTEAD}"
        )
    study = study_of(old, new, where, map_name=map, **options)
    require_meetings(study)
    if is_same(study):
        return CheckResult(declaration, None)
    notes = [note for note in notes_of(study) if not note.startswith(SIDES[0])]
    return _drive(study, declaration, where, budget, tuple(notes))


def _drive(
    study: Study,
    declaration: CheckDeclaration,
    where: Where,
    budget: float,
    notes: tuple[str, ...],
) -> MeetingsChecked:
    """Drive mission after mission until a look decides or the time is over."""
    looks, known = Looks(declaration.within, REACH), list[MissionDrive]()
    watch, errors, is_stopped = Watch(looks, budget), 0, False
    try:
        with (
            Workers(study.workers, ParentProcess, where.time_limit) as workers,
            shown(watch),
            contextlib.closing(missions_driven(study, workers, watch.until)) as missions,
        ):
            for finished in missions:
                if finished.result is None:
                    errors += 1
                    say(f"mission {finished.task.arms[0].episode}: {finished.error}")
                    continue
                known.append(finished.result)
                looks.add(finished.result.difference)
                if looks.is_decided:
                    break
    except KeyboardInterrupt:
        is_stopped = True
    result = None
    if known:
        result = result_of(known)
    return MeetingsChecked(
        declaration=declaration,
        where=_where(study),
        bound=looks.bound,
        result=result,
        errors=errors,
        notes=notes,
        is_interrupted=is_stopped,
    )


def _where(study: Study) -> str:
    """World, map and people of a study, in words."""
    task = study.template
    people = Parts(task).params.people
    world, place = Path(task.world).stem, Path(task.map_name).stem
    return f"world {world}, map {place}, {people.count} people, seed {task.seed}"
