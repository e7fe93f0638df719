"""What to say about a name that Nav2 does not have in this place."""

from collections.abc import Iterable, Iterator

from navstack.errors import did_you_mean
from navstack.params.nav2_file.catalog import Catalog, nearly_equal
from navstack.params.registry import nodes
from navstack.params.registry.block import ParameterBlock

MOST_HOMES = 3  # places named at most

# Names of Eloquent and before, and what to write since Foxy.
_LISTS = "a list {new} and, in the section of each name, its plugin"
RETIRED = {
    "planner_plugin_ids": _LISTS.format(new="planner_plugins"),
    "planner_plugin_types": _LISTS.format(new="planner_plugins"),
    "controller_plugin_ids": _LISTS.format(new="controller_plugins"),
    "controller_plugin_types": _LISTS.format(new="controller_plugins"),
    "plugin_names": _LISTS.format(new="plugins"),
    "plugin_types": _LISTS.format(new="plugins"),
}


def unknown_name(
    catalog: Catalog, name: str, missing: list[str], known: Iterable[str], shown: Iterable[str]
) -> str:
    """The message about a name unknown to Nav2 in its place.

    Args:
        catalog: where else it may belong.
        name: the name.
        missing: a name that a list gives and that has no section, if ``name`` all but spells it.
        known: every name that the place may hold.
        shown: those to list if nothing is near.
    """
    if name in RETIRED:
        return f"is of Nav2 Eloquent; since Foxy it is {RETIRED[name]}"
    known = list(known)
    homes = list(dict.fromkeys(_homes(catalog, name)))
    if homes and not missing and not nearly_equal(name, known):
        more = f" and {len(homes) - MOST_HOMES} more" if len(homes) > MOST_HOMES else ""
        return f"unknown to Nav2 in this place; it belongs to {', '.join(homes[:MOST_HOMES])}{more}"
    hint = did_you_mean(name, missing or sorted(known))
    return f"unknown to Nav2{hint or '; known: ' + (', '.join(sorted(shown)) or 'none')}"


def _homes(catalog: Catalog, name: str) -> Iterator[str]:
    """The nodes and plugins of Nav2 that have a parameter or a section of this name."""
    for node, block in nodes.NODES.items():
        yield from _homes_in(node, block, name)
    for plugins in catalog.families.values():
        for kind, entry in plugins.items():
            yield from _homes_in(kind, entry.keys, name)


def _homes_in(where: str, block: ParameterBlock, name: str) -> Iterator[str]:
    if name in block.own_keys or name in block.groups:
        yield where
    for group, inner in block.groups.items():
        yield from _homes_in(f"{where} ({group})", inner, name)
    for key, inner in block.named.items():
        yield from _homes_in(f"{where} (its {key})", inner, name)
