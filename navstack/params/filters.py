"""Parameters of the costmap filters and of the nodes that serve their masks.

Names and defaults of Nav2 Jazzy.

A filter's ``filter_info_topic`` names a costmap_filter_info_server; its ``mask_topic`` the map
server with the mask.
"""

from dataclasses import dataclass
from typing import Annotated

from navstack.ranges import Capped, NotNegativeInt, Parameters, Quantity, Whole

# values of a filter info's type (filter_values.hpp)
KEEPOUT, SPEED_PERCENT, SPEED_ABSOLUTE = 0, 1, 2
MAX_NON_OBSTACLE = 252  # highest cost at which the robot's centre may be


@dataclass(frozen=True, slots=True)
class KeepoutFilterParams(Parameters):
    """``keepout_filter.cpp``."""

    enabled: bool = True
    filter_info_topic: str = ""  # of the costmap_filter_info_server that tells where the mask is
    # a robot inside a lethal zone sees the mask at a cost that lets it drive out
    override_lethal_cost: bool = False
    # that cost; more counts as the most that is no obstacle
    lethal_override_cost: Annotated[NotNegativeInt, Capped(MAX_NON_OBSTACLE)] = MAX_NON_OBSTACLE


@dataclass(frozen=True, slots=True)
class SpeedFilterParams:
    """``speed_filter.cpp``.

    Its limit always reaches the controller, whatever the topic in between.
    """

    enabled: bool = True
    filter_info_topic: str = ""


@dataclass(frozen=True, slots=True)
class FilterInfoServerParams(Parameters):
    """``costmap_filter_info_server``, also under names that end in ``_filter_info_server``."""

    # 0 keepout, 1 speed limit in percent, 2 speed limit in m/s; others are not read here
    type: Whole = KEEPOUT
    filter_info_topic: str = "costmap_filter_info"
    mask_topic: str = "filter_mask"
    base: Quantity = 0.0  # a speed limit is base + multiplier * mask value
    multiplier: Quantity = 1.0


@dataclass(frozen=True, slots=True)
class MaskServerParams:
    """``filter_mask_server``, also under names that end in ``_mask_server``.

    A map server for a mask.
    """

    yaml_filename: str = ""  # map_server YAML file; a relative path starts at the Nav2 file
    topic_name: str = "map"
