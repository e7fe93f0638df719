"""The nodes that appear in a Nav2 parameter file, and the families of algorithms that it names."""

from collections.abc import Mapping

from navstack.params.registry import bindings, controllers, costmaps, planners, tasks
from navstack.params.registry.entry import Family
from navstack.params.registry.nav2 import NAV2, block_of, family, node_blocks

_HERE: Mapping[str, Family] = {  # those of which this program has some
    "controllers": controllers.CONTROLLERS,
    "dwb_critics": controllers.DWB_CRITICS,
    "mppi_critics": controllers.MPPI_CRITICS,
    "planners": planners.PLANNERS,
    "smoothers": planners.SMOOTHERS,
    "layers": costmaps.LAYERS,
    "goal_checkers": tasks.GOAL_CHECKERS,
    "progress_checkers": tasks.PROGRESS_CHECKERS,
    "behaviors": tasks.BEHAVIORS,
}
FAMILIES: Mapping[str, Family] = {
    name: _HERE.get(name) or family(name, {}) for name in NAV2["families"]
}

COMMON = block_of(NAV2["common"], {})  # parameters of every node
NODES = node_blocks({**bindings.NODES, **bindings.FILTER_NODES})
# of a costmap whose section names none
DEFAULT_LAYERS = NODES["local_costmap"].plugins["plugins"].defaults

_NAMES = NAV2["names"]
RENAMED_PACKAGES: Mapping[str, str] = _NAMES["renamed_packages"]
# class -> the type that does its work here
SUCCESSORS: Mapping[str, str] = _NAMES["successors"]
NODE_ALIASES: Mapping[str, str] = _NAMES["renamed_nodes"]
NODE_PREFIXES: Mapping[str, str] = _NAMES["prefixes"]
NODE_SUFFIXES: Mapping[str, str] = _NAMES["suffixes"]
FOREIGN_NODES = frozenset(_NAMES["foreign_nodes"].split())
