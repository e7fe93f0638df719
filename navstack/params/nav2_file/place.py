"""A namespace of a parameter file, with what Nav2 and this program know of it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields

from navstack.params.nav2_file.catalog import Catalog, nearly_equal, plugin_type
from navstack.params.nav2_file.findings import ParameterSection, names_in, value_of
from navstack.params.nav2_file.ros_yaml import Value
from navstack.params.registry.bindings import NO_EFFECT, ONLY_WITHOUT, field_names, nested_params
from navstack.params.registry.block import ParameterBlock, PluginList
from navstack.params.registry.entry import Params
from navstack.params.registry.releases import Declared

# lists of names beside those called *_plugins; others may be texts, as in layers
ARRAYS = ("plugins", "filters", "navigators", "polygons", "velocity_polygons")


@dataclass(frozen=True, slots=True)
class Namespace:
    """A namespace, what Nav2 declares there, and the dataclasses that read it.

    Without a dataclass all of it is ignored.
    """

    block: ParameterBlock
    section: ParameterSection
    prefix: str
    params: tuple[Params, ...]

    @property
    def used_keys(self) -> frozenset[str]:
        """The parameters that have an effect here."""
        keys = {*self.block.structure_keys, "plugin", "class"}
        for params in self.params:
            keys |= field_names(params) - self._idle(params)
        return frozenset(keys)

    def _idle(self, params: Params) -> frozenset[str]:
        """Fields without effect, at all or because the file gives what they stand in for."""
        idle = NO_EFFECT.get(params, frozenset())
        for key, names in ONLY_WITHOUT.get(params, {}).items():
            if key in self.section.values:
                idle |= names
        return idle

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
        for name in (key, *others):
            if name in self.section.values:
                return names_in(self.section.values[name].value)
        if self.params and key in self.block.plugins:
            return tuple(self.block.plugins[key].defaults)
        return ()

    def lists_defaults(self, key: str) -> bool:
        """Whether a list names what Nav2 lists itself, to which alone it gives types."""
        return self.listed_names(key) == tuple(self.block.plugins[key].defaults)

    @property
    def all_listed(self) -> set[str]:
        """The names in all of its lists, each of which wants a section."""
        return self._names((*self.block.plugins, *self.block.named))

    def list_misfit(self, key: str, declared: Declared, value: Value) -> str:
        """What the names of sections should be, a list or a text; empty: they are as Nav2 wants."""
        if key not in self.block.plugins and key not in self.block.named:
            return ""
        is_text = declared.kinds == {"string"}
        if is_text and isinstance(value, list):
            return "a text (of several names, with blanks between)"
        if isinstance(value, str) and (key.endswith("_plugins") or key in ARRAYS):
            return "a list"
        return ""

    def line_of(self, key: str) -> int:
        """The line of a parameter; 0: the file leaves it out."""
        if key in self.section.values:
            return self.section.values[key].line
        return 0

    def misspells(self, name: str) -> list[str]:
        """The names that a list gives, that have no section, and that ``name`` all but spells."""
        # a critic needs no section
        lists = [key for key, each in self.block.plugins.items() if not each.name_is_type]
        listed = self._names((*lists, *self.block.named))
        return nearly_equal(name, listed - self.section.sections.keys())

    def _names(self, lists: Iterable[str]) -> set[str]:
        return {name for key in lists for name in self.listed_names(key)}


def type_of(
    catalog: Catalog, plugins: PluginList, name: str, child: ParameterSection
) -> str | None:
    """The type of a plugin: as given, Nav2's default for its name, or None."""
    if plugins.name_is_type:
        critic = value_of(child.values, plugins.selector, name)
        return catalog.critic_type(plugins.family, critic)
    if plugins.selector in child.values:
        return plugin_type(child.values[plugins.selector].value)
    return plugins.defaults.get(name)


def joined(block: ParameterBlock, other: ParameterBlock) -> ParameterBlock:
    """A block with the parameters of both."""
    names = [each.name for each in fields(ParameterBlock)]
    return ParameterBlock(*(getattr(block, name) | getattr(other, name) for name in names))
