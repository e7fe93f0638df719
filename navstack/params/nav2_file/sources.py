"""Observation sources that read the robot's one planar scan in place of a sensor of their own."""

from collections.abc import Collection, Iterator, Mapping

from navstack.errors import did_you_mean
from navstack.params.collision_monitor import OTHER_SOURCES
from navstack.params.nav2_file.catalog import plugin_type
from navstack.params.nav2_file.findings import Notice, Parameters, names_of, value_of
from navstack.params.nav2_file.nodes import COSTMAPS, MONITOR
from navstack.params.nav2_file.ros_yaml import ParameterEntry, is_placeholder
from navstack.params.registry.nodes import DEFAULT_LAYERS

OBSTACLE_LAYER = "nav2_costmap_2d::ObstacleLayer"  # a VoxelLayer has a notice of its own
LAYERS_WITH_SOURCES = (
    OBSTACLE_LAYER,
    "nav2_costmap_2d::VoxelLayer",
    "spatio_temporal_voxel_layer::SpatioTemporalVoxelLayer",
)
_OF_VELOCITY_POLYGONS = ("linear_min", "linear_max", "theta_min", "theta_max")
DATA_TYPES = ("LaserScan", "PointCloud2")  # others Nav2 refuses (``obstacle_layer.cpp``)


def source_notices(parameters: Parameters) -> list[Notice]:
    """Point clouds, and scans of other topics than the first one's.

    Topics without a leading slash.
    """
    first, notices = "", []
    for node, layer, name in _sources(parameters, (OBSTACLE_LAYER,)):
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


def data_type_notices(parameters: Parameters) -> list[Notice]:
    """Sources of a type with which Nav2 does not start."""
    notices = []
    for node, layer, name in _sources(parameters, LAYERS_WITH_SOURCES):
        key = f"{layer}.{name}.data_type"
        entry = parameters[node].get(key)
        if entry is None or entry.value in DATA_TYPES or is_placeholder(entry.value):
            continue
        message = (
            f"{entry.value!r} is neither {' nor '.join(DATA_TYPES)}, and Nav2 refuses such a source"
            f"{did_you_mean(str(entry.value), DATA_TYPES)}"
        )
        notices.append(Notice("bad-value", f"{node}: {key}", message, "", entry.line, True))
    return notices


def _sources(parameters: Parameters, types: Collection[str]) -> Iterator[tuple[str, str, str]]:
    """Costmap, layer and name of each source of an enabled layer of one of the types."""
    for node in COSTMAPS:
        entries = parameters.get(node, {})
        for layer in names_of(entries, "plugins", DEFAULT_LAYERS):
            kind = plugin_type(value_of(entries, f"{layer}.plugin", DEFAULT_LAYERS.get(layer, "")))
            if kind in types and value_of(entries, f"{layer}.enabled", True):
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


def missing_of_monitor(entries: Mapping[str, ParameterEntry]) -> Iterator[Notice]:
    """What a collision monitor lacks of that which Nav2 declares without a default."""
    lines = [entry.line for entry in entries.values() if entry.line]
    needed = ["polygons", "observation_sources"]
    for zone in names_of(entries, "polygons"):
        for shape in names_of(entries, f"{zone}.velocity_polygons"):
            needed += [f"{zone}.{shape}.{key}" for key in _OF_VELOCITY_POLYGONS]
    for name in needed:
        if name not in entries:
            message = "is missing; Nav2's collision monitor does not start without it"
            if name == "polygons":
                message += " (Humble's starts, without a zone)"
            yield Notice("missing-value", f"{MONITOR}: {name}", message, line=min(lines, default=0))
