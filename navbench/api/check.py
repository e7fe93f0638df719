"""Whether a changed Nav2 file earns more or less than the one that it replaces."""

import contextlib
import dataclasses
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.analysis.check import (
    ALIKE,
    SIDES,
    CheckDeclaration,
    Checked,
    Looks,
    check_document,
    evaluate,
    reach_at,
)
from harness.analysis.compare import side_of, warnings_of
from harness.analysis.meetings_check import MeetingsChecked
from harness.analysis.side import Side
from harness.economics.prices import Prices
from harness.episode.files import prices_of
from harness.execution.process_cache import forget_changed
from harness.meetings.allowed import INSTEAD, require_meetings, why_deliveries
from harness.meetings.estimators import DELIVERIES, MEETINGS
from harness.meetings.meet import margin_of
from harness.metrics.columns import Row
from harness.report.numbers import counted
from harness.report.short.check import MARKDOWN, check_markdown
from harness.report.short.meetings import meetings_markdown
from harness.storage.documents import write_file
from harness.storage.files import require_writable
from harness.storage.manifest_file import read_manifest, require_study
from harness.storage.new_run import CHECK, create_run, output_folder, require_usable
from harness.storage.run_folder import RunFolder
from harness.storage.texts import name_of, quoted
from harness.study.drive import TABLES, driven, finish, require_own
from harness.study.manifest import about, load_study, parameters, version_notes
from harness.study.places import Where, open_workers
from harness.study.preflight import check as notes_of
from harness.study.stored_run import folder_and_stack, load_run
from harness.task.study import Study, make_study, usable_workers
from navbench.api.driving import any_text, say_interrupted, say_notes, say_what_failed
from navbench.api.large_maps import drivable
from navbench.api.meetings.check import drive_meetings
from navbench.api.meetings.driving import require_local
from navbench.api.progress import Watch, say, shown
from navstack.errors import InputError
from navstack.params.strict import dump_dataclass, load_dataclass

BUDGET = 600.0  # [s] of wall time
MOST_MISSIONS = 10_000  # that a check can drive
NOT_DRIVEN = "finished runs are not driven again"


@dataclass(frozen=True)
class CheckResult:
    """The verdict on NEW against OLD, and what it is from."""

    declaration: CheckDeclaration
    checked: Checked | None  # None: both drive by the same parameters
    is_interrupted: bool = False
    notes: Sequence[str] = ()  # on the file, the robot and the map

    @property
    def verdict(self) -> str:
        """Of NEW: better, worse, alike or undecided."""
        return "alike" if self.checked is None else self.checked.verdict

    def as_json(self) -> Row:
        """As ``navbench check --json`` prints it."""
        return check_document(self.checked, self.declaration)

    @property
    def has_errors(self) -> bool:
        """Whether deliveries ended in an error of the machine."""
        return self.checked is not None and self.checked.left_out > 0


def check(
    old: str,
    new: str,
    *,
    within: float = ALIKE,
    budget: float = BUDGET,
    estimator: str | None = None,
    markdown: Path | None = None,
    out: Path | None = None,
    where: Where | None = None,
    map: str = "sidewalk",  # noqa: A002 - as the option is called
    **options: Any,
) -> CheckResult | MeetingsChecked:
    """Tell whether NEW earns more or less than OLD, on the same missions.

    Args:
        old: a name of params/stacks, a stack file or a Nav2 parameter file; or a finished run.
        new: another one of the same kind.
        within: [USD] a delivery; a difference that is surely no larger makes them alike.
        budget: [s] of wall time for driving.
        estimator: deliveries, or meetings with people; None: meetings where they can be driven.
        markdown: file for a comment on a pull request; None: none.
        out: run folder; None: ``results/<time>-check-<new>``.
        where: deliveries are driven; None: on this machine.
        map: a built-in map or a map_server YAML file.
        options: as of :func:`navbench.run`, without ``episodes``; none beside finished runs.

    Returns:
        The verdict; where it was interrupted, of what was finished by then.

    Raises:
        InputError: a value that ``navbench run`` would refuse too, runs without a mission in
            common, or a run on one side only; by meetings also finished runs, and what
            :func:`require_meetings` refuses.
    """
    declaration = CheckDeclaration(old, new, within, estimator or DELIVERIES)
    require_markdown(markdown)
    if is_run(old) != is_run(new):
        raise InputError(
            f"'{old}' and '{new}': one is a finished run; give two Nav2 files or stacks, or two "
            "run folders"
        )
    if is_run(old):
        if estimator == MEETINGS:
            raise InputError(f"'{old}' is a finished run, which holds no meetings; {INSTEAD}")
        useless = list(options)
        if out:
            useless.append("out")
        if where:
            useless.append("where")
        if useless:
            raise InputError(f"{NOT_DRIVEN}; leave out {', '.join(useless)}")
        return written(CheckResult(declaration, of_runs(old, new, within)), markdown)
    forget_changed()
    where = where or Where()
    if "episodes" in options:
        raise InputError("check drives as many missions as it needs; leave out episodes")
    study = study_of(old, new, where, map_name=drivable(map), **options)
    declaration = dataclasses.replace(declaration, estimator=_estimator(estimator, study, where))
    if is_same(study):
        return written(CheckResult(declaration, None), markdown)
    with output_folder(out, f"check-{name_of(new)}") as path:
        require_usable(path)
        notes = [note for note in notes_of(study) if not note.startswith(SIDES[0])]
        texts = {**parameters(study), CHECK: dump_dataclass(declaration)}
        create_run(path, about(study, sys.argv), texts)
    found = _driven(path, declaration, where, budget)
    return written(dataclasses.replace(found, notes=tuple(notes)), markdown, path)


def resume_check(
    folder: Path, budget: float = BUDGET, markdown: Path | None = None, where: Where | None = None
) -> CheckResult | MeetingsChecked:
    """Go on with the check of a run folder; otherwise as :func:`check`.

    Raises:
        InputError: also, there is no such folder, or it is no check's.
    """
    require_markdown(markdown)
    path = folder.resolve()  # a link may point elsewhere before the run ends
    read_manifest(path)
    require_study(path, CHECK)
    say_notes(version_notes(path))
    notes_of(load_study(path))
    declaration = load_dataclass(CheckDeclaration, path / "params" / CHECK)
    return written(_driven(path, declaration, where or Where(), budget), markdown, path)


def is_run(given: str) -> bool:
    """Whether OLD or NEW is a run folder, or a stack of one."""
    folder, _ = folder_and_stack(given)
    return folder.is_dir() and not given.startswith(":")


def of_runs(old: str, new: str, within: float) -> Checked | None:
    """What finished runs say, with warnings on stderr where they differ in more than the stack.

    None: both are the same deliveries.

    Raises:
        InputError: no such runs, several stacks in one, or no mission in common.
    """
    first, second = side_of(load_run(old)), side_of(load_run(new))
    folders = {side.run.folder.resolve() for side in (first, second)}
    if len(folders) == 1 and first.stack.name == second.stack.name:
        return None
    found = evaluate(first, second, within)
    for warning in warnings_of(first, second):
        say(f"note: not comparable: {warning}")
    return found


def study_of(old: str, new: str, where: Where, **options: Any) -> Study:
    """Both stacks on the same missions, called old and new.

    Raises:
        InputError: something that was given cannot be used.
    """
    asked = [
        make_study(stacks=[given], episodes=MOST_MISSIONS, workers=where.workers, **options)
        for given in (old, new)
    ]
    stacks = tuple(
        dataclasses.replace(study.stacks[0], name=name)
        for study, name in zip(asked, SIDES, strict=True)
    )
    template = dataclasses.replace(asked[0].template, stack=stacks[0])
    workers = usable_workers(where.workers, MOST_MISSIONS * len(stacks))
    return dataclasses.replace(asked[0], stacks=stacks, template=template, workers=workers)


def is_same(study: Study) -> bool:
    """Whether both stacks drive by the same parameters, so that no row can differ."""
    if any(stack.is_policy for stack in study.stacks):
        return False
    known = []
    for stack in study.stacks:
        alone = dataclasses.replace(stack, name=SIDES[0], title="", body="")
        texts = parameters(dataclasses.replace(study, stacks=(alone,)))
        texts.pop(f"{SIDES[0]}-ignored.txt", None)  # tells lines of a file, and changes no row
        nowhere = dataclasses.replace(alone, nav2_file="", sensors="", robot="")
        known.append((nowhere, texts))
    return known[0] == known[1]


def _estimator(given: str | None, study: Study, where: Where) -> str:
    """The one that was asked for, else meetings where they can be driven; says why not.

    Raises:
        InputError: meetings were asked for and cannot be driven.
    """
    if given == MEETINGS:
        require_local(where)
        require_meetings(study)
    if given is not None:
        return given
    reason = why_deliveries(study)
    if not where.is_local:
        reason = "meetings are driven on this machine only"
    if not reason:
        return MEETINGS
    say(f"note: by whole deliveries: {reason}")
    return DELIVERIES


def _driven(
    path: Path, declaration: CheckDeclaration, where: Where, budget: float
) -> CheckResult | MeetingsChecked:
    """What a folder comes to by its estimator, with the missions that it lacks."""
    if declaration.estimator == MEETINGS:
        return drive_meetings(path, declaration, where, budget)
    return _drive(path, declaration, where, budget)


def _drive(path: Path, declaration: CheckDeclaration, where: Where, budget: float) -> CheckResult:
    study = load_study(path, where.workers)
    prices = prices_of(study.template.prices)
    looks, is_stopped = Looks(declaration.within, reach_at(prices)), False
    with RunFolder(path, TABLES, study.total) as folder:
        say_notes(folder.notes)
        require_own(study, folder)
        differences = Differences(folder, prices)
        differences.tell(looks)
        if looks.missions:
            say(f"going on after {counted(looks.missions, 'mission')}")
        try:
            if not looks.is_decided:
                _drive_missions(study, folder, where, budget, differences, looks)
        except KeyboardInterrupt:
            is_stopped = True
        finish(study, folder)
    say_what_failed(folder.rows.where(any_text, "error", "stack_error"))
    run = load_run(str(path))
    first, second = (Side(run.only(name), run.only(name).stacks[0]) for name in SIDES)
    checked = evaluate(first, second, declaration.within, looks.looked_at)
    if is_stopped:
        say_interrupted(looks.missions, counted(looks.missions, "mission"), path)
    return CheckResult(declaration, checked, is_stopped)


def _drive_missions(
    study: Study,
    folder: RunFolder,
    where: Where,
    budget: float,
    differences: "Differences",
    looks: Looks,
) -> None:
    """Drive mission after mission until a look decides or the time is over."""
    path, watch = folder.path, Watch(looks, budget)
    with (
        open_workers(where, study.workers, path, {path: study}) as workers,
        shown(watch),
        contextlib.closing(driven(study.tasks_in_turns(), folder, workers, watch.until)) as runs,
    ):
        for _ in runs:
            differences.tell(looks)
            if looks.is_decided:
                return


class Differences:
    """What missions differ by, in their order, as soon as both sides have driven all before."""

    def __init__(self, folder: RunFolder, prices: Prices) -> None:
        self._rows, self._prices = folder.rows, prices
        self._read = 0  # rows of the folder
        self._next = 0  # mission
        self._earned: dict[int, dict[int, float | None]] = {}  # by mission and stack; None: error

    def tell(self, looks: Looks) -> None:
        """Let the looks hear of every mission that both have driven since.

        Raises:
            InputError: the cargo is not modelled.
        """
        for number in range(self._read, len(self._rows)):
            row = self._rows[number]
            earned = self._earned.setdefault(row["episode"], {})
            earned[row["stack_number"]] = None
            if row.get("error") is None:
                earned[row["stack_number"]] = margin_of(row, self._prices)
        self._read = len(self._rows)
        while len(self._earned.get(self._next, ())) == len(SIDES):
            pair = self._earned.pop(self._next)
            self._next += 1
            if pair[0] is not None and pair[1] is not None:
                looks.add(pair[1] - pair[0])


def written(
    found: CheckResult | MeetingsChecked, markdown: Path | None, folder: Path | None = None
) -> CheckResult | MeetingsChecked:
    """Write the comment for a pull request, if there is to be one.

    Raises:
        InputError: it cannot be written; the message tells the verdict, and the run's ``folder``.
    """
    if markdown is None:
        return found
    if isinstance(found, MeetingsChecked):
        text = meetings_markdown(found)
    else:
        text = check_markdown(found.checked, found.declaration)
    try:
        write_file(markdown, text)
    except InputError as error:
        kept = "" if folder is None else f"; --resume {quoted(folder)} writes it"
        raise InputError(f"{error}; the verdict is: {found.verdict}{kept}") from None
    return found


def require_markdown(file: Path | None) -> None:
    """Check, before the work, that the comment can be written."""
    if file is not None:
        require_writable("comment", file, MARKDOWN)
