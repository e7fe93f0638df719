"""From the values of a Nav2 file to a dataclass, checked field by field."""

import dataclasses
import math
import re
import types
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, TypeVar, Union, get_args, get_origin

from navstack.errors import InputError, ParameterError
from navstack.params.costmap import WITHOUT_LAYERS, CostmapParams
from navstack.params.nav2_file.catalog import plugin_type
from navstack.params.nav2_file.findings import Notice, Visit
from navstack.params.nav2_file.ros_yaml import ParameterEntry, Value, is_placeholder
from navstack.params.registry.bindings import parameter_of
from navstack.params.registry.releases import Declared
from navstack.ranges import NegativeReplaced, Replaced
from navstack.type_hints import hints_of

T = TypeVar("T")

INTEGERS = ("width", "height")  # whole numbers in Nav2, any here
LISTS_ONLY = ("critics",)  # lists of names that no release of Nav2 takes as one text with blanks
PLUGIN_KEYS = ("plugin", "primary_controller")  # parameters whose value is a plugin type

KINDS: dict[Any, str] = {
    float: "a number",
    int: "a whole number",
    str: "a text",
    bool: "true or false",
}
MOST_SHOWN = 60  # characters of a value in a message
LARGEST = 1e9  # of any number with a decimal point
# ends of names whose values may be as large as they like
ENDLESS = ("_range", "_height", "path_length_tolerance", "_velocity", "_accel", "_decel")


def read_values(
    cls: type[T], entries: Mapping[str, ParameterEntry], prefix: str, given: Mapping[str, Any]
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
    mistakes: list[_WrongKindError] = []
    fields = dict(_read_fields(cls, given))
    sections: dict[str, Any] = {
        name: kind for name, kind in fields.items() if dataclasses.is_dataclass(kind)
    }
    for name, kind in fields.items():
        entry = entries.get(f"{prefix}{name}")
        if entry is None or name in sections or _is_left_open(kind, entry):
            continue
        try:
            values[name] = _field_value(name, kind, entry, prefix)
        except _WrongKindError as error:
            mistakes.append(error)
    if mistakes:
        raise _WrongKindsError(mistakes)
    for name, kind in sections.items():
        values[name] = read_values(kind, entries, f"{prefix}{name}.", {})
    return _made(cls, values, prefix)


def _made(cls: type[T], values: Mapping[str, Any], prefix: str) -> T:
    """The dataclass with these values, by parameter."""
    declared = dataclasses.fields(cls)  # type: ignore[arg-type]
    fields = {parameter_of(field.name): field.name for field in declared}
    try:
        made = cls(**{fields[name]: value for name, value in values.items()})
    except InputError as error:
        raise _OutOfRangeError(cls, prefix, str(error)) from None
    except Exception as error:  # of another package's dataclass
        reason = f"{cls.__name__}: {type(error).__name__}: {error}"
        raise _OutOfRangeError(cls, prefix, reason) from None
    for name, value in values.items():  # what the dataclass itself takes at any size
        numbers = value if isinstance(value, tuple) else (value,)
        if not name.endswith(ENDLESS) and any(map(_is_too_large, numbers)):
            reason = f"{name} {value!r} is out of range; at most {LARGEST:g} is allowed"
            raise _OutOfRangeError(cls, prefix, reason)
    return made


def _is_too_large(value: Any) -> bool:
    return isinstance(value, float) and abs(value) > LARGEST


def value_notices(
    node: str, entries: Mapping[str, ParameterEntry], visits: Iterable[Visit]
) -> list[Notice]:
    """Values of the wrong kind or out of range."""
    notices: list[Notice] = []
    for visit in visits:
        for path, reason, line in _mistakes(entries, visit):
            where = f"{node}: {path}" if path else node
            said = reason.removeprefix(f"{node}: ")  # some parameters name their node
            notices.append(Notice("bad-value", where, said, "", line, True))
        kinds = hints_of(visit.params, include_extras=True)
        for field, kind in kinds.items():
            name = parameter_of(field)
            entry = entries.get(f"{visit.prefix}{name}")
            if entry is not None:
                notices += _warnings_of(name, kind, f"{node}: {visit.prefix}{name}", entry)
    return notices


def _mistakes(entries: Mapping[str, ParameterEntry], visit: Visit) -> list[tuple[str, str, int]]:
    """Path, reason and line of each value for which a dataclass cannot be read."""
    given = WITHOUT_LAYERS if visit.params is CostmapParams else {}
    try:
        read_values(visit.params, entries, visit.prefix, given)
    except _WrongKindsError as error:
        return [(each.path, each.reason, each.line) for each in error.mistakes]
    except _OutOfRangeError as error:  # perhaps in a sub-namespace, whose own visit says the same
        names = [name for name in _hints(error.params) if re.search(rf"\b{name}\b", error.reason)]
        found = [entries.get(f"{error.prefix}{name}") for name in names]
        line = min((entry.line for entry in found if entry is not None), default=0)
        return [(error.where, error.reason, line)]
    return []


def _warnings_of(name: str, kind: Any, path: str, entry: ParameterEntry) -> Iterator[Notice]:
    """What to say of a value that can be read."""
    for rule in getattr(kind, "__metadata__", ()):
        if isinstance(rule, Replaced | NegativeReplaced) and (why := _replaced(rule, entry.value)):
            message = f"{_shown(entry.value)} is {why}; Nav2 warns and takes {rule.usual}"
            yield Notice("replaced-value", path, message, f"{name}: {rule.usual}", entry.line)
    if _is_left_open(kind, entry):
        message = f"{_shown(entry.value)} is left to a launch file; Nav2's default is read"
        yield Notice("placeholder", path, message, "write true or false", entry.line)


def _replaced(rule: Replaced | NegativeReplaced, value: Value | None) -> str:
    """Why Nav2 takes another value in place of a number; empty: it takes this one."""
    if isinstance(rule, NegativeReplaced):
        return "negative" if type(value) in (int, float) and float(str(value)) < 0.0 else ""
    # any other than a whole number would be sought in all of a range
    if type(value) is int and value not in rule.known:
        return f"none of {_told(rule.known)}"
    return ""


def _told(known: Sequence[int]) -> str:
    """Numbers in words: a range by its ends, for it may have thousands of millions."""
    if isinstance(known, range):
        return f"{known[0]} to {known[-1]}"
    return ", ".join(map(str, known))


def form_notices(declared: Declared, path: str, entry: ParameterEntry) -> list[Notice]:
    """Numbers of a form that Nav2 refuses where a parameter is declared so."""
    if declared.wants(float, entry.value):
        kind, form, wanted = "whole-number", "no", _as(float, entry.value)
    elif declared.wants(int, entry.value):
        kind, form, wanted = "decimal-number", "a", _as(int, entry.value)
    else:
        return []
    message = f"{_shown(entry.value)} has {form} decimal point, and Nav2 refuses such a number here"
    return [Notice(kind, path, message, f"write {_shown(wanted)}", entry.line)]


def _as(kind: type[int] | type[float], value: Value) -> Value:
    """A number, or those of a list, with a decimal point or without one."""
    if isinstance(value, list):
        return [_as(kind, each) for each in value]
    if isinstance(value, int | float) and math.isfinite(value):
        return kind(value)
    return value


class _WrongKindError(ParameterError):
    """A value of the wrong kind."""

    def __init__(self, path: str, reason: str, line: int) -> None:
        super().__init__(f"{path}: {reason} (line {line})")
        self.path = path
        self.reason = reason
        self.line = line


class _WrongKindsError(ParameterError):
    """The values of the wrong kind in one namespace; the message is about the first."""

    def __init__(self, mistakes: list[_WrongKindError]) -> None:
        super().__init__(str(mistakes[0]))
        self.mistakes = mistakes


class _OutOfRangeError(ParameterError):
    """What a dataclass says about values of the right kind."""

    def __init__(self, params: type[Any], prefix: str, reason: str) -> None:
        self.where = prefix.rstrip(".")
        super().__init__(": ".join(filter(None, (self.where, reason))))
        self.params = params
        self.prefix = prefix
        self.reason = reason


def _read_fields(cls: type[Any], given: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Parameters that come from the file, and their kinds."""
    hints = _hints(cls)
    for field in dataclasses.fields(cls):
        name = parameter_of(field.name)
        if name not in given and get_origin(hints[name]) not in (dict, Mapping):
            yield name, hints[name]


def _field_value(name: str, kind: Any, entry: ParameterEntry, prefix: str) -> Any:
    if name in LISTS_ONLY and isinstance(entry.value, str):
        raise _WrongKindError(f"{prefix}{name}", f"{_shown(entry.value)} is not a list", entry.line)
    value = entry.value
    if name in PLUGIN_KEYS:
        value = plugin_type(value)
    return _convert(kind, value, f"{prefix}{name}", entry.line)


def _is_left_open(kind: Any, entry: ParameterEntry) -> bool:
    """Whether a switch is a placeholder, as in Nav2's own files of Rolling."""
    return kind is bool and is_placeholder(entry.value)


def _hints(cls: type[Any]) -> dict[str, Any]:
    """Kinds by parameter."""
    return {parameter_of(field): kind for field, kind in hints_of(cls).items()}


def _convert(kind: Any, value: Any, path: str, line: int) -> Any:
    kind = _without_none(kind)
    if get_origin(kind) is tuple:
        return _convert_list(get_args(kind), value, path, line)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if kind is float and is_number and not math.isnan(value):
        return float(value)
    if kind is not float and isinstance(value, kind) and isinstance(value, bool) == (kind is bool):
        return value
    reason = f"is not {KINDS[kind]}"
    if is_placeholder(value):
        reason = f"is left to a launch file; write {KINDS[kind]}"
    raise _WrongKindError(path, f"{_shown(value)} {reason}", line)


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
        reason = f"{_shown(value)} has {len(value)} entries; expected {len(kinds)}"
        raise _WrongKindError(path, reason, line)
    return tuple(_convert(kinds[0], item, f"{path}[{i}]", line) for i, item in enumerate(value))


def _shown(value: Any) -> str:
    text = repr(value)
    if len(text) <= MOST_SHOWN:
        return text
    return text[: MOST_SHOWN - 3] + "..."
