"""Whether a changed Nav2 file earns more or less, by meetings with people."""

import dataclasses
import sys
from pathlib import Path
from typing import Any

from harness.analysis.check import ALIKE, SIDES, CheckDeclaration, verdict_of
from harness.analysis.meetings_check import MeetingsChecked
from harness.meetings.allowed import INSTEAD, require_meetings
from harness.meetings.estimators import MEETINGS
from harness.meetings.kept import kept_missions
from harness.meetings.looks import MeetingLooks
from harness.meetings.mission import MissionDrive
from harness.meetings.results import result_of
from harness.report.short.meetings import meetings_markdown
from harness.storage.documents import write_file
from harness.storage.files import locked
from harness.storage.new_run import CHECK, create_run, default_folder, require_usable
from harness.storage.texts import name_of
from harness.study.manifest import about, load_study, parameters
from harness.study.places import Where
from harness.study.preflight import check as notes_of
from navbench.api.check import (
    BUDGET,
    CheckResult,
    Watch,
    is_run,
    is_same,
    require_markdown,
    study_of,
    written,
)
from navbench.api.meetings.driving import is_interrupted, place_of, require_local
from navbench.api.progress import say
from navstack.errors import InputError
from navstack.params.strict import dump_dataclass


def check_by_meetings(
    old: str,
    new: str,
    *,
    within: float = ALIKE,
    budget: float = BUDGET,
    markdown: Path | None = None,
    out: Path | None = None,
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
        markdown: file for a comment on a pull request; None: none.
        out: run folder; None: ``results/<time>-check-<new>``.
        where: on this machine; None: there.
        map: a built-in map or a map_server YAML file.
        options: as of :func:`navbench.run`, without ``episodes``.

    Returns:
        The verdict; where both drive by the same parameters, that of :func:`check`.

    Raises:
        InputError: as of :func:`check`; or finished runs, people who react to the robot, or
            deliveries that cannot be copied.
    """
    declaration, where = CheckDeclaration(old, new, within, MEETINGS), where or Where()
    for given in (old, new):
        if is_run(given):
            raise InputError(f"'{given}' is a finished run, which holds no meetings; {INSTEAD}")
    require_markdown(markdown)
    require_local(where)
    study = study_of(old, new, where, map_name=map, **options)
    require_meetings(study)
    if is_same(study):
        return written(CheckResult(declaration, None), markdown)
    path = out or default_folder(f"check-{name_of(new)}")
    require_usable(path)
    notes = [note for note in notes_of(study) if not note.startswith(SIDES[0])]
    texts = {**parameters(study), CHECK: dump_dataclass(declaration)}
    create_run(path, about(study, sys.argv), texts)
    found = dataclasses.replace(_drive(path, declaration, where, budget), notes=tuple(notes))
    return _written(found, markdown)


def resume_by_meetings(
    path: Path,
    declaration: CheckDeclaration,
    budget: float,
    markdown: Path | None,
    where: Where,
) -> MeetingsChecked:
    """Go on with the check of a run folder; otherwise as :func:`check_by_meetings`."""
    require_local(where)
    return _written(_drive(path, declaration, where, budget), markdown)


def _written(found: MeetingsChecked, markdown: Path | None) -> MeetingsChecked:
    """Write the comment for a pull request, if there is to be one."""
    if markdown is not None:
        write_file(markdown, meetings_markdown(found))
    return found


def _drive(
    path: Path, declaration: CheckDeclaration, where: Where, budget: float
) -> MeetingsChecked:
    """Drive mission after mission until a look decides or the time is over."""
    study = load_study(path, where.workers)
    looks = MeetingLooks(study.template.seed)

    def is_decided_by(drive: MissionDrive) -> bool:
        looks.add(drive)
        return verdict_of(looks.bound, declaration.within) != "undecided"

    with locked(path):
        kept = kept_missions(path, is_ours=True)
        is_decided = any([is_decided_by(drive) for drive in kept.drives])
        if kept.number:
            say(f"going on after {kept.number} missions")
        is_stopped = False
        if not is_decided:
            watch = Watch(looks, budget)
            is_stopped = is_interrupted(study, kept, where, watch, is_decided_by, watch.until)
    result = None
    if kept.drives:
        result = result_of(kept.drives, study.template.seed)
    return MeetingsChecked(
        declaration=declaration,
        folder=path,
        where=place_of(study),
        bound=looks.bound,
        result=result,
        errors=kept.errors,
        is_interrupted=is_stopped,
    )
