"""Plugins as Nav2 Eloquent lists them: names in one list, types in another."""

from dataclasses import replace

from navstack.params.nav2_file.findings import Notice, names_in
from navstack.params.nav2_file.nodes import COSTMAPS
from navstack.params.nav2_file.ros_yaml import Entry

# node -> Eloquent's list of names, its list of types, today's list
_LISTS = {
    "planner_server": ("planner_plugin_ids", "planner_plugin_types", "planner_plugins"),
    "controller_server": ("controller_plugin_ids", "controller_plugin_types", "controller_plugins"),
    "behavior_server": ("plugin_names", "plugin_types", "behavior_plugins"),
    **dict.fromkeys(COSTMAPS, ("plugin_names", "plugin_types", "plugins")),
}


def convert_plugins(node: str, entries: dict[str, Entry]) -> list[Notice]:
    """Turn both lists into today's one, and the types into parameters of the names; tells so.

    A node that has today's list, or lists of different lengths, stays as it is.
    """
    ids, types, today = _LISTS.get(node, ("", "", ""))
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
