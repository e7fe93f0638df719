"""Where a scan says that the robot is, and how well it says that."""

from dataclasses import dataclass

import numpy as np

from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.geometry import normalize_angle
from navstack.scan_matching.kernels import METRES, align, returns_of
from navstack.scan_matching.surface_field import surface_field
from navstack.types import FloatArray, LaserScan, Pose2D

SHARED_STD = 0.05  # [m] of errors that all returns share: the map's cells, what stands at walls
LEAST_STD = (0.05, 0.05, 0.01)  # [m, m, rad] of a belief that is held against a scan
KNOWN_STD = 0.5  # [m] of a direction of which a scan says something
LEAST_RETURNS = 12  # from mapped surfaces
LEAST_SHARE = 0.4  # of the returns, that must come from mapped surfaces
_LEAST = np.diag(np.square(LEAST_STD))


@dataclass(frozen=True, slots=True, eq=False)
class Alignment:
    """What a scan says of a pose."""

    pose: Pose2D  # the likeliest, given the belief
    directions: FloatArray  # (k, 3) of x, y, yaw: those of which the scan says something
    offsets: FloatArray  # (k,) [m] along each of what the scan alone says from ``pose``
    variances: FloatArray  # (k,) [m2] of it

    def covariance(self, believed: FloatArray) -> FloatArray:
        """The covariance (3, 3) of ``pose``, of a belief's."""
        total = np.linalg.inv(believed + _LEAST)
        total += self.directions.T @ (self.directions / self.variances[:, None])
        inverse: FloatArray = np.linalg.inv(total)
        return inverse


class ScanAligner:
    """Aligns scans with a map about a believed pose, no farther than its covariance allows.

    The scan's information matrix is taken apart along its eigenvectors (Censi 2007, ICRA, on what
    can be observed): directions that no surface determines, such as that of a corridor, are left to
    the belief.
    """

    def __init__(self, static_map: OccupancyGrid) -> None:
        """Prepare the map.

        Raises:
            MapError: the map is rotated.
        """
        self.field = surface_field(static_map)

    def returns(self, scan: LaserScan) -> FloatArray:
        """Where a scan's beams end (n, 2) [m], base frame; NaN: no return."""
        points = np.empty((len(scan.ranges), 2))
        mount = scan.sensor_pose.as_array()
        angles = (scan.angle_min, scan.angle_increment)
        returns_of(scan.ranges, *angles, scan.range_min, scan.range_max, mount, points)
        return points

    def align(self, points: FloatArray, pose: Pose2D, covariance: FloatArray) -> Alignment | None:
        """What returns (n, 2) say of a believed pose of covariance (3, 3).

        None where too few of them come from mapped surfaces.
        """
        believed: FloatArray = covariance + _LEAST
        information = np.linalg.inv(believed).astype(np.float64)
        aligned, slope = np.empty(3), np.empty(3)
        values, vectors = np.empty(3), np.empty((3, 3))
        near, count = align(
            points,
            pose.as_array(),
            believed,
            information,
            self.field,
            aligned,
            slope,
            values,
            vectors,
        )
        if near < max(LEAST_RETURNS, LEAST_SHARE * count):
            return None
        known = values > KNOWN_STD**-2
        values, vectors = values[known], vectors[:, known].T
        offsets = -(vectors @ (slope / METRES)) / values
        x, y, yaw = aligned.tolist()
        place = Pose2D(x, y, normalize_angle(yaw))
        return Alignment(place, vectors * METRES, offsets, 1.0 / values + SHARED_STD**2)
