"""Where Nav2's sources declare the parameters of which node and plugin."""

import re

NOT_READ = re.compile(r"(^|/)(test|tests|nav2_system_tests|benchmark|nav2_rviz_plugins)/|^tools/")
# names that are no parameters, or that name a plugin
NO_PARAMETERS = re.compile(
    r"^$|[/ ]|>\.?$|(^|\.)(plugin|class)$"
    r"|(Align|Dist|Footprint)\.(scale|max_scaling_factor|scaling_speed)$"  # set for older files
)
CRITIC = "Critic"
LEFT_OUT = ("_critic", "_navigator")  # ends of classes' names that their files' names may lack
_MONITOR = "nav2_collision_monitor/src/"
_ZONES = (
    f"{_MONITOR}(polygon|circle|velocity_polygon|source|pointcloud|range|polygon_source|costmap)"
    "\\.cpp"
)
_TWISTS = "nav2_util/include/nav2_util/twist_(publisher|subscriber)"

# Variables of the sources that stand for a name of a list; others stand for the plugin's own.
LISTS = (
    ("velocity_polygon", "velocity_polygons.*"),
    ("polygon", "polygons.*"),
    ("source", "observation_sources.*"),
    ("zone", "exclusion_zones.*"),
    ("dock", "docks.*"),
    ("shape", "shapes.*"),
    ("prefix", "states.*"),
)

# node -> regular expressions of its files
NODES = {
    "amcl": ["nav2_amcl/src/amcl_node"],
    "bt_navigator": [
        "nav2_behavior_tree/include/.*bt_action_server_impl",
        "nav2_core/include/.*behavior_tree_navigator",
        "nav2_bt_navigator/src/bt_navigator",
    ],
    "controller_server": ["nav2_controller/src/", _TWISTS],
    "costmap": ["nav2_costmap_2d/src/costmap_2d_ros"],
    "planner_server": ["nav2_planner/src/"],
    "smoother_server": ["nav2_smoother/src/nav2_smoother"],
    "behavior_server": ["nav2_(behaviors|recoveries)/src/", _TWISTS],
    "velocity_smoother": ["nav2_velocity_smoother/src/", _TWISTS],
    "collision_monitor": [f"{_MONITOR}(collision_monitor_node|exclusion_zone)", _ZONES, _TWISTS],
    "collision_detector": [f"{_MONITOR}collision_detector_node", _ZONES],
    "waypoint_follower": ["nav2_waypoint_follower/src/"],
    "docking_server": [
        "nav2_docking/opennav_docking/src/"
        r"(docking_server|parameter_handler|controller|dock_database|navigator)\.cpp",
        r"nav2_docking/opennav_docking/include/.*utils\.hpp",
        _TWISTS,
    ],
    "following_server": ["nav2_following/opennav_following/src/"],
    "route_server": ["nav2_route/src/[^/]*$"],
    "map_server": ["nav2_map_server/src/map_server/"],
    "map_saver": ["nav2_map_server/src/map_saver/"],
    "costmap_filter_info_server": ["nav2_map_server/src/costmap_filter_info/"],
    "vector_object_server": ["nav2_map_server/src/vo_server/"],
    "lifecycle_manager": ["nav2_lifecycle_manager/src/"],
    "loopback_simulator": [r"nav2_loopback_sim/.*loopback_simulator\.(py|cpp)"],
}

# base class in a plugin description -> family
FAMILIES = {
    "nav2_core::Controller": "controllers",
    "nav2_core::GlobalPlanner": "planners",
    "nav2_core::Smoother": "smoothers",
    "nav2_core::GoalChecker": "goal_checkers",
    "nav2_core::ProgressChecker": "progress_checkers",
    "nav2_core::PathHandler": "path_handlers",
    "nav2_core::Behavior": "behaviors",
    "nav2_core::Recovery": "behaviors",
    "nav2_core::NavigatorBase": "navigators",
    "nav2_core::WaypointTaskExecutor": "waypoint_tasks",
    "nav2_costmap_2d::Layer": "layers",
    "dwb_core::TrajectoryCritic": "dwb_critics",
    "mppi::critics::CriticFunction": "mppi_critics",
    "mppi::MotionModel": "motion_models",
    "mppi::OptimalTrajectoryValidator": "trajectory_validators",
    "opennav_docking_core::ChargingDock": "docks",
    "nav2_route::EdgeCostFunction": "edge_scorers",
    "nav2_route::RouteOperation": "route_operations",
    "nav2_route::GraphFileLoader": "graph_loaders",
}
# family -> node, or family and type, to which belongs what its plugins declare elsewhere
HOSTS = {
    "behaviors": "behavior_server",
    "navigators": "bt_navigator",
    "dwb_critics": "dwb_core::DWBLocalPlanner",
    "mppi_critics": "nav2_mppi_controller::MPPIController",
}
OF_HOST = ("dwb_plugin_name_", "parent_name_")  # variables for the namespace of critics' hosts
# family -> files of helpers that all its plugins have
SHARED = {
    "mppi_critics": ("critic_function",),
    "motion_models": ("motion_models",),
    "planners": ("types",),
}
ONE_PLUGIN = (
    "nav2_constrained_smoother",
    "nav2_graceful_controller",
    "nav2_navfn_planner",
    "nav2_regulated_pure_pursuit_controller",
    "nav2_rotation_shim_controller",
    "nav2_theta_star_planner",
    "smac_planner",
)
WHOLE_FOLDERS = {
    "dwb_core::DWBLocalPlanner": "dwb_core/src|dwb_plugins/",
    "nav2_mppi_controller::MPPIController": "src/[^/]*$|tools/path_handler|motion_models",
}
_NAMESPACES = {"dwb_critics": "dwb_critics::", "mppi_critics": "mppi::critics::"}


def as_named(family: str, kind: str) -> str:
    """How a parameter file names a class: critics without namespace, DWB's without Critic."""
    name = kind.removeprefix(_NAMESPACES.get(family, ""))
    if family == "dwb_critics":
        name = name.removesuffix(CRITIC)
    return name
