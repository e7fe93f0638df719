"""Costmaps, their layers and filters."""

from navstack.params.costmap import DenoiseLayerParams, InflationLayerParams, ObstacleLayerParams, StaticLayerParams
from navstack.params.filters import KeepoutFilterParams, SpeedFilterParams
from navstack.params.registry.block import OPEN, Block, PluginList, keys, words
from navstack.params.registry.entry import Entry, Family
from navstack.params.spatio_temporal import SpatioTemporalLayerParams

_SOURCE = Block(
    words(
        """topic sensor_frame observation_persistence expected_update_rate data_type transport_type
        min_obstacle_height max_obstacle_height inf_is_valid marking clearing obstacle_max_range obstacle_min_range
        raytrace_max_range raytrace_min_range"""
    ),
    renamed={"obstacle_range": "obstacle_max_range", "raytrace_range": "raytrace_max_range"},
)
_STVL_SOURCE = keys(
    """topic sensor_frame observation_persistence expected_update_rate data_type transport_type min_obstacle_height
    max_obstacle_height inf_is_valid marking clearing obstacle_range min_z max_z vertical_fov_angle
    vertical_fov_padding horizontal_fov_angle decay_acceleration filter voxel_min_points clear_after_reading enabled
    model_type"""
)
_OBSTACLE = words(
    """plugin enabled footprint_clearing_enabled min_obstacle_height max_obstacle_height combination_method
    tf_filter_tolerance track_unknown_space transform_tolerance"""
)
_FILTER = "plugin enabled filter_info_topic transform_tolerance"

_MAP = ("navstack.costmap.kernels",)
_BEAMS = (*_MAP, "navstack.costmap.cell_kernels", "navstack.costmap.beam_kernels", "navstack.costmap.spread_kernels")
_INFLATION = ("navstack.costmap.inflation_kernels",)
_PLANAR = (
    "runs as an obstacle layer on the robot's planar scan: one return marks its cell, whatever its height and "
    "mark_threshold"
)

_FILTERS: Family = {
    "nav2_costmap_2d::KeepoutFilter": Entry(
        keys(_FILTER + " override_lethal_cost lethal_override_cost"), params=KeepoutFilterParams
    ),
    "nav2_costmap_2d::SpeedFilter": Entry(keys(_FILTER + " speed_limit_topic"), params=SpeedFilterParams),
    "nav2_costmap_2d::BinaryFilter": Entry(keys(_FILTER + " default_state binary_state_topic flip_threshold")),
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
        keys(
            """plugin enabled inflation_radius cost_scaling_factor inflate_unknown inflate_around_unknown
        num_threads distance_steps"""  # the last is this program's own
        ),
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
    "nav2_costmap_2d::DenoiseLayer": Entry(
        keys("plugin enabled minimal_group_size group_connectivity_type"), params=DenoiseLayerParams
    ),
    "nav2_costmap_2d::PluginContainerLayer": Entry(
        Block(words("plugin enabled combination_method"), plugins={"plugins": PluginList("layers")})
    ),
    "spatio_temporal_voxel_layer::SpatioTemporalVoxelLayer": Entry(
        Block(
            words(
                """plugin enabled voxel_size voxel_decay voxel_distance_decay decay_model mark_threshold origin_z
                update_footprint_enabled combination_method publish_voxel_map transform_tolerance mapping_mode
                map_save_duration track_unknown_space unknown_threshold"""
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
    words(
        """always_send_full_costmap footprint_padding footprint global_frame height width lethal_cost_threshold
        map_topic map_vis_z observation_sources origin_x origin_y publish_frequency resolution robot_base_frame
        robot_radius use_radius rolling_window track_unknown_space transform_tolerance initial_transform_timeout
        trinary_costmap unknown_cost_value update_frequency use_maximum clearable_layers
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
