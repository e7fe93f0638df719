"""A robot file and a sensors file from what was identified, each value with where it is from."""

from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from ruamel.yaml import YAML
from ruamel.yaml.comments import CommentedMap, CommentedSeq

from harness.identify.estimate import Estimate
from harness.identify.identification import Identified
from harness.identify.urdf import UrdfBody
from harness.recorded.drive_log import DriveLog
from harness.storage.documents import write_file
from harness.storage.shipped import shipped
from harness.task.own_body import KEPT, Limits, body_of, own_body
from harness.world.physics.robot import RobotParams
from harness.world.sensors.suite import SensorParams
from navstack.params.nav2_file.file import load_nav2
from navstack.params.strict import from_mapping, load_yaml
from navstack.types import FloatArray

DEFAULT_ROBOT, DEFAULT_SENSORS = "segway_e1", "rtk_good"
_NOTED = 0.02  # [-] by which a drive may differ from its commands without a word
_LONGEST_RANGE = 200.0  # [m] beyond which a lidar's stated range is none
_ROBOT = {  # of the robot file; the limits are those of commanded speeds, which the world follows
    "servo_time_constant": "lag_s",
    "compute_latency": "dead_time_s",
    "max_acceleration": "linear_max_acceleration_mps2",
    "max_deceleration": "linear_max_deceleration_mps2",
    "max_yaw_acceleration": "angular_max_acceleration_radps2",
}
_LIMITS = (  # of the robot file, in the order of Limits
    *("max_speed", "max_yaw_rate", "max_acceleration", "max_deceleration"),
    "max_yaw_acceleration",
)
_SENSORS = {  # of the sensors file
    "lidar": {
        "noise_std": "lidar_noise_std_m",
        "dropout": "lidar_dropout",
        "latency": "lidar_latency_s",
    },
    "odometry": {
        "linear_noise": "odometry_linear_noise",
        "yaw_noise_per_distance": "odometry_yaw_noise_per_distance",
        "yaw_noise_per_turn": "odometry_yaw_noise_per_turn",
        "velocity_std": "odometry_velocity_std_mps",
        "yaw_rate_std": "odometry_yaw_rate_std_radps",
        "slip": "odometry_slip",
        "latency": "odometry_latency_s",
    },
    "imu": {
        "yaw_rate_std": "imu_yaw_rate_std_radps",
        "acceleration_std": "imu_acceleration_std_mps2",
        "latency": "imu_latency_s",
    },
    "gps": {"position_std": "gps_position_std_m", "latency": "gps_latency_s"},
}
_SIZES = {  # errors that the world draws anew in each delivery, with this size
    ("odometry", "linear_scale_std"): ("odometry_linear_scale", 1.0),
    ("odometry", "angular_scale_std"): ("odometry_angular_scale", 1.0),
    ("imu", "yaw_rate_bias_std"): ("imu_yaw_rate_bias_radps", 0.0),
}


@dataclass(frozen=True, slots=True)
class Written:
    """The files that were made."""

    robot: Path
    sensors: Path
    measured: int  # values of both that were measured
    total: int  # values of both
    notes: tuple[str, ...]


@dataclass(slots=True)
class _Values:
    """Values with where each is from."""

    values: dict[str, Any]
    sources: dict[str, str]

    def put(self, key: str, value: Any, source: str) -> None:
        """Enter a value."""
        self.values[key] = value
        self.sources[key] = source


def sensors_beside(robot: Path) -> Path:
    """The sensors file that goes with a robot file."""
    return robot.with_name(f"{robot.stem}_sensors.yaml")


def write_files(
    out: Path,
    found: Identified,
    log: DriveLog,
    urdf: UrdfBody | None,
    nav2: Path | None,
) -> Written:
    """Write ``out`` and, beside it, ``<name>_sensors.yaml``.

    Raises:
        InputError: a file cannot be written, or the Nav2 file cannot be read.
    """
    notes: list[str] = []
    robot = _body(found, log, urdf, nav2, notes)
    for key, name in _ROBOT.items():
        estimate = found.estimates[name]
        if estimate.value is not None:
            robot.put(key, float(max(round(estimate.value, 5), 0.0)), _measured(estimate))
    _note_gain(found, notes)
    sensors = _sensors(found, log, robot.values)
    # refused here rather than by the next command
    from_mapping(RobotParams, robot.values, "robot")
    plain = {name: group.values for name, group in sensors.items()}
    from_mapping(SensorParams, plain, "sensors")
    title = f"From {log.files}, {log.duration:.0f} s, by navbench identify."
    beside = sensors_beside(out)
    groups = CommentedMap({name: _commented(group) for name, group in sensors.items()})
    texts = {out: _text(_commented(robot)), beside: _text(groups)}
    for path, text in texts.items():
        write_file(path, f"# {title}\n{text}")
    sources = [*robot.sources.values()]
    for group in sensors.values():
        sources += group.sources.values()
    measured = sum(source.startswith("measured") for source in sources)
    return Written(out, beside, measured, len(sources), tuple(notes))


def _body(
    found: Identified,
    log: DriveLog,
    urdf: UrdfBody | None,
    nav2: Path | None,
    notes: list[str],
) -> _Values:
    """The body: the Nav2 file's, with what the URDF says; else the default robot's."""
    params = shipped("params")
    default = params / "robots" / f"{DEFAULT_ROBOT}.yaml"
    known = load_yaml(default)
    speed, turn = _fastest(found, log)
    source = f"assumed: as {DEFAULT_ROBOT}"
    body = None
    if nav2 is not None:
        sensors = params / "sensors" / f"{DEFAULT_SENSORS}.yaml"
        body = own_body(load_nav2(nav2, True), default, sensors, nav2.stem)
    if body is not None:
        known, source = load_yaml(Path(body.robot)), f"from {nav2 and nav2.name}"
    if urdf is not None and urdf.box is not None:
        limits = Limits(speed, turn, 2.5, 2.5, 3.2, 0.0)
        if body is not None:
            limits = Limits(*(*(known[name] for name in _LIMITS), 0.0))
        outline = np.round(urdf.box, 4)
        known, source = body_of(outline, limits, known), "assumed from the URDF's outline"
    robot = _Values(dict(known), dict.fromkeys(known, source))
    if body is not None and nav2 is not None and (urdf is None or urdf.box is None):
        guessed = set(known) - {"footprint", *_LIMITS}
        robot.sources |= dict.fromkeys(guessed, f"assumed from the outline in {nav2.name}")
        robot.sources |= dict.fromkeys(guessed & set(KEPT), f"assumed: as {DEFAULT_ROBOT}")
    if body is None:
        robot.put("max_speed", round(speed, 3), "measured: the fastest of the log")
        robot.put("max_yaw_rate", round(turn, 3), "measured: the fastest of the log")
    if urdf is None and nav2 is None:
        notes.append(
            f"the body is {DEFAULT_ROBOT}'s; give --urdf or --nav2 for the outline of yours"
        )
    if urdf is not None:
        _enter_urdf(robot, urdf, found, notes)
    return robot


def _note_gain(found: Identified, notes: list[str]) -> None:
    """Say so where the robot drives farther than it is told, which the world's does not."""
    for axis, what in (("linear", "drives"), ("angular", "turns")):
        gain, scale = (found.value(f"{axis}_command_gain"), found.value(f"odometry_{axis}_scale"))
        if gain is None or scale is None:
            continue
        more = gain / scale - 1.0
        if abs(more) > _NOTED:
            notes.append(f"it {what} {100.0 * more:+.1f} % against its commands; here it does not")


def _fastest(found: Identified, log: DriveLog) -> tuple[float, float]:
    """Speed [m/s] and yaw rate [rad/s] that the robot reached, outliers apart."""
    speed, turn = np.percentile(np.abs(log.odometry[:, 4:6]), 99.5, axis=0).tolist()
    speed /= found.value("odometry_linear_scale") or 1.0
    turn /= found.value("odometry_angular_scale") or 1.0
    return max(speed, 0.1), max(turn, 0.1)


def _enter_urdf(robot: _Values, urdf: UrdfBody, found: Identified, notes: list[str]) -> None:
    """Enter what the URDF says, wheels by their measured scales."""
    if urdf.box is None:
        notes.append("the URDF has no boxes, cylinders or spheres, so that its outline is unknown")
    if urdf.axle is not None and abs(urdf.axle) > 0.02:
        notes.append(f"the URDF's base is {urdf.axle:+.2f} m off the driven axle; taken as on it")
    values = robot.values
    if urdf.height is not None:
        robot.put("height", round(urdf.height, 4), "URDF")
    if urdf.mass is not None:
        torque = values["max_wheel_torque"] * urdf.mass / values["mass"]
        robot.put("mass", round(urdf.mass, 3), "URDF")
        robot.put("max_wheel_torque", round(torque, 4), "assumed: by the mass")
    if urdf.casters is not None and abs(urdf.casters) > 0.05:
        robot.put("wheelbase", round(-urdf.casters, 4), "URDF")
    _enter_wheels(robot, urdf, found)
    if urdf.center_of_mass is not None:
        _enter_center(robot, urdf.center_of_mass)


def _enter_wheels(robot: _Values, urdf: UrdfBody, found: Identified) -> None:
    """Wheel radius and track: the URDF's by their measured scales."""
    linear, angular = (found.estimates[f"odometry_{name}_scale"] for name in ("linear", "angular"))
    if urdf.wheel_radius is not None:
        radius, source = urdf.wheel_radius, "URDF"
        if linear.value is not None:
            radius, source = radius / linear.value, f"measured scale {1 / linear.value:.4f} of URDF"
        robot.put("wheel_radius", round(radius, 5), source)
    if urdf.track is not None:
        track, source = urdf.track, "URDF"
        if linear.value is not None and angular.value is not None:
            share = angular.value / linear.value
            track, source = track * share, f"measured scale {share:.4f} of URDF"
        robot.put("track", round(track, 5), source)


def _enter_center(robot: _Values, center: FloatArray) -> None:
    """The centre of mass, kept where the world's robot stands."""
    values = robot.values
    wheelbase = values["wheelbase"]
    low, high = sorted((-0.9 * wheelbase, -0.1 * wheelbase))
    x = min(max(float(center[0]), low), high)
    robot.put("center_of_mass_x", round(x, 4), "URDF, between axle and casters")
    height = min(max(float(center[2]), 0.02), 0.9 * values["height"])
    robot.put("center_of_mass_height", round(height, 4), "URDF")
    if values["ground_clearance"] >= values["height"]:
        robot.put("ground_clearance", round(0.1 * values["height"], 4), "assumed")


def _sensors(found: Identified, log: DriveLog, body: dict[str, Any]) -> dict[str, _Values]:
    """The sensors, those that the log has as measured."""
    base = load_yaml(shipped("params") / "sensors" / f"{DEFAULT_SENSORS}.yaml")
    assumed = f"assumed: as {DEFAULT_SENSORS}"
    sensors = {name: _Values(group, dict.fromkeys(group, assumed)) for name, group in base.items()}
    for name, keys in _SENSORS.items():
        for key, identified in keys.items():
            estimate = found.estimates[identified]
            if estimate.value is not None:
                value = float(round(max(estimate.value, 0.0), 6))
                sensors[name].put(key, value, _measured(estimate))
    for (name, key), (identified, usual) in _SIZES.items():
        estimate = found.estimates[identified]
        if estimate.value is not None:
            size = float(round(abs(estimate.value - usual), 6))
            sensors[name].put(key, size, f"{_measured(estimate)}; drawn anew with this size")
    _enter_rates(sensors, log)
    _enter_lidar(sensors["lidar"], found, log, body)
    if len(log.imu):
        has_heading = bool(np.isfinite(log.imu[:, 1]).mean() > 0.5)
        sensors["imu"].put("has_heading", has_heading, "measured: as its messages say")
    return sensors


def _enter_rates(sensors: dict[str, _Values], log: DriveLog) -> None:
    stamps = {
        "odometry": log.stamps,
        "imu": log.imu_stamps,
        "gps": log.fixes[:, 0],
        "lidar": np.array([scan.stamp for scan in log.scans]),
    }
    for name, times in stamps.items():
        steps = np.diff(np.unique(times))  # of two bags of one drive each stamp is there twice
        if len(steps) > 1:
            rate = float(round(1.0 / float(np.median(steps)), 2))
            sensors[name].put("rate", rate, "measured: by its stamps")


def _enter_lidar(lidar: _Values, found: Identified, log: DriveLog, body: dict[str, Any]) -> None:
    """The lidar's beams as the messages say, and where it is."""
    corners = np.array(body["footprint"])
    low, high = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    outline = {"x_min": low[0], "x_max": high[0], "y_min": low[1], "y_max": high[1]}
    lidar.put("self_filter", outline, "the outline")
    if not log.scans:
        middle = {"x": 0.5 * (low[0] + high[0]), "y": 0.5 * (low[1] + high[1]), "yaw": 0.0}
        lidar.put("mount", middle, "assumed: the middle of the body")
        return
    scan = log.scans[len(log.scans) // 2]
    beams, said = len(scan.ranges), "measured: as its messages say"
    view = float(min(abs(scan.angle_increment) * beams, 2.0 * np.pi))
    lidar.put("beams", beams, said)
    lidar.put("field_of_view", round(view, 9), said)
    lidar.put("range_max", round(min(scan.range_max, _LONGEST_RANGE), 3), said)
    shortest = min(scan.range_min, 0.5 * lidar.values["range_max"])
    lidar.put("range_min", round(shortest, 4), said)
    stated, source = scan.sensor_pose, "measured: as the log's frames say"
    mount = {"x": stated.x, "y": stated.y, "yaw": stated.yaw}
    if not log.has_mounting:
        source = "assumed: nobody says where it is"
    for key, name in (("x", "lidar_x_m"), ("y", "lidar_y_m"), ("yaw", "lidar_yaw_rad")):
        if (value := found.value(name)) is not None:
            mount[key], source = value, "measured: motions between scans"
    mount["yaw"] += scan.angle_min + 0.5 * view  # the world's beams lie evenly about its x axis
    mount["yaw"] = (mount["yaw"] + np.pi) % (2.0 * np.pi) - np.pi
    lidar.put("mount", {key: float(round(value, 5)) for key, value in mount.items()}, source)


def _measured(estimate: Estimate) -> str:
    """Where a value is from, with its interval."""
    low, high = estimate.low, estimate.high
    if low is None or high is None:
        return "measured"
    return f"measured [{low:.4g}, {high:.4g}], {estimate.seconds:.0f} s"


def _commented(group: _Values) -> CommentedMap:
    content = CommentedMap({key: _in_a_line(value) for key, value in group.values.items()})
    for key, source in group.sources.items():
        content.yaml_add_eol_comment(source, key)
    return content


def _in_a_line(value: Any) -> Any:
    """A list or mapping as YAML that takes one line."""
    if isinstance(value, dict):
        flat: Any = CommentedMap(value)
    elif isinstance(value, list | tuple):
        flat = CommentedSeq(value)
    else:
        return value
    flat.fa.set_flow_style()
    return flat


def _text(content: CommentedMap) -> str:
    yaml = YAML(pure=True)
    yaml.width = 4096
    stream = StringIO()
    yaml.dump(content, stream)
    return stream.getvalue()
