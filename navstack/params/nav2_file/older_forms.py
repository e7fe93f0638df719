"""Parameters in the forms of older Nav2 releases, turned into today's."""

from dataclasses import replace

from navstack.params.collision_monitor import FEWEST_VERTICES
from navstack.params.nav2_file.findings import Notice, names_in, names_of
from navstack.params.nav2_file.nodes import COSTMAPS, MONITOR
from navstack.params.nav2_file.ros_yaml import ParameterEntry, Value

TRIANGLE = 3  # vertices that a footprint has at least
# node -> Eloquent's list of names, its list of types, today's list
_LISTS = {
    "planner_server": ("planner_plugin_ids", "planner_plugin_types", "planner_plugins"),
    "controller_server": ("controller_plugin_ids", "controller_plugin_types", "controller_plugins"),
    "behavior_server": ("plugin_names", "plugin_types", "behavior_plugins"),
    **dict.fromkeys(COSTMAPS, ("plugin_names", "plugin_types", "plugins")),
}


def convert_older_forms(node: str, entries: dict[str, ParameterEntry]) -> list[Notice]:
    """Change a node's parameters to today's forms; a notice of each change."""
    notices = []
    if node in _LISTS:
        notices += _convert_plugins(node, entries, *_LISTS[node])
    if node in COSTMAPS:
        message = "a list of numbers, read as the text that Nav2 insists on"
        notices += _convert_polygon(node, entries, "footprint", TRIANGLE, message)
    if node == MONITOR:
        message = (
            "a list of numbers, as up to Nav2 Iron; "
            "read as today's text, which newer releases insist on"
        )
        for name in names_of(entries, "polygons"):
            notices += _convert_polygon(node, entries, f"{name}.points", FEWEST_VERTICES, message)
    return notices


def _convert_plugins(
    node: str, entries: dict[str, ParameterEntry], ids: str, types: str, today: str
) -> list[Notice]:
    """Turn both lists of Eloquent into today's one, and the types into parameters of the names.

    A node that has today's list, or lists of different lengths, stays as it is.
    """
    if ids not in entries or types not in entries or today in entries:
        return []
    names, kinds = names_in(entries[ids].value), names_in(entries[types].value)
    if not names or len(names) != len(kinds):
        return []
    listed, typed = entries.pop(ids), entries.pop(types)
    entries[today] = replace(listed, value=list(names))
    for name, kind in zip(names, kinds, strict=True):
        entries.setdefault(f"{name}.plugin", replace(typed, value=kind))
    message = f"is of Nav2 Eloquent, as is {types}; read as {today}, and as each one's plugin"
    return [Notice("older-form", f"{node}: {ids}", message, line=listed.line)]


def _convert_polygon(
    node: str, entries: dict[str, ParameterEntry], name: str, fewest: int, message: str
) -> list[Notice]:
    """Turn a polygon that is a list into a text."""
    entry = entries.get(name)
    pairs = [] if entry is None else _pairs(entry.value, fewest)
    if entry is None or not pairs:
        return []
    entries[name] = replace(entry, value=str(pairs))
    advice = f'{name.rpartition(".")[2]}: "{pairs}"'
    return [Notice("older-form", f"{node}: {name}", message, advice, entry.line)]


def _pairs(value: Value, fewest: int) -> list[list[float]]:
    """At least so many vertices of ``[x, y, x, y, ...]`` or ``[[x, y], ...]``.

    None if it is something else.
    """
    numbers = value if isinstance(value, list) else []
    if numbers and all(isinstance(pair, list) and len(pair) == 2 for pair in numbers):
        numbers = [number for pair in numbers if isinstance(pair, list) for number in pair]
    if len(numbers) < 2 * fewest or len(numbers) % 2:
        return []
    flat = []
    for number in numbers:
        if isinstance(number, bool) or not isinstance(number, int | float):
            return []
        flat.append(float(number))
    return [list(pair) for pair in zip(flat[::2], flat[1::2], strict=True)]
