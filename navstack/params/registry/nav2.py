"""What Nav2 declares, as it stands in ``nav2.toml``, joined with what this program reads of it."""

import tomllib
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from navstack.params.registry.bindings import CRITICS, nested_params, parameters
from navstack.params.registry.block import ParameterBlock, PluginList, words
from navstack.params.registry.entry import AlgorithmEntry, Family, Params

NAV2 = tomllib.loads(Path(__file__).with_name("nav2.toml").read_text(encoding="utf-8"))
# parameter that gives a plugin's type, if not "plugin"
_SELECTORS = {"dwb_critics": "class", "mppi_critics": ""}


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
    declared = blocks({**tables, **{kind: {} for kind in here if kind not in tables}}, read)
    selector = words(_SELECTORS.get(name, "plugin"))
    return {
        kind: replace(
            here.get(kind, AlgorithmEntry()),
            keys=block if block.is_open else replace(block, keys=block.keys | selector),
        )
        for kind, block in declared.items()
    }


def blocks(tables: Mapping[str, Any], read: Mapping[str, Params]) -> dict[str, ParameterBlock]:
    """The blocks of tables that stand beside each other, by name.

    ``read`` are the dataclasses that read them.
    """
    return {
        name: block_of({**tables.get(table.get("as_in"), {}), **table}, read.get(name))
        for name, table in tables.items()
    }


def block_of(table: Mapping[str, Any], params: Params | None = None) -> ParameterBlock:
    """The block of a table, with the parameters of the dataclass that reads it."""
    given = {key: value for key, value in table.items() if key != "as_in"}
    nested: Mapping[str, Params] = {}
    own: frozenset[str] = frozenset()
    if params is not None:
        nested = nested_params(params)
        if "keys" not in given:
            own = parameters(params)
    return ParameterBlock(
        keys=own | words(given.pop("keys", "")) | words(given.pop("unread", "")),
        groups=blocks(given.pop("groups", {}), nested),
        named=blocks(given.pop("named", {}), nested),
        plugins={name: PluginList(**each) for name, each in given.pop("plugins", {}).items()},
        **given,
    )
