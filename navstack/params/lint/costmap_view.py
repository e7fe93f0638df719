"""One costmap of a file as the lint rules see it.

Layers that are not available here are seen, too.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property

from navstack.geometry import footprint_radii, pad_footprint
from navstack.params.costmap import (
    WITHOUT_LAYERS,
    CostmapParams,
    InflationLayerParams,
    ObservationSourceParams,
    is_unreadable,
    robot_footprint,
)
from navstack.params.nav2_file.catalog import plugin_type
from navstack.params.nav2_file.file import Nav2File
from navstack.params.nav2_file.findings import names_in
from navstack.params.registry.nodes import DEFAULT_LAYERS
from navstack.types import FloatArray

STATIC, INFLATION = "nav2_costmap_2d::StaticLayer", "nav2_costmap_2d::InflationLayer"
VOXEL = "nav2_costmap_2d::VoxelLayer"
SENSOR_LAYERS = ("nav2_costmap_2d::ObstacleLayer", VOXEL)
RANGE = "nav2_costmap_2d::RangeSensorLayer"
MARKING_LAYERS = (STATIC, *SENSOR_LAYERS, RANGE)


@dataclass(frozen=True, slots=True)
class LayerView:
    """One enabled layer."""

    name: str
    type: str  # as Nav2 Jazzy spells it; empty: the file does not say
    sources: Mapping[str, ObservationSourceParams]  # of an obstacle layer

    @property
    def marks_what_is_seen(self) -> bool:
        """Whether sensors mark in it."""
        return self.type == RANGE or any(source.marking for source in self.sources.values())


@dataclass(frozen=True)
class CostmapView:
    """``local_costmap`` or ``global_costmap``."""

    node: str
    params: CostmapParams  # without its layers
    layers: tuple[LayerView, ...]  # the enabled ones, in the order in which they write
    inflations: Mapping[str, InflationLayerParams]  # the enabled ones, by name

    @cached_property
    def footprint(self) -> FloatArray:
        """The padded polygon (N, 2) in [m], base frame."""
        return pad_footprint(robot_footprint(self.params), self.params.footprint_padding)

    @property
    def inscribed(self) -> float:
        """Largest circle about the base inside the padded footprint, in [m]."""
        return footprint_radii(self.footprint)[0]

    @property
    def circumscribed(self) -> float:
        """Smallest circle about the base around the padded footprint, in [m]."""
        return footprint_radii(self.footprint)[1]

    @property
    def half_window(self) -> float:
        """From the robot to the nearest edge of a rolling window, in [m]."""
        return min(self.params.width, self.params.height) / 2.0

    def has(self, *types: str) -> bool:
        """Whether an enabled layer is of one of these types."""
        return any(layer.type in types for layer in self.layers)

    def sources(self) -> Iterable[tuple[str, ObservationSourceParams]]:
        """All observation sources of the enabled layers, each with its dotted name."""
        for layer in self.layers:
            for name, source in layer.sources.items():
                yield f"{layer.name}.{name}", source


def view_costmap(nav2: Nav2File, node: str) -> CostmapView:
    """The view of a costmap.

    Raises:
        ParameterError: a value of the wrong kind; the check of the file reports it.
    """
    params = nav2.read(CostmapParams, node, **WITHOUT_LAYERS)
    names = names_in(nav2.value(node, "plugins", list(CostmapParams().plugins)))
    enabled = [name for name in names if nav2.value(node, f"{name}.enabled", True) is not False]
    layers = tuple(_layer(nav2, node, name) for name in enabled)
    inflations = {
        layer.name: nav2.read(InflationLayerParams, node, layer.name)
        for layer in layers
        if layer.type == INFLATION
    }
    if is_unreadable(params.footprint):
        params = replace(params, footprint="[]")
    return CostmapView(node, params, layers, inflations)


def _layer(nav2: Nav2File, node: str, name: str) -> LayerView:
    default = DEFAULT_LAYERS.get(name, "")
    kind = plugin_type(nav2.value(node, f"{name}.plugin", default))
    sources = {}
    if kind in SENSOR_LAYERS:
        for source in names_in(nav2.value(node, f"{name}.observation_sources")):
            sources[source] = nav2.read(ObservationSourceParams, node, name, source)
    return LayerView(name, kind, sources)
