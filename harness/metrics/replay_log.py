"""Recording of a delivery for its replay: the truth, what the robot saw and what it meant to do."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import shapely

from harness.metrics.delivery_log import NOWHERE
from harness.world.truth import Truth
from navstack.control.decision import Option
from navstack.types import (
    FloatArray,
    LaserScan,
    Observation,
    Odometry,
    Path,
    Pose2D,
    Track,
    Twist2D,
)

if TYPE_CHECKING:
    from harness.task.brain import Brain

TRACE_PERIOD = 0.1  # [s] between the rows of a recorded trajectory
TRACE_COLUMNS = (
    "stamp_s",
    "x_m",
    "y_m",
    "yaw_rad",
    "linear_x_mps",
    "angular_z_radps",
    "believed_x_m",
    "believed_y_m",
    "believed_yaw_rad",
    "command_linear_x_mps",
    "command_angular_z_radps",
)
PLAN_TOLERANCE = 0.02  # [m] that a kept plan may differ from the one that was followed
NO_RETURN = 65535  # a beam's range where nothing came back, or from farther than FARTHEST_MM
FARTHEST_MM = 65534  # [mm] of a range
LARGEST_COMPACT = 16_384.0  # [m] up to which four bytes hold a millimetre
NOT_MOVED = Odometry(0.0, Pose2D(), Twist2D())


class ReplayLog:
    """Keeps what a replay shows.

    All entries of a row belong to one moment: the true state, what the robot believed and saw in
    it, and what it commanded then.
    """

    def __init__(self) -> None:
        self._trace: list[tuple[float, ...]] = []  # of TRACE_COLUMNS
        self._crowd: list[FloatArray] = []  # (n, 2) positions of people
        # pieces lost, motion energy, odometry (5), covariance (3)
        self._rows: list[tuple[float, ...]] = []
        self._tracks: list[tuple[Track, ...]] = []  # of each row
        self._options: list[tuple[Option, ...]] = []  # of each row
        self._scans: list[npt.NDArray[np.uint16]] = []
        self._scan_stamps: list[float] = []
        self._scan: LaserScan | None = None  # the last
        self._plans: list[npt.NDArray[np.floating]] = []
        self._plan_stamps: list[float] = []
        self._plan: Path | None = None  # the last
        self._odometry = NOT_MOVED

    def record(
        self,
        truth: Truth,
        observation: Observation,
        brain: "Brain",
        command: Twist2D,
    ) -> None:
        """Take in a state, what the brain received in it and made of it, and what it commands."""
        self._receive(observation, brain)
        if truth.stamp >= len(self._rows) * TRACE_PERIOD - 1e-6:
            self._keep(truth, brain, command)

    def finish(self, truth: Truth, brain: "Brain", command: Twist2D) -> None:
        """Take in the final state.

        The brain has not seen it, so belief and command are those of the tick before.
        """
        self._keep(truth, brain, command)

    def _receive(self, observation: Observation, brain: "Brain") -> None:
        if observation.odometry is not None:
            self._odometry = observation.odometry
        if observation.scan is not None:
            self._scan = observation.scan
            self._scan_stamps.append(observation.scan.stamp)
            self._scans.append(millimetres(observation.scan.ranges))
        if brain.plan is not self._plan:
            self._plan = brain.plan
            self._plan_stamps.append(observation.stamp)
            points = np.empty((0, 2))
            if self._plan is not None and len(self._plan) > 1:
                points = self._plan.poses[:, :2]
            self._plans.append(_compact(simplified(points, PLAN_TOLERANCE)))

    def _keep(self, truth: Truth, brain: "Brain", command: Twist2D) -> None:
        odometry, belief = self._odometry, brain.belief or NOWHERE
        pose, twist, believed = truth.pose, truth.twist, belief.pose
        self._trace.append(
            (
                truth.stamp,
                pose.x,
                pose.y,
                pose.yaw,
                twist.linear_x,
                twist.angular_z,
                believed.x,
                believed.y,
                believed.yaw,
                command.linear_x,
                command.angular_z,
            )
        )
        self._crowd.append(truth.pedestrians[:, :2].copy())
        pose, twist, covariance = odometry.pose, odometry.twist, belief.covariance
        pieces_lost = 0
        if truth.cargo:
            pieces_lost = truth.cargo.pieces_outside
        self._rows.append(
            (
                pieces_lost,
                truth.motion_energy,
                pose.x,
                pose.y,
                pose.yaw,
                twist.linear_x,
                twist.angular_z,
                covariance[0, 0],
                covariance[0, 1],
                covariance[1, 1],
            )
        )
        self._tracks.append(brain.tracks)
        self._options.append(brain.options)

    def recording(self) -> dict[str, Any]:
        """Arrays of T rows, S scans, P plans and K tracks, and of n people.

        ``trace`` (T, 11) of ``trace_columns``, every :data:`TRACE_PERIOD` and at the end; ``crowd``
        (T, n, 2) [m]; ``pieces_lost`` (T,); ``motion_energy_j`` (T,) [J]; ``odometry`` (T, 5): x, y
        [m], yaw [rad] in the odom frame, vx [m/s], wz [rad/s]; ``belief_covariance`` (T, 3): xx,
        xy, yy [m2]; ``track_count`` (T,) and ``tracks`` (K, 6): id, x, y [m], vx, vy [m/s], radius
        [m] in the map frame; ``scan_stamp`` (S,) [s], ``scan_mm`` (S, beams) [mm] and
        ``scan_geometry`` (7,): least angle, increment [rad], least and most range [m], x, y [m],
        yaw [rad] of the sensor in the base frame; ``plan_stamp`` (P,) [s], ``plan_size`` (P,) and
        ``plan_xy`` (N, 2) [m] in the map frame, of all plans one after the other; ``option_count``
        (T,), ``option_total`` (Q,), ``option_size`` (Q,) and ``option_xy`` (M, 2) [m], map frame:
        the motions that the controller weighed.
        """
        rows = np.array(self._rows).reshape(-1, 10)
        tracks = [
            (each.id, each.x, each.y, each.vx, each.vy, each.radius)
            for row in self._tracks
            for each in row
        ]
        options = [option for row in self._options for option in row]
        return {
            "trace": np.array(self._trace),
            "trace_columns": np.array(TRACE_COLUMNS),
            "crowd": np.array(self._crowd),
            "pieces_lost": rows[:, 0].astype(np.int32),
            "motion_energy_j": rows[:, 1],
            "odometry": rows[:, 2:7],
            "belief_covariance": rows[:, 7:10].astype(np.float32),
            "track_count": np.array([len(row) for row in self._tracks], dtype=np.int32),
            "tracks": _compact(np.array(tracks, dtype=np.float64).reshape(-1, 6)),
            "option_count": np.array([len(row) for row in self._options], dtype=np.int32),
            "option_total": np.array([option.total for option in options]),
            "option_size": np.array([len(option.path) for option in options], dtype=np.int32),
            "option_xy": _compact(
                np.concatenate([np.empty((0, 2)), *(option.path for option in options)])
            ),
            "scan_stamp": np.array(self._scan_stamps),
            "scan_mm": np.array(self._scans or np.empty((0, 0)), dtype=np.uint16),
            "scan_geometry": _geometry(self._scan),
            "plan_stamp": np.array(self._plan_stamps),
            "plan_size": np.array([len(plan) for plan in self._plans], dtype=np.int32),
            "plan_xy": np.concatenate([np.empty((0, 2), np.float32), *self._plans]),
        }


class NoReplayLog(ReplayLog):
    """Asks for nothing and keeps nothing."""

    def record(
        self,
        truth: Truth,
        observation: Observation,
        brain: "Brain",
        command: Twist2D,
    ) -> None:
        """See the base class."""

    def finish(self, truth: Truth, brain: "Brain", command: Twist2D) -> None:
        """See the base class."""


def millimetres(ranges: FloatArray) -> npt.NDArray[np.uint16]:
    """Ranges (n,) [m] in whole millimetres.

    :data:`NO_RETURN` where nothing came back from within them.
    """
    scaled = np.maximum(np.rint(1000.0 * np.where(np.isfinite(ranges), ranges, np.inf)), 0.0)
    return np.where(scaled <= FARTHEST_MM, scaled, NO_RETURN).astype(np.uint16)


def _compact(numbers: FloatArray) -> npt.NDArray[np.floating]:
    """Metres with four bytes each, and with eight where these would lose a millimetre."""
    if (np.abs(numbers) > LARGEST_COMPACT).any():
        return numbers
    return numbers.astype(np.float32)


def simplified(points: FloatArray, tolerance: float) -> FloatArray:
    """Corners (n, 2) [m] of a line, without those within ``tolerance`` [m] of the rest."""
    if len(points) < 2:
        return points
    line = shapely.simplify(shapely.linestrings(points), tolerance, preserve_topology=False)
    corners: FloatArray = shapely.get_coordinates(line)
    return corners


def _geometry(scan: LaserScan | None) -> FloatArray:
    if scan is None:
        return np.zeros(7)
    mount = scan.sensor_pose
    numbers = (
        scan.angle_min,
        scan.angle_increment,
        scan.range_min,
        scan.range_max,
        mount.x,
        mount.y,
        mount.yaw,
    )
    return np.array(numbers)


def tracks_of(arrays: Mapping[str, Any]) -> list[FloatArray]:
    """The tracks (k, 6) of each row of a recording: id, x, y [m], vx, vy [m/s], radius [m]."""
    return np.split(
        np.asarray(arrays["tracks"], dtype=np.float64), np.cumsum(arrays["track_count"])[:-1]
    )


def plans_of(arrays: Mapping[str, Any]) -> list[tuple[float, FloatArray]]:
    """The plans of a recording as times [s] and points (N, 2) [m].

    None where the delivery never had one.
    """
    ends = np.cumsum(arrays["plan_size"])
    pieces = np.split(arrays["plan_xy"], ends)[: len(ends)]
    return list(zip(arrays["plan_stamp"].tolist(), pieces, strict=True))
