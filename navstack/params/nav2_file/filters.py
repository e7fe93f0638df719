"""Where the masks of a Nav2 file's costmap filters come from.

In ROS a filter waits for its info on one topic and for its mask on another; here the nodes that
publish them are looked up in the same file. Topics are compared without a leading slash.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from navstack.errors import ParameterError
from navstack.files import named_by
from navstack.params.filters import (
    SPEED_ABSOLUTE,
    SPEED_PERCENT,
    FilterInfoServerParams,
    MaskServerParams,
)
from navstack.params.nav2_file.catalog import node_kind, plugin_type
from navstack.params.nav2_file.findings import Notice, Parameters, names_of, value_of
from navstack.params.nav2_file.nodes import COSTMAPS

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
    missing: MaskSource | None  # the mask that the file names, if that is not here

    @property
    def path(self) -> str:
        return f"{self.node}: {self.name}"


def find_mask(
    parameters: Parameters, folder: Path, info_topic: str, is_anywhere: bool = False
) -> MaskSource | None:
    """The mask behind a ``filter_info_topic``; None: the file names none.

    Args:
        parameters: of the file.
        folder: of the file, where a relative path begins.
        info_topic: of the filter.
        is_anywhere: whether a mask that does not exist here counts.

    Raises:
        ParameterError: a name that no file can have.
    """
    default = _INFO.filter_info_topic
    for info_node in _publishers(
        parameters, "costmap_filter_info_server", "filter_info_topic", default, info_topic
    ):
        topic = str(value_of(parameters[info_node], "mask_topic", _INFO.mask_topic))
        for mask_node in _publishers(
            parameters, "filter_mask_server", "topic_name", _MASK.topic_name, topic
        ):
            yaml_filename = str(value_of(parameters[mask_node], "yaml_filename", ""))
            if "\0" in yaml_filename:
                raise ParameterError(
                    f"{mask_node}.yaml_filename has a NUL in the map's name; give a map_server "
                    "YAML file"
                )
            if yaml_filename and (is_anywhere or named_by(folder, yaml_filename).exists()):
                return MaskSource(info_node, yaml_filename)
    return None


def keepout_filters_without_mask(parameters: Parameters, folder: Path) -> list[str]:
    """The enabled keepout filters, as ``costmap: name``, for which the file names no mask here."""
    filters = _filters(parameters, folder)
    return [each.path for each in filters if each.type == KEEPOUT_FILTER and each.mask is None]


def filter_notices(parameters: Parameters, folder: Path) -> list[Notice]:
    """Filters that do nothing here, or not all that their info says."""
    notices = []
    for each in _filters(parameters, folder):
        info = parameters[each.mask.info_node] if each.mask else {}
        kind = value_of(info, "type", _INFO.type)
        if f"{each.name}.filter_info_topic" not in parameters[each.node]:
            message = "is missing; Nav2's costmap does not start without it"
            path = f"{each.path}.filter_info_topic"
            notices.append(Notice("missing-value", path, message))
        if each.missing and each.type == KEEPOUT_FILTER:
            message = f"its mask {each.missing.yaml_filename} is not here; the world's own is used"
            notices.append(Notice("no-mask", each.path, message))
        elif each.type == SPEED_FILTER and each.mask is None:
            advice = "name it in a filter_info_server and a mask_server of this file"
            notices.append(Notice("no-mask", each.path, "has no mask and no effect", advice))
        elif each.type == SPEED_FILTER and kind not in (SPEED_PERCENT, SPEED_ABSOLUTE):
            advice = f"give {SPEED_PERCENT} (percent) or {SPEED_ABSOLUTE} (m/s)"
            message = f"its info is of type {kind}: it has no effect"
            notices.append(Notice("filter-type", each.path, message, advice))
        is_scaled = any(
            value_of(info, name, usual) != usual
            for name, usual in (("base", _INFO.base), ("multiplier", _INFO.multiplier))
        )
        if each.type == KEEPOUT_FILTER and is_scaled:
            message = "a keepout filter does not use base and multiplier"
            notices.append(Notice("filter-scale", each.path, message))
    return notices


def _filters(parameters: Parameters, folder: Path) -> Iterator[_Filter]:
    """The enabled filters of both costmaps that read a mask here."""
    for node in COSTMAPS:
        entries = parameters.get(node, {})
        for name in (*names_of(entries, "plugins"), *names_of(entries, "filters")):
            kind = plugin_type(value_of(entries, f"{name}.plugin", ""))
            is_filter = kind in (KEEPOUT_FILTER, SPEED_FILTER)
            if is_filter and value_of(entries, f"{name}.enabled", True):
                topic = str(value_of(entries, f"{name}.filter_info_topic", ""))
                mask = find_mask(parameters, folder, topic)
                named = find_mask(parameters, folder, topic, is_anywhere=True)
                yield _Filter(node, name, kind, mask, None if mask else named)


def _publishers(
    parameters: Parameters, kind: str, key: str, default: str, topic: str
) -> Iterator[str]:
    """The nodes of a kind that publish on a topic, which ``key`` names."""
    for node, entries in parameters.items():
        published = str(value_of(entries, key, default))
        if node_kind(node) == kind and published.lstrip("/") == topic.lstrip("/"):
            yield node
