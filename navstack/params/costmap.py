"""Parameters of a layered costmap.

Names and defaults are those of Nav2 Jazzy's ``nav2_costmap_2d``.

The layers stand in :attr:`CostmapParams.layers` under their instance names; ``plugins`` and then
``filters`` give their order. A layer's type selects its dataclass in
``navstack.params.registry.costmaps``.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar

import numpy as np

from navstack.errors import ParameterError
from navstack.geometry import make_footprint
from navstack.params.filters import KeepoutFilterParams, SpeedFilterParams
from navstack.params.nav2_file.vertices import parse_vertices
from navstack.params.spatio_temporal import SpatioTemporalLayerParams
from navstack.ranges import (
    NOT_NEGATIVE,
    Capped,
    NotNegative,
    NotNegativeInt,
    OpenQuantity,
    Parameters,
    Positive,
    Quantity,
    Replaced,
    Whole,
    within,
)
from navstack.types import FloatArray

MOST_CELLS = 20_000_000  # of a costmap, or of a map at its resolution; 223 m x 223 m at 0.05 m
OVERWRITE, MAXIMUM, MAXIMUM_WITHOUT_UNKNOWN = 0, 1, 2  # values of combination_method
CIRCLE_VERTICES = 16  # of a footprint made from robot_radius
CombinationMethod = Annotated[int, Replaced((OVERWRITE, MAXIMUM, MAXIMUM_WITHOUT_UNKNOWN), MAXIMUM)]
GroupConnectivityType = Annotated[int, Replaced((4, 8), 8)]

# [m] from the sensor; no map is wider, and cells are counted by it
Reach = Annotated[float, NOT_NEGATIVE, Capped(1e6)]


@dataclass(frozen=True, slots=True)
class StaticLayerParams:
    """``static_layer.cpp``.

    What all layers share (thresholds, unknown cells) stands in :class:`CostmapParams`.
    """

    enabled: bool = True


@dataclass(frozen=True, slots=True)
class ObservationSourceParams(Parameters, whose="observation source"):
    """One of a layer's ``observation_sources``; here each is fed with the robot's one scan."""

    marking: bool = True
    clearing: bool = False
    obstacle_max_range: Reach = 2.5  # [m] farther returns do not mark
    obstacle_min_range: Reach = 0.0  # [m] nearer returns do not mark
    raytrace_max_range: Reach = 3.0  # [m] beams clear up to here
    raytrace_min_range: Reach = 0.0  # [m] beams clear from here
    # a beam without return clears (as if it ended at range_max); False: it says nothing
    inf_is_valid: bool = False
    # [s] scans are applied again for so long; 0: the newest only
    observation_persistence: NotNegative = 0.0
    # [s] between scans; the costmap is not current when they stay away; 0: any
    expected_update_rate: NotNegative = 0.0


@dataclass(frozen=True, slots=True)
class ObstacleLayerParams(Parameters):
    """``obstacle_layer.cpp``."""

    CELLS_SHORT: ClassVar[int] = 0  # by how many cells a clearing beam ends before the return
    enabled: bool = True
    footprint_clearing_enabled: bool = True  # cells under the robot are free in this layer
    min_obstacle_height: OpenQuantity = (
        0.0  # [m] lower points do not mark; a planar scan has no heights
    )
    max_obstacle_height: OpenQuantity = 2.0  # [m] higher points do not mark
    # with the layers below: 0 overwrite, 2 maximum but unknown stays, else maximum
    combination_method: CombinationMethod = MAXIMUM
    observation_sources: tuple[str, ...] = ()
    # by the names just above
    sources: Mapping[str, ObservationSourceParams] = field(default_factory=dict)

    @property
    def active_sources(self) -> tuple[ObservationSourceParams, ...]:
        """The sources in their order; one that is named but not described has Nav2's defaults."""
        return tuple(
            self.sources.get(name, ObservationSourceParams()) for name in self.observation_sources
        )


@dataclass(frozen=True, slots=True)
class VoxelLayerParams(ObstacleLayerParams):
    """``voxel_layer.cpp``, which runs as an obstacle layer on the robot's planar scan."""

    CELLS_SHORT: ClassVar[int] = 2


@dataclass(frozen=True, slots=True)
class InflationLayerParams(Parameters):
    """``inflation_layer.cpp``."""

    enabled: bool = True
    inflation_radius: Annotated[float, within(0.0, 100.0)] = 0.55  # [m]
    # [1/m] how fast the cost falls beyond the inscribed radius
    cost_scaling_factor: NotNegative = 10.0
    inflate_unknown: bool = False  # unknown cells take any cost > 0; False: only 253 and more
    inflate_around_unknown: bool = False  # unknown cells inflate as obstacles do
    # [1/cell] Nav2 main rounds distances to so many steps per cell (100 there); 0: exact
    distance_steps: NotNegativeInt = 0


@dataclass(frozen=True, slots=True)
class DenoiseLayerParams(Parameters):
    """``denoise_layer.cpp``."""

    enabled: bool = True
    # [cells] smaller groups of obstacle cells are freed; 1 or less: none
    minimal_group_size: Whole = 2
    # neighbours that make a group: 4, else 8 with the diagonal ones
    group_connectivity_type: GroupConnectivityType = 8


LayerParams = (
    StaticLayerParams
    | ObstacleLayerParams
    | SpatioTemporalLayerParams
    | InflationLayerParams
    | DenoiseLayerParams
    | KeepoutFilterParams
    | SpeedFilterParams
)


def _default_layers() -> dict[str, LayerParams]:
    return {
        "static_layer": StaticLayerParams(),
        "obstacle_layer": ObstacleLayerParams(),
        "inflation_layer": InflationLayerParams(),
    }


@dataclass(frozen=True, slots=True)
class CostmapParams(Parameters):
    """``local_costmap`` or ``global_costmap`` (``costmap_2d_ros.cpp``)."""

    width: Positive = 5.0  # [m] of a costmap without a static layer, and of every rolling one
    height: Positive = 5.0  # [m]
    # [m/cell] as a map's may be; a fixed costmap with a static layer takes the map's
    resolution: Annotated[float, within(1e-4, 1e3)] = 0.1
    origin_x: Quantity = 0.0  # [m] of the lower left corner while nothing else sets it
    origin_y: Quantity = 0.0  # [m]
    rolling_window: bool = False  # the costmap moves with the robot
    update_frequency: NotNegative = 5.0  # [Hz] 0: it starts and is never updated
    footprint: str = "[]"  # "[[x, y], ...]" in [m]; "[]": a circle of robot_radius
    robot_radius: Quantity = 0.1  # [m]
    footprint_padding: Quantity = 0.01  # [m] added to each vertex
    track_unknown_space: bool = False  # cells start unknown instead of free
    lethal_cost_threshold: Whole = 100  # [%] occupancy from which a cell of the map is lethal
    trinary_costmap: bool = True  # map cells below the threshold are free; False: scaled
    # the static layer keeps higher costs of the layers before it; False: it overwrites them
    use_maximum: bool = False
    plugins: tuple[str, ...] = ("static_layer", "obstacle_layer", "inflation_layer")
    # no default in merged files: in ROS 2 an empty list has no type
    filters: tuple[str, ...] = field(default_factory=tuple)
    layers: Mapping[str, LayerParams] = field(default_factory=_default_layers)

    def _check_together(self) -> None:
        cells = self.width / self.resolution * (self.height / self.resolution)
        if self.rolling_window and cells > MOST_CELLS:
            raise ParameterError(
                f"width {self.width:g} m and height {self.height:g} m at resolution "
                f"{self.resolution:g} m/cell are {cells:,.0f} cells; at most {MOST_CELLS:,} are "
                "allowed"
            )
        for name in (*self.plugins, *self.filters):
            if name not in self.layers:
                raise ParameterError(
                    f"costmap plugin '{name}' is not described; described: {', '.join(self.layers)}"
                )

    def enabled_layers(self, names: tuple[str, ...]) -> dict[str, LayerParams]:
        """The enabled ones of ``plugins`` or of ``filters``, in the order in which they write."""
        return {name: self.layers[name] for name in names if self.layers[name].enabled}

    @property
    def has_keepout_filter(self) -> bool:
        """Whether a keepout filter is listed, enabled or not."""
        return any(
            isinstance(self.layers[name], KeepoutFilterParams)
            for name in (*self.plugins, *self.filters)
        )


# of a costmap whose layers are read by themselves
WITHOUT_LAYERS: dict[str, Any] = {"plugins": (), "filters": (), "layers": {}}


def is_unreadable(footprint: str) -> bool:
    """Whether Nav2 cannot read the text of a footprint, and takes robot_radius instead."""
    try:
        robot_footprint(CostmapParams(footprint=footprint))
    except ParameterError:
        return True
    return False


def robot_footprint(params: CostmapParams) -> FloatArray:
    """The unpadded footprint polygon (N, 2) in [m], base frame (``footprint.cpp``).

    Text is parsed to single precision as Nav2 does; an empty one gives the circle of
    ``robot_radius``.

    Raises:
        ParameterError: the text is not a list of at least three pairs.
    """
    vertices = parse_vertices(params.footprint)
    if vertices is None:
        raise ParameterError(
            f"footprint '{params.footprint}' is not a list of [x, y] pairs, "
            "e.g. [[0.3, 0.2], [0.3, -0.2], [-0.3, 0]]"
        )
    if vertices:
        return make_footprint(vertices).astype(np.float32).astype(np.float64)
    angles = np.arange(CIRCLE_VERTICES) * (2.0 * math.pi / CIRCLE_VERTICES)
    return params.robot_radius * np.column_stack((np.cos(angles), np.sin(angles)))
