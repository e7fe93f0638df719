"""From a Nav2 file to one that earns more, tested on missions it never saw."""

import dataclasses
import inspect
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from harness.episode.files import nav2_parameters
from harness.execution.process_cache import forget_changed
from harness.meetings.allowed import require_meetings
from harness.meetings.estimators import DELIVERIES
from harness.storage.new_run import TUNING, create_run, output_folder, require_usable
from harness.storage.shipped import resolve, shipped
from harness.study.manifest import about, load_study, parameters
from harness.study.places import Where
from harness.study.preflight import check
from harness.task.made_files import is_made
from harness.task.stack import Stack
from harness.task.study import Study, is_recording, make_study
from harness.tuning.declaration import MARGIN_OBJECTIVE, ORIGINAL, SPACE, StudyDeclaration, sizes
from harness.tuning.notes import notes_before
from harness.tuning.objective import parse_objectives
from harness.tuning.sampler import make_sampler
from harness.tuning.space.checking import check_space
from harness.tuning.space.file import SpaceFile, read_spaces
from harness.tuning.space.fitting import fit_space
from harness.tuning.space.paths import with_absolute_files
from harness.tuning.training import USUAL_MISSIONS
from navbench.api.large_maps import drivable
from navbench.api.meetings.driving import require_local
from navbench.api.tuning.driving import drive_tuning
from navbench.api.tuning.written import Tuned
from navstack.errors import InputError
from navstack.params.strict import dump_dataclass, read_text

DEFAULT_STACK = "nav2-stock"
FILES = ("map", "world", "rules", "prices")  # options that may be files
RUN_OPTIONS = (
    *("map", "pedestrians", "people", "world", "rules", "missions", "distance", "start", "goal"),
    "prices",
)


def tune(
    stack: str = DEFAULT_STACK,
    spaces: Sequence[str] = ("dwb_critics",),
    *,
    objective: str = MARGIN_OBJECTIVE,
    estimator: str = DELIVERIES,
    sampler: str = "tpe",
    trials: int = 100,
    budget: float | None = None,
    episodes: int | None = None,
    test_episodes: int | None = None,
    finalists: int = 4,
    final_episodes: int | None = None,
    is_raced: bool = True,
    waterfall_missions: int | None = None,
    out: Path | None = None,
    where: Where | None = None,
    map: str = "sidewalk",  # noqa: A002 - as the option is called
    **options: Any,
) -> Tuned | None:
    """Tune a Nav2 parameter file for what its deliveries earn, and test it on unseen missions.

    Args:
        stack: a name of params/stacks, a stack file or a Nav2 parameter file.
        spaces: what may change: names of params/search_spaces or YAML files.
        objective: margin, capped_margin, shared_margin, cvar, lower_bound, margin@sla>=SHARE, or a
            metric such as -duration_s; several, separated by commas, for a Pareto front.
        estimator: how training missions are driven: deliveries, or meetings with people, which
            tell the margin with less driving. The test is of whole deliveries.
        sampler: tpe, cmaes, random or grid.
        trials: files to try, beside the original.
        budget: [s] of wall time for everything; None: as long as it takes.
        episodes: training missions, the same for every trial; None: 32, or fewer where the budget
            is short.
        test_episodes: unseen missions of the test; None: as the size of the search wants it.
        finalists: trials that meet the original on further training missions; 0: none.
        final_episodes: such missions; None: as the size of the search wants it.
        is_raced: whether hopeless trials are dropped early.
        waterfall_missions: on which the explanation drives mixtures of old and new; 0: none.
        out: study folder; None: ``results/<time>-tune-<stack>``.
        where: deliveries are driven; None: on this machine.
        map: a built-in map or a map_server YAML file.
        options: as of :func:`navbench.run`.

    Returns:
        None where it is interrupted; what is finished is kept in the folder.

    Raises:
        InputError: a value that ``navbench run`` would refuse too, or a search space that does not
            fit the file.
    """
    forget_changed()
    where, map_name = where or Where(), drivable(map)
    is_fitted = budget is not None and episodes is None
    if episodes is None:
        episodes = USUAL_MISSIONS
    given = {
        "test_episodes": test_episodes,
        "final_episodes": final_episodes,
        "waterfall_missions": waterfall_missions,
    }
    chosen_sizes = {name: size for name, size in given.items() if size is not None}
    space_files = [
        resolve(space, shipped("params") / "search_spaces", "search space") for space in spaces
    ]
    space, content = read_spaces(space_files)
    declaration = StudyDeclaration(
        stack=stack,
        space=space,
        objective=objective,
        sampler=sampler,
        trials=trials,
        episodes=episodes,
        is_raced=is_raced,
        finalists=finalists,
        budget=budget,
        is_fitted=is_fitted,
        estimator=estimator,
        sensors="",
        robot="",
        options=_run_options({"map": map_name, **options}),
        **(sizes(trials, episodes) | chosen_sizes),
    )
    study = make_study(
        stacks=[stack],
        episodes=max(declaration.test_episodes, episodes),
        map_name=map_name,
        workers=where.workers,
        **options,
    )
    if declaration.is_by_meetings:
        require_local(where)
        require_meetings(study)
    path, notes = _created(declaration, study, content, space_files, out)
    found = drive_tuning(path, where)
    return found and dataclasses.replace(found, notes=(*notes, *notes_before(declaration, options)))


def _created(
    declaration: StudyDeclaration,
    study: Study,
    content: SpaceFile,
    space_files: Sequence[Path],
    out: Path | None,
) -> tuple[Path, tuple[str, ...]]:
    """Check that all of it fits together, and create the folder; returns it, and notes.

    Args:
        declaration: what was asked for; robot and sensors are added.
        study: with the original.
        content: of the search space.
        space_files: from which it was read.
        out: the folder; None: a new one.
    """
    original, template = study.stacks[0], study.template
    _require_nav2(original)
    declaration = dataclasses.replace(
        declaration,
        sensors=_short(original.sensors, original, "sensors"),
        robot=_short(original.robot, original, "robot"),
    )
    nav2 = nav2_parameters(original.nav2_file, template.allow_unknown)
    space = fit_space(declaration.space, content, nav2, template.allow_unknown)
    objectives = parse_objectives(declaration.objective)
    drawing = make_sampler(
        declaration.sampler, space, template.seed, declaration.trials, len(objectives)
    )
    check_space(space, nav2, drawing, template.allow_unknown)
    with output_folder(out, f"tune-{original.name}") as path:
        require_usable(path)
        notes = (*check(study), *space.notes)
        texts = {
            TUNING: dump_dataclass(declaration),
            SPACE: _space_text(content, space_files),
            ORIGINAL: with_absolute_files(nav2, template.allow_unknown).document.text,
        }
        create_run(path, about(study, sys.argv), {**parameters(study), **texts})
    return path, notes


def _require_nav2(original: Stack) -> None:
    if not original.is_nav2:
        raise InputError(
            f"stack '{original.name}' does not drive by a Nav2 file that could be tuned; "
            "give another"
        )


def _space_text(content: SpaceFile, files: Sequence[Path]) -> str:
    """The search space as it is kept: the file that was given, or what several come to."""
    if len(files) == 1:
        return read_text(files[0])
    return dump_dataclass(content)


def resume_tuning(
    folder: Path,
    budget: float | None = None,
    where: Where | None = None,
    **more: int | None,
) -> Tuned | None:
    """Go on with the study of a folder; otherwise as :func:`tune`.

    A finished study searches on only with another ``budget``. ``more`` are numbers of missions in
    place of those of before: ``test_episodes``, ``final_episodes``, ``waterfall_missions``.
    """
    path = folder.resolve()  # a link may point elsewhere before the study ends
    check(load_study(path))
    return drive_tuning(path, where or Where(), budget=budget, **more)


def _run_options(choices: Mapping[str, Any]) -> tuple[str, ...]:
    """The options of ``navbench run`` that differ from its defaults, as one writes them."""
    usual = inspect.signature(make_study).parameters
    given: list[str] = []
    for name in RUN_OPTIONS:
        value = choices.get(name)
        default = usual["map_name" if name == "map" else name].default
        if value is None or value == default:
            continue
        if name in ("distance", "start", "goal"):
            text = ",".join(f"{number:.15g}" for number in value)
        elif (name in FILES and Path(value).is_file()) or (
            name == "people" and is_recording(value)
        ):
            text = str(Path(value).resolve())
        else:
            text = str(value)
        given += [f"--{name}", text]
    if not choices.get("allow_unknown", True):
        given.append("--strict")
    return tuple(given)


def _short(file: str, stack: Stack, field: str) -> str:
    """What a stack's file in the tuning's folder says for a file of the original.

    The name of one that comes with the program, the path of another; that of a robot made from the
    Nav2 file stands in the folder itself.
    """
    path = Path(file)
    if path.parent.parent == shipped("params").resolve():
        return path.stem
    return f"params/{stack.name}-{field}.yaml" if is_made(file) else file
