"""The collision monitor of a file: polygons in an older form, sources that run as something simpler or not at all."""

from collections.abc import Mapping
from dataclasses import replace

from navstack.params.collision_monitor import FEWEST_VERTICES, OTHER_SOURCES
from navstack.params.nav2_file.findings import Notice, names_in
from navstack.params.nav2_file.ros_yaml import Entry, Value

NODE = "collision_monitor"


def monitor_notices(parameters: Mapping[str, Mapping[str, Entry]]) -> list[Notice]:
    """The enabled sources that are no planar scans."""
    entries = parameters.get(NODE, {})
    listed = entries.get("observation_sources")
    notices = []
    for name in names_in(listed.value) if listed else ():
        kind, enabled = entries.get(f"{name}.type"), entries.get(f"{name}.enabled")
        if kind is None or (enabled is not None and not enabled.value):
            continue
        path = f"{NODE}: {name}"
        if kind.value == "pointcloud":
            notices.append(Notice("substitute", path, "a pointcloud runs on the robot's planar scan", line=kind.line))
        elif kind.value in OTHER_SOURCES:
            message = f"there is no sensor of type '{kind.value}' here: it sees nothing and never grows stale"
            notices.append(Notice("substitute", path, message, line=kind.line))
    return notices


def convert_polygons(entries: dict[str, Entry]) -> list[Notice]:
    """Turn polygons that are lists of numbers, as up to Nav2 Iron, into today's texts; tells which."""
    listed = entries.get("polygons")
    notices = []
    for name in names_in(listed.value) if listed else ():
        entry = entries.get(f"{name}.points")
        pairs = _pairs(entry.value) if entry is not None else []
        if entry is not None and pairs:
            entries[f"{name}.points"] = replace(entry, value=str(pairs))
            message = "a list of numbers, as up to Nav2 Iron; read as today's text, which newer releases insist on"
            notices.append(Notice("older-form", f"{NODE}: {name}.points", message, f'points: "{pairs}"', entry.line))
    return notices


def _pairs(value: Value) -> list[list[float]]:
    """The vertices of ``[x, y, x, y, ...]``; none if it is something else."""
    numbers = value if isinstance(value, list) else []
    if len(numbers) < 2 * FEWEST_VERTICES or len(numbers) % 2:
        return []
    if any(isinstance(number, bool) or not isinstance(number, int | float) for number in numbers):
        return []
    flat = [float(number) for number in numbers if isinstance(number, int | float)]
    return [list(pair) for pair in zip(flat[::2], flat[1::2], strict=True)]
