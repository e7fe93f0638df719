"""What a recorded drive costs: its events, energy and spilled cargo by the cost model."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import savgol_filter

from harness.economics.cost_model import running
from harness.economics.measured import Measured
from harness.economics.prices import Prices
from harness.identify.collisions import IN_A_STEP, find_impacts
from harness.identify.drive_events import DriveEvent, People, events_of, people_on
from harness.metrics.contacts import PRICED_PROPERTY
from harness.metrics.delivery_log import JOULES_PER_KWH
from harness.recorded.drive_log import DriveLog, period_of
from harness.world.cargo.cargo import BucketStep, Cargo
from harness.world.cargo.loose_cargo import make_cargo
from harness.world.map.scene import Scene
from harness.world.physics.drive_kernels import drive_constants, mechanical_power
from harness.world.physics.robot import RobotParams
from harness.world.world_params import WorldParams
from navstack.types import FloatArray

SPOILED = 0.05  # [-] of the pieces from which food is spoiled (published)
_SMOOTH = 0.25  # [s] over which speed is smoothed for its energy


@dataclass(frozen=True, slots=True)
class DriveCost:
    """A drive with its events and its dollars."""

    events: tuple[DriveEvent, ...]
    duration: float  # [s]
    distance: float  # [m]
    energy_joules: FloatArray  # (N,) at the wheels until each row of the odometry
    spilled: float | None  # [-] share of the cargo; None: no cargo in this world
    threshold: float  # [N s] of contacts
    false_alarms: float  # [1/h]
    source: str  # of contacts: imu or odometry
    terms: dict[str, float | None]  # [USD] of this drive by the terms of the cost model

    people: People  # who was tracked

    @property
    def energy(self) -> float:
        """[kWh] at the wheels."""
        return float(self.energy_joules[-1]) / JOULES_PER_KWH

    @property
    def total(self) -> float:
        """[USD] of the terms that a log tells."""
        return sum(value for value in self.terms.values() if value is not None)

    def count(self, kind: str) -> int:
        """How many events of a kind."""
        return sum(event.kind == kind for event in self.events)


def cost_of_drive(
    log: DriveLog,
    robot: RobotParams,
    scene: Scene,
    world: WorldParams,
    prices: Prices,
) -> DriveCost:
    """Find the events of a drive, and price them.

    Args:
        log: the drive.
        robot: that drove.
        scene: where it drove; its map frame is that of the log's poses.
        world: the cargo and the contacts that count.
        prices: by which to pay.
    """
    impacts = find_impacts(log, robot)
    least = world.contacts.counted_impulse / IN_A_STEP
    people = people_on(log, scene)
    events = events_of(log, impacts, people, robot, scene, world, prices)
    distance, energy = _driven(log, robot, world.physics.gravity)
    spilled = _spilled(log, robot, world)
    contacts = [event for event in events if event.kind == "contact"]
    in_all = float(energy[-1]) / JOULES_PER_KWH
    terms = _terms(contacts, least, log.duration, distance, in_all, spilled, events, prices)
    return DriveCost(
        events,
        log.duration,
        distance,
        energy,
        spilled,
        impacts.threshold,
        impacts.false_alarms,
        impacts.source,
        terms,
        people,
    )


def _driven(log: DriveLog, robot: RobotParams, gravity: float) -> tuple[float, FloatArray]:
    """Distance [m], and energy (N,) [J] that the motors delivered to the wheels until each row."""
    stamps, distance = log.stamps, float(log.steps.sum())
    period = period_of(stamps)
    if len(stamps) < 10:
        return distance, np.zeros(max(len(stamps), 1))
    constants = drive_constants(robot, gravity, period)
    width = min(max(round(_SMOOTH / period) | 1, 5), (len(stamps) - 1) | 1)
    speeds, turns = (savgol_filter(log.odometry[:, n], width, 2) for n in (4, 5))
    along, couple = _forces(robot, speeds, turns, period)
    energy = np.zeros(len(stamps))
    for number, dt in enumerate(np.diff(stamps).tolist()):
        half = 0.5 * float(along[number])
        twist = float(couple[number]) / robot.track
        motion = float(speeds[number]), float(turns[number])
        power = mechanical_power(half - twist, half + twist, *motion, 2.0 * half, constants)
        energy[number + 1] = power * min(dt, 10.0 * period)
    return distance, np.cumsum(energy)


def _forces(
    robot: RobotParams,
    speeds: FloatArray,
    turns: FloatArray,
    period: float,
) -> tuple[FloatArray, FloatArray]:
    """Force (n,) [N] and couple (n,) [N m] of both motors, by the motion of the centre of mass.

    It lies behind the axle, which the ground holds sideways: that turns the robot as well.
    """
    lever = -robot.center_of_mass_x
    bends = np.gradient(turns, period)
    along = robot.mass * (np.gradient(speeds, period) + lever * turns**2)
    sideways = robot.mass * (speeds * turns - lever * bends)
    return along, robot.inertia[2] * bends - lever * sideways


def _spilled(log: DriveLog, robot: RobotParams, world: WorldParams) -> float | None:
    """Share of the popcorn that the measured accelerations spill; None: none is carried."""
    cargo = make_cargo(world.cargo, robot, world.physics)
    if cargo is None:
        return None
    try:
        _shake(cargo, log, robot, world)
        return cargo.state.lost_fraction
    finally:
        cargo.close()


def _shake(cargo: Cargo, log: DriveLog, robot: RobotParams, world: WorldParams) -> None:
    """Move the cargo as the log says, from the first step on."""
    dt = 1.0 / world.physics.rate
    pushes, yaw, rates = _pushes(log, world.cargo.place_on(robot), dt)
    cargo.reset(np.random.default_rng(0))
    shaken = np.hypot(pushes[:, 0], pushes[:, 1]) > world.cargo.wake_acceleration
    velocity = np.cumsum(pushes, axis=0) * dt
    for number, (ax, ay) in enumerate(pushes.tolist()):
        if shaken[number] or cargo.is_awake:
            half = 0.5 * float(yaw[number])
            turn = (0.0, 0.0, math.sin(half), math.cos(half))
            moving = (float(velocity[number, 0]), float(velocity[number, 1]), 0.0)
            spin = (0.0, 0.0, float(rates[number]))
            cargo.step(BucketStep((ax, ay, 0.0), moving, turn, spin))


def _pushes(
    log: DriveLog,
    place: tuple[float, float, float],
    dt: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Accelerations (n, 2) [m/s2] of a place on the robot, its yaw (n,) and yaw rate (n,).

    Every ``dt`` [s], in the frame in which the robot stood at first.
    """
    if log.has_accelerations:
        stamps, rates = log.imu_stamps, log.gyro_rates
        ahead, aside = log.imu[:, 3], log.imu[:, 4]
    else:
        stamps, rates = log.stamps, log.yaw_rates
        ahead = np.gradient(log.speeds, stamps)
        aside = log.speeds * rates
    grid = np.arange(stamps[0], stamps[-1], dt)
    columns = [np.interp(grid, stamps, each) for each in (ahead, aside, rates)]
    yaw = np.cumsum(columns[2]) * dt
    cos, sin = np.cos(yaw), np.sin(yaw)
    x, y, _ = place
    alpha, squared = np.gradient(columns[2], dt), columns[2] ** 2
    ahead, aside = columns[0] - squared * x - alpha * y, columns[1] + alpha * x - squared * y
    pushes = np.column_stack((cos * ahead - sin * aside, sin * ahead + cos * aside))
    return pushes, yaw, columns[2]


def _terms(
    contacts: list[DriveEvent],
    least: float,
    duration: float,
    distance: float,
    energy: float,
    spilled: float | None,
    events: Sequence[DriveEvent],
    prices: Prices,
) -> dict[str, float | None]:
    """Expected dollars of the drive by the cost model's terms.

    Whether it came in time no log says. Contacts from ``least`` [N s] on are likely to count.
    """
    hours = duration / 3600.0
    paid = dict.fromkeys((event.what for event in contacts), 0.0)
    for event in contacts:
        paid[event.what] += event.cost or 0.0
    damages = {
        f"{kind}_contacts": paid[kind] / getattr(prices.property_damage, kind).value
        for kind in PRICED_PROPERTY
        if paid.get(kind)
    }
    takeovers = sum(event.kind == "intervention" for event in events)
    likely = [event.size for event in contacts if event.size >= least]
    measured = Measured(
        sla=None,
        spoiled=None if spilled is None else float(spilled > SPOILED and not takeovers),
        timeout=0.0,
        physical_assistance=float(takeovers > 0),
        avg_velocity_mps=distance / max(duration, 1e-9),
        avg_mechanical_power_kw=energy / max(hours, 1e-12),
        avg_collision_impulse_ns=IN_A_STEP * sum(likely),
        avg_collision_delta_v_mps=0.0,
        pedestrian_injury_usd_per_run=paid.get("person", 0.0) + paid.get("unknown", 0.0),
        avg_runtime_h=hours,
        avg_distance_km=1e-3 * distance,
        **damages,
    )
    terms = dict(running(measured, prices).terms)
    # the fee is lost once, and somebody comes each time
    terms["repair"] = takeovers * prices.repair_per_physical_assistance
    return terms
