"""A costmap's layers in their order, the filters among them joined with their masks."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from navstack.costmap.field_cache import shared_array
from navstack.costmap.filters import FilterMask, KeepoutMask, SpeedFilter
from navstack.costmap.occupancy_grid import OCCUPIED, OccupancyGrid
from navstack.costmap.window import Window
from navstack.errors import MapError
from navstack.params.costmap import (
    OVERWRITE,
    CostmapParams,
    DenoiseLayerParams,
    InflationLayerParams,
    ObstacleLayerParams,
    StaticLayerParams,
)
from navstack.params.filters import (
    SPEED_ABSOLUTE,
    SPEED_PERCENT,
    KeepoutFilterParams,
    SpeedFilterParams,
)
from navstack.params.spatio_temporal import SpatioTemporalLayerParams
from navstack.types import BoolArray

BoundLayer = (
    StaticLayerParams
    | ObstacleLayerParams
    | SpatioTemporalLayerParams
    | InflationLayerParams
    | DenoiseLayerParams
    | KeepoutMask
)


class FastParts(NamedTuple):
    """What the quick way makes of the layers between map and obstacles."""

    before: list[KeepoutMask]  # that are inflated
    inflation: InflationLayerParams
    after: list[KeepoutMask]  # that are not


@dataclass(frozen=True, slots=True)
class LayerList:
    """The layers that have an effect: enabled, and filters only where they have a mask."""

    plugins: list[BoundLayer]
    filters: list[BoundLayer]  # written after all others, unseen by them
    speed_filters: list[SpeedFilter]

    def fast_parts(self) -> FastParts | None:
        """What :class:`~navstack.costmap.fast_update.FastUpdate` needs.

        None unless the layers come in this order: a map, obstacles by maximum and keepout masks, at
        most one inflation, keepout masks. Maxima may be taken in any order.
        """
        rest = list(self.plugins)
        after = [layer for layer in self.filters if isinstance(layer, KeepoutMask)]
        if not rest or not isinstance(rest.pop(0), StaticLayerParams):
            return None
        if len(after) < len(self.filters):
            return None
        while rest and isinstance(mask := rest[-1], KeepoutMask):
            after.append(mask)
            rest.pop()
        inflation = InflationLayerParams(inflation_radius=0.0)
        if rest and isinstance(last := rest[-1], InflationLayerParams):
            inflation = last
            rest.pop()
        before = [layer for layer in rest if isinstance(layer, KeepoutMask)]
        obstacles = [layer for layer in rest if isinstance(layer, ObstacleLayerParams)]
        is_maximum = all(layer.combination_method != OVERWRITE for layer in obstacles)
        is_fixed = not any(mask.params.override_lethal_cost for mask in (*before, *after))
        if not (is_maximum and is_fixed and len(before) + len(obstacles) == len(rest)):
            return None
        return FastParts(before, inflation, after)


def join_layers(
    params: CostmapParams, masks: Mapping[str, FilterMask], window: Window
) -> LayerList:
    """The layers of a costmap whose lattice is the window's; ``masks`` by the names of the filters.

    Raises:
        MapError: a mask is rotated.
    """
    speed_filters: list[SpeedFilter] = []

    def joined(names: tuple[str, ...]) -> list[BoundLayer]:
        layers: list[BoundLayer] = []
        for name, layer in params.enabled_layers(names).items():
            mask = masks.get(name)
            if not isinstance(layer, KeepoutFilterParams | SpeedFilterParams):
                layers.append(layer)
            elif mask is None:
                continue
            elif isinstance(layer, KeepoutFilterParams):
                layers.append(KeepoutMask(layer, mask, window, params.rolling_window))
            elif mask.type in (SPEED_PERCENT, SPEED_ABSOLUTE):
                speed_filters.append(SpeedFilter(mask))
        return layers

    return LayerList(joined(params.plugins), joined(params.filters), speed_filters)


def with_world_mask(
    params: CostmapParams,
    masks: Mapping[str, FilterMask],
    static: OccupancyGrid | None,
    keepout: BoolArray | None,
) -> dict[str, FilterMask]:
    """The masks, with ``keepout`` (cells of the map) for each keepout filter that has none.

    Raises:
        MapError: the mask has not the map's shape.
    """
    if keepout is None or static is None:
        return dict(masks)
    if keepout.shape != static.data.shape:
        raise MapError(
            f"the keepout mask has the shape {keepout.shape}, "
            f"the map {static.data.shape}; they must agree"
        )

    def compute() -> npt.NDArray[np.int8]:
        return keepout.astype(np.int8) * np.int8(OCCUPIED)

    cells = shared_array(keepout.size, compute, "keepout cells 1", keepout)
    own = FilterMask(OccupancyGrid(cells, static.resolution, static.origin))
    joined = dict(masks)
    for name, layer in params.layers.items():
        if isinstance(layer, KeepoutFilterParams) and name not in joined:
            joined[name] = own
    return joined
