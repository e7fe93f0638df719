"""Costmap layers and filters that run here."""

from navstack.params.costmap import (
    DenoiseLayerParams,
    InflationLayerParams,
    ObstacleLayerParams,
    StaticLayerParams,
    VoxelLayerParams,
)
from navstack.params.filters import KeepoutFilterParams, SpeedFilterParams
from navstack.params.registry.entry import AlgorithmEntry
from navstack.params.registry.nav2 import family
from navstack.params.spatio_temporal import SpatioTemporalLayerParams

_MAP = ("navstack.costmap.kernels",)
_SPREAD = ("navstack.costmap.inflation_kernels", "navstack.costmap.spread_kernels")
_BEAMS = (*_MAP, "navstack.costmap.cell_kernels", "navstack.costmap.beam_kernels", *_SPREAD)
_INFLATION = AlgorithmEntry(params=InflationLayerParams, kernels=_SPREAD)
_PLANAR = (
    "runs as an obstacle layer on the robot's planar scan: "
    "one return marks its cell, whatever its height and mark_threshold"
)

LAYERS = family(
    "layers",
    {
        "nav2_costmap_2d::StaticLayer": AlgorithmEntry(params=StaticLayerParams, kernels=_MAP),
        "nav2_costmap_2d::ObstacleLayer": AlgorithmEntry(
            params=ObstacleLayerParams, kernels=_BEAMS
        ),
        "nav2_costmap_2d::VoxelLayer": AlgorithmEntry(
            params=VoxelLayerParams, kernels=_BEAMS, note=_PLANAR
        ),
        "nav2_costmap_2d::InflationLayer": _INFLATION,
        "nav2_costmap_2d::LegacyInflationLayer": _INFLATION,
        "nav2_costmap_2d::RangeSensorLayer": AlgorithmEntry(
            params=ObstacleLayerParams,  # without sources
            note="adds nothing: no robot here has range sensors",
        ),
        "nav2_costmap_2d::DenoiseLayer": AlgorithmEntry(params=DenoiseLayerParams),
        "spatio_temporal_voxel_layer::SpatioTemporalVoxelLayer": AlgorithmEntry(
            params=SpatioTemporalLayerParams, kernels=_BEAMS, note=_PLANAR
        ),
        "nav2_costmap_2d::KeepoutFilter": AlgorithmEntry(params=KeepoutFilterParams),
        "nav2_costmap_2d::SpeedFilter": AlgorithmEntry(params=SpeedFilterParams),
    },
)
