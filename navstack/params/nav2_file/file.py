"""Nav2 parameter files in and out."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from navstack.errors import ParameterError
from navstack.params.dwb import DwbParams
from navstack.params.nav2_file import edit
from navstack.params.nav2_file.catalog import Catalog, node_block, node_params, plugin_type
from navstack.params.nav2_file.check import Checker
from navstack.params.nav2_file.dwb import fallback_scales, missing_critics
from navstack.params.nav2_file.filters import filter_notices
from navstack.params.nav2_file.findings import (
    Findings,
    Known,
    Notice,
    Parameters,
    ParameterSection,
    Visit,
    is_told,
    value_of,
)
from navstack.params.nav2_file.footprints import footprint_notices
from navstack.params.nav2_file.merged import dump, merged
from navstack.params.nav2_file.newer_forms import convert_newer_forms
from navstack.params.nav2_file.nodes import (
    MONITOR,
    entries_of,
    in_file,
    joined_notices,
    node_notices,
    nodes_to_check,
    owner_of,
    require_nodes,
    tree_notices,
)
from navstack.params.nav2_file.older_forms import convert_older_forms
from navstack.params.nav2_file.release import (
    VELOCITY_SMOOTHER,
    no_smoother,
    other_defaults,
    release_of,
    without_own_names,
)
from navstack.params.nav2_file.ros_yaml import (
    Document,
    ParameterEntry,
    Value,
    load_document,
    parse_document,
)
from navstack.params.nav2_file.sources import (
    data_type_notices,
    missing_of_monitor,
    monitor_notices,
    source_notices,
)
from navstack.params.nav2_file.values import read_values, value_notices
from navstack.params.registry import nodes
from navstack.params.registry.block import ParameterBlock
from navstack.params.registry.releases import lacks

T = TypeVar("T")


@dataclass(frozen=True)
class Nav2File:
    """A Nav2 parameter file, held against Nav2's schema.

    ``notices`` are the findings that a user should see, errors among them only if they were asked
    for; ``ignored`` names what is real Nav2 but has no effect here.
    """

    path: Path
    document: Document
    parameters: Parameters  # wildcards and other releases' names applied
    visits: Mapping[str, tuple[Visit, ...]]
    # node -> today's dotted name -> the one that the file has
    renames: Mapping[str, Mapping[str, str]]
    notices: tuple[Notice, ...]
    ignored: tuple[str, ...]
    names: tuple[Known, ...]  # that stand in the file and that Nav2 has
    release: str  # whose defaults are read
    release_defaults: tuple[str, ...]  # those that Jazzy does not have, left out in the file
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
        return value_of(self.parameters.get(node, {}), name, default)

    def sets(self, node: str) -> bool:
        """Whether any parameter of a node stands in the file."""
        return any(entry.line for entry in self.parameters.get(node, {}).values())

    def runs(self, node: str) -> bool:
        """Whether the robot has a node: the file sets it, or its release brings it up."""
        return self.sets(node) or not lacks(self.release, node)

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
            said = str(error).removeprefix(f"{node}: ")  # some parameters name their node
            raise ParameterError(f"{self.path.name}: {node}: {said}") from None

    def plugin(self, node: str, name: str, family: str) -> str:
        """The type of a plugin by the name of its section, as Nav2 Jazzy spells it.

        Raises:
            ParameterError: the type is missing, unknown, or not available here.
        """
        where = f"{self.path.name}: {node}: {name}"
        lists = nodes.NODES[node].plugins.values()
        defaults = (plugins.defaults.get(name) for plugins in lists if plugins.family == family)
        value = self.value(node, f"{name}.plugin", next(filter(None, defaults), None))
        if value is None:
            raise ParameterError(f"{where}.plugin is missing; give the plugin's type")
        kind = plugin_type(value)
        refusal = self.catalog.refusal(family, kind)
        if refusal:
            way_on = self.catalog.way_on(family, name, kind)
            raise ParameterError("; ".join(filter(None, (f"{where}: {refusal}", way_on))))
        return kind

    def merged(self) -> dict[str, Any]:
        """The file with every default that this program reads, nested as Nav2 wants it."""
        return merged(self.parameters, self.visits)

    def dump_merged(self) -> str:
        """The text of :meth:`merged`, itself a Nav2 parameter file."""
        return dump(self.merged())

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
        changed = parse_nav2(text, self.path, self.catalog, allow_unknown)
        for name, value in changes.items():
            read = changed.value(*name.split(".", 1))
            if read != value:
                raise ParameterError(
                    f"{self.path}: {name} cannot be set to {value!r}: in this file the value of "
                    f"{read!r} counts; give the parameter a line of its own, as Nav2 Jazzy has it"
                )
        return changed

    def dump(self, path: Path) -> None:
        """Write the file: as it was read, comments and order included, but for changed values."""
        path.write_text(self.document.text, encoding="utf-8")

    def _owner_of(self, node: str, dotted: str) -> tuple[str, ...]:
        """Where in the file a parameter stands, or should; see :func:`owner_of`."""
        entry = self.parameters[node].get(dotted)
        known = {name.path for name in self.names}
        is_shared = any(
            other != node and entries.get(dotted) is entry and f"{other}: {dotted}" in known
            for other, entries in self.parameters.items()
        )
        return owner_of(self.document, node, dotted, is_shared)


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
    if len(errors) > 1:
        raise ParameterError(f"{path}: {errors[0]} (and {len(errors) - 1} more)")
    if errors:
        raise ParameterError(f"{path}: {errors[0]}")
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
    require_nodes(document, str(path))
    parameters: dict[str, dict[str, ParameterEntry]] = {}
    found: dict[str, Findings] = {}
    for node in nodes_to_check(document):
        block = node_block(node)
        if block is not None:
            parameters[node] = entries_of(document, node)
            found[node] = _check_node(node, block, parameters[node], catalog)
    names = tuple(name for findings in found.values() for name in findings.names if name.line)
    notices = _notices(path, document, parameters, found, allow_unknown)
    release = release_of(names)
    notices = without_own_names(notices, names, release)
    added = {
        node: other_defaults(release, entries, found[node].visits)
        for node, entries in parameters.items()
    }
    if lacks(release, VELOCITY_SMOOTHER) and not in_file(document, VELOCITY_SMOOTHER):
        added[VELOCITY_SMOOTHER] = no_smoother(parameters)
    for node, entries in added.items():
        parameters[node] |= entries
    ignored = [
        name
        for node, findings in found.items()
        if in_file(document, node)
        for name in findings.ignored
    ]
    return Nav2File(
        path=path,
        document=document,
        parameters=parameters,
        visits={node: tuple(findings.visits) for node, findings in found.items()},
        renames={
            node: {**{new: old for old, new in findings.renames.items()}, **findings.moved}
            for node, findings in found.items()
        },
        notices=notices,
        names=names,
        release=release,
        release_defaults=tuple(
            f"{node}: {name} {entry.value}"
            for node, entries in added.items()
            for name, entry in entries.items()
        ),
        ignored=tuple(dict.fromkeys(ignored)),
        catalog=catalog,
    )


def _check_node(
    node: str, block: ParameterBlock, entries: dict[str, ParameterEntry], catalog: Catalog
) -> Findings:
    """Check one node, and give its parameters today's names and forms."""
    given = set(entries)
    forms, newer = convert_older_forms(node, entries), convert_newer_forms(node, entries)
    findings = Checker(node, catalog).check_node(
        block, ParameterSection.of(entries), node_params(node)
    )
    findings.notices += [*forms, *newer.notices]
    findings.moved |= newer.moved
    converted = {f"{node}: {name}" for name in entries.keys() - given}
    findings.names = [name for name in findings.names if name.path not in converted]
    findings.apply_renames(entries)
    for visit in findings.visits:
        if visit.params is DwbParams:
            entries |= fallback_scales(entries, visit.prefix)
    return findings


def _notices(
    path: Path,
    document: Document,
    parameters: Parameters,
    found: Mapping[str, Findings],
    allow_unknown: bool,
) -> tuple[Notice, ...]:
    """What a user should see: errors first, then in the order of the file."""
    notices = [
        *(Notice(kind, "", text, line=line) for kind, line, text in document.remarks),
        *node_notices(document),
        *joined_notices(document, found),
        *tree_notices(parameters),
        *filter_notices(parameters, path.parent),
        *footprint_notices(parameters),
        *monitor_notices(parameters),
        *source_notices(parameters),
        *data_type_notices(parameters),
    ]
    if in_file(document, MONITOR):
        notices += missing_of_monitor(parameters[MONITOR])
    for node, entries in parameters.items():
        notices += value_notices(node, entries, found[node].visits)
        notices += missing_critics(node, entries, found[node].visits)
    notices.sort(key=lambda notice: (not notice.is_error, notice.line))
    if allow_unknown:
        notices = [
            replace(notice, is_error=notice.is_error and notice.id == "bad-value")
            for notice in notices
        ]
    shown = [
        each for each in notices if each.id != "bad-value" or not is_told(each.message, notices)
    ]
    return tuple(dict.fromkeys(shown))
