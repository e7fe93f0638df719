"""Single parameters of a Nav2 file by path: found, read and set.

A path is ``node.parameter``, as :meth:`navstack.params.nav2_file.file.Nav2File.with_values` names
parameters, e.g. ``controller_server.FollowPath.max_vel_x``; ``ros__parameters`` may stand in it as
in the file. Instead of the name of a plugin's section, which is the file's own choice, the type may
be given: ``controller_server.{dwb_core::DWBLocalPlanner}.max_vel_x``. ``[0]`` at the end is the
first entry of a list. The value of a whole list of names is a text, its entries joined by
:data:`COMMA`.
"""

import dataclasses
import re
import types
import typing
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from harness.task.stack import absolute_files
from harness.tuning.evaluation import Value
from harness.tuning.space.file import ListEdit
from navstack.errors import ParameterError, did_you_mean
from navstack.params.nav2_file.file import Nav2File
from navstack.params.nav2_file.findings import Visit
from navstack.params.nav2_file.ros_yaml import PARAMETERS, is_placeholder
from navstack.params.nav2_file.views import idle_plugins
from navstack.params.registry.bindings import ONLY_WITHOUT
from navstack.type_hints import hints_of

SCALARS = (bool, int, float, str)
COMMA = ", "
_ENTRY = re.compile(r"(.*)\[(\d{1,2})\]")
_TYPE = re.compile(r"\{([\w:/]+)\}")


@dataclass(frozen=True, slots=True)
class ParameterPlace:
    """A parameter that has an effect."""

    path: str  # node.parameter, with the section's name in the file
    kind: type  # one of SCALARS
    value: Value  # in the file, or Nav2's default


class AbsentError(ParameterError):
    """A file has nothing of the kind that a path names."""


class NoPluginError(AbsentError):
    """A file has no plugin of the type that a path names, or its release no such node."""


def locate(nav2: Nav2File, path: str) -> ParameterPlace:
    """Find a parameter.

    Raises:
        AbsentError: the file has no such node, plugin or parameter, or none that has an effect
            here; the message offers the nearest path.
    """
    node, name, index, kind, value = _find(nav2, path)
    suffix = ""
    if index is not None:
        suffix = f"[{index}]"
    if index is not None and isinstance(value, list | tuple) and index < len(value):
        kind, value = typing.get_args(kind)[0], value[index]
    if kind not in SCALARS or not isinstance(value, SCALARS):
        has = "has no value in it, nor in Nav2"
        if value is not None:
            has = f"has the value {value!r}"
        raise AbsentError(
            f"{nav2.path.name}: {node}.{name}{suffix} {has}; give the path of a number, text or "
            "switch"
        )
    return ParameterPlace(f"{node}.{name}{suffix}", kind, float(value) if kind is float else value)


def locate_list(nav2: Nav2File, path: str) -> ParameterPlace:
    """Find a list of names; its kind is that of a text, see the head of this module.

    Raises:
        AbsentError: as :func:`locate`.
        ParameterError: the parameter is no such list.
    """
    node, name, index, kind, value = _find(nav2, path)
    if index is not None or not _is_names(kind) or not value:
        raise ParameterError(
            f"{nav2.path.name}: {node}.{name} is {value!r}; give the path of a list of names"
        )
    return ParameterPlace(f"{node}.{name}", str, COMMA.join(value))


def edited_list(nav2: Nav2File, place: ParameterPlace, edit: ListEdit) -> str:
    """The value of a list with names reordered, exchanged or appended.

    Args:
        nav2: the file.
        place: of the list.
        edit: what becomes of it. An exchange is passed over where the list lacks the former name,
            or has the latter.
    """
    names = str(place.value).split(COMMA)
    types_ = {
        visit.prefix.removesuffix("."): visit.plugin for visit in nav2.visits[_split(place.path)[0]]
    }
    ordered = [
        name for each in edit.order for name in names if each in (name, f"{{{types_.get(name)}}}")
    ]
    following = iter(ordered)
    moved = (next(following) if name in ordered else name for name in names)
    possible = {old: new for old, new in edit.replace.items() if new not in names}
    return COMMA.join(
        [
            *(possible.get(name, name) for name in moved),
            *(name for name in edit.add if name not in names),
        ]
    )


def is_list(value: Value) -> bool:
    """Whether a value is that of a list of names."""
    return isinstance(value, str) and COMMA in value


def with_values(
    nav2: Nav2File,
    values: Mapping[str, Value],
    allow_unknown: bool = False,
) -> Nav2File:
    """A copy of a file with parameters set, by the paths of their :class:`ParameterPlace`.

    All other text stays as it is.

    Args:
        nav2: the file.
        values: path -> value.
        allow_unknown: as the file was loaded with.

    Raises:
        ParameterError: a value of the wrong kind or that the parameter cannot have.
    """
    changes: dict[str, Any] = {}
    for path, value in values.items():
        entry = _ENTRY.fullmatch(path)
        if entry is None:
            changes[path] = (
                value.split(COMMA) if isinstance(value, str) and _names_list(nav2, path) else value
            )
            continue
        # maybe Nav2's default
        changes.setdefault(entry[1], list(_find(nav2, entry[1])[4]))[int(entry[2])] = value
    return nav2.with_values(changes, allow_unknown)


def _find(nav2: Nav2File, path: str) -> tuple[str, str, int | None, Any, Any]:
    """Node, name, number of the entry, type and value of a parameter that has an effect.

    The number is None for the whole parameter.
    """
    node, name = _split(path)
    index = None
    entry = _ENTRY.fullmatch(name)
    if entry is not None:
        name, index = entry[1], int(entry[2])
    if not nav2.runs(node):
        raise NoPluginError(
            f"path '{path}': {nav2.path.name} reads like a file of Nav2 {nav2.release}, which has "
            f"no {node}; leave it out"
        )
    known = {
        each: (kind, default)
        for visit in _visits(nav2, node)
        for each, kind, default in _parameters(nav2, node, visit)
    }
    given = _TYPE.search(name)
    if given is not None:
        name = name.replace(f"{given[0]}.", _prefix_of(nav2, node, given[1], path))
    if name not in known:
        raise _absent(nav2, path, node, name, known)
    kind, default = known[name]
    value = nav2.value(node, name, default)
    if kind is not str and is_placeholder(value):  # as the parameter itself is read
        value = default
    return node, name, index, kind, value


def _visits(nav2: Nav2File, node: str) -> list[Visit]:
    """What is read of a node, but for plugins that are listed and not used."""
    idle = idle_plugins(nav2, node)
    return [
        visit for visit in nav2.visits.get(node, ()) if visit.prefix.partition(".")[0] not in idle
    ]


def _names_list(nav2: Nav2File, path: str) -> bool:
    """Whether a path is that of a list of names."""
    try:
        return _is_names(_find(nav2, path)[3])
    except AbsentError:
        return False


def _is_names(kind: Any) -> bool:
    """Whether a parameter is a list of texts."""
    return typing.get_origin(kind) is tuple and set(typing.get_args(kind)) <= {str, Ellipsis}


def _split(path: str) -> tuple[str, str]:
    """Node and parameter of a path."""
    before, found, after = path.partition(f".{PARAMETERS}.")
    if found:
        return before.rpartition(".")[2], after
    node, _, name = path.partition(".")
    return node, name


def _prefix_of(nav2: Nav2File, node: str, plugin: str, path: str) -> str:
    """Where the parameters of a plugin type stand, also below a rotation shim."""
    params = {types[plugin] for types in nav2.catalog.available.values() if plugin in types} - {
        None
    }
    if not params:
        types_ = sorted({kind for types in nav2.catalog.available.values() for kind in types})
        raise ParameterError(
            f"path '{path}': unknown plugin '{plugin}'{did_you_mean(plugin, types_)}"
        )
    found = next((visit.prefix for visit in _visits(nav2, node) if visit.params in params), None)
    if found is None:
        raise NoPluginError(
            f"path '{path}': {nav2.path.name} has no {plugin} in {node}; choose another search "
            "space"
        )
    return found


def _absent(
    nav2: Nav2File,
    path: str,
    node: str,
    name: str,
    known: Mapping[str, Any],
) -> AbsentError:
    what = f"path '{path}': {nav2.path.name}"
    if not known:
        nodes = [each for each, visits in nav2.visits.items() if visits]
        return AbsentError(
            f"{what} has no node '{node}' that has an effect{did_you_mean(node, nodes)}"
        )
    if name in nav2.parameters.get(node, {}):
        return AbsentError(f"{what}: {node}.{name} has no effect here; leave it out")
    places = [f"{node}.{each}" for each in known]
    return AbsentError(f"{what} has no such parameter{did_you_mean(f'{node}.{name}', places)}")


def _parameters(nav2: Nav2File, node: str, visit: Visit) -> Iterator[tuple[str, Any, Any]]:
    """Name, type and default of what a file may hold in a namespace, and that counts there.

    Other namespaces have visits of their own.
    """
    hints = hints_of(visit.params)
    idle: set[str] = set()
    for other, names in ONLY_WITHOUT.get(visit.params, {}).items():
        if nav2.value(node, f"{visit.prefix}{other}") is not None:
            idle |= names
    for field in dataclasses.fields(visit.params):
        if field.name in idle:
            continue
        kind = hints[field.name]
        if typing.get_origin(kind) in (typing.Union, types.UnionType):
            kind = next(option for option in typing.get_args(kind) if option is not type(None))
        if kind in SCALARS or typing.get_origin(kind) is tuple:
            yield f"{visit.prefix}{field.name}", kind, field.default


def with_absolute_files(nav2: Nav2File, allow_unknown: bool = False) -> Nav2File:
    """A copy whose costmap filters find their masks from any folder.

    A map that is not read here stays as it is.
    """
    moved = {
        f"{node}.yaml_filename": file
        for node, file in absolute_files(nav2).items()
        if nav2.visits.get(node) and str(nav2.parameters[node]["yaml_filename"].value) != file
    }
    if moved:
        return nav2.with_values(moved, allow_unknown)
    return nav2
