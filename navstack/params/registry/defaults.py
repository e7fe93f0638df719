"""Defaults in which a distribution of Nav2 differs from Jazzy's, which the dataclasses have."""

from collections.abc import Mapping
from dataclasses import MISSING, fields
from functools import cache
from typing import Any

from navstack.params.registry import bindings, nodes, releases
from navstack.params.registry.bindings import CRITICS, nested_params, parameter_of
from navstack.params.registry.entry import Params
from navstack.params.registry.nav2 import EACH, NAV2

MODELLED = "jazzy"  # the distribution whose defaults the dataclasses have
NO_DIFFERENCE = (
    "max_cycles_factor",  # NavFn gives up alike in every distribution; here it is off
    "max_points",  # one less than min_points, which has the same default
)

Defaults = Mapping[str, Any]  # by dotted name


def differing(params: Params, release: str) -> Mapping[str, bool | int | float]:
    """The numbers and switches that a distribution declares otherwise, by name."""
    return _all_differing(release).get(params, {})


@cache
def _all_differing(release: str) -> Mapping[Params, Mapping[str, bool | int | float]]:
    jazzy, found = _declared(MODELLED), {}
    for params, defaults in _declared(release).items():
        given = {parameter_of(field.name): field.default for field in fields(params)}
        own = {name: default for name, default in given.items() if default is not MISSING}
        usual = {**own, **jazzy[params]}
        found[params] = {
            name: value
            for name, value in defaults.items()
            if name in own.keys() - NO_DIFFERENCE
            and isinstance(value, int | float)
            and value != usual[name]
        }
    return found


def _declared(release: str) -> Mapping[Params, Defaults]:
    """What a distribution declares for each dataclass."""
    found: dict[Params, dict[str, Any]] = {}
    of_nodes = releases.load(release)["nodes"]
    for node, params in {**bindings.NODES, **bindings.FILTER_NODES}.items():
        name = NAV2["nodes"].get(node, {}).get("as_in", node)
        _add(found, params, of_nodes.get(name, {}))
    for family, entries in nodes.FAMILIES.items():
        critics = nested_params(CRITICS[family]) if family in CRITICS else {}
        declared = releases.plugins_in(release, family, nodes.RENAMED_PACKAGES)
        for kind, entry in entries.items():
            read = entry.params or critics.get(kind)
            if read is not None:
                _add(found, read, declared.get(kind, {}))
    return found


def _add(found: dict[Params, dict[str, Any]], params: Params, declared: Defaults) -> None:
    """Sort what a namespace declares by dataclass: its own, and those of what lies below."""
    own = found.setdefault(params, {})
    own |= {name: default for name, default in declared.items() if "." not in name}
    for name, inner in nested_params(params).items():
        below = {
            each.removeprefix(f"{name}.").removeprefix(f"{EACH}."): default
            for each, default in declared.items()
            if each.startswith(f"{name}.")
        }
        _add(found, inner, below)
