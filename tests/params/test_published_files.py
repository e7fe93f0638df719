"""Our two files of the published robot beside the published ones.

Every difference is known (docs/calibration.md).
"""

import os
import re
from pathlib import Path
from typing import Any

import pytest
from ruamel.yaml import YAML

from harness.storage.shipped import shipped
from navstack.params.registry import releases

DATA = os.environ.get("NAVSTACK_DATA")
FOLDER = Path(DATA or "") / "costnav"
pytestmark = pytest.mark.skipif(
    not DATA, reason="NAVSTACK_DATA is not set: the published files are not there"
)

NAMES = {  # ours -> published, of plugins and sources
    "tuned": {
        "static_layer": "static_map_layer",
        "local_costmap.obstacle_layer": "local_costmap.front_3d_lidar_layer",
    },
    "stock": {
        "static_layer": "static_map_layer",
        "local_costmap.voxel_layer.points": "local_costmap.front_3d_lidar_layer.hesai_mark",
        "local_costmap.voxel_layer": "local_costmap.front_3d_lidar_layer",
    },
}
NOT_HERE = (  # nodes that no delivery needs
    r"docking_server\..*|map_saver\..*|robot_state_publisher\..*|map_server\.yaml_filename|"
    r"\w+_(client|rclcpp_node)\.use_sim_time"
)
WIRING = (  # names of topics, nodes and plugins
    r".*\.(odom_topic|scan_topic|map_topic|topic|(local_|global_)?(costmap|footprint)_topic)|"
    r".*\.(plugins|observation_sources|map_subscribe_transient_local)|"
    r"controller_server\.goal_checker_plugins|"
    r"bt_navigator\.error_code_names|.*\.use_realtime_priority|"
    r".*\.(publish_frequency|always_send_full_costmap|publish_voxel_map|debug_trajectory_details|"
    r"save_pose_rate)"
)
WAITING = (  # for other processes, which answer at once here
    r".*\.(transform_tolerance|costmap_update_timeout|wait_for_service_timeout|"
    r"action_server_result_timeout|stop_pub_timeout|odom_duration)"
)
IGNORED = (  # by Nav2 itself: names that the plugin does not have
    r"local_costmap\.mark_threshold|controller_server\.FollowPath\.stateful|"
    r"collision_monitor\.scan\.m(in|ax)_height|"
    r"local_costmap\.front_3d_lidar_layer\.(decay_model|voxel_decay|voxel_size|track_unknown_space|"
    r"update_footprint_enabled)|.*\.hesai_mark\.(clear_after_reading|filter)"
)
KEEPOUT = r"(local|global)_costmap\.keepout_filter\..*"  # ours; without effect on the published map
INITIAL_POSE = r"amcl\.(set_initial_pose|initial_pose\.\w+)"  # here that of the mission


def jazzys_defaults() -> dict[str, list[Any]]:
    """The defaults that Nav2 Jazzy declares anywhere, by the last part of a parameter's name."""
    facts = releases.load("jazzy")
    namespaces = [*facts["nodes"].values()]
    for family in facts["plugins"].values():
        namespaces += family.values()
    found: dict[str, list[Any]] = {}
    for namespace in namespaces:
        for name, default in namespace.items():
            found.setdefault(name.rpartition(".")[2], []).append(default)
    return found


def flat(file: Path) -> dict[str, Any]:
    """Parameters by node.dotted.name."""
    found: dict[str, Any] = {}

    def walk(prefix: str, value: Any) -> None:
        if isinstance(value, dict):
            for key, each in value.items():
                walk(prefix if key == "ros__parameters" else f"{prefix}{key}.", each)
        else:
            found[prefix[:-1]] = value.replace(" ", "") if isinstance(value, str) else value

    walk("", YAML(typ="safe", pure=True).load(file.read_text(encoding="utf-8")))
    return {
        re.sub(r"^(local|global)_costmap\.\1", r"\1", key): value for key, value in found.items()
    }


def ours(name: str) -> dict[str, Any]:
    """Our file under the published names."""
    renamed: dict[str, Any] = {}
    for key, value in flat(shipped("params") / "nav2" / f"{name}.yaml").items():
        key = key.replace(
            "controller_server.goal_checker.", "controller_server.general_goal_checker."
        )
        for mine, theirs in NAMES[name].items():
            if "." in mine or key.startswith("local_costmap."):
                key = key.replace(mine, theirs)
        renamed[key] = value
    return renamed


@pytest.mark.parametrize(("name", "published"), [("tuned", "true"), ("stock", "false")])
def test_every_difference_is_known(name: str, published: str) -> None:
    theirs, mine = flat(FOLDER / f"segway_e1_navigation_params_tuned_{published}.yaml"), ours(name)
    defaults, unknown = jazzys_defaults(), {}
    for key in sorted(theirs.keys() | mine.keys()):
        sides = theirs.get(key), mine.get(key)
        given = [side for side in sides if side is not None]
        known = any(
            re.fullmatch(each, key)
            for each in (NOT_HERE, WIRING, WAITING, IGNORED, KEEPOUT, INITIAL_POSE)
        )
        known |= len(given) == 1 and given[0] in defaults.get(key.rpartition(".")[2], [])
        if not known and sides[0] != sides[1]:
            unknown[key] = sides
    assert unknown == {}


def test_the_published_scan_clears_nothing_beyond_its_returns() -> None:
    theirs = flat(FOLDER / "segway_e1_navigation_params_tuned_true.yaml")
    assert theirs["local_costmap.front_3d_lidar_layer.scan.inf_is_valid"] is False
    assert ours("tuned")["local_costmap.front_3d_lidar_layer.scan.inf_is_valid"] is False
    assert ours("tuned")["global_costmap.obstacle_layer.scan.inf_is_valid"] is False
