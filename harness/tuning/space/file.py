"""Search spaces as their files have them, single ones and several together."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from navstack.errors import ParameterError
from navstack.params.strict import load_dataclass

OF_TRIAL = {
    "trial": "int64",
    "state": "string",
    "missions": "int64",
    "told": "double",
    "p": "double",
    "reason": "string",
}  # columns of trials.parquet beside one per objective and parameter
JOINT = "+"  # between the names of spaces that are searched together


@dataclass(frozen=True, slots=True)
class ListEdit:
    """What may become of a list of plugins or critics.

    ``{type}`` stands for the names of all plugins of that type.
    """

    # these come in this order, in the places that they have; others stay where they are
    order: tuple[str, ...] = ()
    replace: dict[str, str] = field(default_factory=dict)  # name -> the one in its place
    add: tuple[str, ...] = ()  # these follow at the end, unless they are there


@dataclass(frozen=True, slots=True)
class SpaceEntry:
    """A parameter as a search space's file has it."""

    path: str
    # paths of further parameters that take the same value; plugins may be absent
    also: tuple[str, ...] = ()
    low: float | None = None
    high: float | None = None
    log: bool = False
    step: float | None = None
    levels: tuple[float, ...] = ()
    choices: tuple[str, ...] = ()
    switch: bool = False
    lists: tuple[ListEdit, ...] = ()
    # left out where the file has no such parameter; otherwise that is an error
    optional: bool = False
    unit: str = ""
    why: str = ""  # one may want to change it


@dataclass(frozen=True, slots=True)
class SpaceFile:
    """A search space as its file has it."""

    title: str
    parameters: dict[str, SpaceEntry]
    # name -> path of a number that stays, for the constraints
    reads: dict[str, str] = field(default_factory=dict)
    constraints: tuple[str, ...] = ()


def read_space(path: Path) -> SpaceFile:
    """Read a search space's file.

    Raises:
        ParameterError: it cannot be used.
    """
    content = load_dataclass(SpaceFile, path)
    if not content.parameters:
        raise ParameterError(f"{path}: names no parameters; give at least one")
    _check_names(content, str(path))
    for name, entry in content.parameters.items():
        _check_entry(entry, f"{path}: parameters.{name}")
    return content


def read_spaces(paths: Sequence[Path]) -> tuple[str, SpaceFile]:
    """Read search spaces that are searched together; returns their name, and all of them as one.

    A parameter may stand in several of them if it does so in the same words.

    Raises:
        ParameterError: one cannot be used, or two contradict each other.
    """
    contents = [read_space(path) for path in paths]
    name = JOINT.join(path.stem for path in paths)
    for number, path in enumerate(paths):
        if path in paths[:number]:
            raise ParameterError(f"--space: {path.stem} is given twice; give it once")
        for before, other in zip(paths[:number], contents, strict=False):
            _check_agreement(before.stem, other, path.stem, contents[number])
    parameters: dict[str, SpaceEntry] = {}
    reads: dict[str, str] = {}
    constraints: list[str] = []
    for content in contents:
        parameters |= content.parameters
        reads |= content.reads
        constraints += content.constraints
    title = "; ".join(content.title for content in contents)
    merged = SpaceFile(title, parameters, reads, tuple(dict.fromkeys(constraints)))
    _check_names(merged, name)
    return name, merged


def _check_agreement(first: str, one: SpaceFile, second: str, other: SpaceFile) -> None:
    """Check that what stands in two spaces is the same in both."""
    for mine, theirs in ((one.parameters, other.parameters), (one.reads, other.reads)):
        differing = [name for name in mine if name in theirs and mine[name] != theirs[name]]
        if differing:
            advice = "give spaces that agree, or a file of your own with one of the two"
            raise ParameterError(
                f"--space {first} and {second} differ in '{differing[0]}'; {advice}"
            )


def _check_names(content: SpaceFile, where: str) -> None:
    """Check that names are unique and can stand in constraints and beside :data:`OF_TRIAL`."""
    for name in (*content.parameters, *content.reads):
        if (
            not name.isidentifier()
            or not name.isascii()
            or name in OF_TRIAL
            or name.startswith("objective_")
        ):
            advice = f"give letters, digits and _, none of {', '.join(OF_TRIAL)}"
            raise ParameterError(f"{where}: {name!r} is no name for a parameter; {advice}")
    twice = sorted(content.parameters.keys() & content.reads.keys())
    if twice:
        raise ParameterError(
            f"{where}: '{twice[0]}' stands in both parameters and reads; give it another name in "
            "one"
        )


def _ways(edit: ListEdit) -> int:
    """In how many ways an edit changes its list."""
    return sum(map(bool, (edit.order, edit.replace, edit.add)))


def _check_entry(entry: SpaceEntry, where: str) -> None:
    """Check that an entry says in one way what its parameter may be."""
    is_range = entry.low is not None or entry.high is not None
    ways = [is_range, *map(bool, (entry.levels, entry.choices, entry.switch, entry.lists))]
    if sum(ways) != 1:
        raise ParameterError(
            f"{where}: give low and high, or levels, or choices, or switch: true, or lists"
        )
    if entry.lists and (entry.also or any(_ways(edit) != 1 for edit in entry.lists)):
        raise ParameterError(
            f"{where}: each of the lists has one of order, replace and add, and there is no 'also'"
        )
    if not is_range:
        return
    if entry.low is None or entry.high is None or entry.low >= entry.high:
        raise ParameterError(
            f"{where}: low {entry.low} and high {entry.high} are no range; give low < high"
        )
    if entry.log and (entry.low <= 0.0 or entry.step is not None):
        raise ParameterError(f"{where}: a logarithmic range begins above 0 and has no step")
    if entry.step is not None and not 0.0 < entry.step <= entry.high - entry.low:
        raise ParameterError(f"{where}: step {entry.step} does not fit between low and high")
