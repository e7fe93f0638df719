"""Observation sources of the collision monitor that run as something simpler here, or not at all."""

from collections.abc import Mapping

from navstack.params.collision_monitor import OTHER_SOURCES
from navstack.params.nav2_findings import Notice, names_in
from navstack.params.ros_yaml import Entry

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
