import pytest

from navstack.errors import ParameterError
from navstack.params.costmap import InflationLayerParams
from navstack.params.nav2_file.file import load_nav2
from navstack.params.nav2_file.views import read_controller, read_costmap
from navstack.params.registry.releases import span

DWB = """
controller_server:
  ros__parameters:
    controller_plugins: ["FollowPath"]
    FollowPath:
      plugin: "dwb_core::DWBLocalPlanner"
      max_vel_x: 1.0
      critics: ["PathAlign", "GoalDist"]
      PathAlign.scale: 8.0
      GoalDist:
        scale: 4.0
"""


def costmap(body):
    return "local_costmap:\n  local_costmap:\n    ros__parameters:\n" + body


SOURCES = """
      plugins: ["obstacle_layer"]
      obstacle_layer:
        plugin: "nav2_costmap_2d::ObstacleLayer"
        observation_sources: scan base_scan
        scan: {topic: /scan, clearing: true}
        base_scan: {topic: /base_scan}
"""


def only_error(file):
    assert len(file.errors) == 1, file.errors
    return file.errors[0]


@pytest.mark.parametrize(
    ("text", "where", "nearest"),
    [
        (
            DWB.replace("max_vel_x", "max_vel_xx"),
            "controller_server: FollowPath.max_vel_xx",
            "max_vel_x",
        ),
        (DWB.replace("PathAlign.scale", "PathAlign.scal"), "FollowPath.PathAlign.scal", "scale"),
        (DWB.replace("PathAlign.scale", "PathAlgn.scale"), "FollowPath.PathAlgn", "PathAlign"),
        (
            DWB.replace("controller_server:", "controler_server:") + "amcl: {ros__parameters: }",
            "controler_server",
            "controller_server",
        ),
        (
            DWB.replace("controller_plugins", "controller_plugin"),
            "controller_plugin",
            "controller_plugins",
        ),
        (
            DWB.replace("    FollowPath:", "    FollowPth:"),
            "controller_server: FollowPth",
            "FollowPath",
        ),
        (costmap("      robot_radus: 0.3\n"), "local_costmap: robot_radus", "robot_radius"),
        (
            costmap(SOURCES.replace("clearing", "claering")),
            "obstacle_layer.scan.claering",
            "clearing",
        ),
        (
            costmap(SOURCES.replace("        scan:", "        scann:")),
            "obstacle_layer.scann",
            "scan",
        ),
        ("amcl: {ros__parameters: {initial_pose: {yaww: 0.0}}}", "amcl: initial_pose.yaww", "yaw"),
        ("amcl: {ros__parameters: {use_sim_tme: true}}", "amcl: use_sim_tme", "use_sim_time"),
        (
            "planner_server: {ros__parameters: {GridBased: {toleranc: 0.1}}}",
            "GridBased.toleranc",
            "tolerance",
        ),
    ],
)
def test_misspelt_names_offer_the_nearest(inspect, text, where, nearest):
    message = only_error(inspect(text))
    assert where in message
    assert f"did you mean '{nearest}'?" in message


def test_errors_raise_with_file_and_line_and_soften_on_request(inspect, tmp_path):
    inspect(DWB.replace("max_vel_x", "max_vel_xx").replace("scale: 4.0", "sale: 4.0"))
    path = tmp_path / "robot.yaml"
    with pytest.raises(ParameterError, match=r"robot.yaml: line 7: .*max_vel_xx.*\(and 1 more"):
        load_nav2(path)
    file = load_nav2(path, allow_unknown=True)
    assert any("max_vel_xx" in warning for warning in file.warnings)
    assert not file.errors


@pytest.mark.parametrize(
    ("node", "line", "said"),
    [
        (
            "controller_server",
            "FollowPath: 5",
            "FollowPath: 5 is not a section of keys; write its parameters below",
        ),
        (
            "controller_server",
            "controller_plugins: [Mine], Mine: true",
            "Mine: True is not a section of keys",
        ),
        (
            "planner_server",
            "planner_plugins: [GridBased], GridBased: a",
            "GridBased: 'a' is not a section of keys",
        ),
    ],
)
def test_a_value_where_a_section_belongs_is_told_as_such(inspect, node, line, said):
    assert said in only_error(inspect(f"{node}: {{ros__parameters: {{{line}}}}}"))


def test_real_plugins_that_are_not_available_are_named_when_used(inspect):
    text = (
        DWB + "    goal_checker_plugins: [near]\n"
        "    near: {plugin: nav2_controller/AdaptiveToleranceGoalChecker}\n"
    )
    file = inspect(text)
    expected = (
        "nav2_controller::AdaptiveToleranceGoalChecker is a Nav2 plugin that is not available "
        "here; available: "
    )
    assert not file.errors
    assert any(expected in warning for warning in file.warnings)
    with pytest.raises(ParameterError, match="is a Nav2 plugin that is not available here"):
        file.plugin("controller_server", "near", "goal_checkers")


def test_a_layer_of_range_sensors_adds_nothing_and_legacy_inflation_is_inflation(inspect):
    layers = """
      plugins: ["sonar", "puff"]
      sonar: {plugin: "nav2_costmap_2d::RangeSensorLayer", topics: ["/sonar"], phi: 1.2}
      puff: {plugin: "nav2_costmap_2d::LegacyInflationLayer", inflation_radius: 0.7}
"""
    file = inspect(costmap(layers))
    assert not file.errors and any(
        "adds nothing: no robot here has range sensors" in each for each in file.warnings
    )
    params = read_costmap(file, "local_costmap")
    assert params.layers["sonar"].observation_sources == ()
    assert params.layers["puff"] == InflationLayerParams(inflation_radius=0.7)


def test_a_footprint_that_is_a_list_is_read_as_the_text(inspect):
    for given in ("[[0.3, 0.2], [0.3, -0.2], [-0.3, 0]]", "[0.3, 0.2, 0.3, -0.2, -0.3, 0.0]"):
        file = inspect(costmap(f"      footprint: {given}\n"))
        assert not file.errors and any(
            "a list of numbers, read as the text" in each for each in file.warnings
        )
        assert (
            read_costmap(file, "local_costmap").footprint
            == "[[0.3, 0.2], [0.3, -0.2], [-0.3, 0.0]]"
        )
    assert "is not a text" in only_error(inspect(costmap("      footprint: [[0.3, 0.2], [0.3]]\n")))


def test_a_pose_in_one_value_has_no_effect_as_in_nav2(inspect):
    file = inspect(
        "amcl: {ros__parameters: {initial_pose: [1.0, 2.0, 0.5], max_beams: 60}}",
        allow_unknown=True,
    )
    assert not file.errors and any(
        "initial_pose" in each and "has no effect" in each for each in file.warnings
    )


def test_plugins_as_eloquent_lists_them(inspect):
    text = DWB.replace("controller_plugins:", "controller_plugin_ids:").replace(
        "      plugin: ", "      spare: "
    )
    text = text.replace(
        "    FollowPath:",
        '    controller_plugin_types: ["dwb_core::DWBLocalPlanner"]\n    FollowPath:',
    )
    file = inspect(text, allow_unknown=True)
    assert not file.errors and any("is of Nav2 Eloquent" in each for each in file.warnings)
    assert read_controller(file).params.max_vel_x == 1.0
    layers = (
        '      plugin_names: ["wide"]\n      plugin_types: ["nav2_costmap_2d::InflationLayer"]\n'
    )
    params = read_costmap(
        inspect(costmap(layers + "      wide: {inflation_radius: 0.8}\n")), "local_costmap"
    )
    assert params.layers == {"wide": InflationLayerParams(inflation_radius=0.8)}


def test_both_spellings_and_older_packages_of_plugins(inspect):
    text = (
        "recoveries_server: {ros__parameters: {recovery_plugins: [spin], spin: {plugin: "
        "nav2_recoveries/Spin}}}\n"
    )
    file = inspect(
        text + "planner_server: {ros__parameters: {GridBased: {plugin: "
        "nav2_navfn_planner/NavfnPlanner}}}"
    )
    assert not file.errors
    assert (
        file.plugin("planner_server", "GridBased", "planners") == "nav2_navfn_planner::NavfnPlanner"
    )
    assert file.value("behavior_server", "behavior_plugins") == ["spin"]
    assert any("recoveries_server: is an older name" in warning for warning in file.warnings)


def test_a_missing_type_is_an_error_but_for_nav2s_own_names(inspect):
    assert not inspect("planner_server: {ros__parameters: {GridBased: {tolerance: 1.0}}}").errors
    text = "planner_server: {ros__parameters: {planner_plugins: [Mine], Mine: {tolerance: 1.0}}}"
    assert "'planner_plugins' names it, but its 'plugin' is missing" in only_error(inspect(text))


def test_rotation_shim_shares_its_namespace_with_the_primary_controller(inspect):
    shim = "nav2_rotation_shim_controller::RotationShimController"
    text = DWB.replace(
        '"dwb_core::DWBLocalPlanner"',
        f"{shim}\n      primary_controller: dwb_core::DWBLocalPlanner",
    )
    assert not inspect(text).errors
    assert "did you mean 'max_vel_x'" in only_error(
        inspect(text.replace("max_vel_x", "max_vel_xx"))
    )
    assert "unknown plugin" in only_error(inspect(text.replace("r: dwb_core", "r: dwc_core")))


def test_parameters_of_an_exchanged_plugin_are_ignored_not_unknown(inspect):
    file = inspect(DWB.replace("max_vel_x: 1.0", "forward_sampling_distance: 0.5"))
    assert not file.errors
    assert any(
        "FollowPath.forward_sampling_distance (of nav2_rotation_shim" in name
        for name in file.ignored
    )


def test_sections_that_no_list_names_are_ignored(inspect):
    file = inspect(
        "collision_monitor:\n  ros__parameters:\n    polygons: [Stop]\n"
        "    Stop: {type: circle, action_type: stop, radius: 0.3}\n"
        "    Limit: {type: polygon, linear_limit: 0.4}\n"
        + costmap(
            "      plugins: [inflation_layer]\n"
            "      static_layer: {map_subscribe_transient_local: true}\n"
        )
    )
    assert not file.errors
    assert "local_costmap: static_layer (no list names it)" in file.ignored


def test_what_nodes_of_a_tree_read_is_ignored_not_unknown(inspect):
    """Nav2 hands all parameters of bt_navigator on to them."""
    file = inspect("bt_navigator: {ros__parameters: {goal_reached_tol: 0.25, my_node_topic: /x}}")
    assert not file.errors and not file.warnings
    ignored = ["bt_navigator: goal_reached_tol", "bt_navigator: my_node_topic"]
    assert [name for name in file.ignored if "bt_navigator" in name] == ignored
    misspelt = inspect("bt_navigator: {ros__parameters: {bt_loop_durations: 10}}")
    assert "did you mean 'bt_loop_duration'" in only_error(misspelt)


def test_a_costmap_source_of_the_monitor_has_parameters_of_its_own(inspect):
    file = inspect(
        "collision_monitor:\n  ros__parameters:\n    observation_sources: [c]\n"
        "    c: {type: costmap, cost_threshold: 254, treat_unknown_as_obstacle: true}\n"
    )
    assert not file.errors


def test_what_has_no_effect_is_listed_once(inspect):
    file = inspect(
        DWB + "    use_sim_time: true\n    odom_topic: odom\n"
        "amcl: {ros__parameters: {use_sim_time: true}}\n"
    )
    assert file.ignored.count("use_sim_time") == 1
    assert "controller_server: odom_topic" in file.ignored
    assert not any("max_vel_x" in name or "scale" in name for name in file.ignored)


def test_voxel_layer_runs_as_obstacle_layer_with_a_note(inspect):
    file = inspect(
        costmap(SOURCES.replace("ObstacleLayer", "VoxelLayer") + "        z_voxels: 16\n")
    )
    assert not file.errors
    assert any("VoxelLayer runs as an obstacle layer" in warning for warning in file.warnings)
    assert "local_costmap: obstacle_layer.z_voxels" in file.ignored


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            DWB.replace("1.0", "fast"),
            "controller_server: FollowPath.max_vel_x: 'fast' is not a number",
        ),
        (
            DWB.replace('["PathAlign", "GoalDist"]', "3"),
            "controller_server: FollowPath.critics: 3 is not a list",
        ),
        (
            DWB.replace("1.0", "1.0\n      vx_samples: 2.5"),
            "FollowPath.vx_samples: 2.5 is not a whole number",
        ),
        (
            DWB.replace("1.0", "1.0\n      prune_plan: 1"),
            "FollowPath.prune_plan: 1 is not true or false",
        ),
        (
            DWB.replace("8.0", "[8.0]"),
            "controller_server: FollowPath.PathAlign.scale: [8.0] is not a number",
        ),
        (DWB.replace("8.0", ".nan"), "FollowPath.PathAlign.scale: nan is not a number"),
        (
            "velocity_smoother: {ros__parameters: {max_accel: [1.0, 0.0]}}",
            "max_accel: [1.0, 0.0] has 2 entries",
        ),
        (
            "planner_server: {ros__parameters: {GridBased: {tolerance: -1.0}}}",
            "GridBased: tolerance -1.0 must be 0 to 100",
        ),
        (
            costmap("      footprint: [[0.1, 0.1], [0.1, -0.1]]\n"),
            "local_costmap: footprint: [[0.1, 0.1], [0.1, -0.1]]",
        ),
    ],
)
def test_values_of_the_wrong_kind_are_one_clear_line(inspect, text, message):
    errors = [error for error in inspect(text).errors if message in error]
    assert len(errors) == 1
    assert "\n" not in errors[0]


def test_whole_numbers_where_nav2_insists_on_decimals_are_warned_of(inspect):
    file = inspect(
        DWB.replace("max_vel_x: 1.0", "max_vel_x: 1") + costmap("      width: 3\n      height: 3\n")
    )
    assert [notice.path for notice in file.notices if notice.id == "whole-number"] == [
        "controller_server: FollowPath.max_vel_x"
    ]


def test_a_section_in_the_place_of_a_value_is_not_called_misspelt(inspect):
    file = inspect("controller_server:\n  ros__parameters:\n    controller_frequency: {hz: 20.0}\n")
    (notice,) = [notice for notice in file.notices if notice.id == "unknown-key"]
    assert (notice.path, notice.line) == ("controller_server: controller_frequency", 3)
    assert "section" in notice.message and "did you mean" not in notice.message


def test_decimals_where_nav2_insists_on_whole_numbers_are_warned_of(inspect):
    file = inspect(costmap("      width: 3.5\n      height: 3\n"))
    (notice,) = [notice for notice in file.notices if notice.id == "decimal-number"]
    assert (notice.path, notice.line, notice.is_error) == ("local_costmap: width", 4, False)
    assert read_costmap(file, "local_costmap").width == 3.5
    merged = file.merged()["global_costmap"]["global_costmap"]["ros__parameters"]
    assert (merged["width"], type(merged["width"])) == (5, int)


def test_another_behavior_tree_is_warned_of(inspect):
    text = (
        'bt_navigator: {ros__parameters: {default_nav_to_pose_bt_xml: "$(find-pkg-share '
        'x)/trees/mine.xml"}}'
    )
    assert any("'mine.xml' is not read" in warning for warning in inspect(text).warnings)
    assert not inspect(text.replace("mine", "navigate_to_pose_w_replanning_and_recovery")).warnings


def test_own_planner_keys_are_known(inspect):
    text = (
        "planner_server: {ros__parameters: {GridBased: {plugin: navstack::OmplPlanner, "
        "algorithm: RRTstar}}}"
    )
    assert not inspect(text).errors
    assert "did you mean 'algorithm'" in only_error(inspect(text.replace("algorithm", "algoritm")))
    assert "unknown OMPL algorithm 'RRTsta'" in only_error(
        inspect(text.replace("RRTstar", "RRTsta"))
    )


@pytest.mark.parametrize(
    ("family", "plugin", "meant"),
    [
        # the same class in another package, whatever else is spelt alike
        (
            "layers",
            "nav2_costmap_2d::SpatioTemporalVoxelLayer",
            "spatio_temporal_voxel_layer::SpatioTemporalVoxelLayer",
        ),
        ("controllers", "nav2_dwb_controller::DWBLocalPlanner", "dwb_core::DWBLocalPlanner"),
        ("goal_checkers", "mine::StoppedGoalChecker", "nav2_controller::StoppedGoalChecker"),
        # what does its work
        ("planners", "nav2_smac_planner::SmacPlanner", "nav2_smac_planner::SmacPlannerHybrid"),
        ("layers", "mine::NonPersistentVoxelLayer", "nav2_costmap_2d::ObstacleLayer"),
        # misspelt
        ("layers", "nav2_costmap_2d::InflatonLayer", "nav2_costmap_2d::InflationLayer"),
        # another package's own
        ("controllers", "neo_local_planner::NeoLocalPlanner", ""),
        ("planners", "mine::Planner", ""),
    ],
)
def test_the_plugin_that_is_meant_by_another(inspect, family, plugin, meant):
    catalog = inspect("amcl: {ros__parameters: {max_beams: 60}}").catalog
    assert catalog.meant(family, plugin) == meant
    refusal = catalog.refusal(family, plugin)
    assert ("did you mean" in refusal) is (bool(meant) and not catalog.families[family].get(plugin))
    assert not meant or meant in catalog.way_on(family, "here", plugin)


def test_every_class_of_nav2_is_found_in_another_package(inspect):
    catalog = inspect("amcl: {ros__parameters: {max_beams: 60}}").catalog
    for family in ("controllers", "planners", "layers", "goal_checkers", "progress_checkers"):
        for kind in catalog.available[family]:
            name = kind.rpartition("::")[2]
            assert catalog.meant(family, f"other::{name}") == kind


def test_a_third_partys_plugin_gets_a_way_on_in_lint(inspect):
    text = DWB.replace("dwb_core::DWBLocalPlanner", "neo_local_planner::NeoLocalPlanner")
    (notice,) = [each for each in inspect(text).notices if each.id == "unknown-plugin"]
    assert "did you mean" not in notice.message
    assert "--substitute FollowPath=dwb_core::DWBLocalPlanner" in notice.advice


def test_what_a_monitor_needs_to_start_is_told(inspect):
    """Nav2 declares these without a default, and throws."""
    zone = "Slow: {type: velocity_polygon, action_type: stop, velocity_polygons: [fast], fast: "
    body = "collision_monitor:\n  ros__parameters:\n    polygons: [Slow]\n    " + zone
    shape = 'points: "[[1, 1], [1, -1], [-1, -1], [-1, 1]]"'
    given = body + f"{{{shape}, linear_min: 0.0, linear_max: 1.0, theta_max: 1.0}}}}\n"
    missing = [each for each in inspect(given).notices if each.id == "missing-value"]
    assert [each.path for each in missing] == [
        "collision_monitor: observation_sources",
        "collision_monitor: Slow.fast.theta_min",
    ]
    assert all(each.line == 3 and not each.is_error for each in missing)
    whole = (
        given.replace("linear_min", "theta_min: -1.0, linear_min") + "    observation_sources: []\n"
    )
    assert not [each for each in inspect(whole).notices if each.id == "missing-value"]
    assert not [each for each in inspect(DWB).notices if each.id == "missing-value"]


def told(file) -> dict[str, list[str]]:
    """What is said, by id."""
    found: dict[str, list[str]] = {}
    for notice in file.notices:
        found.setdefault(notice.id, []).append(f"{notice.path}: {notice.message}")
    return found


LAYERS = """\
local_costmap:
  local_costmap:
    ros__parameters:
      plugins: [{names}]
      obstacle_layer: {{enabled: true}}
"""


def test_nav2_gives_types_to_its_own_list_only(inspect):
    own = inspect(LAYERS.format(names='"static_layer", "obstacle_layer", "inflation_layer"'))
    assert "missing-plugin" not in told(own)
    other = inspect(LAYERS.format(names='"obstacle_layer", "inflation_layer"'))
    first, second = sorted(told(other)["missing-plugin"], reverse=True)
    assert "obstacle_layer: its 'plugin' is missing" in first
    assert "inflation_layer: its 'plugin' is missing" in second
    assert not other.errors, "here it has a type"


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("planner_server: {ros__parameters: {planner_plugins: GridBased}}", "a list"),
        ("collision_monitor: {ros__parameters: {polygons: Zone}}", "a list"),
        (
            LAYERS.format(names='"obstacle_layer"').replace(
                "enabled: true",
                'plugin: "nav2_costmap_2d::ObstacleLayer", observation_sources: [scan]',
            ),
            "a text",
        ),
    ],
)
def test_names_are_a_list_or_a_text_as_nav2_declares_them(inspect, text: str, wanted: str):
    assert any(f"is not {wanted}" in error for error in inspect(text).errors)


def test_a_filter_wants_the_topic_of_its_info(inspect):
    text = "global_costmap: {global_costmap: {ros__parameters: {filters: [keepout], "
    text += 'keepout: {plugin: "nav2_costmap_2d::KeepoutFilter"%s}}}}'
    topic = ', filter_info_topic: "/info"'
    assert "missing-value" not in told(inspect(text % topic))
    (message,) = told(inspect(text % ""))["missing-value"]
    assert message.startswith("global_costmap: keepout.filter_info_topic: is missing")


@pytest.mark.parametrize(
    ("type_", "model", "said"),
    [
        ("nav2_navfn_planner/NavfnPlanner", "nav2_amcl::DifferentialMotionModel", "until iron"),
        ("nav2_navfn_planner::NavfnPlanner", "differential", "until galactic"),
        ("nav2_navfn_planner::NavfnPlanner", "nav2_amcl::DifferentialMotionModel", ""),
    ],
)
def test_a_name_of_another_release_is_told(inspect, type_: str, model: str, said: str):
    """Jazzy's names of these plugins are their classes', with ``::``."""
    text = "planner_server: {ros__parameters: {planner_plugins: [GridBased], costmap_update_timeout"
    text += f': 1.0, GridBased: {{plugin: "{type_}"}}}}}}\n'
    text += "controller_server: {ros__parameters: {costmap_update_timeout: 0.3}}\n"
    text += f'amcl: {{ros__parameters: {{robot_model_type: "{model}", freespace_downsampling: '
    text += "false}}\n"
    names = inspect(text).names
    lacking = [name for name in names if "jazzy" not in name.releases]
    assert [span(name.releases) for name in lacking] == ([said] if said else [])


def test_a_type_that_the_file_leaves_out_tells_no_release(inspect):
    """Humble's own list needs none."""
    text = "controller_server: {ros__parameters: {progress_checker_plugin: progress_checker}}\n"
    text += "behavior_server: {ros__parameters: {behavior_plugins: [spin, backup, "
    text += "drive_on_heading, wait]}}\n"
    assert inspect(text).release in ("humble", "iron")


def test_names_may_be_a_text_where_the_package_wants_one(inspect):
    layer = LAYERS.format(names='"stvl"').replace(
        "obstacle_layer: {enabled: true}",
        (
            'stvl: {plugin: "spatio_temporal_voxel_layer/SpatioTemporalVoxelLayer", '
            "observation_sources: mark clear, mark: {topic: a}, clear: {topic: b}}"
        ),
    )
    loader = "route_server: {ros__parameters: {graph_file_loader: GeoJsonGraphFileLoader}}\n"
    for text in (layer, loader):
        assert not [error for error in inspect(text).errors if "is not a" in error]


def test_a_section_of_any_namespace_is_joined_with_the_wildcards(inspect):
    nav2 = inspect(
        "/**:\n  ros__parameters:\n    max_velocity: [0.3, 0.0, 1.0]\n"
        "/**/velocity_smoother:\n  ros__parameters:\n    smoothing_frequency: 20.0\n"
        "velocity_smoother:\n  ros__parameters:\n    feedback: OPEN_LOOP\n"
    )
    assert not nav2.errors
    assert nav2.value("velocity_smoother", "max_velocity") == [0.3, 0.0, 1.0]
    assert nav2.value("velocity_smoother", "smoothing_frequency") == 20.0
    assert "several-namespaces" not in told(nav2)
