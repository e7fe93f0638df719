"""From the values of a Nav2 file to a dataclass, checked field by field."""

import dataclasses
import math
import types
import typing
from collections.abc import Iterable, Mapping
from typing import Any, TypeVar, Union, get_args, get_origin

from navstack.errors import InputError, ParameterError
from navstack.params.costmap import CostmapParams
from navstack.params.nav2_catalog import plugin_type
from navstack.params.nav2_findings import Notice, Visit
from navstack.params.ros_yaml import Entry, Value

T = TypeVar("T")

INTEGERS = ("width", "height")  # whole numbers in Nav2, any here
PLUGIN_KEYS = ("plugin", "primary_controller")  # parameters whose value is a plugin type


def read_values(cls: type[T], entries: Mapping[str, Entry], prefix: str, given: Mapping[str, Any]) -> T:
    """Fill a dataclass from the parameters below a dotted prefix (ending in a dot, or empty).

    A field that is a dataclass is filled from the sub-namespace of its name; a mapping of dataclasses keeps its default
    unless ``given``. An absent parameter keeps the field's default, which is Nav2's.

    Raises:
        ParameterError: a value of the wrong kind; the message begins with the parameter's dotted name.
    """
    values = dict(given)
    for field in dataclasses.fields(cls):  # type: ignore[arg-type]
        name, kind = field.name, _hints(cls)[field.name]
        if name in values or get_origin(kind) in (dict, Mapping):
            continue
        if dataclasses.is_dataclass(kind) and isinstance(kind, type):
            values[name] = read_values(kind, entries, f"{prefix}{name}.", {})
        elif f"{prefix}{name}" in entries:
            entry = entries[f"{prefix}{name}"]
            value = plugin_type(entry.value) if name in PLUGIN_KEYS else entry.value
            values[name] = _convert(kind, value, f"{prefix}{name}", entry.line)
    try:
        return cls(**values)
    except InputError as error:
        raise ParameterError(f"{prefix.rstrip('.')}: {error}" if prefix else str(error)) from None


def value_notices(node: str, entries: Mapping[str, Entry], visits: Iterable[Visit]) -> list[Notice]:
    """Values of the wrong kind or out of range, and whole numbers where Nav2 insists on decimals."""
    notices: list[Notice] = []
    for visit in visits:
        given: dict[str, Any] = {"plugins": (), "layers": {}} if visit.params is CostmapParams else {}
        try:
            read_values(visit.params, entries, visit.prefix, given)
        except ParameterError as error:
            notices.append(Notice("bad-value", node, str(error), is_error=True))
        for name, kind in _hints(visit.params).items():
            entry = entries.get(f"{visit.prefix}{name}")
            if entry is not None and name not in INTEGERS and _lacks_point(kind, entry.value):
                path = f"{node}: {visit.prefix}{name}"
                message = f"{_shown(entry.value)} has no decimal point, and Nav2 refuses a whole number here"
                notices.append(Notice("whole-number", path, message, "write 1.0 instead of 1", entry.line))
    return notices


def _lacks_point(kind: Any, value: Value) -> bool:
    if get_origin(kind) is tuple and get_args(kind)[0] is float:
        return isinstance(value, list) and any(type(item) is int for item in value)
    return kind is float and type(value) is int


def _hints(cls: type[Any]) -> dict[str, Any]:
    return typing.get_type_hints(cls)


def _convert(kind: Any, value: Any, path: str, line: int) -> Any:
    if get_origin(kind) in (Union, types.UnionType):
        kind = next(option for option in get_args(kind) if option is not type(None))
    if get_origin(kind) is tuple:
        return _convert_list(get_args(kind), value, path, line)
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if kind is float and is_number and not math.isnan(value):
        return float(value)
    if kind is not float and isinstance(value, kind) and isinstance(value, bool) == (kind is bool):
        return value
    expected = {float: "a number", int: "a whole number", str: "a text", bool: "true or false"}
    raise ParameterError(f"{path}: {_shown(value)} is not {expected.get(kind, kind.__name__)} (line {line})")


def _convert_list(kinds: tuple[Any, ...], value: Any, path: str, line: int) -> tuple[Any, ...]:
    if isinstance(value, str) and kinds[0] is str:
        value = value.split()  # observation_sources and the single plugins of older releases
    if not isinstance(value, list):
        raise ParameterError(f"{path}: {_shown(value)} is not a list (line {line})")
    if kinds[-1] is not Ellipsis and len(value) != len(kinds):
        raise ParameterError(f"{path}: {_shown(value)} has {len(value)} entries; expected {len(kinds)} (line {line})")
    return tuple(_convert(kinds[0], item, f"{path}[{i}]", line) for i, item in enumerate(value))


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
