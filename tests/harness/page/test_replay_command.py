"""``navbench replay``: messages that rosbags reads back, and one clear line for what cannot be."""

import json

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from harness.metrics.columns import EPISODE_COLUMNS, EVENT_COLUMNS
from harness.recorded.bag import Bag
from harness.recorded.ros_messages import TYPES
from harness.report.replay import RecordedReplay, contacts_shown, grid_around
from harness.report.replay_bag import GREY, RED, write_bag
from harness.storage.checksums import write_checksums
from harness.storage.tables import read_rows
from harness.world.map.scene_io import load_scene
from navstack.geometry import compose
from navstack.types import Pose2D

TOPICS = {
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
    "/map": "nav_msgs/msg/OccupancyGrid",
    "/scan": "sensor_msgs/msg/LaserScan",
    "/odom": "nav_msgs/msg/Odometry",
    "/plan": "nav_msgs/msg/Path",
    "/people": "visualization_msgs/msg/MarkerArray",
    "/tracks": "visualization_msgs/msg/MarkerArray",
    "/contacts": "visualization_msgs/msg/MarkerArray",
    "/belief": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "/ground_truth": "geometry_msgs/msg/PoseStamped",
    "/footprint": "geometry_msgs/msg/PolygonStamped",
    "/cmd_vel": "geometry_msgs/msg/TwistStamped",
}


ROW = {"duration_s": 5.0, "start_x_m": 0.0, "start_y_m": 0.0, "goal_x_m": 8.0, "goal_y_m": 0.0}
CORNERS = np.array([[0.1, 0.2], [0.1, -0.2], [-0.6, -0.2], [-0.6, 0.2]])


def read(path):
    """Every message by topic, with its time of arrival [s]."""
    found = {}
    with AnyReader([path]) as reader:
        for connection, time, content in reader.messages():
            message = reader.deserialize(content, connection.msgtype)
            found.setdefault(connection.topic, []).append((time / 1e9, message))
        kinds = {connection.topic: connection.msgtype for connection in reader.connections}
    assert kinds == TOPICS
    return found


def messages_of(path, topic):
    """The messages of one topic."""
    with AnyReader([path]) as reader:
        own = [each for each in reader.connections if each.topic == topic]
        # given no connections, rosbags reads all of them
        read_back = reader.messages(connections=own) if own else ()
        return [reader.deserialize(content, each.msgtype) for each, _, content in read_back]


@pytest.fixture
def bag(folder, navbench, tmp_path):
    """The bag of the recorded delivery."""
    code, _, err = navbench("replay", folder, 1, "--mcap", tmp_path / "d.mcap")
    assert code == 0, err
    return tmp_path / "d.mcap"


def yaw_of(rotation):
    return float(2.0 * np.arctan2(rotation.z, rotation.w))


def pose_of(transform):
    moved = transform.transform
    return Pose2D(moved.translation.x, moved.translation.y, yaw_of(moved.rotation))


def test_rosbags_reads_the_messages_back(folder, bag, make_arrays):
    arrays = make_arrays(read_rows(folder / "episodes.parquet", EPISODE_COLUMNS)[1], 1)
    found = read(bag)
    trace = arrays["trace"]
    truth = np.array(
        [(time, m.pose.position.x, m.pose.position.y) for time, m in found["/ground_truth"]]
    )
    np.testing.assert_allclose(truth, trace[:, :3], atol=1e-9)
    stamps = [m.header.stamp.sec + m.header.stamp.nanosec * 1e-9 for _, m in found["/scan"]]
    np.testing.assert_allclose(stamps, arrays["scan_stamp"], atol=1e-9)
    ranges = np.array([m.ranges for _, m in found["/scan"]])
    assert np.isinf(ranges[:, 0]).all()
    np.testing.assert_allclose(ranges[:, 1:], arrays["scan_mm"][:, 1:] / 1000.0, atol=1e-6)
    assert [len(m.poses) for _, m in found["/plan"]] == arrays["plan_size"].tolist()
    assert {len(m.markers) for _, m in found["/people"]} == {arrays["crowd"].shape[1]}
    for (_, message), row in zip(found["/tf"], trace, strict=True):
        by_child = {each.child_frame_id: pose_of(each) for each in message.transforms}
        believed = compose(by_child["odom"], by_child["base_link"])
        np.testing.assert_allclose((believed.x, believed.y), row[6:8], atol=1e-9)
    grid = found["/map"][0][1]
    assert len(grid.data) == grid.info.width * grid.info.height > 0
    assert grid.info.resolution == pytest.approx(load_scene("sidewalk").geometry.resolution)
    events = [
        each for each in read_rows(folder / "events.parquet", EVENT_COLUMNS) if each["episode"] == 1
    ]
    assert [time for time, _ in found["/contacts"]] == pytest.approx(
        [e["stamp_s"] for e in contacts_shown(events)]
    )


def test_a_person_who_was_hit_is_red_whatever_the_price(make_arrays, tmp_path):
    event = {
        "x_m": 1.0,
        "y_m": 0.0,
        "impulse_ns": 2727.0,
        "type": "counted_contact",
        "cost_usd": 0.0,
    }
    person = {"kind": "pedestrian", "partner": "pedestrian", "partner_id": 3}
    thing = {"kind": "mailbox", "partner": "property", "partner_id": 1}
    later = {"type": "contact_event", "cost_usd": None, "duration_s": 0.5}
    hits = [
        {**event, **person, "stamp_s": 3.0},
        {**event, **thing, "stamp_s": 2.0, "cost_usd": 4.5},
        {**event, **thing, "stamp_s": 1.0},
        # the same contact as a whole: not shown twice
        {**event, **person, **later, "stamp_s": 2.8},
        {**event, **person, **later, "stamp_s": 4.0},
        {**event, **person, "stamp_s": None},
    ]
    write_bag(
        tmp_path / "d.mcap",
        RecordedReplay(make_arrays(ROW), contacts_shown(hits), CORNERS, 0.3),
        None,
    )
    found = messages_of(tmp_path / "d.mcap", "/contacts")
    colours = [(m.markers[0].color.r, m.markers[0].color.g, m.markers[0].color.b) for m in found]
    np.testing.assert_allclose(colours, [GREY, RED, RED, GREY], rtol=1e-6)


def test_headings_of_a_plan_point_to_the_next_pose_and_the_last_one_stays(bag):
    poses = messages_of(bag, "/plan")[0].poses
    last, before = poses[-1].pose.orientation, poses[-2].pose.orientation
    assert (last.z, last.w) == (before.z, before.w)


def test_a_map_that_has_changed_is_in_no_file(folder, navbench, tmp_path):
    about = json.loads((folder / "run.json").read_text(encoding="utf-8"))
    (folder / "run.json").write_text(
        json.dumps({**about, "map_sha256": "0" * 64}), encoding="utf-8"
    )
    write_checksums(folder)
    code, _, err = navbench("replay", folder, 1, "--mcap", tmp_path / "d.mcap")
    assert (code, err.count("\n")) == (0, 1)
    assert "note: the replay has no map: map 'sidewalk' has changed since the run" in err
    assert messages_of(tmp_path / "d.mcap", "/map") == []


def test_a_way_off_the_map_has_no_map(make_arrays, tmp_path):
    arrays, grid = (
        make_arrays({**ROW, "start_x_m": 900.0, "goal_x_m": 908.0}),
        load_scene("sidewalk").geometry,
    )
    assert grid_around(grid, arrays["trace"]) is None
    write_bag(tmp_path / "d.mcap", RecordedReplay(arrays, [], CORNERS, 0.3), grid)
    assert messages_of(tmp_path / "d.mcap", "/map") == []


def test_the_absent_stand_nowhere(make_arrays, tmp_path):
    arrays = make_arrays({**ROW, "duration_s": 2.0})
    arrays["crowd"][:10, 1] = np.inf
    write_bag(tmp_path / "d.mcap", RecordedReplay(arrays, [], CORNERS, 0.3), None)
    messages = messages_of(tmp_path / "d.mcap", "/people")
    shown = [[marker.id for marker in message.markers] for message in messages]
    assert shown == [[0, 2, 3, 4]] * 10 + [[0, 1, 2, 3, 4]] * (len(arrays["trace"]) - 10)


def test_our_own_reader_of_recorded_logs_takes_the_file(bag):
    with Bag([bag], TYPES) as opened:
        assert {"/scan", "/odom", "/tf"} <= set(opened.topics)


def test_what_cannot_be_shown_is_said_in_one_line(folder, tmp_path, navbench, write_run):
    two = write_run("two", stacks=("a", "b"), episodes=2)
    page, mcap = tmp_path / "p.html", tmp_path / "d.mcap"
    mcap.mkdir()
    for words, said in (
        ((folder, 9, "--html", page), "finished no episode 9"),
        ((two, 9, "--html", page), "no episode 9 finished"),
        ((f"{two}:c", 0, "--html", page), "'c'"),
        ((folder, 1, "--mcap", tmp_path / "d.bag"), "give a name that ends with .mcap"),
        ((folder, 1, "--mcap", tmp_path / "no" / "d.mcap"), "its folder does not exist"),
        ((folder, 1, "--mcap", mcap), "it is a folder; give a file"),
        ((folder, 1, "--html", page, "--mcap", "no/d.mcap"), "its folder does not exist"),
    ):
        code, _, err = navbench("replay", *words)
        assert (code, said in err, err.count("\n")) == (1, True, 1), err
    mcap.rmdir()
    assert not page.exists(), "nothing is made before all can be"
    assert not list(tmp_path.glob("*.mcap")) and not list(tmp_path.glob(".bag-*"))
