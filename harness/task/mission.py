"""A delivery to make: from where, to where."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from scipy import ndimage

from harness.task.clearance import coarse_clearance
from harness.task.shortest_paths import (
    descend,
    distance_field,
    line_of_sight,
    path_length,
    string_pull,
)
from navstack.costmap.occupancy_grid import FREE, SOLID_FROM, OccupancyGrid
from navstack.errors import InputError, MapError, UnknownNameError
from navstack.geometry import transform_points
from navstack.types import BoolArray, FloatArray, IntArray, Pose2D

SAMPLINGS = ("published", "uniform")
BY_PLACES = "osm"  # on a district: from shops to homes
CLEARANCE = 1.0  # [m] of start and goal to the edges of the navigation mesh (published sampling)
# [m] a path exists where a disc of this radius can go: the robot's inscribed circle, padded
ROBOT_RADIUS = 0.4
GOAL_DISTANCE = (20.0, 1000.0)  # [m] between start and goal as the crow flies (published sampling)
_COARSE = 0.2  # [m] grid on which paths are searched
_TOUCH = 0.2  # [-] of a cell's side that a footprint may reach into an occupied one
_BATCH = 64  # draws at a time
_MOST_BATCHES = 2000


@dataclass(frozen=True, slots=True)
class Mission:
    """One delivery."""

    start: Pose2D  # true pose at the start, map frame
    goal: Pose2D
    shortest_path: float  # [m] along the navigation mesh


class MissionSampler:
    """Draws missions on one map.

    Start: uniform on the navigation mesh, random heading. Both start and goal keep ``CLEARANCE``
    from the mesh's edges, and a disc of ``ROBOT_RADIUS`` must get from one to the other; otherwise
    both are drawn anew. The goal's heading is that of the shortest path's end. Paths are searched
    on a grid of about 0.2 m whose cells are passable when the disc fits at their centre. How the
    goal is drawn is a name of ``SAMPLINGS``:

    - ``published``: at a random bearing and a distance uniform in 20..1000 m from the start, as the
      paper's public configuration has it. There a point off the mesh is projected to the nearest
      walkable point first, which changes nothing: the nearest point lies on an edge and fails the
      clearance. So goals are those points that fall on the mesh by themselves, denser near the
      start than uniform ones. (Projected to the nearest point with clearance instead, paths would
      have a mean of 151..158 m on the sidewalk worlds; published are 102 m, and so drawn 92..105.)
      On maps with a diagonal below 200 m the least distance is a tenth of the diagonal.
    - ``uniform``: uniform on the mesh.
    """

    def __init__(
        self, mesh: OccupancyGrid, sampling: str = "published", ground: OccupancyGrid | None = None
    ) -> None:
        """Precompute for one map.

        Args:
            mesh: FREE where missions are drawn and paths lead; axis-aligned.
            sampling: a name of ``SAMPLINGS``.
            ground: FREE where a given pose may be; None: the mesh.

        Raises:
            MapError: the map has a yaw, or nowhere room for a start and a goal.
            UnknownNameError: there is no such sampling.
        """
        if sampling not in SAMPLINGS:
            raise UnknownNameError("missions", sampling, SAMPLINGS)
        if mesh.origin.yaw != 0.0:
            raise MapError(
                f"map origin has a yaw of {mesh.origin.yaw} rad; turn the map parallel to the "
                "axes first"
            )
        self._mesh, self._ground, self._sampling = mesh, ground or mesh, sampling
        self._factor = max(round(_COARSE / mesh.resolution), 1)
        self._cell_size = self._factor * mesh.resolution  # [m]
        clearance = coarse_clearance(mesh, self._factor)
        self._passable = clearance >= ROBOT_RADIUS
        # 4-connected, as corners are not cut
        self._labels: npt.NDArray[np.int32] = ndimage.label(self._passable)[0]
        self._roomy = clearance >= CLEARANCE
        self._cells: IntArray = np.argwhere(self._roomy)
        diagonal = math.hypot(*clearance.shape) * self._cell_size
        self._distances = min(GOAL_DISTANCE[0], 0.1 * diagonal), min(GOAL_DISTANCE[1], diagonal)

    def sample(self, rng: np.random.Generator) -> Mission:
        """Draw a mission.

        Raises:
            MapError: a hundred thousand draws gave no valid mission.
        """
        if len(self._cells) < 2:
            raise MapError(
                f"map has no room to draw missions: nowhere {CLEARANCE} m of clearance to what is "
                "not walkable; give --start and --goal"
            )
        for _ in range(_MOST_BATCHES):
            starts = self._anywhere(rng)
            if self._sampling == "published":
                goals = self._around(starts, rng)
            else:
                goals = self._anywhere(rng)
            valid = np.flatnonzero(self._are_valid(starts, goals))
            if len(valid):
                return self._assemble(
                    starts[valid[0]], goals[valid[0]], float(rng.uniform(-math.pi, math.pi))
                )
        raise MapError(
            f"no valid mission in {_MOST_BATCHES * _BATCH} draws; the map's walkable parts may be "
            "too small"
        )

    def _anywhere(self, rng: np.random.Generator) -> IntArray:
        """Cells (N, 2) uniform on what keeps its clearance."""
        drawn: IntArray = self._cells[rng.integers(len(self._cells), size=_BATCH)]
        return drawn

    def _around(self, starts: IntArray, rng: np.random.Generator) -> IntArray:
        """Cells (N, 2) at random bearings and distances from others, wherever they fall."""
        bearings = rng.uniform(-math.pi, math.pi, _BATCH)
        distances = rng.uniform(*self._distances, _BATCH)
        offsets = distances * np.stack((np.sin(bearings), np.cos(bearings))) / self._cell_size
        cells: IntArray = np.rint(starts + offsets.T).astype(np.int64)
        return cells

    def _are_valid(self, starts: IntArray, goals: IntArray) -> BoolArray:
        """Which of the coarse cells (N, 2) are a start and a goal with a path between them."""
        within = (goals >= 0) & (goals < self._roomy.shape)
        inside = within[:, 0] & within[:, 1]
        rows, columns = np.where(inside[:, None], goals, 0).T
        same_part = self._labels[rows, columns] == self._labels[starts[:, 0], starts[:, 1]]
        different = (starts != goals).any(axis=1)
        valid: BoolArray = inside & self._roomy[rows, columns] & same_part & different
        return valid

    def _assemble(self, start: IntArray, goal: IntArray, heading: float) -> Mission:
        path = self._path(start, goal)
        end = path[-1] - path[-2]
        start_x, start_y = self._centre(start)
        goal_pose = Pose2D(*self._centre(goal), math.atan2(end[0], end[1]))
        return Mission(Pose2D(start_x, start_y, heading), goal_pose, self._length(path))

    def mission(self, start: Pose2D, goal: Pose2D) -> Mission:
        """A mission between two given poses.

        Raises:
            InputError: a pose is outside the map or not on walkable ground, or no path connects
                them.
        """
        check_pose_free(self._ground, start, "start")
        check_pose_free(self._ground, goal, "goal")
        from_cell, to_cell = self._nearest_passable(start), self._nearest_passable(goal)
        if from_cell is None or to_cell is None or self._label(from_cell) != self._label(to_cell):
            raise InputError(
                f"no path of {2 * ROBOT_RADIUS} m width leads from start ({start.x:.1f}, "
                f"{start.y:.1f}) m "
                f"to goal ({goal.x:.1f}, {goal.y:.1f}) m; choose poses on connected walkable ground"
            )
        length = self._length(self._path(from_cell, to_cell))
        return Mission(start, goal, max(length, math.hypot(goal.x - start.x, goal.y - start.y)))

    def _label(self, cell: IntArray) -> int:
        return int(self._labels[cell[0], cell[1]])

    def _path(self, start: IntArray, goal: IntArray) -> IntArray:
        first = int(start[0]), int(start[1])
        return string_pull(
            self._passable, descend(distance_field(self._passable, goal, first), first)
        )

    def _length(self, path: IntArray) -> float:
        return path_length(path) * self._cell_size

    def _centre(self, cell: IntArray) -> tuple[float, float]:
        """The point that a coarse cell stands for.

        The centre of the map cell in its middle, in [m].
        """
        row, column = (cell * self._factor + self._factor // 2 + 0.5) * self._mesh.resolution
        return self._mesh.origin.x + float(column), self._mesh.origin.y + float(row)

    def _nearest_passable(self, pose: Pose2D) -> IntArray | None:
        """The passable coarse cell nearest to a pose, within 1 m of it and in sight."""
        size = self._cell_size
        row = int((pose.y - self._mesh.origin.y) / size)
        column = int((pose.x - self._mesh.origin.x) / size)
        reach = math.ceil(1.0 / size)
        low = np.maximum((row - reach, column - reach), 0)
        cells = low + np.argwhere(
            self._passable[low[0] : row + reach + 1, low[1] : column + reach + 1]
        )
        for cell in cells[np.argsort(((cells - (row, column)) ** 2).sum(axis=1), kind="stable")]:
            if self._sees(pose, cell):
                nearest: IntArray = cell
                return nearest
        return None

    def _sees(self, pose: Pose2D, cell: IntArray) -> bool:
        """Whether free ground leads straight from a pose to a coarse cell's centre."""
        r, origin = self._ground.resolution, self._ground.origin
        x, y = self._centre(cell)
        ends = ((pose.x, pose.y), (x, y))
        (mx0, my0), (mx1, my1) = (
            (int((px - origin.x) / r), int((py - origin.y) / r)) for px, py in ends
        )
        return line_of_sight(self._ground.data == FREE, my0, mx0, my1, mx1)


def check_pose_free(walkable: OccupancyGrid, pose: Pose2D, what: str) -> None:
    """Check that a pose that a user gave stands on free ground of an axis-aligned map.

    Raises:
        InputError: it is outside the map or not on a free cell; the message offers the nearest free
            cell.
    """
    r, origin = walkable.resolution, walkable.origin
    where = f"{what} ({pose.x:.1f}, {pose.y:.1f}) m"
    if not all(math.isfinite(value) for value in (pose.x, pose.y, pose.yaw)):
        raise InputError(
            f"{where} is not a pose; three finite numbers x, y [m] and yaw [rad] are needed"
        )
    mx, my = math.floor((pose.x - origin.x) / r), math.floor((pose.y - origin.y) / r)
    if not (0 <= mx < walkable.width and 0 <= my < walkable.height):
        raise InputError(
            f"{where} lies outside the map; allowed: x "
            f"{origin.x:.1f}..{origin.x + walkable.width * r:.1f}, "
            f"y {origin.y:.1f}..{origin.y + walkable.height * r:.1f} m"
        )
    if walkable.data[my, mx] == FREE:
        return
    free = np.argwhere(walkable.data == FREE)
    if not len(free):
        raise InputError(f"{where} lies in no free cell; the map has none")
    offsets = (free[:, ::-1] + 0.5) * r + (origin.x - pose.x, origin.y - pose.y)
    distance = float(np.hypot(*offsets.T).min())
    raise InputError(
        f"{where} lies in an occupied or unknown cell; nearest free cell is {distance:.2f} m away"
    )


def check_apart(start: Pose2D, goal: Pose2D, arrival_radius: float) -> None:
    """Check that a delivery is not over before it begins.

    Raises:
        InputError: start and goal are within the arrival radius [m] of each other.
    """
    distance = math.hypot(goal.x - start.x, goal.y - start.y)
    if distance <= arrival_radius:
        raise InputError(
            f"start and goal are {distance:.2f} m apart, and a delivery has arrived within "
            f"{arrival_radius} m; "
            "give poses farther apart"
        )


def check_footprint_free(geometry: OccupancyGrid, start: Pose2D, footprint: FloatArray) -> None:
    """Check that the robot's footprint (N, 2) [m], base frame, covers no occupied cell at a start.

    Raises:
        InputError: it does.
    """
    polygon = transform_points(start, footprint)
    corner, size = geometry.origin, geometry.resolution
    cells = (polygon - (corner.x, corner.y)) / size
    low = np.maximum(np.floor(cells.min(axis=0)).astype(int), 0)
    high = np.minimum(np.ceil(cells.max(axis=0)).astype(int), (geometry.width, geometry.height))
    rows, columns = np.mgrid[low[1] : high[1], low[0] : high[0]]
    x, y = corner.x + columns * size, corner.y + rows * size
    # not its centre alone, which on a coarse map may be far from a corner of the robot
    edge = _TOUCH * size
    inner = shapely.box(x + edge, y + edge, x + size - edge, y + size - edge)
    covered = shapely.intersects(shapely.Polygon(polygon), inner)
    if (geometry.data[rows, columns][covered] >= SOLID_FROM).any():
        raise InputError(
            f"start ({start.x:g}, {start.y:g}) m, yaw {start.yaw:g}: the robot's footprint "
            "reaches into an obstacle "
            "there; give a start farther from it or another yaw"
        )
