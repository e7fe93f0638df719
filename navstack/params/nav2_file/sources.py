"""Observation sources of obstacle layers that read the robot's one planar scan in place of a sensor of their own."""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from navstack.params.nav2_file.catalog import plugin_type
from navstack.params.nav2_file.findings import Notice, names_in
from navstack.params.nav2_file.nodes import COSTMAPS
from navstack.params.nav2_file.ros_yaml import Entry, Value
from navstack.params.registry.nodes import DEFAULT_LAYERS

OBSTACLE_LAYER = "nav2_costmap_2d::ObstacleLayer"  # a VoxelLayer is told as a whole


class _Source(NamedTuple):
    path: str  # costmap: layer.source
    data_type: str
    topic: str
    line: int


def source_notices(parameters: Mapping[str, Mapping[str, Entry]]) -> list[Notice]:
    """Point clouds, and scans of other topics than the first one's."""
    first, notices = "", []
    for source in _sources(parameters):
        if source.data_type == "PointCloud2":
            message = "a PointCloud2 runs on the robot's planar scan"
        elif not first or source.topic == first:
            first = source.topic
            continue
        else:
            message = f"the scan of topic '{source.topic}' is that of '{first}' here: the robot has one planar scan"
        notices.append(Notice("substitute", source.path, message, line=source.line))
    return notices


def _sources(parameters: Mapping[str, Mapping[str, Entry]]) -> Iterator[_Source]:
    """The sources of the enabled obstacle layers of both costmaps; topics without a leading slash."""
    for node in COSTMAPS:
        entries = parameters.get(node, {})
        layers = names_in(_value(entries, "plugins", list(DEFAULT_LAYERS)))
        for layer in layers:
            kind = plugin_type(_value(entries, f"{layer}.plugin", DEFAULT_LAYERS.get(layer, "")))
            if kind == OBSTACLE_LAYER and _value(entries, f"{layer}.enabled", True):
                for name in names_in(_value(entries, f"{layer}.observation_sources", "")):
                    yield _source(node, entries, layer, name)


def _source(node: str, entries: Mapping[str, Entry], layer: str, name: str) -> _Source:
    where = f"{layer}.{name}"
    given = entries.get(f"{where}.data_type") or entries.get(f"{where}.topic")
    data_type = str(_value(entries, f"{where}.data_type", "LaserScan"))
    topic = str(_value(entries, f"{where}.topic", name)).lstrip("/")
    return _Source(f"{node}: {where}", data_type, topic, given.line if given else 0)


def _value(entries: Mapping[str, Entry], name: str, default: Value) -> Value:
    return entries[name].value if name in entries else default
