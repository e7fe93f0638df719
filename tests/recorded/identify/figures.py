"""What simulated robots' logs tell: the figures of docs/your_robot.md.

    python -m tests.recorded.identify.figures robots --first 9100 --count 20
    python -m tests.recorded.identify.figures contacts --first 9200 --count 300

Robots are identified from five minutes each. Contacts are looked for on drives of a minute, on
every other one among people; a drive on which somebody squeezes the robot is counted apart.
"""

import navstack.dispatch  # isort: skip  # noqa: F401  first: it chooses the loops of numpy

import argparse
import dataclasses
import sys
import tempfile
from pathlib import Path

import numpy as np

from harness.economics.contact_costs import injury_costs
from harness.economics.prices import load_prices
from harness.identify.collisions import Impact, find_impacts, strongest_steps
from harness.identify.identification import identify
from harness.recorded.drive_log import DriveLog
from harness.recorded.log import LogRequest, read_log
from harness.storage.shipped import shipped
from harness.world.physics.robot import RobotParams
from navstack.params.strict import load_dataclass

from . import drives

SECONDS = {"robots": 300.0, "contacts": 60.0}  # of a drive
OFF = {  # what a value may be off
    "dead_time_s": 0.01,
    "odometry_linear_scale": 0.01,
    "odometry_angular_scale": 0.01,
}
SHARE = {  # of the truth
    "linear_max_acceleration_mps2": 0.05,
    "linear_max_deceleration_mps2": 0.05,
    "angular_max_acceleration_radps2": 0.05,
}
FACTOR = 1.5  # that a noise may be off
NOISES = (
    "odometry_linear_noise",
    "odometry_yaw_noise_per_distance",
    "odometry_yaw_noise_per_turn",
    "odometry_velocity_std_mps",
    "odometry_yaw_rate_std_radps",
    "imu_yaw_rate_std_radps",
    "imu_acceleration_std_mps2",
    "gps_position_std_m",
    "lidar_noise_std_m",
)
PEOPLE = 14
HARD = 50.0  # [N s]
SQUEEZE = 300.0  # [N s] in a physics step: more than a walker's body can push
TOGETHER = 0.5  # [s] between a contact and what was found of it


def say(line: str) -> None:
    """Print a line at once."""
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def log_of(drive: drives.Recorded) -> DriveLog:
    """What is read of a drive's log."""
    with tempfile.TemporaryDirectory() as folder:
        bag = drives.write_mcap(Path(folder) / "drive.mcap", drive.entries)
        return read_log(LogRequest((bag,)), lambda _: None)


def is_found(key: str, value: float | None, true: float) -> bool:
    """Whether a value is as near to the truth as is asked for; of others nothing is."""
    if key in OFF:
        return value is not None and abs(value - true) <= OFF[key]
    if key in SHARE:
        return value is not None and abs(value / true - 1.0) <= SHARE[key]
    if key in NOISES:
        return value is not None and 1.0 / FACTOR < value / true < FACTOR
    return True


def robots(seeds: range) -> None:
    """Identify robots with drawn parameters."""
    default = load_dataclass(RobotParams, shipped("params") / "robots" / "segway_e1.yaml")
    good = held = intervals = 0
    for seed in seeds:
        drive = drives.record(seed, SECONDS["robots"])
        estimates = identify(log_of(drive), default).estimates
        missed = [
            key
            for key, true in drive.truth.items()
            if not is_found(key, estimates[key].value, true)
        ]
        good += not missed
        for key, true in drive.truth.items():
            low, high = estimates[key].low, estimates[key].high
            if low is not None and high is not None:
                intervals += 1
                held += low <= true <= high
        say(
            f"{seed}: {', '.join(missed) or 'all found'}; so far {good} robots of "
            f"{seed - seeds.start + 1}, {held} of {intervals} intervals hold the truth",
        )


def contacts(seeds: range) -> None:
    """Find and price contacts by logs alone."""
    prices = load_prices()
    hard = hard_found = found = real = 0
    for seed in seeds:
        drive = drives.record(seed, SECONDS["contacts"], people=PEOPLE * (1 - seed % 2))
        log = log_of(drive)
        impacts = find_impacts(log, drive.robot).found
        blind = find_impacts(dataclasses.replace(log, imu=log.imu[:0]), drive.robot).found
        stamps = [contact.stamp for contact in drive.contacts]
        strong = [contact for contact in drive.contacts if contact.impulse >= HARD]
        hard += len(strong)
        hard_found += sum(near(contact.stamp, impacts) for contact in strong)
        found += len(impacts)
        real += sum(near_any(impact, stamps) for impact in impacts)
        steps = [strongest_steps(impact.impulse) for impact in impacts]
        paid = injury_costs([each.impulse for each in drive.counted], prices).sum()
        by_log = sum(np.mean((each >= HARD) * injury_costs(each, prices)) for each in steps)
        strongest = max((each.peak_step_impulse for each in drive.contacts), default=0.0)
        say(
            f"{seed}: {hard_found} of {hard} hard contacts found, {real} of {found} found are "
            f"real; by odometry alone {sum(near(each.stamp, blind) for each in strong)} of "
            f"{len(strong)} here; {paid:.1f} USD, by the log {by_log:.1f}"
            f"{', squeezed' * (strongest > SQUEEZE)}",
        )


def near(stamp: float, impacts: tuple[Impact, ...]) -> bool:
    """Whether one of the impacts is that of a contact."""
    return any(abs(impact.stamp - stamp) < TOGETHER for impact in impacts)


def near_any(impact: Impact, stamps: list[float]) -> bool:
    """Whether an impact is that of one of the contacts."""
    return any(abs(impact.stamp - stamp) < TOGETHER for stamp in stamps)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", choices=SECONDS)
    parser.add_argument("--first", type=int, default=9100)
    parser.add_argument("--count", type=int, default=20)
    asked = parser.parse_args()
    {"robots": robots, "contacts": contacts}[asked.what](
        range(asked.first, asked.first + asked.count)
    )


if __name__ == "__main__":
    main()
