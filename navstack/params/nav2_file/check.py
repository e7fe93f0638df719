"""Holds the parameters of one node against Nav2's schema."""

from dataclasses import replace

from navstack.params.nav2_file.catalog import Catalog, nearly_equal, plugin_type
from navstack.params.nav2_file.findings import (
    MISSPELT,
    RENAMED,
    UNKNOWN_KEY,
    Findings,
    Known,
    Notice,
    ParameterSection,
    Visit,
    value_of,
)
from navstack.params.nav2_file.hints import unknown_name
from navstack.params.nav2_file.place import Namespace, joined, type_of
from navstack.params.nav2_file.release import releases_of_plugin, releases_of_value
from navstack.params.nav2_file.ros_yaml import ParameterEntry, is_placeholder
from navstack.params.nav2_file.values import form_notices
from navstack.params.registry.block import OPEN, ParameterBlock, PluginList
from navstack.params.registry.entry import Params
from navstack.params.registry.localizers import OWN_NODE
from navstack.params.registry.nodes import COMMON
from navstack.params.registry.releases import Declared, span

EXAMPLES = {"primary_controller": "dwb_core::DWBLocalPlanner"}  # of what a delegate may be


class Checker:
    """Walks the namespaces of one node."""

    def __init__(self, node: str, catalog: Catalog) -> None:
        self._node = node
        self._catalog = catalog
        self.findings = Findings()

    def check_node(
        self, block: ParameterBlock, root: ParameterSection, params: Params | None
    ) -> Findings:
        """Check a whole node; ``params`` is what this program reads of it."""
        if params is None and self._node != OWN_NODE:
            self.findings.ignored.append(self._node)
        self._check(joined(block, COMMON), root, "", params)
        return self.findings

    def _check(
        self,
        block: ParameterBlock,
        section: ParameterSection,
        prefix: str,
        params: Params | None,
        plugin: str = "",
    ) -> None:
        """Check a namespace, of a type of plugin or another one, and those in it."""
        read_by = () if params is None else (params,)
        place = self._with_delegates(Namespace(block, section, prefix, read_by))
        self._note_renames(place)
        for params in place.params:
            self.findings.visits.append(Visit(place.prefix, params, plugin))
        if place.block.is_open:
            return
        used_keys = place.used_keys
        for key, entry in place.section.values.items():
            declared = place.block.keys.get(key) or COMMON.keys.get(key, Declared())
            self._meet(f"{prefix}{key}", entry.line, releases_of_value(key, declared, entry))
            if key in COMMON.keys:
                self.findings.ignored.append(key)
            elif key not in place.block.own_keys:
                self._unknown_value(place, key, entry)
                continue
            elif place.params and key not in used_keys:
                self._ignore(f"{prefix}{key}")
            path = f"{prefix}{key}"
            self.findings.notices += form_notices(declared, f"{self._node}: {path}", entry)
            expected = place.list_misfit(key, declared, entry.value)
            if not expected and key not in used_keys:
                expected = declared.misfit(entry.value)
            if expected and not is_placeholder(entry.value):
                self._error("bad-value", path, f"{entry.value!r} is not {expected}", entry.line)
        self._check_sections(place)

    def _check_sections(self, place: Namespace) -> None:
        for key, plugins in place.block.plugins.items():
            for name in place.listed_names(key):
                self._check_plugin(place, key, plugins, name)
        for key, inner in place.block.named.items():
            for name in place.listed_names(key):
                self._check_named(place, key, inner, name)
        for name, child in place.section.sections.items():
            if name in place.block.delegates:
                self._check_delegate(place, name, child)
            elif name not in place.all_listed:
                self._check_unlisted(place, name, child)

    def _check_plugin(self, place: Namespace, key: str, plugins: PluginList, name: str) -> None:
        """A sub-namespace that a list such as controller_plugins names."""
        where = f"{place.prefix}{name}"
        child = place.section.sections.get(name, ParameterSection())
        kind = type_of(self._catalog, plugins, name, child)
        if kind is None:
            if name not in place.section.values:  # else reported as a value in a section's place
                message = f"'{key}' names it, but its '{plugins.selector}' is missing"
                self._error("missing-plugin", where, message, child.first_line())
            return
        known = self._catalog.families[plugins.family]
        if kind not in known:
            # a critic, without which its controller cannot run
            is_ours = plugins.name_is_type and bool(place.params)
            line = child.first_line() or place.line_of(key)
            self._unknown_plugin(plugins.family, kind, where, line, is_ours)
            return
        line = child.first_line() or place.line_of(key)
        given = str(value_of(child.values, plugins.selector, ""))
        self._meet(
            f"{where} ({given or kind})",
            line,
            releases_of_plugin(plugins.family, given, known[kind]),
        )
        is_default = key not in place.section.values or place.lists_defaults(key)
        if not (is_default or plugins.name_is_type or plugins.selector in child.values):
            message = f"its '{plugins.selector}' is missing, and '{key}' is not Nav2's own list"
            self._warn("missing-plugin", where, f"{message}: Nav2 does not start", line)
        params = self._params_of(place, plugins, kind)
        if place.params and params is None and name in place.section.sections:
            self._note_unread(plugins, kind, where, child)
        if params is not None and known[kind].note:
            self._warn("substitute", where, f"{kind} {known[kind].note}", child.first_line())
        plugin = "" if plugins.name_is_type else kind
        self._check(known[kind].keys, child, f"{where}.", params, plugin)

    def _params_of(self, place: Namespace, plugins: PluginList, kind: str) -> Params | None:
        """The dataclass of a plugin: from the table, of a critic from the parent's fields."""
        if not place.params:
            return None
        if plugins.name_is_type and kind in place.nested_params:
            return place.nested_params[kind]
        return self._catalog.available[plugins.family].get(kind)

    def _note_unread(
        self, plugins: PluginList, kind: str, where: str, child: ParameterSection
    ) -> None:
        """A plugin that does not run here, or that runs without parameters of its own."""
        if self._catalog.is_available(plugins.family, kind):
            known = self._catalog.families[plugins.family][kind].keys.own_keys - {plugins.selector}
            for key in child.values:
                if key in known:
                    self._ignore(f"{where}.{key}")
        elif self._catalog.available[plugins.family]:
            refusal = self._catalog.refusal(plugins.family, kind)
            self._warn("unavailable-plugin", where, refusal, child.first_line())
        else:
            self._ignore(f"{where} ({kind})")

    def _check_named(self, place: Namespace, key: str, inner: ParameterBlock, name: str) -> None:
        """A sub-namespace that a list such as observation_sources names."""
        child = place.section.sections.get(name, ParameterSection())
        self._check(inner, child, f"{place.prefix}{name}.", place.nested_params.get(key))

    def _check_unlisted(self, place: Namespace, name: str, child: ParameterSection) -> None:
        """A sub-namespace that no list names.

        Of fixed name, left over from another setup, or unknown.
        """
        path = f"{place.prefix}{name}"
        if name in place.block.groups:
            params = place.nested_params.get(name)
            if place.params and params is None:
                self._ignore(path)
            self._check(place.block.groups[name], child, f"{path}.", params)
            return
        if name in place.block.own_keys:
            reason = "is a section of keys here, where Nav2 reads one value; its default is taken"
            self._error(UNKNOWN_KEY, path, reason, child.first_line())
            return
        left_over = self._left_over(place, name, child)
        if left_over is None or place.misspells(name):
            self._unknown(place, name, child.first_line())
            return
        if place.params:
            self._ignore(f"{path} (no list names it)")
        self._check(left_over, child, f"{path}.", None)

    def _left_over(
        self, place: Namespace, name: str, child: ParameterSection
    ) -> ParameterBlock | None:
        """The block of a section that Nav2 itself leaves unread because no list names it."""
        for plugins in place.block.plugins.values():
            known = self._catalog.families[plugins.family]
            kind = type_of(self._catalog, plugins, name, child)
            if kind is not None and kind in known:
                return known[kind].keys
        for inner in place.block.named.values():
            if child.values and child.values.keys() <= inner.own_keys:
                return inner
        return None

    def _with_delegates(self, place: Namespace) -> Namespace:
        """Join the plugin that shares this namespace, such as RotationShim's primary controller."""
        for key, family in place.block.delegates.items():
            entry = place.section.values.get(key)
            if entry is None:
                self._require_delegate(place, key)
                continue
            block, params = self._delegate(place, family, f"{place.prefix}{key}", entry)
            if block.is_open:  # its own lists, such as MPPI's critics, share the namespace
                return replace(place, block=block)
            place = replace(place, block=joined(place.block, block))
            if params is not None:
                place = replace(place, params=(*place.params, params))
        return place

    def _delegate(
        self, place: Namespace, family: str, where: str, entry: ParameterEntry
    ) -> tuple[ParameterBlock, Params | None]:
        """Block and dataclass of the delegate that an entry names; open where there is none."""
        kind = plugin_type(entry.value)
        known = self._catalog.families[family]
        if kind not in known:
            self._unknown_plugin(family, kind, where, entry.line, False)
            return OPEN, None
        if not place.params:
            return known[kind].keys, None
        if not self._catalog.is_available(family, kind):
            refusal = self._catalog.refusal(family, kind)
            self._warn("unavailable-plugin", where, refusal, entry.line)
            return OPEN, None
        return known[kind].keys, self._catalog.available[family][kind]

    def _require_delegate(self, place: Namespace, key: str) -> None:
        section = place.section.sections.get(key)
        if place.params and (section is None or "plugin" not in section.values):
            message = f"is missing; name the plugin that does the work, e.g. {EXAMPLES[key]}"
            line = place.section.first_line()
            self._error("missing-plugin", f"{place.prefix}{key}", message, line)

    def _check_delegate(self, place: Namespace, key: str, child: ParameterSection) -> None:
        """A delegate in a namespace of its own, as Nav2 main has it."""
        if "plugin" not in child.values:
            return  # reported as missing
        prefix, family = f"{place.prefix}{key}.", place.block.delegates[key]
        block, params = self._delegate(place, family, f"{prefix}plugin", child.values["plugin"])
        self._check(block, child, prefix, params)

    def _note_renames(self, place: Namespace) -> None:
        """Parameters under the name of another release.

        Where today's name is given, too, the other has no effect.
        """
        for other, name in place.block.renamed.items():
            path, values = f"{place.prefix}{other}", place.section.values
            if other in values and name in values:
                self._ignore(f"{path} ({name} is given)")
            elif other in values:
                self.findings.renames[path] = f"{place.prefix}{name}"
                known = place.block.keys.get(other, Declared()).releases
                when = f" ({span(known)})" if known else ""
                message = f"is another name{when}; read as '{name}'"
                self._warn(RENAMED, path, message, values[other].line)

    def _unknown_value(self, place: Namespace, key: str, entry: ParameterEntry) -> None:
        """A key that Nav2 does not have here, or the name of a section with a value of its own."""
        path, critics = f"{place.prefix}{key}", self._critics(place)
        if key in place.block.groups and key not in critics:
            reason = f"has no effect: Nav2 reads parameters below '{key}:' and ignores this"
            self._error(UNKNOWN_KEY, path, f"{entry.value!r} {reason}", entry.line)
        elif key in critics or key in place.all_listed:
            reason = f"is not a section of keys; write its parameters below '{key}:', one a line"
            self._error("bad-value", path, f"{entry.value!r} {reason}", entry.line)
        else:
            self._unknown(place, key, entry.line)

    def _unknown(self, place: Namespace, name: str, line: int) -> None:
        path, sibling = f"{place.prefix}{name}", self._sibling_with(place, name)
        if sibling:
            self._ignore(f"{path} (of {sibling})")
            return
        known = place.block.own_keys.union(place.block.groups, self._critics(place), COMMON.keys)
        misspelt = place.misspells(name)
        message = unknown_name(self._catalog, name, misspelt, known, place.block.own_keys)
        is_misspelt = misspelt or nearly_equal(name, known)
        if place.block.is_shared and not is_misspelt:
            self.findings.added.append(path)
            self._ignore(path)
            return
        self._error(MISSPELT if is_misspelt else UNKNOWN_KEY, path, message, line)

    def _unknown_plugin(
        self, family: str, kind: str, where: str, line: int, is_error: bool
    ) -> None:
        """A misspelt type is an error.

        One of another package is refused only where the file needs it.
        """
        is_error = is_error or bool(nearly_equal(kind, self._catalog.families[family]))
        refusal = self._catalog.refusal(family, kind)
        advice = self._catalog.way_on(family, where.rpartition(".")[2], kind)
        path = f"{self._node}: {where}"
        self.findings.notices.append(
            Notice("unknown-plugin", path, refusal, advice, line, is_error)
        )

    def _critics(self, place: Namespace) -> set[str]:
        """Names of the sub-namespaces whose name alone gives their type."""
        critics: set[str] = set()
        for plugins in place.block.plugins.values():
            if plugins.name_is_type:
                critics |= self._catalog.families[plugins.family].keys()
        return critics

    def _sibling_with(self, place: Namespace, name: str) -> str:
        """Another plugin of the same family with this parameter, which the file had before."""
        kind = plugin_type(value_of(place.section.values, "plugin", ""))
        types = next((types for types in self._catalog.families.values() if kind in types), {})
        for other, entry in types.items():
            if name in entry.keys.own_keys or name in entry.keys.groups:
                return other
        return ""

    def _meet(self, path: str, line: int, releases: tuple[str, ...]) -> None:
        if releases:
            self.findings.names.append(Known(f"{self._node}: {path}", line, releases))

    def _ignore(self, path: str) -> None:
        self.findings.ignored.append(f"{self._node}: {path}")

    def _error(self, kind: str, path: str, message: str, line: int) -> None:
        self._notice(kind, path, message, line, is_error=True)

    def _warn(self, kind: str, path: str, message: str, line: int) -> None:
        self._notice(kind, path, message, line, is_error=False)

    def _notice(self, kind: str, path: str, message: str, line: int, is_error: bool) -> None:
        notice = Notice(kind, f"{self._node}: {path}", message, line=line, is_error=is_error)
        self.findings.notices.append(notice)
