"""Observation sources that read the robot's one planar scan in place of a sensor of their own."""

from collections.abc import Iterator

from navstack.params.collision_monitor import OTHER_SOURCES
from navstack.params.nav2_file.catalog import plugin_type
from navstack.params.nav2_file.findings import Notice, Parameters, names_of, value_of
from navstack.params.nav2_file.nodes import COSTMAPS, MONITOR
from navstack.params.registry.nodes import DEFAULT_LAYERS

OBSTACLE_LAYER = "nav2_costmap_2d::ObstacleLayer"  # a VoxelLayer has a notice of its own


def source_notices(parameters: Parameters) -> list[Notice]:
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
            message = (
                f"the scan of topic '{topic}' is that of '{first}' here: "
                "the robot has one planar scan"
            )
        given = entries.get(f"{source}.data_type") or entries.get(f"{source}.topic")
        line = 0 if given is None else given.line
        notices.append(Notice("substitute", f"{node}: {source}", message, line=line))
    return notices


def _sources(parameters: Parameters) -> Iterator[tuple[str, str, str]]:
    """Costmap, layer and name of each source of an enabled obstacle layer."""
    for node in COSTMAPS:
        entries = parameters.get(node, {})
        for layer in names_of(entries, "plugins", DEFAULT_LAYERS):
            kind = plugin_type(value_of(entries, f"{layer}.plugin", DEFAULT_LAYERS.get(layer, "")))
            if kind == OBSTACLE_LAYER and value_of(entries, f"{layer}.enabled", True):
                for name in names_of(entries, f"{layer}.observation_sources"):
                    yield node, layer, name


def monitor_notices(parameters: Parameters) -> list[Notice]:
    """The collision monitor's enabled sources that are no planar scans."""
    entries = parameters.get(MONITOR, {})
    notices = []
    for name in names_of(entries, "observation_sources"):
        kind = entries.get(f"{name}.type")
        if kind is None or not value_of(entries, f"{name}.enabled", True):
            continue
        if kind.value == "pointcloud":
            message = "a pointcloud runs on the robot's planar scan"
        elif kind.value in OTHER_SOURCES:
            message = (
                f"there is no sensor of type '{kind.value}' here: "
                "it sees nothing and never grows stale"
            )
        else:
            continue
        notices.append(Notice("substitute", f"{MONITOR}: {name}", message, line=kind.line))
    return notices
