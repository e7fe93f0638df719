"""The folder of a suite: a run folder for each cell, whose deliveries are kept and added to."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from harness.storage.documents import write_file
from harness.storage.manifest_file import extend_run, read_manifest
from harness.storage.new_run import MANIFEST, create_run
from harness.storage.parameters import parameter_folder
from harness.storage.texts import quoted
from harness.study.manifest import about, load_study, parameters
from harness.study.stored_run import MOST_PEOPLE
from harness.study.suite import Cell, Suite, cell_study, cells, load_suite
from harness.task.study import Study
from navstack.errors import InputError
from navstack.files import check_regular
from navstack.params.nav2_file.yaml_text import load_text
from navstack.params.strict import dump_dataclass, read_text

DECLARATION = "suite.yaml"  # a folder that has it can be resumed
TABLE = "episodes.parquet"
# stem of its file in params/, and what it is called
PEOPLE, RECORDING = "people", "recording of people"


def declare(path: Path, suite: Suite) -> None:
    """Write what a suite folder is to hold.

    Raises:
        InputError: it cannot be written.
    """
    write_file(path / DECLARATION, dump_dataclass(suite))


def begin(path: Path, suite: Suite, cell: Cell, episodes: int, command: Sequence[str]) -> None:
    """Make the run folder of a cell, or let one that has fewer episodes have more.

    Those are driven as the ones that it has.

    Raises:
        InputError: the folder cannot be written, or is in use; a value that ``navbench run`` would
            refuse too; cells that were begun before have another world, other rules or other
            prices than today's.
    """
    folder = path / cell.name
    if not is_begun(path, cell):
        study = cell_study(suite, cell, episodes)
        texts = parameters(study)
        begun = [other for other in cells(suite) if is_begun(path, other)]
        alike = [other for other in begun if _world_of(other) == _world_of(cell)]
        # these were held against the others when they were begun
        for other in {*begun[:1], *alike[:1]}:
            _require_common(path, other, cell, texts)
        create_run(folder, about(study, command), texts)
    elif load_study(folder).episodes < episodes:
        extend_run(folder, episodes)


def run_of(path: Path, cell: Cell) -> str | None:
    """The run of a cell as :func:`harness.study.stored_run.load_run` takes it.

    None: it has no tables yet, and a packed run of its condition has other stacks only.
    """
    if (path / cell.name / TABLE).is_file():
        return str(path / cell.name)
    packed = path / cell.group
    if (packed / TABLE).is_file():
        if cell.stack_name in [stack["name"] for stack in read_manifest(packed)["stacks"]]:
            return f"{packed}:{cell.stack_name}"
    return None


def is_begun(path: Path, cell: Cell) -> bool:
    """Whether a suite folder has a run folder for a cell."""
    return (path / cell.name / MANIFEST).is_file()


def is_packed(path: Path, cell: Cell) -> bool:
    """Whether a cell's deliveries are stored with those of other stacks, and stay as they are."""
    return not is_begun(path, cell) and run_of(path, cell) is not None


def _world_of(cell: Cell) -> tuple[str, int | None]:
    return cell.condition.world, cell.condition.pedestrians


def _require_common(path: Path, begun: Cell, cell: Cell, texts: Mapping[str, str]) -> None:
    """Check that a cell to begin has another's rules, prices and, where that is the same, world."""
    folder, names = path / begun.name, ["rules.yaml", "prices.yaml"]
    if _world_of(begun) == _world_of(cell):
        names += ["world.yaml", RECORDING]
    other = [name for name in _differing(folder, texts) if name in names]
    if other:
        raise InputError(
            f"'{path / cell.name}' would be driven with another {other[0]} than '{folder}', whose "
            "deliveries the "
            "same suite has; restore the file, or begin the suite in a new folder"
        )


def _differing(folder: Path, texts: Mapping[str, str]) -> list[str]:
    """Which parameters of a run folder are others than these, by the names of their files."""
    files = (
        file
        for file in parameter_folder(folder).iterdir()
        if file.suffix == ".yaml" or file.stem == PEOPLE
    )
    then, now = _contents({file.name: _text_of(file) for file in files}), _contents(texts)
    return [name for name in sorted({*now, *then}) if now.get(name) != then.get(name)]


def _text_of(file: Path) -> str:
    if file.suffix == ".yaml":
        return read_text(file)
    check_regular(file, MOST_PEOPLE)
    return file.read_text(encoding="utf-8", errors="replace")


def _contents(texts: Mapping[str, str]) -> dict[str, Any]:
    """Parameters as they compare: the content of files, and the recording of people as it is."""
    found: dict[str, Any] = {
        RECORDING: [text for name, text in texts.items() if Path(name).stem == PEOPLE]
    }
    return found | {
        name: load_text(text, name) for name, text in texts.items() if name.endswith(".yaml")
    }


def require_alike(path: Path, cell: Cell, study: Study) -> None:
    """Check that what a cell holds was driven with the parameters that it would be driven with now.

    Raises:
        InputError: it was not.
    """
    folder = path / cell.name
    other = _differing(folder, parameters(study))
    if load_study(folder).template.missions != study.template.missions:
        other.append("way to draw missions")
    if other:
        raise InputError(
            f"run folder '{folder}' was driven with another {other[0]} than today's; remove the "
            "folder to drive it "
            f"anew, or go on with the old one by --resume {quoted(path)}"
        )


def stored_suite(path: Path) -> Suite:
    """The suite of a suite folder.

    Raises:
        InputError: the folder holds none.
    """
    if not (path / DECLARATION).is_file():
        raise InputError(
            f"'{path}' holds no suite: {DECLARATION} is missing; give the folder that a suite wrote"
        )
    return load_suite(path / DECLARATION)


def require_same(path: Path, suite: Suite) -> None:
    """Check that a suite is the one that a folder holds, maybe with other cells added or left out.

    Raises:
        InputError: it has none of the cells that the folder has, or differs in what all cells have
            in common.
    """
    stored = stored_suite(path)
    known = {cell.name for cell in cells(suite)}
    begun = [cell.name for cell in cells(stored) if is_begun(path, cell)]
    shared = ("missions", "people", "localizer", "robot", "record", "start", "goal")
    other = [key for key in shared if getattr(stored, key) != getattr(suite, key)]
    if other or (begun and known.isdisjoint(begun)):
        what = (
            f"{other[0]} is another"
            if other
            else f"none of its runs, {begun[0]} for one, is of this suite"
        )
        raise InputError(f"'{path}' holds the suite '{stored.title}': {what}; give another --out")
