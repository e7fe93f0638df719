"""The Spatio-Temporal Voxel Layer (STVL): obstacles vanish by time, not because a beam passes.

After S. Macenski, D. Tsai, M. Feinberg, "Spatio-temporal voxel layer", IJARS 17 (2020), and its ROS
2 release. Every return marks its voxel with the time. A voxel of age t is dropped once the time
that is left to it is negative: ``voxel_decay`` - t (linear) or ``voxel_decay`` exp(-t). Within a
clearing frustum a t^3 / 6 is taken off first, with the source's ``decay_acceleration`` a, and off
the mark as well, so that it adds up from update to update.

The robot has one planar scan: the voxels are squares of one plane, each stands for a whole column
(no ``mark_threshold``), and frustums look along the robot's heading.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np

from navstack.costmap.costmap import LETHAL_OBSTACLE
from navstack.costmap.layers import Bounds, ObstacleLayer, cost_of_unknown
from navstack.costmap.observations import ObservationBuffer, PointObservation
from navstack.costmap.window import Window
from navstack.params.spatio_temporal import (
    DEPTH_CAMERA,
    EXPONENTIAL,
    LINEAR,
    SpatioTemporalLayerParams,
    SpatioTemporalSourceParams,
)
from navstack.types import BoolArray, FloatArray, IntArray, Pose2D

FULL_CIRCLE = 6.27  # [rad] from which a frustum has no sides (three_dimensional_lidar_frustum.cpp)
NEAREST = 0.01  # [m] nearer returns do not mark
_ROW = 1 << 32  # between the keys of two rows of voxels


class SpatioTemporalLayer(ObstacleLayer):
    """What the scans showed lately.

    A return is seen in the costmap one update after the one that took it in.
    """

    def __init__(
        self,
        params: SpatioTemporalLayerParams,
        sources: Sequence[ObservationBuffer[SpatioTemporalSourceParams]],
        window: Window,
        clock: Callable[[], float],
    ) -> None:
        """``clock`` gives the time [s] of the update."""
        super().__init__(params, (), window, cost_of_unknown(params))
        self._decay = params
        self.sources = self._readings = sources
        self._clock = clock
        self.clear()

    def clear(self) -> None:
        """Forget all voxels."""
        super().clear()
        self._keys: IntArray = np.empty(0, dtype=np.int64)  # of the voxels, ascending
        self._marks: FloatArray = np.empty(0)  # [s] when each was marked
        self._read = [-math.inf] * len(self._readings)  # [s] newest scan taken in, of each source

    def moved(self, dx: int, dy: int) -> None:
        """The grid is written with every update."""

    def update_bounds(
        self, window: Window, pose: Pose2D, footprint: FloatArray, bounds: Bounds
    ) -> None:
        """Let voxels decay, show those that are left, then mark all returns."""
        now, seen = self._clock(), self._take_readings()
        frustums = [(source, reading) for source, reading in seen if source.clearing]
        x, y = self._centres()
        expired = self._expire(x, y, pose.yaw, now, frustums)
        for chosen in (expired, ~expired):
            if chosen.any():
                xs, ys = x[chosen], y[chosen]
                bounds.join(np.array((xs.min(), xs.max(), ys.min(), ys.max())))
        self._keys, self._marks = self._keys[~expired], self._marks[~expired]
        self._show(window, x[~expired], y[~expired])
        for source, reading in seen:
            if source.marking:
                self._mark(source, reading, now)
        self._place_footprint(window, footprint, bounds)

    def _take_readings(self) -> list[tuple[SpatioTemporalSourceParams, PointObservation]]:
        readings = []
        for k, buffer in enumerate(self._readings):
            once = buffer.params.clear_after_reading
            fresh = [
                each for each in buffer.observations if not (once and each.stamp <= self._read[k])
            ]
            readings += [(buffer.params, each) for each in fresh]
            self._read[k] = max([self._read[k], *(each.stamp for each in fresh)])
        return readings

    def _centres(self) -> tuple[FloatArray, FloatArray]:
        """Of the voxels, (n,) each, [m]."""
        row, column = np.divmod(self._keys + _ROW // 2, _ROW)
        size = self._decay.voxel_size
        return (column - _ROW // 2 + 0.5) * size, (row + 0.5) * size

    def _expire(
        self,
        x: FloatArray,
        y: FloatArray,
        heading: float,
        now: float,
        frustums: list[tuple[SpatioTemporalSourceParams, PointObservation]],
    ) -> BoolArray:
        """Which voxels (n,) are dropped; the marks of those that a frustum aged are moved back."""
        age = now - self._marks
        left = remaining(self._decay, age)
        is_free = np.ones(len(age), dtype=np.bool_)  # not yet in any frustum: the first one counts
        for source, reading in frustums:
            inside = is_free & is_inside(
                source, x - reading.origin_x, y - reading.origin_y, heading
            )
            aged = source.decay_acceleration / 6.0 * age[inside] ** 3
            left[inside] -= aged
            self._marks[inside] -= aged
            is_free &= ~inside
        return left < 0.0

    def _show(self, window: Window, x: FloatArray, y: FloatArray) -> None:
        """Write voxels at (x, y) [m] into the grid, which holds nothing else."""
        self.grid[:] = self._fill
        column = np.floor((x - window.origin_x) / window.resolution).astype(np.int64)
        row = np.floor((y - window.origin_y) / window.resolution).astype(np.int64)
        on = (column >= 0) & (row >= 0) & (column < window.size_x) & (row < window.size_y)
        self.grid[row[on], column[on]] = LETHAL_OBSTACLE

    def _mark(
        self, source: SpatioTemporalSourceParams, reading: PointObservation, now: float
    ) -> None:
        """Mark the voxels of the returns of a scan."""
        points = reading.marking
        distance = np.hypot(points[:, 0] - reading.origin_x, points[:, 1] - reading.origin_y)
        near = points[(distance <= source.obstacle_range) & (distance >= NEAREST)]
        voxels = np.floor(near / self._decay.voxel_size).astype(np.int64)
        marked = np.unique(voxels[:, 1] * _ROW + voxels[:, 0])
        kept = ~np.isin(self._keys, marked, assume_unique=True)
        keys = np.concatenate((self._keys[kept], marked))
        marks = np.concatenate((self._marks[kept], np.full(len(marked), now)))
        order = np.argsort(keys, kind="stable")
        self._keys, self._marks = keys[order], marks[order]


def remaining(params: SpatioTemporalLayerParams, age: FloatArray) -> FloatArray:
    """The time [s] that is left to voxels of an age (n,) [s] outside all frustums."""
    if params.decay_model == LINEAR:
        return params.voxel_decay - age
    if params.decay_model == EXPONENTIAL:
        return params.voxel_decay * np.exp(-age)
    return np.full(len(age), params.voxel_decay)


def is_inside(
    source: SpatioTemporalSourceParams, dx: FloatArray, dy: FloatArray, heading: float
) -> BoolArray:
    """Which points lie in a source's frustum in the plane of the scan.

    Args:
        source: what the frustum is.
        dx: (n,) from the sensor, [m].
        dy: (n,).
        heading: [rad] along which it looks.
    """
    ahead = dx * math.cos(heading) + dy * math.sin(heading)
    aside = dy * math.cos(heading) - dx * math.sin(heading)
    is_camera = source.model_type == DEPTH_CAMERA
    far = ahead
    if not is_camera:
        far = np.hypot(dx, dy)
    inside: BoolArray = (far >= source.min_z) & (far <= source.max_z)
    if is_camera or source.horizontal_fov_angle <= FULL_CIRCLE:
        inside &= np.abs(np.arctan2(aside, ahead)) <= source.horizontal_fov_angle / 2.0
    return inside
