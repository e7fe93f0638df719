"""Holds the parameters of one node against Nav2's schema."""

from dataclasses import replace

from navstack.params.nav2_file.catalog import Catalog, plugin_type
from navstack.params.nav2_file.findings import (
    MISSPELT,
    UNKNOWN_KEY,
    Findings,
    Notice,
    Section,
    Visit,
)
from navstack.params.nav2_file.hints import nearly_equal, unknown_name
from navstack.params.nav2_file.place import Place, joined, type_of
from navstack.params.nav2_file.ros_yaml import Entry, is_placeholder
from navstack.params.nav2_file.values import form_notices
from navstack.params.registry.block import OPEN, Block, PluginList
from navstack.params.registry.entry import Params
from navstack.params.registry.kinds import wrong_kind
from navstack.params.registry.localizers import OWN_NODE
from navstack.params.registry.nodes import COMMON

EXAMPLES = {"primary_controller": "dwb_core::DWBLocalPlanner"}  # of what a delegate may be


class Checker:
    """Walks the namespaces of one node."""

    def __init__(self, node: str, catalog: Catalog) -> None:
        self._node = node
        self._catalog = catalog
        self.findings = Findings()

    def check_node(self, block: Block, root: Section, params: Params | None) -> Findings:
        """Check a whole node; ``params`` is what this program reads of it."""
        if params is None and self._node != OWN_NODE:
            self.findings.ignored.append(self._node)
        self._check(Place(joined(block, COMMON), root, "", () if params is None else (params,)))
        return self.findings

    def _check(self, place: Place, plugin: str = "") -> None:
        place = self._with_delegates(place)
        self._note_renames(place)
        for params in place.params:
            self.findings.visits.append(Visit(place.prefix, params, plugin))
        if place.block.is_open:
            return
        for key, entry in place.section.values.items():
            if key in COMMON.keys:
                self.findings.ignored.append(key)
            elif key not in place.block.own_keys:
                self._unknown_value(place, key, entry)
                continue
            elif place.params and key not in place.used_keys:
                self.findings.ignored.append(f"{self._node}: {place.prefix}{key}")
            if key in place.used_keys:
                continue
            self.findings.notices += form_notices(key, f"{self._node}: {place.prefix}{key}", entry)
            expected = wrong_kind(key, entry.value)
            if expected and not is_placeholder(entry.value):
                self._error(
                    "bad-value",
                    f"{place.prefix}{key}",
                    f"{entry.value!r} is not {expected}",
                    entry.line,
                )
        self._check_sections(place)

    def _check_sections(self, place: Place) -> None:
        listed = set()
        for key, plugins in place.block.plugins.items():
            for name in place.listed_names(key):
                listed.add(name)
                self._check_plugin(place, key, plugins, name)
        for key, inner in place.block.named.items():
            for name in place.listed_names(key):
                listed.add(name)
                self._check_named(place, key, inner, name)
        for name, child in place.section.sections.items():
            if name in place.block.delegates:
                self._check_delegate(place, name, child)
            elif name not in listed:
                self._check_unlisted(place, name, child)

    def _check_plugin(self, place: Place, key: str, plugins: PluginList, name: str) -> None:
        """A sub-namespace that a list such as controller_plugins names."""
        where = f"{place.prefix}{name}"
        child = place.section.sections.get(name, Section())
        kind = type_of(self._catalog, plugins, name, child)
        if kind is None:
            if name not in place.section.values:  # else told as a value where a section belongs
                message = f"'{key}' names it, but its '{plugins.selector}' is missing"
                self._error("missing-plugin", where, message, child.first_line())
            return
        known = self._catalog.families.get(plugins.family, {})
        if kind not in known:
            # a critic, without which its controller cannot run
            is_ours = plugins.name_is_type and bool(place.params)
            line = child.first_line() or place.line_of(key)
            self._unknown_plugin(plugins.family, kind, where, line, is_ours)
            return
        params = self._params_of(place, plugins, kind, name)
        if place.params and params is None and name in place.section.sections:
            self._note_unread(plugins, kind, where, child)
        if params is not None and known[kind].note:
            self._warn("substitute", where, f"{kind} {known[kind].note}", child.first_line())
        inner = Place(known[kind].keys, child, f"{where}.", () if params is None else (params,))
        self._check(inner, "" if plugins.name_is_type else kind)

    def _params_of(self, place: Place, plugins: PluginList, kind: str, name: str) -> Params | None:
        """The dataclass of a plugin: from the table, or for a critic the parent's field of that name."""
        if plugins.name_is_type and kind in place.nested_params:
            return place.nested_params[kind]
        return self._catalog.available.get(plugins.family, {}).get(kind) if place.params else None

    def _note_unread(self, plugins: PluginList, kind: str, where: str, child: Section) -> None:
        """A plugin that does not run here, or that runs without parameters of its own."""
        if self._catalog.is_available(plugins.family, kind):
            known = self._catalog.families[plugins.family][kind].keys.own_keys - {plugins.selector}
            self.findings.ignored += [
                f"{self._node}: {where}.{key}" for key in child.values if key in known
            ]
        elif plugins.family in self._catalog.available:
            self._warn(
                "unavailable-plugin",
                where,
                self._catalog.refusal(plugins.family, kind),
                child.first_line(),
            )
        else:
            self.findings.ignored.append(f"{self._node}: {where} ({kind})")

    def _check_named(self, place: Place, key: str, inner: Block, name: str) -> None:
        """A sub-namespace that a list such as observation_sources names."""
        child = place.section.sections.get(name, Section())
        params = place.nested_params.get(key)
        self._check(
            Place(inner, child, f"{place.prefix}{name}.", () if params is None else (params,))
        )

    def _check_unlisted(self, place: Place, name: str, child: Section) -> None:
        """A sub-namespace that no list names.

        Of fixed name, left over from another setup, or unknown.
        """
        prefix = f"{place.prefix}{name}."
        if name in place.block.groups:
            params = place.nested_params.get(name)
            if place.params and params is None:
                self.findings.ignored.append(f"{self._node}: {place.prefix}{name}")
            self._check(
                Place(place.block.groups[name], child, prefix, () if params is None else (params,))
            )
            return
        left_over = self._left_over(place, name, child)
        if left_over is None or place.misspells(name):
            self._unknown(place, name, child.first_line())
            return
        if place.params:
            self.findings.ignored.append(f"{self._node}: {place.prefix}{name} (no list names it)")
        self._check(Place(left_over, child, prefix, ()))

    def _left_over(self, place: Place, name: str, child: Section) -> Block | None:
        """The block of a section that Nav2 itself leaves unread because no list names it."""
        for plugins in place.block.plugins.values():
            known = self._catalog.families.get(plugins.family, {})
            kind = type_of(self._catalog, plugins, name, child)
            if kind is not None and kind in known:
                return known[kind].keys
        for inner in place.block.named.values():
            if child.values and child.values.keys() <= inner.own_keys:
                return inner
        return None

    def _with_delegates(self, place: Place) -> Place:
        """Join the plugin that shares this namespace, such as RotationShim's primary controller."""
        for key, family in place.block.delegates.items():
            entry = place.section.values.get(key)
            if entry is None:
                self._require_delegate(place, key)
                continue
            where = f"{place.prefix}{key}"
            block, params = self._delegate(
                place, family, where, plugin_type(entry.value), entry.line
            )
            if block.is_open:  # its own lists, such as MPPI's critics, share the namespace
                return replace(place, block=block)
            place = replace(
                place, block=joined(place.block, block), params=(*place.params, *params)
            )
        return place

    def _delegate(
        self, place: Place, family: str, where: str, kind: str, line: int
    ) -> tuple[Block, tuple[Params, ...]]:
        """Block and dataclass of a delegate; the block is open where they are not to be had."""
        known = self._catalog.families.get(family, {})
        if kind not in known:
            self._unknown_plugin(family, kind, where, line, False)
            return OPEN, ()
        params = self._catalog.available.get(family, {}).get(kind)
        if place.params and params is None:
            self._warn("unavailable-plugin", where, self._catalog.refusal(family, kind), line)
            return OPEN, ()
        return known[kind].keys, (params,) if place.params and params is not None else ()

    def _require_delegate(self, place: Place, key: str) -> None:
        section = place.section.sections.get(key)
        if place.params and (section is None or "plugin" not in section.values):
            message = f"is missing; name the plugin that does the work, e.g. {EXAMPLES[key]}"
            self._error(
                "missing-plugin", f"{place.prefix}{key}", message, place.section.first_line()
            )

    def _check_delegate(self, place: Place, key: str, child: Section) -> None:
        """A delegate in a namespace of its own, as Nav2 main has it."""
        entry, prefix = child.values.get("plugin"), f"{place.prefix}{key}."
        if entry is None:
            return  # reported as missing
        kind = plugin_type(entry.value)
        block, params = self._delegate(
            place, place.block.delegates[key], f"{prefix}plugin", kind, entry.line
        )
        self._check(Place(block, child, prefix, params))

    def _note_renames(self, place: Place) -> None:
        """Parameters under the name of another release.

        Where today's name is given, too, the other has no effect.
        """
        names = [(*pair, "is an older name") for pair in place.block.renamed.items()]
        names += [(*pair, "is a name of Nav2 Rolling") for pair in place.block.newer.items()]
        for other, name, what in names:
            entry = place.section.values.get(other)
            if entry is not None and name in place.section.values:
                self.findings.ignored.append(
                    f"{self._node}: {place.prefix}{other} ({name} is given)"
                )
            elif entry is not None:
                self.findings.renames[f"{place.prefix}{other}"] = f"{place.prefix}{name}"
                self._warn(
                    "renamed", f"{place.prefix}{other}", f"{what}; read as '{name}'", entry.line
                )

    def _unknown_value(self, place: Place, key: str, entry: Entry) -> None:
        """A key that Nav2 does not have here, or the name of a section with a value of its own."""
        if key in place.block.groups and key not in self._critics(place):
            message = f"{entry.value!r} has no effect: Nav2 reads parameters below '{key}:' and ignores this"
            self._error(UNKNOWN_KEY, f"{place.prefix}{key}", message, entry.line)
        elif key in self._critics(place) or key in place.all_listed:
            message = f"{entry.value!r} is not a section of keys; write its parameters below '{key}:', one a line"
            self._error("bad-value", f"{place.prefix}{key}", message, entry.line)
        else:
            self._unknown(place, key, entry.line)

    def _unknown(self, place: Place, name: str, line: int) -> None:
        sibling = self._sibling_with(place, name)
        if sibling:
            self.findings.ignored.append(f"{self._node}: {place.prefix}{name} (of {sibling})")
            return
        known = place.block.own_keys | set(place.block.groups) | self._critics(place) | COMMON.keys
        misspelt = place.misspells(name)
        message = unknown_name(self._catalog, name, misspelt, known, place.block.own_keys)
        kind = MISSPELT if misspelt or nearly_equal(name, known) else UNKNOWN_KEY
        self._error(kind, f"{place.prefix}{name}", message, line)

    def _unknown_plugin(
        self, family: str, kind: str, where: str, line: int, is_error: bool
    ) -> None:
        """A misspelt type is an error.

        One of another package is refused only where the file needs it.
        """
        is_error = is_error or bool(nearly_equal(kind, self._catalog.families.get(family, {})))
        report = self._error if is_error else self._warn
        report("unknown-plugin", where, self._catalog.refusal(family, kind), line)

    def _critics(self, place: Place) -> set[str]:
        """Names of the sub-namespaces whose name alone gives their type."""
        families = [
            plugins.family for plugins in place.block.plugins.values() if plugins.name_is_type
        ]
        return {name for family in families for name in self._catalog.families[family]}

    def _sibling_with(self, place: Place, name: str) -> str:
        """Another plugin of the same family with this parameter, left over from an exchange of the plugin."""
        entry = place.section.values.get("plugin")
        kind = plugin_type(entry.value) if entry else ""
        types = next((types for types in self._catalog.families.values() if kind in types), {})
        blocks = {other: entry.keys for other, entry in types.items()}
        return next(
            (
                other
                for other, block in blocks.items()
                if name in block.own_keys | set(block.groups)
            ),
            "",
        )

    def _error(self, kind: str, path: str, message: str, line: int) -> None:
        self.findings.notices.append(
            Notice(kind, f"{self._node}: {path}", message, line=line, is_error=True)
        )

    def _warn(self, kind: str, path: str, message: str, line: int) -> None:
        self.findings.notices.append(Notice(kind, f"{self._node}: {path}", message, line=line))
