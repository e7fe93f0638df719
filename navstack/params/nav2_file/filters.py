"""Where the masks of a Nav2 file's costmap filters come from.

In ROS a filter waits for its info on one topic and for its mask on another; here the nodes that
publish them are looked up in the same file. Topics are compared without a leading slash.
"""

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from navstack.params.filters import (
    SPEED_ABSOLUTE,
    SPEED_PERCENT,
    FilterInfoServerParams,
    MaskServerParams,
)
from navstack.params.nav2_file.catalog import node_kind, plugin_type
from navstack.params.nav2_file.findings import Notice, names_of, value_of
from navstack.params.nav2_file.nodes import COSTMAPS
from navstack.params.nav2_file.ros_yaml import Entry

Parameters = Mapping[str, Mapping[str, Entry]]  # node -> dotted name -> entry

KEEPOUT_FILTER, SPEED_FILTER = "nav2_costmap_2d::KeepoutFilter", "nav2_costmap_2d::SpeedFilter"
_INFO, _MASK = FilterInfoServerParams(), MaskServerParams()


class MaskSource(NamedTuple):
    """Where a filter's mask stands in a file."""

    info_node: str  # the costmap_filter_info_server
    yaml_filename: str  # of the mask, as the file gives it


class _Filter(NamedTuple):
    node: str  # costmap
    name: str
    type: str
    mask: MaskSource | None

    @property
    def path(self) -> str:
        return f"{self.node}: {self.name}"


def find_mask(parameters: Parameters, info_topic: str) -> MaskSource | None:
    """The mask behind a ``filter_info_topic``; None: the file names none."""
    for info_node in _publishers(
        parameters, "costmap_filter_info_server", "filter_info_topic", info_topic
    ):
        mask_topic = str(value_of(parameters[info_node], "mask_topic", _INFO.mask_topic))
        for mask_node in _publishers(parameters, "filter_mask_server", "topic_name", mask_topic):
            yaml_filename = str(value_of(parameters[mask_node], "yaml_filename", ""))
            if yaml_filename:
                return MaskSource(info_node, yaml_filename)
    return None


def keepout_filters_without_mask(parameters: Parameters) -> list[str]:
    """The enabled keepout filters, as ``costmap: name``, for which the file names no mask."""
    return [
        each.path
        for each in _filters(parameters)
        if each.type == KEEPOUT_FILTER and each.mask is None
    ]


def filter_notices(parameters: Parameters) -> list[Notice]:
    """Filters that do nothing here, or not all that their info says."""
    notices = []
    for each in _filters(parameters):
        info = parameters[each.mask.info_node] if each.mask else {}
        kind = value_of(info, "type", _INFO.type)
        if each.type == SPEED_FILTER and each.mask is None:
            advice = "name it in a filter_info_server and a mask_server of this file"
            notices.append(Notice("no-mask", each.path, "has no mask and no effect", advice))
        elif each.type == SPEED_FILTER and kind not in (SPEED_PERCENT, SPEED_ABSOLUTE):
            advice = f"give {SPEED_PERCENT} (percent) or {SPEED_ABSOLUTE} (m/s)"
            notices.append(
                Notice(
                    "filter-type",
                    each.path,
                    f"its info is of type {kind}: it has no effect",
                    advice,
                )
            )
        scale = (value_of(info, "base", _INFO.base), value_of(info, "multiplier", _INFO.multiplier))
        if each.type == KEEPOUT_FILTER and scale != (_INFO.base, _INFO.multiplier):
            notices.append(
                Notice(
                    "filter-scale", each.path, "a keepout filter does not use base and multiplier"
                )
            )
    return notices


def _filters(parameters: Parameters) -> Iterator[_Filter]:
    """The enabled filters of both costmaps that read a mask here."""
    for node in COSTMAPS:
        entries = parameters.get(node, {})
        for name in (*names_of(entries, "plugins"), *names_of(entries, "filters")):
            kind = plugin_type(value_of(entries, f"{name}.plugin", ""))
            if kind in (KEEPOUT_FILTER, SPEED_FILTER) and value_of(
                entries, f"{name}.enabled", True
            ):
                topic = str(value_of(entries, f"{name}.filter_info_topic", ""))
                yield _Filter(node, name, kind, find_mask(parameters, topic))


def _publishers(parameters: Parameters, kind: str, key: str, topic: str) -> Iterator[str]:
    """The nodes of a kind that publish on a topic."""
    default = _INFO.filter_info_topic if key == "filter_info_topic" else _MASK.topic_name
    for node, entries in parameters.items():
        if node_kind(node) == kind and str(value_of(entries, key, default)).lstrip(
            "/"
        ) == topic.lstrip("/"):
            yield node
