"""Nav2's schema joined with what this program reads of it."""

import difflib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from navstack.params.extensions import algorithms
from navstack.params.registry import bindings, nodes
from navstack.params.registry.bindings import nested_params
from navstack.params.registry.block import OPEN, ParameterBlock
from navstack.params.registry.entry import AlgorithmEntry, Params

NEARLY_EQUAL = 0.85  # similarity from which a name is taken for a misspelt one

SUBSTITUTES = {  # family -> the plugin that does what is wanted of most of them
    "controllers": "dwb_core::DWBLocalPlanner",
    "planners": "nav2_navfn_planner::NavfnPlanner",
    "layers": "nav2_costmap_2d::ObstacleLayer",
    "goal_checkers": "nav2_controller::SimpleGoalChecker",
    "progress_checkers": "nav2_controller::SimpleProgressChecker",
}
LEFT_OUT = "none"  # in the place of a type: the plugin is taken from its list


@dataclass(frozen=True)
class Catalog:
    """Blocks by node and by plugin type, and the plugins that are available."""

    families: Mapping[str, Mapping[str, AlgorithmEntry]]  # of Nav2 and of this program, by type
    # those that run here, with their parameters; by family and type
    available: Mapping[str, Mapping[str, Params | None]]

    @staticmethod
    def build() -> "Catalog":
        """The catalog of this program's plugins and those of installed packages."""
        families, available = {}, {}
        for family, types in nodes.FAMILIES.items():
            known = {**types, **algorithms(family)}
            families[family] = known
            available[family] = {
                kind: entry.params
                for kind, entry in known.items()
                if _has_own_params(family, entry)
            }
        return Catalog(families, available)

    def is_available(self, family: str, plugin: str) -> bool:
        """Whether a plugin runs here."""
        return plugin in self.available[family]

    def critic_type(self, family: str, value: Any) -> str:
        """The name of a critic in the schema: ``dwb_critics::PathAlignCritic`` is ``PathAlign``.

        A critic of another package keeps its package, and so is unknown.
        """
        text = str(value).replace("/", "::")
        name = text.removeprefix(f"{family}::")
        known = self.families[family]
        short = name.removesuffix("Critic")
        if short in known and name not in known:
            return short
        return name

    def refusal(self, family: str, plugin: str) -> str:
        """Why a plugin type cannot be had, in one line without a subject's path.

        Empty if it can.
        """
        if self.is_available(family, plugin):
            return ""
        here = ", ".join(sorted(self._running(family))) or "none"
        if plugin in self.families[family]:
            return f"{plugin} is a Nav2 plugin that is not available here; available: {here}"
        hint = ""
        if meant := self.meant(family, plugin):
            hint = f"; did you mean '{meant}'?"
        return f"unknown plugin '{plugin}'{hint}; available: {here}"

    def meant(self, family: str, plugin: str) -> str:
        """The type that was probably meant; empty: there is none.

        Its successor, the same class in another package, or the type of the nearest spelling.
        """
        running = sorted(self._running(family))
        name = plugin.rpartition("::")[2]
        successor = nodes.SUCCESSORS.get(name, "")
        if successor in running:
            return successor
        similar = [kind for kind in running if kind.rpartition("::")[2] == name != kind]
        similar += nearly_equal(plugin, [*running, *self.families[family]])
        if similar:
            return similar[0]
        return ""

    def way_on(self, family: str, name: str, plugin: str) -> str:
        """How a file drives although a plugin of it does not; empty: it does not."""
        if family not in SUBSTITUTES:
            return ""
        other = self.meant(family, plugin) or SUBSTITUTES[family]
        text = f"drive with another one by --substitute {name}={other}"
        if family == "layers":
            text += f", or without it by --substitute {name}={LEFT_OUT}"
        return text

    def _running(self, family: str) -> Iterable[str]:
        """The types of a family that run here; of one that this program does not know, all."""
        known, available = self.families[family], self.available[family]
        if family in bindings.CRITICS:
            ours = known.keys() & nested_params(bindings.CRITICS[family]).keys()
            return ours | available.keys()
        return available or known


def nearly_equal(name: str, known: Iterable[str], similarity: float = NEARLY_EQUAL) -> list[str]:
    """The one name that ``name`` all but spells, or none."""
    return difflib.get_close_matches(name, list(known), n=1, cutoff=similarity)


def _has_own_params(family: str, entry: AlgorithmEntry) -> bool:
    """Whether an algorithm runs here.

    The parameters of this program's critics are fields of their controller's.
    """
    return entry.is_available and (entry.params is not None or family not in bindings.CRITICS)


def plugin_type(value: Any) -> str:
    """A plugin type as Nav2 Jazzy spells it: with ``::`` and today's package name."""
    package, separator, name = str(value).replace("/", "::").partition("::")
    return nodes.RENAMED_PACKAGES.get(package, package) + separator + name


def node_kind(name: str) -> str | None:
    """The node of Nav2 whose parameters a node has, by its name in the file.

    None: Nav2 has no such node.
    """
    if name in nodes.NODES:
        return name
    known = [target for begin, target in nodes.NODE_PREFIXES.items() if name.startswith(begin)]
    known += [target for end, target in nodes.NODE_SUFFIXES.items() if name.endswith(end)]
    return next(iter(known), None)


def node_block(name: str) -> ParameterBlock | None:
    """The block of a node by its name in the file; None for a node Nav2 does not have."""
    if name in nodes.FOREIGN_NODES:
        return OPEN
    kind = node_kind(name)
    if kind is None:
        return None
    return nodes.NODES.get(kind, ParameterBlock())


def node_params(name: str) -> Params | None:
    """The dataclass of what this program reads of a node; None: nothing."""
    return bindings.NODES.get(name) or bindings.FILTER_NODES.get(node_kind(name) or "")


def node_names() -> Iterable[str]:
    """The nodes a Nav2 file may hold."""
    return [*nodes.NODES, *nodes.NODE_ALIASES, *nodes.FOREIGN_NODES]
