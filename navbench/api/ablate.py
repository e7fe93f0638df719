"""One localizer after the other on the same deliveries."""

import dataclasses
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.ablation.analysis import Ablation, AblationDeclaration, analyse
from harness.ablation.arms import arms_of, parameter_sources, with_arms
from harness.ablation.document import ablation_document
from harness.ablation.meetings import MeetingsArms
from harness.ablation.precision import FIRST, check_within, counts_wanted
from harness.episode.files import prices_of
from harness.execution.process_cache import forget_changed
from harness.meetings.estimators import DELIVERIES, MEETINGS
from harness.metrics.columns import Row
from harness.report.ablations.figure import draw_ablation
from harness.report.page.ablation import write_ablation
from harness.report.page.document import write_study_page
from harness.storage.documents import write_document
from harness.storage.files import nearby
from harness.storage.manifest_file import require_study, share_out, shared_within
from harness.storage.new_run import ABLATION, create_run, output_folder, require_usable
from harness.storage.texts import name_of
from harness.study.manifest import about, load_study, parameters, version_notes
from harness.study.places import Where
from harness.study.preflight import check
from harness.study.stored_run import StoredRun, load_run
from harness.task.study import make_study
from navbench.api.driving import Driven, drive_folder, extend, say_notes
from navbench.api.large_maps import drivable
from navbench.api.meetings.ablate import drive_arms, only_of_deliveries, require_arms
from navbench.api.progress import say
from navbench.api.report import today
from navstack.errors import InputError
from navstack.params.strict import dump_dataclass, load_dataclass

DEFAULT_STACK = "nav2-amcl"  # it drives as nav2-gps does, and its AMCL knows the wheels


@dataclass(frozen=True)
class Ablated:
    """What each arm earns, and how they differ."""

    driven: Driven  # which may be interrupted
    ablation: Ablation
    content: Row
    figures: list[Path]
    page: Path
    notes: Sequence[str] = ()  # on the file, the robot and the map

    def as_json(self) -> Row:
        """As ``navbench ablate --json`` prints it."""
        figures = [str(figure) for figure in self.figures]
        return {**self.content, "figures": figures, "folder": str(self.driven.folder)}


def ablate(
    stack: str = DEFAULT_STACK,
    localizers: Sequence[str] = (),
    errors: Sequence[str] = (),
    *,
    correlation_time: float | None = None,
    against: str | None = None,
    estimator: str = DELIVERIES,
    within: float | None = None,
    out: Path | None = None,
    where: Where | None = None,
    map: str = "sidewalk",  # noqa: A002 - as the option is called
    episodes: int = 20,
    **options: Any,
) -> Ablated | MeetingsArms:
    """Drive one stack with one localizer after the other on the same missions, people and noise.

    Args:
        stack: what drives.
        localizers: ``NAME`` or ``NAME@MAP`` each; none: all, with ``errors`` the ground truth.
        errors: ``position=0.1,0.3`` [m] or ``heading=2`` [deg] each, an arm for every value.
        correlation_time: [s] over which such an error changes; None: the usual one.
        against: arm to which the others are compared; None: the first.
        estimator: deliveries, or meetings with people, which decide with less driving.
        within: [USD] that each arm's margin may lie off: an arm drives until it is known so well;
            None: all drive as often.
        out: run folder; None: ``results/<time>-ablate-<stack>``.
        where: deliveries are driven; None: on this machine.
        map: a built-in map or a map_server YAML file.
        episodes: deliveries of each arm, at most, or missions whose meetings it drives.
        options: as of :func:`navbench.run`.

    Raises:
        InputError: a value that ``navbench run`` would refuse too, arms that cannot be had, or a
            world whose people cannot be met.
    """
    where = where or Where()
    forget_changed()
    study = make_study(
        stacks=[stack], episodes=episodes, map_name=drivable(map), workers=where.workers, **options
    )
    asked = localizers, errors, correlation_time
    arms = arms_of(study.stacks[0], *asked, study.template.allow_unknown)
    sources = parameter_sources(study.stacks[0], arms, study.template.allow_unknown)
    study = with_arms(study, arms, where.workers)
    name, first = name_of(stack), study.stacks[0].name
    declaration = AblationDeclaration(name, against or first, sources, estimator, within)
    declaration.check(study.stacks)
    check_within(within)
    if within is not None:
        study = dataclasses.replace(study, counts=(min(FIRST, study.episodes),) * len(arms))
    if estimator == MEETINGS:
        require_arms(study, where)
    # all arms share the Nav2 file and the robot that notes are about
    own = f"{first}: "
    with output_folder(out, f"ablate-{name}") as path:
        require_usable(path)
        notes = [note for note in check(study) if note.startswith(own)]
        texts = {**parameters(study), ABLATION: dump_dataclass(declaration)}
        create_run(path, about(study, sys.argv), texts)
    found = _drive(path, declaration, where)
    told = [f"{name}: {note.removeprefix(own)}" for note in notes]
    return dataclasses.replace(found, notes=tuple(told))


def resume_ablation(
    folder: Path,
    against: str | None = None,
    where: Where | None = None,
    episodes: int | None = None,
    within: float | None = None,
    retry_errors: bool = False,
) -> Ablated | MeetingsArms:
    """Go on with the ablation of a run folder.

    Args:
        folder: of the run.
        against: arm to which the others are compared; None: the one of before.
        where: deliveries are driven; None: on this machine.
        episodes: deliveries of each arm from now on; None: as many as it was made for.
        within: [USD] as of :func:`ablate`; None: as it was made.
        retry_errors: also drive what ended in an error of the machine, as a map that was missing.

    Raises:
        InputError: the folder holds none, has no such arm, or has more deliveries.
    """
    where = where or Where()
    path = nearby(folder.resolve())  # a link may point elsewhere before the run ends
    study = load_study(path, where.workers)
    require_study(path, ABLATION)
    declaration = load_dataclass(AblationDeclaration, path / "params" / ABLATION)
    if within is None:
        within = shared_within(path) or declaration.within
    declaration = dataclasses.replace(
        declaration, against=against or declaration.against, within=within
    )
    declaration.check(study.stacks)
    check_within(within)
    if declaration.estimator == MEETINGS and within is not None:
        raise only_of_deliveries()
    if declaration.estimator == MEETINGS and retry_errors:
        raise InputError(
            f"--retry-errors is for whole deliveries, and '{path}' drives meetings; leave it out"
        )
    say_notes(version_notes(path))
    check(study)
    if episodes is not None:
        extend(path, episodes)
    if within is not None:
        counts = study.counts or (study.episodes,) * len(study.stacks)
        names = [stack.name for stack in study.stacks]
        share_out(path, dict(zip(names, counts, strict=True)), within)
    return _drive(path, declaration, where, retry_errors)


def _drive(
    path: Path,
    declaration: AblationDeclaration,
    where: Where,
    retries_errors: bool = False,
) -> Ablated | MeetingsArms:
    if declaration.estimator == MEETINGS:
        return drive_arms(path, declaration, where)
    driven, run = _drive_arms(path, declaration, where, retries_errors)
    study = driven.study
    prices = prices_of(study.template.prices)
    ablation = analyse(declaration, driven.results, run, prices, study.episodes)
    figures = draw_ablation(ablation, path)
    content = ablation_document(ablation, study, prices)
    write_document(path / "ablation.json", content)
    runs = [] if driven.is_interrupted else [run]
    page = write_study_page(write_ablation(ablation, figures, path), runs, today())
    return Ablated(driven, ablation, content, figures, page)


def _drive_arms(
    path: Path, declaration: AblationDeclaration, where: Where, retries_errors: bool
) -> tuple[Driven, StoredRun]:
    """Drive what the arms lack, and more of those whose margin is not known well enough."""
    while True:
        study = load_study(path, where.workers)
        driven = drive_folder(study, path, where, retries_errors)
        retries_errors = False  # what ends in one now would forever
        run = load_run(str(path))
        if declaration.within is None or driven.is_interrupted:
            return driven, run
        wanted = counts_wanted(run, declaration.within, study.episodes)
        more = [
            stack.name
            for stack in run.stacks
            if wanted[stack.name] > len(stack.rows) + stack.errors
        ]
        if not more:
            return driven, run
        say(f"margin not known to within {declaration.within:g} USD yet: {', '.join(more)}")
        share_out(path, wanted, declaration.within)
