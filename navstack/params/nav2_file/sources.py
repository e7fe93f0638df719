"""Observation sources of obstacle layers that read the robot's one planar scan in place of a sensor of their own."""

from collections.abc import Iterator, Mapping

from navstack.params.nav2_file.catalog import plugin_type
from navstack.params.nav2_file.findings import Notice, names_of, value_of
from navstack.params.nav2_file.nodes import COSTMAPS
from navstack.params.nav2_file.ros_yaml import Entry
from navstack.params.registry.nodes import DEFAULT_LAYERS

OBSTACLE_LAYER = "nav2_costmap_2d::ObstacleLayer"  # a VoxelLayer is told as a whole


def source_notices(parameters: Mapping[str, Mapping[str, Entry]]) -> list[Notice]:
    """Point clouds, and scans of other topics than the first one's.

    Topics without a leading slash.
    """
    first, notices = "", []
    for node, layer, name in _sources(parameters):
        entries, source = parameters[node], f"{layer}.{name}"
        topic = str(value_of(entries, f"{source}.topic", name)).lstrip("/")
        if value_of(entries, f"{source}.data_type", "LaserScan") == "PointCloud2":
            message = "a PointCloud2 runs on the robot's planar scan"
        elif not first or topic == first:
            first = topic
            continue
        else:
            message = f"the scan of topic '{topic}' is that of '{first}' here: the robot has one planar scan"
        given = entries.get(f"{source}.data_type") or entries.get(f"{source}.topic")
        notices.append(
            Notice("substitute", f"{node}: {source}", message, line=given.line if given else 0)
        )
    return notices


def _sources(parameters: Mapping[str, Mapping[str, Entry]]) -> Iterator[tuple[str, str, str]]:
    """Costmap, layer and name of each source of an enabled obstacle layer."""
    for node in COSTMAPS:
        entries = parameters.get(node, {})
        for layer in names_of(entries, "plugins", DEFAULT_LAYERS):
            kind = plugin_type(value_of(entries, f"{layer}.plugin", DEFAULT_LAYERS.get(layer, "")))
            if kind == OBSTACLE_LAYER and value_of(entries, f"{layer}.enabled", True):
                yield from (
                    (node, layer, name)
                    for name in names_of(entries, f"{layer}.observation_sources")
                )
