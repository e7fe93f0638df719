"""A Nav2 file with every default that this program reads."""

import dataclasses
from collections.abc import Iterable, Iterator, Mapping
from io import StringIO
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.scalarstring import DoubleQuotedScalarString

from navstack.params.nav2_file.dwb import unnamed_critics
from navstack.params.nav2_file.findings import Parameters, Visit
from navstack.params.nav2_file.nodes import default_path
from navstack.params.nav2_file.ros_yaml import Value, parse_scalar
from navstack.params.nav2_file.values import INTEGERS
from navstack.params.registry.bindings import parameter_of
from navstack.params.registry.entry import Params


def merged(parameters: Parameters, visits: Mapping[str, Iterable[Visit]]) -> dict[str, Any]:
    """The parameters of all nodes with the defaults of what was visited, as Nav2 nests them."""
    result: dict[str, Any] = {}
    for node, entries in parameters.items():
        values = {name: entry.value for name, entry in entries.items()}
        namespaces = {name[:i] for name in values for i, char in enumerate(name) if char == "."}
        met = list(visits[node])
        met += [critic for parent in met for critic in unnamed_critics(parent, values)]
        for visit in met:
            if visit.plugin:
                values.setdefault(f"{visit.prefix}plugin", visit.plugin)
            for name, default in _defaults(visit.params):
                if f"{visit.prefix}{name}" not in namespaces:
                    values.setdefault(f"{visit.prefix}{name}", default)
        body: dict[str, Any] = {"ros__parameters": _nested(values)}
        for part in reversed(default_path(node)):
            body = {part: body}
        result |= body
    return result


def dump(nested: Mapping[str, Any]) -> str:
    """The text of a parameter file."""
    stream = StringIO()
    yaml = YAML(pure=True)
    yaml.default_flow_style = False
    yaml.width = 10_000
    yaml.dump(_quoted(nested), stream)
    return stream.getvalue()


def _defaults(params: Params) -> Iterator[tuple[str, Value]]:
    """The defaults of a dataclass that a parameter file can hold, of the type that Nav2 wants."""
    for field in dataclasses.fields(params):
        default: Any = field.default
        if field.name in INTEGERS:
            default = int(default)
        if isinstance(default, tuple):
            default = list(default)
        if default == []:  # ROS takes it for no value; Nav2 has the same default
            continue
        if isinstance(default, bool | int | float | str | list):
            yield parameter_of(field.name), default


def _nested(values: Mapping[str, Value]) -> dict[str, Any]:
    """Dotted names as nested mappings; a name that is both value and namespace keeps its dots."""
    tree: dict[str, Any] = {}
    for name, value in values.items():
        *parts, last = name.split(".")
        place = tree
        while parts and isinstance(place.setdefault(parts[0], {}), dict):
            place = place[parts.pop(0)]
        place[".".join((*parts, last))] = value
    return tree


def _quoted(value: Any) -> Any:
    """A value whose texts are marked to be quoted where ROS would read something else.

    Ruamel writes YAML 1.2.
    """
    if isinstance(value, dict):
        return {name: _quoted(item) for name, item in value.items()}
    if isinstance(value, list):
        return [_quoted(item) for item in value]
    if isinstance(value, str) and parse_scalar(value) != value:
        return DoubleQuotedScalarString(value)
    return value
