"""From the values of a Nav2 file to a dataclass, checked field by field."""

import dataclasses
import math
import re
import types
import typing
from collections.abc import Iterable, Iterator, Mapping
from keyword import iskeyword
from typing import Any, TypeVar, Union, get_args, get_origin

from navstack.errors import InputError, ParameterError
from navstack.params.costmap import CHOICES, CostmapParams
from navstack.params.nav2_file.catalog import plugin_type
from navstack.params.nav2_file.findings import Notice, Visit
from navstack.params.nav2_file.ros_yaml import Entry, Value, is_placeholder
from navstack.params.registry.bindings import parameter_of
from navstack.params.registry.kinds import DECIMALS, WHOLE_NUMBERS

T = TypeVar("T")

INTEGERS = ("width", "height")  # whole numbers in Nav2, any here
LISTS_ONLY = ("critics",)  # lists of names that no release of Nav2 takes as one text with blanks
PLUGIN_KEYS = ("plugin", "primary_controller")  # parameters whose value is a plugin type

LARGEST = 1e9  # of any number with a decimal point
# ends of names whose values may be as large as they like
ENDLESS = ("_range", "_height", "path_length_tolerance")


def read_values(
    cls: type[T], entries: Mapping[str, Entry], prefix: str, given: Mapping[str, Any]
) -> T:
    """Fill a dataclass from the parameters below a dotted prefix (ending in a dot, or empty).

    A field that is a dataclass is filled from the sub-namespace of its name; a mapping of
    dataclasses keeps its default unless ``given``. An absent parameter keeps the field's default,
    which is Nav2's.

    Raises:
        ParameterError: a value of the wrong kind; the message begins with the parameter's dotted
            name.
    """
    values = dict(given)
    for name, kind in _read_fields(cls, given):
        if dataclasses.is_dataclass(kind) and isinstance(kind, type):
            values[name] = read_values(kind, entries, f"{prefix}{name}.", {})
        elif f"{prefix}{name}" in entries and not _is_left_open(kind, entries[f"{prefix}{name}"]):
            values[name] = _field_value(name, kind, entries[f"{prefix}{name}"], prefix)
    try:
        made = cls(
            **{f"{name}_" if iskeyword(name) else name: value for name, value in values.items()}
        )
    except InputError as error:
        raise _OutOfRangeError(cls, prefix, str(error)) from None
    for name, value in values.items():  # what the dataclass itself takes at any size
        if isinstance(value, float) and abs(value) > LARGEST and not name.endswith(ENDLESS):
            raise _OutOfRangeError(
                cls, prefix, f"{name} {value!r} is out of range; at most {LARGEST:g} is allowed"
            )
    return made


def value_notices(node: str, entries: Mapping[str, Entry], visits: Iterable[Visit]) -> list[Notice]:
    """Values of the wrong kind or out of range, and whole numbers or decimals where Nav2 insists on the other."""
    notices: list[Notice] = []
    for visit in visits:
        given: dict[str, Any] = (
            {"plugins": (), "filters": (), "layers": {}} if visit.params is CostmapParams else {}
        )
        notices += _wrong_kinds(node, entries, visit, given) or _out_of_range(
            node, entries, visit, given
        )
        for name, kind in _hints(visit.params).items():
            if f"{visit.prefix}{name}" in entries:
                path, entry = f"{node}: {visit.prefix}{name}", entries[f"{visit.prefix}{name}"]
                notices += _warnings_of(name, kind, path, entry)
    return notices


def _warnings_of(name: str, kind: Any, path: str, entry: Entry) -> Iterator[Notice]:
    """What to say of a value that can be read."""
    if name in INTEGERS and isinstance(entry.value, float):
        yield _decimal_number(path, entry)
    if name not in INTEGERS and _lacks_point(kind, entry.value):
        yield _whole_number(path, entry)
    known, usual = CHOICES.get(name, ((), 0))
    if known and type(entry.value) is int and entry.value not in known:
        message = f"{_shown(entry.value)} is none of {', '.join(map(str, known))}; Nav2 warns and takes {usual}"
        yield Notice("replaced-value", path, message, f"{name}: {usual}", entry.line)
    if _is_left_open(kind, entry):
        message = f"{_shown(entry.value)} is left to a launch file; Nav2's default is read"
        yield Notice("placeholder", path, message, "write true or false", entry.line)


def form_notices(name: str, path: str, entry: Entry) -> list[Notice]:
    """The same for a parameter that this program does not read.

    Nothing where its name does not tell its form.
    """
    if name in DECIMALS and type(entry.value) is int:
        return [_whole_number(path, entry)]
    if name in WHOLE_NUMBERS and isinstance(entry.value, float):
        return [_decimal_number(path, entry)]
    return []


def _whole_number(path: str, entry: Entry) -> Notice:
    message = f"{_shown(entry.value)} has no decimal point, and Nav2 refuses a whole number here"
    return Notice("whole-number", path, message, "write 1.0 instead of 1", entry.line)


def _decimal_number(path: str, entry: Entry) -> Notice:
    message = f"{_shown(entry.value)} has a decimal point, and Nav2 refuses a decimal number here"
    return Notice("decimal-number", path, message, "write 3 instead of 3.0", entry.line)


def _wrong_kinds(
    node: str, entries: Mapping[str, Entry], visit: Visit, given: Mapping[str, Any]
) -> list[Notice]:
    """All values of one namespace that are of the wrong kind."""
    notices = []
    for name, kind in _read_fields(visit.params, given):
        entry = entries.get(f"{visit.prefix}{name}")
        if entry is None or dataclasses.is_dataclass(kind) or _is_left_open(kind, entry):
            continue
        try:
            _field_value(name, kind, entry, visit.prefix)
        except _WrongKindError as error:
            notices.append(
                Notice(
                    "bad-value",
                    f"{node}: {error.path}",
                    error.reason,
                    line=entry.line,
                    is_error=True,
                )
            )
    return notices


def _out_of_range(
    node: str, entries: Mapping[str, Entry], visit: Visit, given: Mapping[str, Any]
) -> list[Notice]:
    """What a dataclass says about values that are of the right kind."""
    try:
        read_values(visit.params, entries, visit.prefix, given)
    except _WrongKindError as error:  # in a sub-namespace, e.g. of a critic that no list names
        return [
            Notice(
                "bad-value", f"{node}: {error.path}", error.reason, line=error.line, is_error=True
            )
        ]
    except _OutOfRangeError as error:  # perhaps in a sub-namespace, whose own visit says the same
        named = {name for name in _hints(error.params) if re.search(rf"\b{name}\b", error.reason)}
        lines = [
            entries[f"{error.prefix}{name}"].line
            for name in named
            if f"{error.prefix}{name}" in entries
        ]
        path = f"{node}: {error.where}" if error.where else node
        return [Notice("bad-value", path, error.reason, line=min(lines, default=0), is_error=True)]
    return []


class _WrongKindError(ParameterError):
    """A value of the wrong kind."""

    def __init__(self, path: str, reason: str, line: int) -> None:
        super().__init__(f"{path}: {reason} (line {line})")
        self.path, self.reason, self.line = path, reason, line


class _OutOfRangeError(ParameterError):
    """What a dataclass says about values of the right kind."""

    def __init__(self, params: type[Any], prefix: str, reason: str) -> None:
        self.where = prefix.rstrip(".")
        super().__init__(f"{self.where}: {reason}" if self.where else reason)
        self.params, self.prefix, self.reason = params, prefix, reason


def _read_fields(cls: type[Any], given: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Parameters that come from the file, and their kinds."""
    hints = _hints(cls)
    for field in dataclasses.fields(cls):
        name = parameter_of(field.name)
        if name not in given and get_origin(hints[name]) not in (dict, Mapping):
            yield name, hints[name]


def _field_value(name: str, kind: Any, entry: Entry, prefix: str) -> Any:
    if name in LISTS_ONLY and isinstance(entry.value, str):
        raise _WrongKindError(f"{prefix}{name}", f"{_shown(entry.value)} is not a list", entry.line)
    value = plugin_type(entry.value) if name in PLUGIN_KEYS else entry.value
    return _convert(kind, value, f"{prefix}{name}", entry.line)


def _is_left_open(kind: Any, entry: Entry) -> bool:
    """Whether a switch is a placeholder, as in Nav2's own files of Rolling."""
    return kind is bool and is_placeholder(entry.value)


def _lacks_point(kind: Any, value: Value) -> bool:
    kind = _without_none(kind)
    if get_origin(kind) is tuple and get_args(kind)[0] is float:
        return isinstance(value, list) and any(type(item) is int for item in value)
    return kind is float and type(value) is int


def _hints(cls: type[Any]) -> dict[str, Any]:
    """Kinds by parameter."""
    return {parameter_of(field): kind for field, kind in typing.get_type_hints(cls).items()}


def _convert(kind: Any, value: Any, path: str, line: int) -> Any:
    kind = _without_none(kind)
    if get_origin(kind) is tuple:
        return _convert_list(get_args(kind), value, path, line)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if kind is float and is_number and not math.isnan(value):
        return float(value)
    if kind is not float and isinstance(value, kind) and isinstance(value, bool) == (kind is bool):
        return value
    expected = {float: "a number", int: "a whole number", str: "a text", bool: "true or false"}[
        kind
    ]
    if is_placeholder(value):
        raise _WrongKindError(
            path, f"{_shown(value)} is left to a launch file; write {expected}", line
        )
    raise _WrongKindError(path, f"{_shown(value)} is not {expected}", line)


def _without_none(kind: Any) -> Any:
    """The kind of an optional value."""
    if get_origin(kind) not in (Union, types.UnionType):
        return kind
    return next(option for option in get_args(kind) if option is not type(None))


def _convert_list(kinds: tuple[Any, ...], value: Any, path: str, line: int) -> tuple[Any, ...]:
    if isinstance(value, str) and kinds[0] is str:
        value = value.split()  # observation_sources and the single plugins of older releases
    if not isinstance(value, list):
        raise _WrongKindError(path, f"{_shown(value)} is not a list", line)
    if kinds[-1] is not Ellipsis and len(value) != len(kinds):
        raise _WrongKindError(
            path, f"{_shown(value)} has {len(value)} entries; expected {len(kinds)}", line
        )
    return tuple(_convert(kinds[0], item, f"{path}[{i}]", line) for i, item in enumerate(value))


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
