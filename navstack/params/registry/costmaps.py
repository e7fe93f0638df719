"""Costmaps, their layers and filters."""

from navstack.params.costmap import (
    CostmapParams,
    DenoiseLayerParams,
    InflationLayerParams,
    ObservationSourceParams,
    ObstacleLayerParams,
    StaticLayerParams,
)
from navstack.params.filters import KeepoutFilterParams, SpeedFilterParams
from navstack.params.registry.block import OPEN, Block, PluginList, keys, of_fields, parameters, words
from navstack.params.registry.entry import Entry, Family
from navstack.params.spatio_temporal import SpatioTemporalLayerParams, SpatioTemporalSourceParams

_UNREAD = words("topic sensor_frame data_type transport_type min_obstacle_height max_obstacle_height")
_SOURCE = Block(
    parameters(ObservationSourceParams) | _UNREAD,
    renamed={"obstacle_range": "obstacle_max_range", "raytrace_range": "raytrace_max_range"},
)
_STVL_SOURCE = of_fields(
    SpatioTemporalSourceParams,
    *_UNREAD,
    *("vertical_fov_angle", "vertical_fov_padding", "filter", "voxel_min_points"),
)
_OBSTACLE = parameters(ObstacleLayerParams) | words(
    "plugin tf_filter_tolerance track_unknown_space transform_tolerance"
)

_MAP = ("navstack.costmap.kernels",)
_INFLATION = ("navstack.costmap.inflation_kernels", "navstack.costmap.spread_kernels")
_BEAMS = (*_MAP, "navstack.costmap.cell_kernels", "navstack.costmap.beam_kernels", *_INFLATION)
_PLANAR = (
    "runs as an obstacle layer on the robot's planar scan: one return marks its cell, whatever its height and "
    "mark_threshold"
)

_FILTERS: Family = {
    "nav2_costmap_2d::KeepoutFilter": Entry(
        of_fields(KeepoutFilterParams, "plugin", "transform_tolerance"), params=KeepoutFilterParams
    ),
    "nav2_costmap_2d::SpeedFilter": Entry(
        of_fields(SpeedFilterParams, "plugin", "transform_tolerance", "speed_limit_topic"), params=SpeedFilterParams
    ),
    "nav2_costmap_2d::BinaryFilter": Entry(
        keys("plugin enabled filter_info_topic transform_tolerance default_state binary_state_topic flip_threshold")
    ),
    "nav2_costmap_2d::ZoneParameterFilter": Entry(OPEN),
}

# Nav2 loads the plugins of both lists alike: a filter may stand among the layers, a layer among the filters.
LAYERS: Family = {
    "nav2_costmap_2d::StaticLayer": Entry(
        keys(
            """plugin enabled map_topic map_subscribe_transient_local subscribe_to_updates transform_tolerance
        track_unknown_space use_maximum lethal_cost_threshold unknown_cost_value trinary_costmap
        footprint_clearing_enabled restore_cleared_footprint"""
        ),
        params=StaticLayerParams,
        kernels=_MAP,
    ),
    "nav2_costmap_2d::ObstacleLayer": Entry(
        Block(_OBSTACLE, named={"observation_sources": _SOURCE}), params=ObstacleLayerParams, kernels=_BEAMS
    ),
    "nav2_costmap_2d::VoxelLayer": Entry(
        Block(
            _OBSTACLE | words("publish_voxel_map origin_z z_resolution z_voxels unknown_threshold mark_threshold"),
            named={"observation_sources": _SOURCE},
        ),
        params=ObstacleLayerParams,
        kernels=_BEAMS,
        note=_PLANAR,
    ),
    "nav2_costmap_2d::InflationLayer": Entry(
        of_fields(InflationLayerParams, "plugin", "num_threads"),
        params=InflationLayerParams,
        kernels=_INFLATION,
    ),
    "nav2_costmap_2d::LegacyInflationLayer": Entry(
        keys("plugin enabled inflation_radius cost_scaling_factor inflate_unknown inflate_around_unknown"),
        params=InflationLayerParams,
        kernels=_INFLATION,
    ),
    "nav2_costmap_2d::AsymmetricInflationLayer": Entry(OPEN),
    "nav2_costmap_2d::RangeSensorLayer": Entry(
        keys(
            """plugin enabled topics phi inflate_cone no_readings_timeout clear_threshold mark_threshold
        clear_on_max_reading input_sensor_type"""
        ),
        params=ObstacleLayerParams,  # without sources
        note="adds nothing: no robot here has range sensors",
    ),
    "nav2_costmap_2d::DenoiseLayer": Entry(of_fields(DenoiseLayerParams, "plugin"), params=DenoiseLayerParams),
    "nav2_costmap_2d::PluginContainerLayer": Entry(
        Block(words("plugin enabled combination_method"), plugins={"plugins": PluginList("layers")})
    ),
    "spatio_temporal_voxel_layer::SpatioTemporalVoxelLayer": Entry(
        Block(
            parameters(SpatioTemporalLayerParams)
            | words(
                """plugin voxel_distance_decay mark_threshold origin_z publish_voxel_map transform_tolerance
                mapping_mode map_save_duration unknown_threshold"""
            ),
            named={"observation_sources": _STVL_SOURCE},
        ),
        params=SpatioTemporalLayerParams,
        kernels=_BEAMS,
        note=_PLANAR,
    ),
    **_FILTERS,
}

COSTMAP = Block(
    parameters(CostmapParams)
    | words(
        """always_send_full_costmap global_frame map_topic map_vis_z observation_sources publish_frequency
        robot_base_frame use_radius transform_tolerance initial_transform_timeout unknown_cost_value clearable_layers
        subscribe_to_stamped_footprint"""
    ),
    plugins={
        "plugins": PluginList(
            "layers",
            {
                "static_layer": "nav2_costmap_2d::StaticLayer",
                "obstacle_layer": "nav2_costmap_2d::ObstacleLayer",
                "inflation_layer": "nav2_costmap_2d::InflationLayer",
            },
        ),
        "filters": PluginList("layers"),
    },
)
