"""Nav2 parameter files in and out."""

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from io import StringIO
from pathlib import Path
from typing import Any, TypeVar

from ruamel.yaml import YAML
from ruamel.yaml.scalarstring import DoubleQuotedScalarString

from navstack.errors import ParameterError
from navstack.params.dwb import DwbParams
from navstack.params.nav2_file import edit
from navstack.params.nav2_file.catalog import Catalog, node_block, node_params, plugin_type
from navstack.params.nav2_file.check import Checker
from navstack.params.nav2_file.dwb import fallback_scales, unnamed_critics
from navstack.params.nav2_file.eloquent import convert_plugins
from navstack.params.nav2_file.filters import filter_notices
from navstack.params.nav2_file.findings import Findings, Notice, Section, Visit, is_told, names_in
from navstack.params.nav2_file.monitor import NODE as MONITOR
from navstack.params.nav2_file.monitor import convert_footprint, convert_polygons, monitor_notices
from navstack.params.nav2_file.nodes import (
    COSTMAPS,
    default_path,
    entries_of,
    in_file,
    is_wildcard,
    joined_notices,
    node_notices,
    nodes_to_check,
    sections_of,
    tree_notices,
)
from navstack.params.nav2_file.ros_yaml import (
    Document,
    Entry,
    Value,
    load_document,
    parse_document,
    parse_scalar,
)
from navstack.params.nav2_file.sources import source_notices
from navstack.params.nav2_file.values import INTEGERS, read_values, value_notices
from navstack.params.registry import nodes
from navstack.params.registry.bindings import parameter_of
from navstack.params.registry.entry import Params

T = TypeVar("T")
SUBSTITUTES = {  # family -> the plugin that does what is wanted of most of them
    "controllers": "dwb_core::DWBLocalPlanner",
    "planners": "nav2_navfn_planner::NavfnPlanner",
    "layers": "nav2_costmap_2d::ObstacleLayer",
    "goal_checkers": "nav2_controller::SimpleGoalChecker",
    "progress_checkers": "nav2_controller::SimpleProgressChecker",
}


@dataclass(frozen=True)
class Nav2File:
    """A Nav2 parameter file, held against Nav2's schema.

    ``notices`` are the findings that a user should see, errors among them only if they were asked
    for; ``ignored`` names what is real Nav2 but has no effect here.
    """

    path: Path
    document: Document
    parameters: Mapping[
        str, Mapping[str, Entry]
    ]  # node -> dotted name -> entry; wildcards and other releases' names applied
    visits: Mapping[str, tuple[Visit, ...]]
    # node -> today's dotted name -> the one that the file has
    renames: Mapping[str, Mapping[str, str]]
    notices: tuple[Notice, ...]
    ignored: tuple[str, ...]
    catalog: Catalog

    @property
    def warnings(self) -> tuple[str, ...]:
        """The findings that do not keep the file from being used, one line each."""
        return tuple(str(notice) for notice in self.notices if not notice.is_error)

    @property
    def errors(self) -> tuple[str, ...]:
        """The findings for which :func:`load_nav2` refuses the file, one line each."""
        return tuple(str(notice) for notice in self.notices if notice.is_error)

    def value(self, node: str, name: str, default: Any = None) -> Any:
        """One parameter by its dotted name, as it stands in the file."""
        entry = self.parameters.get(node, {}).get(name)
        return default if entry is None else entry.value

    def read(self, cls: type[T], node: str, *prefix: str, **given: Any) -> T:
        """A dataclass filled from a node's parameters below a prefix.

        ``given`` fields are taken as they are.

        Raises:
            ParameterError: a value of the wrong kind or out of range; one line names the file, node
                and parameter.
        """
        dotted = "".join(f"{part}." for part in prefix)
        try:
            return read_values(cls, self.parameters.get(node, {}), dotted, given)
        except ParameterError as error:
            raise ParameterError(f"{self.path.name}: {node}: {error}") from None

    def plugin(self, node: str, name: str, family: str) -> str:
        """The type of a plugin by the name of its section, as Nav2 Jazzy spells it.

        Raises:
            ParameterError: the type is missing, unknown, or not available here.
        """
        value = self.value(node, f"{name}.plugin")
        lists = nodes.NODES[node].plugins.values()
        defaults = {
            key: kind
            for plugins in lists
            if plugins.family == family
            for key, kind in plugins.defaults.items()
        }
        if value is None and name not in defaults:
            raise ParameterError(
                f"{self.path.name}: {node}: {name}.plugin is missing; give the plugin's type"
            )
        kind = defaults[name] if value is None else plugin_type(value)
        refusal = self.catalog.refusal(family, kind)
        if refusal:
            raise ParameterError(
                f"{self.path.name}: {node}: {name}: {refusal}{_way_on(family, name)}"
            )
        return kind

    def merged(self) -> dict[str, Any]:
        """The file with the defaults of everything that this program reads filled in, nested as Nav2 wants it."""
        result: dict[str, Any] = {}
        for node in self.parameters:
            values = {name: entry.value for name, entry in self.parameters.get(node, {}).items()}
            namespaces = {name[:i] for name in values for i, char in enumerate(name) if char == "."}
            visits = list(self.visits.get(node, ()))
            visits += [critic for parent in visits for critic in unnamed_critics(parent, values)]
            for visit in visits:
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

    def dump_merged(self) -> str:
        """The text of :meth:`merged`, itself a Nav2 parameter file."""
        stream = StringIO()
        yaml = YAML(pure=True)
        yaml.default_flow_style = False
        yaml.width = 10_000
        yaml.dump(_quoted(self.merged()), stream)
        return stream.getvalue()

    def with_values(self, changes: Mapping[str, Value], allow_unknown: bool = False) -> "Nav2File":
        """A copy with parameters set, named ``node.dotted_name``.

        The rest of the text stays as it is.

        A number that the file has under another release's name is set under that name.

        Args:
            changes: name -> value.
            allow_unknown: as in :func:`load_nav2`.

        Raises:
            ParameterError: a name without a node, or one that is unknown to Nav2.
        """
        found = []
        for name, value in changes.items():
            node, _, dotted = name.partition(".")
            if not dotted:
                raise ParameterError(
                    f"'{name}' is not node.parameter, e.g. controller_server.FollowPath.max_vel_x"
                )
            if not isinstance(value, list):
                dotted = self.renames.get(node, {}).get(dotted, dotted)
            found.append((self._owner_of(node, dotted), dotted, value))
        text = edit.set_values(self.document.text, found, str(self.path))
        return parse_nav2(text, self.path, self.catalog, allow_unknown)

    def dump(self, path: Path) -> None:
        """Write the file: as it was read, comments and order included, but for changed values."""
        path.write_text(self.document.text, encoding="utf-8")

    def _owner_of(self, node: str, dotted: str) -> tuple[str, ...]:
        """Where in the file a parameter stands, or should.

        The section that wins, else the node's own.
        """
        sections = sections_of(self.document, node)
        holding = [text for text in sections if dotted in text.entries]
        own = [text for text in sections if not is_wildcard(text)]
        return (holding or own)[-1].path if holding or own else default_path(node)


def load_nav2(path: Path, allow_unknown: bool = False) -> Nav2File:
    """Read and check a Nav2 parameter file.

    Args:
        path: the file.
        allow_unknown: parameters and plugins unknown to Nav2 are warnings instead of errors, as
            Nav2 ignores them.

    Raises:
        ParameterError: the file cannot be read, or has errors; the message is one line with the
            first of them.
    """
    file = inspect_nav2(path, allow_unknown)
    errors = file.errors
    if errors:
        others = f" (and {len(errors) - 1} more)" if len(errors) > 1 else ""
        raise ParameterError(f"{path}: {errors[0]}{others}")
    return file


def inspect_nav2(path: Path, allow_unknown: bool = False) -> Nav2File:
    """As :func:`load_nav2`, but errors of content stay in ``notices``; for a linter.

    Raises:
        ParameterError: the file is not a parameter file at all.
    """
    return _checked(load_document(path), path, allow_unknown, Catalog.build())


def parse_nav2(text: str, path: Path, catalog: Catalog, allow_unknown: bool = False) -> Nav2File:
    """Check the text of a parameter file.

    Raises:
        ParameterError: it has errors.
    """
    file = _checked(parse_document(text, str(path)), path, allow_unknown, catalog)
    if file.errors:
        raise ParameterError(f"{path}: {file.errors[0]}")
    return file


def _checked(document: Document, path: Path, allow_unknown: bool, catalog: Catalog) -> Nav2File:
    parameters: dict[str, dict[str, Entry]] = {}
    found: dict[str, Findings] = {}
    for node in nodes_to_check(document):
        block = node_block(node)
        if block is None:
            continue
        entries = entries_of(document, node)
        older = convert_plugins(node, entries)
        findings = Checker(node, catalog).check_node(block, Section.of(entries), node_params(node))
        for old, new in findings.renames.items():
            entry = entries.pop(old)
            value = entry.value
            if isinstance(value, str) and new.endswith("_plugins"):  # one name became a list
                value = list(names_in(value))
            entries[new] = replace(entry, value=value)
        findings.notices += older
        if node == MONITOR:
            findings.notices += convert_polygons(entries)
        if node in COSTMAPS:
            findings.notices += convert_footprint(node, entries)
        for prefix in (visit.prefix for visit in findings.visits if visit.params is DwbParams):
            entries |= fallback_scales(entries, prefix)
        parameters[node], found[node] = entries, findings
    visits = {node: tuple(findings.visits) for node, findings in found.items()}
    notices = [Notice(kind, "", text, line=line) for kind, line, text in document.remarks]
    notices += [
        *node_notices(document),
        *joined_notices(document, found),
        *tree_notices(parameters),
    ]
    notices += [
        *filter_notices(parameters),
        *monitor_notices(parameters),
        *source_notices(parameters),
    ]
    for node, entries in parameters.items():
        notices += value_notices(node, entries, visits[node])
    notices.sort(key=lambda notice: (not notice.is_error, notice.line))
    if allow_unknown:
        notices = [
            replace(notice, is_error=notice.is_error and notice.id == "bad-value")
            for notice in notices
        ]
    notices = [
        notice
        for notice in notices
        if notice.id != "bad-value" or not is_told(notice.message, notices)
    ]
    ignored = [
        name
        for node, findings in found.items()
        if in_file(document, node)
        for name in findings.ignored
    ]
    unique = tuple(dict.fromkeys(ignored))
    renames = {
        node: {new: old for old, new in findings.renames.items()}
        for node, findings in found.items()
    }
    return Nav2File(
        path, document, parameters, visits, renames, tuple(dict.fromkeys(notices)), unique, catalog
    )


def _way_on(family: str, name: str) -> str:
    """How a file drives although a plugin of it does not."""
    kind = SUBSTITUTES.get(family)
    return f"; drive with another one by --substitute {name}={kind}" if kind else ""


def _defaults(params: Params) -> Iterator[tuple[str, Value]]:
    """The defaults of a dataclass that a parameter file can hold, of the type that Nav2 wants."""
    for field in dataclasses.fields(params):
        default: Any = field.default
        if field.name in INTEGERS:
            default = int(default)
        if isinstance(default, tuple):
            default = list(default)
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
    return (
        DoubleQuotedScalarString(value)
        if isinstance(value, str) and parse_scalar(value) != value
        else value
    )
