"""Robots with drawn parameters that drive in a walled yard, and the logs that they record.

The physics and the sensors are the world's; the log is what a real robot records: commands,
odometry, an inertial unit, scans and fixes with their stamps, in the order of their arrival.
"""

import dataclasses
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from harness.recorded.mcap_writer import McapWriter
from harness.recorded.ros_messages import IMU, POSE_COVARIANCE, TRANSFORMS
from harness.storage.shipped import shipped
from harness.task.mission import Mission
from harness.task.study import RandomStreams
from harness.world.map.extrude import extrude
from harness.world.map.scene import Scene
from harness.world.people.models import make_pedestrians
from harness.world.physics.robot import RobotParams
from harness.world.pybullet_world import PyBulletWorld
from harness.world.sensors.suite import SensorParams, SensorSuite
from harness.world.truth import Contact, CountedContact
from harness.world.world_params import WorldParams
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from navstack.params.strict import load_dataclass
from navstack.types import Observation, Pose2D, Twist2D

from ..writing import Entry, fix, header, odometry, pose, quaternion, scan, transforms

START = 1_700_000_000.0  # [s] of the first message
PHYSICS_RATE = 120.0  # [Hz]
TICK = 1.0 / 60.0  # [s]: two steps of the physics
TICKS_PER_COMMAND = 3
TICKS_PER_POSE = 6
COMPUTED = 0.012  # [s] from a pose to the command that it leads to
HALF = 14.0  # [m] half the width of the yard
TWIST = "geometry_msgs/msg/TwistStamped"
Entries = list[Entry]


@dataclass
class Recorded:
    """A drive with the parameters that it was driven with."""

    robot: RobotParams
    sensors: SensorParams
    truth: dict[str, float]
    entries: Entries = field(default_factory=list)
    poses: list[tuple[float, ...]] = field(default_factory=list)  # stamp, x, y, yaw
    contacts: tuple[Contact, ...] = ()
    counted: tuple[CountedContact, ...] = ()  # those that the published rule pays for
    energy: float = 0.0  # [J] that the motors delivered


@cache
def yard() -> Scene:
    """A square yard with walls, and boxes along them."""
    resolution = 0.05
    cells = round(2.2 * HALF / resolution)
    data = np.full((cells, cells), FREE, dtype=np.int8)
    edge = round(0.1 * HALF / resolution)
    for side in (slice(edge - 4, edge), slice(cells - edge, cells - edge + 4)):
        data[side, :] = OCCUPIED
        data[:, side] = OCCUPIED
    boxes = np.random.default_rng(5)
    for _ in range(14):
        along, size = boxes.integers(edge, cells - edge - 30), boxes.integers(8, 28)
        depth = boxes.integers(6, 24)
        place = [slice(along, along + size), slice(edge, edge + depth)]
        if boxes.random() < 0.5:
            place[1] = slice(cells - edge - depth, cells - edge)
        if boxes.random() < 0.5:
            place.reverse()
        data[tuple(place)] = OCCUPIED
    corner = -0.5 * cells * resolution
    grid = OccupancyGrid(data, resolution, Pose2D(corner, corner))
    return Scene("yard", extrude(grid, data == OCCUPIED), (), grid, grid)


def draw(seed: int) -> tuple[RobotParams, SensorParams]:
    """A robot and its sensors."""
    rng = np.random.default_rng([52, seed])
    params = shipped("params")
    robot = load_dataclass(RobotParams, params / "robots" / "segway_e1.yaml")
    sensors = load_dataclass(SensorParams, params / "sensors" / "rtk_good.yaml")
    robot = dataclasses.replace(
        robot,
        compute_latency=rng.uniform(0.0, 0.25),
        servo_time_constant=rng.uniform(0.04, 0.25),
        max_acceleration=rng.uniform(0.8, 2.5),
        max_deceleration=rng.uniform(1.0, 3.5),
        max_yaw_acceleration=rng.uniform(1.5, 4.0),
    )
    mount = Pose2D(rng.uniform(-0.3, 0.2), rng.uniform(-0.1, 0.1), rng.uniform(-0.3, 0.3))
    lidar = dataclasses.replace(
        sensors.lidar,
        noise_std=rng.uniform(0.008, 0.03),
        mount=mount,
        latency=rng.uniform(0, 0.08),
    )
    wheels = dataclasses.replace(
        sensors.odometry,
        linear_scale_std=0.03,
        angular_scale_std=0.04,
        linear_noise=rng.uniform(0.005, 0.03),
        yaw_noise_per_distance=rng.uniform(0.004, 0.015),
        yaw_noise_per_turn=rng.uniform(0.01, 0.04),
        velocity_std=rng.uniform(0.01, 0.05),
        yaw_rate_std=rng.uniform(0.01, 0.04),
    )
    imu = dataclasses.replace(
        sensors.imu,
        rate=60.0,
        has_heading=False,
        yaw_rate_std=rng.uniform(0.002, 0.01),
        yaw_rate_bias_std=0.01,
        acceleration_std=rng.uniform(0.05, 0.3),
    )
    gps = dataclasses.replace(
        sensors.gps,
        rate=5.0,
        position_std=rng.uniform(0.02, 0.5),
        multipath_std=0.0,
        lost_above=1.0,
        found_below=1.0,
        latency=rng.uniform(0.05, 0.4),
    )
    return robot, dataclasses.replace(sensors, lidar=lidar, odometry=wheels, imu=imu, gps=gps)


def record(
    seed: int,
    duration: float = 300.0,
    people: int = 0,
    reach: float = 7.0,
    **changes: float,
) -> Recorded:
    """Drive a drawn robot about the yard.

    It stands at first, then it takes steps of speed and yaw rate.

    Args:
        seed: of its parameters and of the drive.
        duration: [s].
        people: who walk about, whom it does not see.
        reach: [m] from the middle where it turns back; the walls begin at 12.6 m.
        changes: of the robot's parameters, by name.
    """
    robot, sensors = draw(seed)
    robot = dataclasses.replace(robot, **changes)
    streams = RandomStreams(seed, 0)
    suite = SensorSuite(sensors, yard(), 0.3)
    params = load_dataclass(WorldParams, shipped("params") / "worlds" / "easy.yaml")
    params = dataclasses.replace(
        params,
        people=dataclasses.replace(params.people, count=people),
        cargo=dataclasses.replace(params.cargo, pieces=0),
    )
    walkers = make_pedestrians(params.people, yard().navigation_mesh, robot)
    world = PyBulletWorld(yard(), robot, params, walkers, suite, 2)
    try:
        start = Pose2D(0.0, 0.0, 0.3)
        seen = world.reset(Mission(start, Pose2D(5.0, 5.0), 7.0), streams)
        drive = Recorded(robot, sensors, _truth(robot, sensors, suite))
        drive.entries.append(transforms(START, ("base_link", "laser", _mounting(sensors))))
        _record(world, drive, seen, steps(seed, reach), duration)
        truth = world.close_episode()
        drive.contacts, drive.counted = truth.contacts, truth.counted_contacts
        drive.energy = truth.motion_energy
    finally:
        world.close()
    return drive


def _truth(robot: RobotParams, sensors: SensorParams, suite: SensorSuite) -> dict[str, float]:
    """What is to be found, by the names of the values that ``identify`` finds."""
    wheels, unit = suite._odometry._sensor, suite._imu._sensor
    mount, measured = sensors.lidar.mount, sensors.odometry
    of_way, of_turn = wheels._linear_scale, wheels._angular_scale
    steps_late = math.ceil(robot.compute_latency * PHYSICS_RATE - 1e-6)
    return {
        "dead_time_s": steps_late / PHYSICS_RATE,
        "lag_s": robot.servo_time_constant,
        "linear_max_acceleration_mps2": robot.max_acceleration,
        "linear_max_deceleration_mps2": robot.max_deceleration,
        "angular_max_acceleration_radps2": robot.max_yaw_acceleration,
        "odometry_linear_scale": of_way,
        "odometry_angular_scale": of_turn,
        "odometry_linear_noise": measured.linear_noise,
        "odometry_yaw_noise_per_distance": measured.yaw_noise_per_distance,
        "odometry_yaw_noise_per_turn": measured.yaw_noise_per_turn,
        "odometry_velocity_std_mps": measured.velocity_std,
        "odometry_yaw_rate_std_radps": measured.yaw_rate_std,
        "imu_yaw_rate_bias_radps": unit._bias,
        "imu_yaw_rate_std_radps": sensors.imu.yaw_rate_std,
        "imu_acceleration_std_mps2": sensors.imu.acceleration_std,
        "gps_position_std_m": sensors.gps.position_std,
        "lidar_noise_std_m": sensors.lidar.noise_std,
        "lidar_x_m": mount.x,
        "lidar_y_m": mount.y,
        "lidar_yaw_rad": mount.yaw,
    }


def steps(seed: int, reach: float = 7.0) -> Callable[[float, Pose2D], Twist2D]:
    """Commands: 15 s of standing, then steps that keep the robot in the yard."""
    rng = np.random.default_rng([7, seed])
    state = {"until": 15.0, "speed": 0.0, "turn": 0.0}

    def command(stamp: float, at: Pose2D) -> Twist2D:
        if stamp >= state["until"]:
            kind = rng.integers(4)
            state["until"] = stamp + rng.uniform(1.5, 3.5)
            state["speed"] = rng.choice((0.0, 0.6, 1.2, 1.8)) if kind < 3 else -0.5
            state["turn"] = rng.choice((-1.5, -0.8, 0.0, 0.0, 0.8, 1.5))
        speed, turn = state["speed"], state["turn"]
        ahead = math.cos(at.yaw) * at.x + math.sin(at.yaw) * at.y
        if max(abs(at.x), abs(at.y)) > reach and ahead > 0.0 and speed > 0.0:
            left = math.cos(at.yaw) * at.y - math.sin(at.yaw) * at.x
            turn = math.copysign(1.2, -left)
            speed = min(speed, 1.2)
        if max(abs(at.x), abs(at.y)) > reach and ahead < 0.0 and speed < 0.0:
            speed = 0.6
        return Twist2D(speed, 0.0, turn)

    return command


def _record(
    world: PyBulletWorld,
    drive: Recorded,
    seen: Observation,
    command_at: Callable[[float, Pose2D], Twist2D],
    duration: float,
) -> None:
    command = Twist2D()
    for number in range(round(duration / TICK)):
        truth, stamp = world.truth, START + world.stamp
        drive.entries += entries_of(seen, stamp)
        drive.poses.append((stamp, truth.pose.x, truth.pose.y, truth.pose.yaw))
        if number % TICKS_PER_POSE == 0:
            drive.entries.append(belief(stamp, truth.pose))
        if number % TICKS_PER_COMMAND == 0:
            command = command_at(world.stamp, truth.pose)
            drive.entries.append(command_entry(stamp, command))
        seen = world.step(command)


def command_entry(stamp: float, command: Twist2D) -> Entry:
    """A geometry_msgs/TwistStamped that arrives now, with the stamp of what it is computed from."""
    twist = {"linear": {"x": command.linear_x}, "angular": {"z": command.angular_z}}
    return Entry("/cmd_vel", TWIST, stamp - COMPUTED, {"twist": twist}, "base_link", arrival=stamp)


def belief(stamp: float, at: Pose2D) -> Entry:
    """A geometry_msgs/PoseWithCovarianceStamped of a localizer that is right."""
    return Entry("/amcl_pose", POSE_COVARIANCE, stamp, {"pose": {"pose": pose(at)}}, "map")


def entries_of(seen: Observation, arrival: float) -> Entries:
    """What the sensors delivered, as messages that arrive now."""
    found: Entries = []
    if seen.odometry is not None:
        at, twist = seen.odometry.pose, seen.odometry.twist
        stamp = START + seen.odometry.stamp
        found.append(odometry(stamp, at, twist.linear_x, twist.angular_z))
    if seen.imu is not None:
        unit = seen.imu
        fields: dict[str, Any] = {
            "orientation": quaternion(0.0),
            "orientation_covariance": [-1.0] + [0.0] * 8,
            "angular_velocity": {"z": unit.angular_velocity_z},
            "linear_acceleration": {
                "x": unit.linear_acceleration_x,
                "y": unit.linear_acceleration_y,
                "z": 9.81,
            },
        }
        if not math.isnan(unit.yaw):
            fields["orientation"] = quaternion(unit.yaw)
            fields["orientation_covariance"] = [unit.yaw_std**2] + [0.0] * 8
        found.append(Entry("/imu/data", IMU, START + unit.stamp, fields, "base_link"))
    if seen.gps is not None:
        entry = fix(START + seen.gps.stamp, seen.gps.x, seen.gps.y)
        found.append(dataclasses.replace(entry, frame="base_link"))
    if seen.scan is not None:
        scan_ = seen.scan
        stamp = START + scan_.stamp
        reach = {"range_min": scan_.range_min, "range_max": scan_.range_max}
        found.append(scan(stamp, scan_.ranges, scan_.angle_min, scan_.angle_increment, **reach))
    return [dataclasses.replace(entry, arrival=arrival) for entry in found]


def _mounting(sensors: SensorParams) -> tuple[float, ...]:
    mount = sensors.lidar.mount
    half = 0.5 * mount.yaw
    return (mount.x, mount.y, 0.4, 0.0, 0.0, math.sin(half), math.cos(half))


def write_mcap(path: Path, entries: Entries) -> Path:
    """Write a log."""
    with McapWriter(path) as bag:
        for entry in entries:
            fields: Mapping[str, Any] = entry.fields
            if entry.type != TRANSFORMS:
                fields = {**fields, "header": header(entry.stamp, entry.frame)}
            arrival = entry.stamp if entry.arrival is None else entry.arrival
            bag.write(entry.topic, entry.type, arrival, fields)
    return path
