"""Search spaces: which parameters of a Nav2 file may change, how far, and which limits bind them together.

A file of ``params/search_spaces`` gives each parameter a name, its path (:mod:`harness.tuning.paths`) and what it may
be: a range ``low`` to ``high`` (``log``: evenly in the logarithm; ``step``: multiples above ``low``), some ``levels``,
some texts (``choices``), or true and false (``switch``). Whether a number is whole follows from Nav2. The value that
the user's file has is always possible: a range that lacks it is widened, a list is lengthened.
"""

import contextlib
import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from harness.tuning.constraint import Constraint, parse_constraint
from harness.tuning.evaluation import Value
from harness.tuning.paths import AbsentError, NoPluginError, Place, locate
from navstack.errors import ParameterError
from navstack.params.nav2_file import Nav2File
from navstack.params.strict import load_dataclass

DIGITS = 4  # significant ones of a tuned number
RESERVED = ("trial", "state", "missions", "told", "p", "reason")  # columns of trials.parquet that are no parameter


@dataclass(frozen=True, slots=True)
class Entry:
    """A parameter as a search space's file has it."""

    path: str
    also: tuple[str, ...] = ()  # paths of further parameters that take the same value; plugins may be absent
    low: float | None = None
    high: float | None = None
    log: bool = False
    step: float | None = None
    levels: tuple[float, ...] = ()
    choices: tuple[str, ...] = ()
    switch: bool = False
    optional: bool = False  # left out where the file has no such parameter; otherwise that is an error
    unit: str = ""
    why: str = ""  # one may want to change it


@dataclass(frozen=True, slots=True)
class SpaceFile:
    """A search space as its file has it."""

    title: str
    parameters: dict[str, Entry]
    reads: dict[str, str] = field(default_factory=dict)  # name -> path of a number that stays, for the constraints
    constraints: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Parameter:
    """One dimension of a search space on a certain Nav2 file."""

    name: str
    paths: tuple[str, ...]  # ``node.parameter`` each; they all take the value
    original: Value  # what the file says, or Nav2's default
    low: float = 0.0
    high: float = 0.0
    is_log: bool = False
    step: float | None = None
    is_int: bool = False
    choices: tuple[Value, ...] = ()  # not empty: one of these instead of a range
    unit: str = ""

    def rounded(self, value: Value) -> Value:
        """The value as it is written into a file: a decimal to a few digits, within the range."""
        if self.choices or self.is_int or not isinstance(value, float) or value == 0.0:
            return value
        digits = DIGITS - 1 - math.floor(math.log10(abs(value)))
        return min(max(round(value, digits), self.low), self.high)


@dataclass(frozen=True, slots=True)
class Space:
    """A search space on a certain Nav2 file."""

    name: str
    title: str
    parameters: tuple[Parameter, ...]
    constraints: tuple[Constraint, ...] = ()
    constants: tuple[tuple[str, Value], ...] = ()  # numbers of the file that the constraints speak of
    notes: tuple[str, ...] = ()  # what was fitted to the file

    @property
    def original(self) -> dict[str, Value]:
        """The user's own values, by name."""
        return {parameter.name: parameter.original for parameter in self.parameters}

    def values(self, point: Mapping[str, Value]) -> dict[str, Value]:
        """What a point changes in the file: paths and values, without those that it leaves as they are."""
        return {
            path: point[parameter.name]
            for parameter in self.parameters
            for path in parameter.paths
            if point[parameter.name] != parameter.original
        }

    def allows(self, point: Mapping[str, Value]) -> bool:
        """Whether a point keeps every constraint."""
        return all(constraint.holds({**dict(self.constants), **point}) for constraint in self.constraints)


def load_space(path: Path, nav2: Nav2File) -> Space:
    """Read a search space and fit it to a Nav2 file.

    Raises:
        ParameterError: the file cannot be used, or a parameter that it names does not exist in the Nav2 file.
    """
    content = load_dataclass(SpaceFile, path)
    if not content.parameters:
        raise ParameterError(f"{path}: names no parameters; give at least one")
    _check_names(content, str(path))
    fitted: list[Parameter] = []
    notes: list[str] = []
    for name, entry in content.parameters.items():
        _check_entry(entry, f"{path}: parameters.{name}")
        try:
            fitted.append(_fit(name, entry, nav2, f"{path.name}: {name}", notes))
        except AbsentError as error:
            if not entry.optional:
                raise ParameterError(f"{path}: {name}: {error}") from None
            notes.append(f"{path.name}: {name} is left out: {error}")
    if not fitted:
        raise ParameterError(f"{path}: {nav2.path.name} has none of its parameters; choose another search space")
    _check_paths(fitted, str(path))
    constants = tuple((name, _number(nav2, source, f"{path}: {name}")) for name, source in content.reads.items())
    names = (*content.parameters, *content.reads)
    constraints = [parse_constraint(text, names, str(path)) for text in content.constraints]
    numbers = {each.name for each in fitted if not isinstance(each.original, str)} | content.reads.keys()
    kept = tuple(each for each in constraints if each.names <= numbers)
    for each in constraints:
        if each not in kept:
            notes.append(f"{path.name}: constraint {each.text} is left out: not all it names are numbers of the file")
    space = Space(path.stem, content.title, tuple(fitted), kept, constants)
    if not space.allows(space.original):
        notes.append(f"{path.name}: {nav2.path.name} itself breaks a constraint, which only other values have to keep")
    return dataclasses.replace(space, notes=tuple(notes))


def _check_names(content: SpaceFile, where: str) -> None:
    """Check that names can stand in constraints and head columns beside :data:`RESERVED`, and are given once."""
    for name in (*content.parameters, *content.reads):
        if not name.isidentifier() or not name.isascii() or name in RESERVED or name.startswith("objective_"):
            advice = f"give letters, digits and _, none of {', '.join(RESERVED)}"
            raise ParameterError(f"{where}: {name!r} is no name for a parameter; {advice}")
    twice = sorted(content.parameters.keys() & content.reads.keys())
    if twice:
        raise ParameterError(f"{where}: '{twice[0]}' stands in both parameters and reads; give it another name in one")


def _check_paths(fitted: Sequence[Parameter], where: str) -> None:
    """Check that nothing in the file belongs to two parameters."""
    owners: dict[str, str] = {}
    for each in fitted:
        for path in each.paths:
            other = owners.setdefault(path, each.name)
            if other != each.name:
                raise ParameterError(f"{where}: {other} and {each.name} both set {path}; leave one of them out")


def _number(nav2: Nav2File, source: str, where: str) -> Value:
    """A number of the file that the constraints speak of."""
    try:
        place = locate(nav2, source)
    except AbsentError as error:
        raise ParameterError(f"{where}: {error}") from None
    if place.kind not in (int, float):
        raise ParameterError(f"{where}: {place.path} is {place.value!r}; constraints are of numbers")
    return place.value


def _check_entry(entry: Entry, where: str) -> None:
    """Check that an entry says in one way what its parameter may be."""
    ways = [entry.low is not None or entry.high is not None, *map(bool, (entry.levels, entry.choices, entry.switch))]
    if sum(ways) != 1:
        raise ParameterError(f"{where}: give low and high, or levels, or choices, or switch: true")
    if not ways[0]:
        return
    if entry.low is None or entry.high is None or entry.low >= entry.high:
        raise ParameterError(f"{where}: low {entry.low} and high {entry.high} are no range; give low < high")
    if entry.log and (entry.low <= 0.0 or entry.step is not None):
        raise ParameterError(f"{where}: a logarithmic range begins above 0 and has no step")
    if entry.step is not None and not 0.0 < entry.step <= entry.high - entry.low:
        raise ParameterError(f"{where}: step {entry.step} does not fit between low and high")


def _fit(name: str, entry: Entry, nav2: Nav2File, where: str, notes: list[str]) -> Parameter:
    place = locate(nav2, entry.path)
    others = []
    for path in entry.also:
        with contextlib.suppress(NoPluginError):
            others.append(locate(nav2, path))
    for other in others:
        if other.kind is not place.kind:
            raise ParameterError(f"{where}: {other.path} is {other.value!r}, of another kind than {place.path}")
        if other.value != place.value:
            notes.append(f"{where}: a change sets {other.path}, now {other.value!r}, to the value of {place.path}, too")
    paths = (place.path, *(other.path for other in others))
    if entry.low is not None and entry.high is not None:
        return _range(name, entry, place, paths, where, notes)
    kinds = {"levels": (int, float), "choices": (str,), "switch": (bool,)}
    way = "levels" if entry.levels else "choices" if entry.choices else "switch"
    if place.kind not in kinds[way]:
        raise ParameterError(f"{where}: {place.path} is {place.value!r}, for which '{way}' is not the way")
    choices: tuple[Value, ...] = entry.choices or (False, True) if way != "levels" else entry.levels
    if place.kind is int:
        choices = tuple(_whole(float(choice), where) for choice in choices)
    if place.value not in choices:
        notes.append(f"{where}: {place.value!r}, as the file has it, is one more choice")
        choices = (*choices, place.value)
    choices = tuple(sorted(set(choices), key=float)) if way == "levels" else tuple(dict.fromkeys(choices))
    return Parameter(name, paths, place.value, choices=choices, unit=entry.unit)


def _range(name: str, entry: Entry, place: Place, paths: tuple[str, ...], where: str, notes: list[str]) -> Parameter:
    assert entry.low is not None and entry.high is not None
    if not isinstance(place.value, int | float) or isinstance(place.value, bool):
        raise ParameterError(f"{where}: {place.path} is {place.value!r}, which has no range")
    low, high, step, is_log = entry.low, entry.high, entry.step, entry.log
    is_int = place.kind is int
    if is_int:
        low, high, step = _whole(low, where), _whole(high, where), None if step is None else _whole(step, where)
    if not low <= place.value <= high:
        low, high = min(low, place.value), max(high, place.value)
        is_log = is_log and low > 0.0
        notes.append(f"{where}: the range is widened to {low:g} .. {high:g}: the file has {place.value:g}")
    return Parameter(name, paths, place.value, float(low), float(high), is_log, step, is_int, unit=entry.unit)


def _whole(value: float, where: str) -> int:
    if value != round(value):
        raise ParameterError(f"{where}: {value:g} is no whole number, which Nav2 wants here")
    return round(value)
