"""One localizer after the other, by meetings with people."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from harness.ablation.analysis import AblationDeclaration
from harness.ablation.meetings import MeetingsArms
from harness.economics.unseen import hit_cost
from harness.episode.files import prices_of
from harness.meetings.allowed import INSTEAD, require_meetings
from harness.meetings.kept import KeptMissions, kept_missions
from harness.meetings.mission import MissionDrive
from harness.meetings.results import result_of
from harness.report.numbers import counted
from harness.storage.files import locked
from harness.study.manifest import load_study
from harness.study.places import Where
from harness.task.study import Study
from navbench.api.meetings.driving import is_interrupted, place_of, require_local
from navbench.api.progress import Bar, say
from navstack.errors import InputError


def require_arms(study: Study, where: Where) -> None:
    """Check, before the folder is made, that arms can be met.

    Raises:
        InputError: they cannot, or single missions or records of them are asked for.
    """
    require_local(where)
    require_meetings(study)
    if study.counts:
        raise only_of_deliveries()
    if study.only:
        raise InputError(f"meetings are driven on all missions; leave out --only, or {INSTEAD}")
    if study.template.keep_trace or study.template.keep_decisions:
        raise InputError(f"meetings leave no recordings; leave out --record, or {INSTEAD}")


def only_of_deliveries() -> InputError:
    """The error of arms that shall drive until their margins are known, by meetings."""
    return InputError(
        f"--within is for whole deliveries: all arms drive the same meetings; leave it out, or "
        f"{INSTEAD}"
    )


def drive_arms(path: Path, declaration: AblationDeclaration, where: Where) -> MeetingsArms:
    """Drive the missions that the folder of an ablation lacks.

    Args:
        path: of the folder.
        declaration: which arm the others are compared to.
        where: missions are driven.
    """
    require_local(where)
    study = load_study(path, where.workers)
    with locked(path):
        kept = kept_missions(path, is_ours=True)
        bar = Bar("{done} of {total} missions", study.episodes, kept.number)
        if kept.number >= study.episodes:
            say(f"run {path} is complete, with {counted(study.episodes, 'mission')}")
            is_stopped = False
        else:
            if kept.number:
                say(f"going on after {kept.number} of {study.episodes} missions")

            def is_enough(drive: MissionDrive) -> bool:
                bar.done = kept.number
                return False

            is_stopped = is_interrupted(study, kept, where, bar, is_enough)
    found = _found(path, declaration, study, kept)
    return dataclasses.replace(found, is_interrupted=is_stopped)


def arms_of_folder(
    path: Path, declaration: AblationDeclaration, names: Sequence[str] = ()
) -> MeetingsArms:
    """What the finished missions of a folder say.

    Args:
        path: of the folder.
        declaration: which arm the others are compared to.
        names: of the arms that count; none: all.

    Raises:
        InputError: an arm that it lacks.
    """
    return _found(path, declaration, load_study(path, 1), kept_missions(path), names)


def _found(
    path: Path,
    declaration: AblationDeclaration,
    study: Study,
    kept: KeptMissions,
    names: Sequence[str] = (),
) -> MeetingsArms:
    all_names = [stack.name for stack in study.stacks]
    unknown = [name for name in names if name not in all_names]
    if unknown:
        raise InputError(f"'{path}' has no stack '{unknown[0]}'; it has {', '.join(all_names)}")
    chosen = [all_names.index(name) for name in names or all_names]
    drives = [
        dataclasses.replace(each, arms=tuple(each.arms[number] for number in chosen))
        for each in kept.drives
    ]
    result = None
    if drives:
        hit = hit_cost(prices_of(study.template.prices))
        result = result_of(drives, study.template.seed, hit)
    return MeetingsArms(
        declaration=declaration,
        arms=tuple(study.stacks[number] for number in chosen),
        folder=path,
        where=place_of(study),
        episodes=study.episodes,
        seed=study.template.seed,
        result=result,
        errors=kept.errors,
    )
