"""Polygons in other forms than Nav2's texts, and the collision monitor's sources that run as something simpler."""

from collections.abc import Mapping
from dataclasses import replace

from navstack.params.collision_monitor import FEWEST_VERTICES, OTHER_SOURCES
from navstack.params.nav2_file.findings import Notice, names_of, value_of
from navstack.params.nav2_file.ros_yaml import Entry, Value

NODE = "collision_monitor"
TRIANGLE = 3  # vertices that a footprint has at least


def monitor_notices(parameters: Mapping[str, Mapping[str, Entry]]) -> list[Notice]:
    """The enabled sources that are no planar scans."""
    entries = parameters.get(NODE, {})
    notices = []
    for name in names_of(entries, "observation_sources"):
        kind = entries.get(f"{name}.type")
        if kind is None or not value_of(entries, f"{name}.enabled", True):
            continue
        path = f"{NODE}: {name}"
        if kind.value == "pointcloud":
            notices.append(
                Notice(
                    "substitute",
                    path,
                    "a pointcloud runs on the robot's planar scan",
                    line=kind.line,
                )
            )
        elif kind.value in OTHER_SOURCES:
            message = f"there is no sensor of type '{kind.value}' here: it sees nothing and never grows stale"
            notices.append(Notice("substitute", path, message, line=kind.line))
    return notices


def convert_polygons(entries: dict[str, Entry]) -> list[Notice]:
    """Turn polygons that are lists of numbers, as up to Nav2 Iron, into today's texts.

    Tells which.
    """
    notices = []
    for name in names_of(entries, "polygons"):
        entry = entries.get(f"{name}.points")
        pairs = _pairs(entry.value, FEWEST_VERTICES) if entry is not None else []
        if entry is not None and pairs:
            entries[f"{name}.points"] = replace(entry, value=str(pairs))
            message = "a list of numbers, as up to Nav2 Iron; read as today's text, which newer releases insist on"
            notices.append(
                Notice(
                    "older-form",
                    f"{NODE}: {name}.points",
                    message,
                    f'points: "{pairs}"',
                    entry.line,
                )
            )
    return notices


def convert_footprint(node: str, entries: dict[str, Entry]) -> list[Notice]:
    """Turn a costmap's footprint that is a list into a text; tells so."""
    entry = entries.get("footprint")
    pairs = _pairs(entry.value, TRIANGLE) if entry is not None else []
    if entry is None or not pairs:
        return []
    entries["footprint"] = replace(entry, value=str(pairs))
    message = "a list of numbers, read as the text that Nav2 insists on"
    return [
        Notice("older-form", f"{node}: footprint", message, f'footprint: "{pairs}"', entry.line)
    ]


def _pairs(value: Value, fewest: int) -> list[list[float]]:
    """At least so many vertices of ``[x, y, x, y, ...]`` or ``[[x, y], ...]``.

    None if it is something else.
    """
    numbers = value if isinstance(value, list) else []
    if numbers and all(isinstance(pair, list) and len(pair) == 2 for pair in numbers):
        numbers = [number for pair in numbers if isinstance(pair, list) for number in pair]
    if len(numbers) < 2 * fewest or len(numbers) % 2:
        return []
    if any(isinstance(number, bool) or not isinstance(number, int | float) for number in numbers):
        return []
    flat = [float(number) for number in numbers if isinstance(number, int | float)]
    return [list(pair) for pair in zip(flat[::2], flat[1::2], strict=True)]
