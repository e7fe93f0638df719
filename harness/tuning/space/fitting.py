"""Fits a file of search spaces to a Nav2 file."""

import contextlib
import dataclasses
import math
from collections.abc import Mapping, Sequence

from harness.tuning.evaluation import Value
from harness.tuning.space.constraint import parse_constraint
from harness.tuning.space.file import SpaceEntry, SpaceFile
from harness.tuning.space.paths import (
    AbsentError,
    NoPluginError,
    ParameterPlace,
    edited_list,
    locate,
    locate_list,
    with_values,
)
from harness.tuning.space.space import Parameter, Space
from navstack.errors import ParameterError
from navstack.params.nav2_file.file import Nav2File


def fit_space(name: str, content: SpaceFile, nav2: Nav2File, allow_unknown: bool = False) -> Space:
    """Fit a search space to a Nav2 file, loaded with ``allow_unknown``.

    Raises:
        ParameterError: a parameter that it names does not exist in the Nav2 file.
    """
    notes: list[str] = []
    fitted = _fit_all(name, content, nav2, allow_unknown, notes)
    if not fitted:
        raise ParameterError(
            f"{name}: {nav2.path.name} has none of its parameters; choose another search space"
        )
    _check_paths(fitted, name)
    constants = tuple(
        (key, _number(nav2, source, f"{name}: {key}")) for key, source in content.reads.items()
    )
    names = (*content.parameters, *content.reads)
    constraints = [parse_constraint(text, names, name) for text in content.constraints]
    numbers = {
        each.name for each in fitted if not isinstance(each.original, str)
    } | content.reads.keys()
    kept = tuple(each for each in constraints if each.names <= numbers)
    for each in constraints:
        if each not in kept:
            notes.append(
                f"{name}: constraint {each.text} is left out: not all it names are numbers of the "
                "file"
            )
    space = Space(name, content.title, tuple(fitted), kept, constants)
    if not space.allows(space.original):
        notes.append(
            f"{name}: {nav2.path.name} itself breaks a constraint, which only other values have to "
            "keep"
        )
    return dataclasses.replace(space, notes=tuple(notes))


def _fit_all(
    name: str,
    content: SpaceFile,
    nav2: Nav2File,
    allow_unknown: bool,
    notes: list[str],
) -> list[Parameter]:
    """The parameters that the file has, or would have with another choice of a list."""
    fitted: dict[str, Parameter] = {}
    absent: list[str] = []
    files: dict[tuple[str, Value], Nav2File] = {}  # as they would be with one list changed
    # lists first
    for key in sorted(content.parameters, key=lambda key: not content.parameters[key].lists):
        entry, where = content.parameters[key], f"{name}: {key}"
        try:
            if entry.lists:
                fitted[key] = _fit_list(key, entry, nav2, where)
                for each in fitted[key].choices:
                    files[key, each] = with_values(
                        nav2, dict.fromkeys(fitted[key].paths, each), allow_unknown
                    )
            else:
                fitted[key] = _fit_among(key, entry, nav2, files, where, notes)
        except AbsentError as error:
            if not entry.optional:
                raise ParameterError(f"{where}: {error}") from None
            absent.append(key)
    if absent:
        notes.append(
            f"{name}: left out, as {nav2.path.name} has nothing of the kind: {', '.join(absent)}"
        )
    return [fitted[key] for key in content.parameters if key in fitted]


def _fit_list(name: str, entry: SpaceEntry, nav2: Nav2File, where: str) -> Parameter:
    """A list and what it may become."""
    place = locate_list(nav2, entry.path)
    edited = (edited_list(nav2, place, edit) for edit in entry.lists)
    choices = tuple(dict.fromkeys((place.value, *edited)))
    if len(choices) < 2:
        raise AbsentError(
            f"{where}: none of the lists changes anything in {place.path} of {nav2.path.name}"
        )
    return Parameter(name, (place.path,), place.value, choices=choices)


def _fit_among(
    name: str,
    entry: SpaceEntry,
    nav2: Nav2File,
    files: Mapping[tuple[str, Value], Nav2File],
    where: str,
    notes: list[str],
) -> Parameter:
    """A parameter that the file has, or one of those with another list.

    With the lists that it needs.
    """
    having = [key for key, file in files.items() if _has(file, entry.path)]
    file = nav2
    if not (_has(nav2, entry.path) or not having):
        file = files[having[0]]
    fitted = _fit(name, entry, file, where, notes)
    needs = []
    for owner in dict.fromkeys(owner for owner, _ in files):
        every = tuple(choice for other, choice in files if other == owner)
        found = tuple(choice for choice in every if (owner, choice) in having)
        if found and found != every:
            needs.append((owner, found))
    return dataclasses.replace(fitted, needs=tuple(needs))


def _has(nav2: Nav2File, path: str) -> bool:
    try:
        locate(nav2, path)
    except AbsentError:
        return False
    return True


def _check_paths(fitted: Sequence[Parameter], where: str) -> None:
    """Check that nothing in the file belongs to two parameters."""
    owners: dict[str, str] = {}
    for each in fitted:
        for path in each.paths:
            other = owners.setdefault(path, each.name)
            if other != each.name:
                raise ParameterError(
                    f"{where}: {other} and {each.name} both set {path}; leave one of them out"
                )


def _number(nav2: Nav2File, source: str, where: str) -> Value:
    """A number of the file that the constraints speak of."""
    try:
        place = locate(nav2, source)
    except AbsentError as error:
        raise ParameterError(f"{where}: {error}") from None
    if place.kind not in (int, float):
        raise ParameterError(
            f"{where}: {place.path} is {place.value!r}; constraints are of numbers"
        )
    return place.value


def _fit(name: str, entry: SpaceEntry, nav2: Nav2File, where: str, notes: list[str]) -> Parameter:
    place = locate(nav2, entry.path)
    others = []
    for path in entry.also:
        with contextlib.suppress(NoPluginError):
            others.append(locate(nav2, path))
    for other in others:
        if other.kind is not place.kind:
            raise ParameterError(
                f"{where}: {other.path} is {other.value!r}, of another kind than {place.path}"
            )
        if other.value != place.value:
            notes.append(
                f"{where}: a change sets {other.path}, now {other.value!r}, to the value of "
                f"{place.path}, too"
            )
    paths = (place.path, *(other.path for other in others))
    if entry.low is not None and entry.high is not None:
        return _range(name, entry, place, paths, where, notes)
    return Parameter(
        name, paths, place.value, choices=_choices(entry, place, where, notes), unit=entry.unit
    )


def _choices(
    entry: SpaceEntry,
    place: ParameterPlace,
    where: str,
    notes: list[str],
) -> tuple[Value, ...]:
    """The values that a parameter without a range may have."""
    way = "switch"
    kinds: tuple[type, ...] = (bool,)
    choices: tuple[Value, ...] = (False, True)
    if entry.levels:
        way, kinds, choices = "levels", (int, float), entry.levels
    elif entry.choices:
        way, kinds, choices = "choices", (str,), entry.choices
    if place.kind not in kinds:
        raise ParameterError(
            f"{where}: {place.path} is {place.value!r}, for which '{way}' is not the way"
        )
    if place.kind is int:
        choices = tuple(_whole(float(choice), where) for choice in choices)
    if place.value not in choices:
        notes.append(f"{where}: {place.value!r}, as the file has it, is one more choice")
        choices = (*choices, place.value)
    if way == "levels":
        return tuple(sorted(set(choices), key=float))
    return tuple(dict.fromkeys(choices))


def _range(
    name: str,
    entry: SpaceEntry,
    place: ParameterPlace,
    paths: tuple[str, ...],
    where: str,
    notes: list[str],
) -> Parameter:
    assert entry.low is not None and entry.high is not None
    if not isinstance(place.value, int | float) or isinstance(place.value, bool):
        raise ParameterError(f"{where}: {place.path} is {place.value!r}, which has no range")
    if not math.isfinite(place.value):
        raise ParameterError(
            f"{where}: {place.path} is {place.value}, which no range can hold; give it levels"
        )
    low, high, step, is_log = entry.low, entry.high, entry.step, entry.log
    is_int = place.kind is int
    if is_int:
        low, high = _whole(low, where), _whole(high, where)
        if step is not None:
            step = _whole(step, where)
    if not low <= place.value <= high:
        if step is None:
            low, high = min(low, place.value), max(high, place.value)
        else:  # which lead where they led
            low -= step * math.ceil(max(low - place.value, 0.0) / step)
            high += step * math.ceil(max(place.value - high, 0.0) / step)
        is_log = is_log and low > 0.0
        notes.append(
            f"{where}: the range is widened to {low:g} .. {high:g}: the file has {place.value:g}"
        )
    return Parameter(
        name,
        paths,
        place.value,
        float(low),
        float(high),
        is_log,
        step,
        is_int,
        unit=entry.unit,
    )


def _whole(value: float, where: str) -> int:
    if value != round(value):
        raise ParameterError(f"{where}: {value:g} is no whole number, which Nav2 wants here")
    return round(value)
