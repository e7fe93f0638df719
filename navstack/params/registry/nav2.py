"""What Nav2 declares, joined with what this program reads of it."""

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from navstack.params.registry import releases
from navstack.params.registry.bindings import CRITICS, nested_params, parameters
from navstack.params.registry.block import ParameterBlock, PluginList
from navstack.params.registry.entry import AlgorithmEntry, Family, Params
from navstack.params.registry.releases import Declared

NAV2 = tomllib.loads(Path(__file__).with_name("nav2.toml").read_text(encoding="utf-8"))
# parameter that gives a plugin's type, if not "plugin"
_SELECTORS = {"dwb_critics": "class", "mppi_critics": ""}
EACH = "*"  # of a dotted name: what a list names

Names = Mapping[str, Declared]  # by dotted name


def family(name: str, here: Mapping[str, AlgorithmEntry]) -> Family:
    """A family of algorithms: those that Nav2 declares, then this program's own.

    Args:
        name: of the family.
        here: those that run here, without what Nav2 declares.
    """
    if name in CRITICS:
        read = nested_params(CRITICS[name])
    else:
        read = {kind: entry.params for kind, entry in here.items() if entry.params is not None}
    tables = NAV2["families"][name]
    of_nav2 = releases.plugins_of(name, NAV2["names"]["renamed_packages"])
    selectors = _SELECTORS.get(name, "plugin").split()
    found = {}
    for kind in dict.fromkeys((*of_nav2, *tables, *here)):
        having, declared = of_nav2.get(kind, ((), {}))
        block = block_of(tables.get(kind, {}), declared, read.get(kind))
        if not block.is_open:
            block = replace(block, keys={**block.keys, **dict.fromkeys(selectors, Declared())})
        found[kind] = replace(here.get(kind, AlgorithmEntry()), keys=block, releases=having)
    return found


def node_blocks(read: Mapping[str, Params]) -> dict[str, ParameterBlock]:
    """The blocks of Nav2's nodes by name; ``read`` are the dataclasses that read them."""
    tables = NAV2["nodes"]
    names = dict.fromkeys((*tables, *sorted(releases.node_names() - {"costmap"})))
    found = {}
    for name in names:
        table = tables.get(name, {})
        declared = releases.of_node(table.get("as_in", name))
        found[name] = block_of(table, declared, read.get(name))
    return found


def block_of(
    table: Mapping[str, Any], declared: Names, params: Params | None = None
) -> ParameterBlock:
    """The block of a namespace, with the parameters of the dataclass that reads it."""
    keys: dict[str, Declared] = {}
    nested: Mapping[str, Params] = {}
    if params is not None and not table.get("declared_only"):
        nested = nested_params(params)
        keys = dict.fromkeys(parameters(params), Declared())
    keys |= dict.fromkeys(table.get("keys", "").split(), Declared())
    for name, default in table.get("defaults", {}).items():
        keys[name] = releases.declared(default)
    below: dict[str, dict[str, Declared]] = {}
    for dotted, each in declared.items():
        name, _, rest = dotted.partition(".")
        if rest:
            below.setdefault(name, {})[rest] = each
        else:
            keys[name] = each
    named, fixed = table.get("named", {}), table.get("groups", {})
    lists, groups = {}, {}
    for name in {**below, **named, **fixed}:
        names = below.get(name, {})
        of_each = {key.removeprefix(f"{EACH}."): each for key, each in names.items()}
        if name in named or of_each.keys() != names.keys():
            lists[name] = block_of(named.get(name, {}), of_each, nested.get(name))
        else:
            groups[name] = block_of(fixed.get(name, {}), names, nested.get(name))
    return ParameterBlock(
        keys=keys,
        groups=groups,
        named=lists,
        plugins={name: PluginList(**each) for name, each in table.get("plugins", {}).items()},
        renamed=table.get("renamed", {}),
        delegates=table.get("delegates", {}),
        is_open=table.get("is_open", False),
        is_shared=table.get("is_shared", False),
    )
