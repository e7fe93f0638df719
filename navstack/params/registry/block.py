"""What one namespace of parameters may hold."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from navstack.params.registry.releases import Declared


@dataclass(frozen=True)
class PluginList:
    """A parameter that names sub-namespaces, each holding one plugin."""

    family: str  # key of FAMILIES
    # Nav2's names and types where the list is absent
    defaults: Mapping[str, str] = field(default_factory=dict)
    selector: str = "plugin"  # parameter of the sub-namespace that gives the type
    name_is_type: bool = False  # without the selector, the name itself is the type (critics)


@dataclass(frozen=True)
class ParameterBlock:
    """The parameters that Nav2 declares in one namespace, of any release from Foxy to main."""

    keys: Mapping[str, Declared] = field(default_factory=dict)
    groups: Mapping[str, "ParameterBlock"] = field(
        default_factory=dict
    )  # sub-namespaces of fixed name
    # list parameter -> what it names
    plugins: Mapping[str, PluginList] = field(default_factory=dict)
    # list parameter -> block of each named sub-namespace
    named: Mapping[str, "ParameterBlock"] = field(default_factory=dict)
    # name of other releases -> the one that this program reads, same meaning
    renamed: Mapping[str, str] = field(default_factory=dict)
    # parameter naming a plugin that shares this namespace
    delegates: Mapping[str, str] = field(default_factory=dict)
    is_open: bool = False  # any parameter is accepted
    # names that are not known belong to what users add, unless they all but spell a known one
    is_shared: bool = False

    @property
    def structure_keys(self) -> frozenset[str]:
        """The parameters that name something else: plugins, sections, today's names."""
        return frozenset().union(self.plugins, self.named, self.renamed, self.delegates)

    @property
    def own_keys(self) -> frozenset[str]:
        """Every parameter directly in this namespace."""
        return self.structure_keys.union(self.keys)


OPEN = ParameterBlock(is_open=True)
