"""A namespace of a parameter file, with what Nav2 and this program know of it."""

from collections.abc import Mapping
from dataclasses import dataclass, fields

from navstack.params.nav2_file.catalog import Catalog, plugin_type
from navstack.params.nav2_file.findings import Section, names_in
from navstack.params.nav2_file.hints import nearly_equal
from navstack.params.registry.bindings import NO_EFFECT, ONLY_WITHOUT, field_names, nested_params
from navstack.params.registry.block import Block, PluginList
from navstack.params.registry.entry import Params


@dataclass(frozen=True, slots=True)
class Place:
    """A namespace, what Nav2 declares there, and the dataclasses that read it (none.

    All of it is ignored).
    """

    block: Block
    section: Section
    prefix: str
    params: tuple[Params, ...]

    @property
    def used_keys(self) -> frozenset[str]:
        """The parameters that have an effect here."""
        block = self.block
        structure = {
            *block.plugins,
            *block.named,
            *block.renamed,
            *block.newer,
            *block.delegates,
            "plugin",
            "class",
        }
        return frozenset(structure).union(
            *(field_names(params) - self._idle(params) for params in self.params)
        )

    def _idle(self, params: Params) -> frozenset[str]:
        """Fields that do nothing, at all or because the parameter is given that they stand in for."""
        replaced = [
            names
            for key, names in ONLY_WITHOUT.get(params, {}).items()
            if key in self.section.values
        ]
        return NO_EFFECT.get(params, frozenset()).union(*replaced)

    @property
    def nested_params(self) -> Mapping[str, Params]:
        """The dataclasses of its sub-namespaces, by field or list."""
        merged: dict[str, Params] = {}
        for params in self.params:
            merged |= nested_params(params)
        return merged

    def listed_names(self, key: str) -> tuple[str, ...]:
        """The names in a list parameter, or Nav2's default names where it is absent."""
        others = [other for other, name in self.block.renamed.items() if name == key]
        entries = [
            self.section.values[name] for name in (key, *others) if name in self.section.values
        ]
        if entries:
            return names_in(entries[0].value)
        plugins = self.block.plugins.get(key)
        return tuple(plugins.defaults) if plugins is not None and self.params else ()

    @property
    def all_listed(self) -> set[str]:
        """The names in all of its lists, each of which wants a section."""
        return {
            name
            for key in (*self.block.plugins, *self.block.named)
            for name in self.listed_names(key)
        }

    def line_of(self, key: str) -> int:
        """The line of a parameter; 0: the file leaves it out."""
        entry = self.section.values.get(key)
        return entry.line if entry is not None else 0

    def misspells(self, name: str) -> list[str]:
        """The names that a list gives, that have no section, and that ``name`` all but spells."""
        sections = self.section.sections
        missing = [
            each for key in self._lists() for each in self.listed_names(key) if each not in sections
        ]
        return nearly_equal(name, missing)

    def _lists(self) -> list[str]:
        """The list parameters whose names need a section; a critic needs none."""
        return [key for key, each in self.block.plugins.items() if not each.name_is_type] + [
            *self.block.named
        ]


def type_of(catalog: Catalog, plugins: PluginList, name: str, child: Section) -> str | None:
    """The type of a plugin: as given, Nav2's default for its name, or None."""
    entry = child.values.get(plugins.selector)
    if plugins.name_is_type:
        return catalog.critic_type(plugins.family, entry.value if entry else name)
    return plugin_type(entry.value) if entry else plugins.defaults.get(name)


def joined(block: Block, other: Block) -> Block:
    """A block with the parameters of both."""
    return Block(*(getattr(block, each.name) | getattr(other, each.name) for each in fields(Block)))
