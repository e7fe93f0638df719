"""Whether a delivery can have gone as its row says."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from harness.world.outcome import ARRIVALS, Outcome

SLACK = 0.1  # [m], [s] of poses and times that are taken a tick apart
FASTER = 1.1  # times the robot's greatest speed: downhill


@dataclass(frozen=True, slots=True)
class Limits:
    """What bounds a delivery; infinite or 0 where it is not known."""

    max_speed: float = math.inf  # [m/s] of the robot
    arrival_radius: float = math.inf  # [m] between robot and goal
    least_timeout: float = 0.0  # [s] of simulated time until a timeout
    spoiled_fraction: float = 1.0  # share of the pieces above which food is spoiled


def implausible(row: Mapping[str, Any], limits: Limits) -> str:
    """Why a finished delivery cannot have gone so; empty: it can.

    Args:
        row: as in ``episodes.parquet``; what it lacks is not checked.
        limits: of the robot and the rules.
    """
    checks = (_way(row), _pace(row, limits), _end(row, limits), _cargo(row, limits))
    return next((found for each in checks for found in each), "")


def _way(row: Mapping[str, Any]) -> Iterator[str]:
    """Shorter than the straight way, by the triangle inequality."""
    keys = ("start_x_m", "start_y_m", "goal_x_m", "goal_y_m", "goal_distance_m")
    if any(row.get(key) is None for key in keys):
        return
    x, y, goal_x, goal_y, left = (row[key] for key in keys)
    straight = math.hypot(goal_x - x, goal_y - y) - left
    if row["distance_m"] < straight - SLACK:
        yield f"{row['distance_m']:.2f} m driven, but its end is {straight:.2f} m from its start"


def _pace(row: Mapping[str, Any], limits: Limits) -> Iterator[str]:
    """Faster than the robot, or than distance and duration say."""
    distance, duration, speed = (
        row[key] for key in ("distance_m", "duration_s", "average_speed_mps")
    )
    fastest = FASTER * limits.max_speed
    if distance > fastest * (duration + SLACK) and not _was_touched(row):
        yield f"{distance:.2f} m in {duration:.2f} s; its robot drives at most {fastest:.2f} m/s"
    if abs(speed * duration - distance) > SLACK + 1e-3 * distance:
        yield f"average_speed_mps {speed:.3g} is not {distance:.2f} m in {duration:.2f} s"


def _was_touched(row: Mapping[str, Any]) -> bool:
    """Whether anything may have pushed it, or thrown it."""
    return any(value for key, value in row.items() if key.endswith("_contacts"))


def _end(row: Mapping[str, Any], limits: Limits) -> Iterator[str]:
    """Arrived far from the goal, or out of time before the timeout."""
    left, outcome, duration = row.get("goal_distance_m"), row["outcome"], row["duration_s"]
    if Outcome(outcome) in ARRIVALS and left is not None and left > limits.arrival_radius + SLACK:
        yield f"arrived {left:.2f} m from the goal; it counts within {limits.arrival_radius:g} m"
    if outcome == Outcome.TIMEOUT.value and duration < limits.least_timeout - SLACK:
        yield f"out of time after {duration:.2f} s; it has {limits.least_timeout:g} s"


def _cargo(row: Mapping[str, Any], limits: Limits) -> Iterator[str]:
    """Food that is intact though it is spoiled, or more lost than was there."""
    lost, pieces = row.get("pieces_lost"), row.get("pieces_at_start")
    if lost is None or pieces is None:
        return
    if lost > pieces:
        yield f"{lost} pieces lost of {pieces}"
    most = limits.spoiled_fraction * pieces
    if row["outcome"] == Outcome.SLA.value and lost > most:
        yield f"{lost} of {pieces} pieces lost, but not spoiled; that is above {most:g}"
