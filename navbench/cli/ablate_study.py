"""An ablation as ``navbench ablate`` begins it, goes on with it and tells of it."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from harness.ablation.analysis import AblationDeclaration, analyse
from harness.ablation.arms import arms_of, with_arms
from harness.ablation.document import ablation_document
from harness.episode.factory import prices_of
from harness.report.ablation import ablation_blocks, draw_ablation
from harness.report.tables import print_blocks, report_console
from harness.storage.documents import write_document
from harness.storage.run_folder import ABLATION, create_run, default_folder, require_usable
from harness.study.manifest import about, load_study, parameters, version_notes
from harness.study.places import Where
from harness.study.preflight import check
from harness.study.stored_run import load_run
from harness.task.study import Study, make_study
from navbench.cli.driving import drive_folder, exit_status
from navbench.cli.progress import say
from navbench.cli.streams import print_json
from navstack.errors import InputError
from navstack.params.strict import dump_dataclass, load_dataclass

Begun = tuple[Path, Study, AblationDeclaration]  # of a run folder


def create_ablation(
    stack: str,
    localizers: Sequence[str],
    errors: Sequence[str],
    correlation_time: float | None,
    against: str | None,
    out: Path | None,
    choices: dict[str, Any],
) -> Begun:
    """Check what a user asks for, arms in place of stacks, and make the run folder.

    Raises:
        InputError: a value that ``navbench run`` would refuse too, or arms that cannot be had.
    """
    study = make_study(stacks=[stack], **choices)
    arms = arms_of(
        study.stacks[0], localizers, errors, correlation_time, study.template.allow_unknown
    )
    study = with_arms(study, arms, choices["workers"])
    name, first = Path(stack).stem, study.stacks[0].name
    declaration = AblationDeclaration(name, against or first)
    declaration.check(study.stacks)
    path = out or default_folder(f"ablate-{name}")
    require_usable(path)
    for note in check(study):
        # all arms share the Nav2 file and the robot that notes are about
        if note.startswith(f"{first}: "):
            say(f"note: {name}: {note.removeprefix(f'{first}: ')}")
    create_run(
        path, about(study, sys.argv), {**parameters(study), ABLATION: dump_dataclass(declaration)}
    )
    return path, load_study(path, study.workers), declaration


def stored_ablation(path: Path, against: str | None, where: Where) -> Begun:
    """The ablation of a run folder, to go on with it.

    Raises:
        InputError: the folder holds none, or has no such arm.
    """
    path = path.resolve()  # a link may point elsewhere before the run ends
    study = load_study(path, where.workers)
    stored = path / "params" / ABLATION
    if not stored.is_file():
        raise InputError(
            f"'{path}' is no ablation: params/{ABLATION} is missing; use navbench run --resume"
        )
    declaration = load_dataclass(AblationDeclaration, stored)
    declaration = AblationDeclaration(declaration.stack, against or declaration.against)
    declaration.check(study.stacks)
    for note in version_notes(path):
        say(f"note: {note}")
    return path, study, declaration


def drive(
    declaration: AblationDeclaration, study: Study, path: Path, where: Where, as_json: bool
) -> int:
    """Drive what an ablation lacks, show progress on stderr, print the report on stdout.

    Returns the exit status.
    """
    results, interrupted = drive_folder(study, path, where)
    prices = prices_of(study.template.prices)
    ablation = analyse(declaration, results, load_run(str(path)), prices, study.episodes)
    figures = draw_ablation(ablation, path)
    content = ablation_document(ablation, study, prices)
    write_document(path / "ablation.json", content)
    if as_json:
        print_json({**content, "figures": [str(figure) for figure in figures], "folder": str(path)})
    else:
        print_blocks(ablation_blocks(ablation, figures, path), report_console())
    return exit_status(results, interrupted)
