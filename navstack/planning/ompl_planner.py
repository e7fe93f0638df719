"""Sampling-based planning with the Open Motion Planning Library (OMPL), a plugin of our own."""

import math

import numpy as np

from navstack.costmap.costmap import Costmap
from navstack.errors import PlanningError, StartOccupiedError
from navstack.params.planners import OmplParams, SimpleSmootherParams
from navstack.planning.dubins import is_curve_free
from navstack.planning.endpoints import (
    corners,
    dense_poses,
    goal_occupied,
    occupied,
    place_in_cells,
    require_on_map,
    single_pose,
    to_cells,
)
from navstack.planning.ompl_kernels import (
    Room,
    blocked_table,
    can_turn,
    is_free,
    is_polyline_free,
    nearest_free_cell,
)
from navstack.planning.ompl_problem import Query, why_no_path
from navstack.planning.ompl_search import OmplResult, path_cost, search
from navstack.planning.planner import Planner, RobotShape, convex_hull
from navstack.planning.polyline_kernels import polyline_cost, shortcut
from navstack.planning.simple_smoother import SimpleSmoother
from navstack.types import FloatArray, Path, Pose2D

SHORTCUTS = 300  # tries; a 100 m path through streets no longer gets shorter after about 200
LARGEST_SEED = 2**31 - 1
JOIN = 1.0  # [m] from a path within which the robot still follows it, where it may turn on the spot
ROUNDINGS = (1000, 100, 10)  # iterations of the smoother, the roundest first
WORTH_IT = 0.99  # of the cost of a kept path, which another one must not exceed


class OmplPlanner(Planner):
    """Plans with one of OMPL's algorithms, for a point in the plane or a pose on Dubins curves.

    In the plane (R2) the robot turns at way points, where a disc of its circumscribed radius must
    have room, and drives straight between them, where a strip of its width must; start and goal
    need no room to turn. With poses (SE2) the footprint itself is tried along the curves. Both hold
    against the squares of the costmap's lethal cells, on top of ``max_allowed_cost``.

    While the robot drives, every plan searches anew from where it is, and the cheaper of the new
    path and what is left of the last one is taken: a first path is there at once and gets better on
    the way. Once ``fruitless_searches`` in a row have found nothing cheaper, the path is kept
    without a search as long as it is free.

    A plan is repeatable: the effort is limited by a count, and every plan seeds OMPL anew from the
    generator that ``reset`` gave, so that it does not depend on what else the process has planned;
    ``max_planning_time`` gives that up. An occupied start or goal is replaced by the nearest free
    cell.
    """

    def __init__(self, params: OmplParams, shape: RobotShape | None = None) -> None:
        """``shape`` None: the costs alone say where the robot can be."""
        self._params = params
        self._shape = shape
        self._rng = np.random.default_rng(0)  # until reset
        self._blocked = blocked_table(params.max_allowed_cost, params.allow_unknown)
        self._hull = convex_hull(shape)
        self._improvement: tuple[tuple[float, float], ...] = ()
        self._kept: Path | None = None

    @property
    def improvement(self) -> tuple[tuple[float, float], ...]:
        """Wall time [s] and cost [m] whenever the last plan's best path got better.

        Simplification is not in it.
        """
        return self._improvement

    def reset(self, rng: np.random.Generator) -> None:
        """Draw from ``rng`` from here on, and keep no path."""
        self._rng = rng
        self._kept = None
        self._fruitless = 0

    def plan(self, start: Pose2D, goal: Pose2D, costmap: Costmap, stamp: float = 0.0) -> Path:
        """A path from ``start`` to ``goal`` in steps of one cell, the last pose as the goal.

        Each pose looks along the path. A path to the same goal that is still free is kept, if so
        wanted.

        Raises:
            PlanningError: start or goal outside the map or in an obstacle, no connection, or the
                budget used up.
        """
        seed = int(self._rng.integers(1, LARGEST_SEED))
        draws = self._rng.random((SHORTCUTS, 2))
        self._improvement = ()
        require_on_map(start, goal, costmap)
        if (start.x, start.y) == (goal.x, goal.y):
            return Path(single_pose(start, goal, False), stamp)
        kept = self._still_free(start, goal, costmap)
        if kept is None:
            self._fruitless = 0
        poses = kept
        if kept is None or self._fruitless < self._params.fruitless_searches:
            poses = self._cheaper(kept, start, goal, costmap, seed, draws)
        assert poses is not None
        self._kept = None
        if self._params.keep_valid_path:
            self._kept = Path(poses, stamp)
        return Path(poses.copy(), stamp)

    def _cheaper(
        self,
        kept: FloatArray | None,
        start: Pose2D,
        goal: Pose2D,
        costmap: Costmap,
        seed: int,
        draws: FloatArray,
    ) -> FloatArray:
        """A path found anew, or what is left of the last one where that costs hardly more."""
        try:
            query, states = self._search(start, goal, costmap, seed, draws)
            found = self._poses(query, states, start, goal, costmap)
        except PlanningError:
            if kept is None:
                raise
            self._fruitless += 1
            return kept
        if kept is not None:
            if self._cost(found, costmap) > WORTH_IT * self._cost(kept, costmap):
                self._fruitless += 1
                return kept
        self._fruitless = 0
        return found

    def _cost(self, poses: FloatArray, costmap: Costmap) -> float:
        """Of a path (N, 3) [m], in [cells]."""
        cells = to_cells(poses, costmap)
        return float(polyline_cost(costmap.data, cells, self._params.cost_weight))

    def _search(
        self, start: Pose2D, goal: Pose2D, costmap: Costmap, seed: int, draws: FloatArray
    ) -> tuple[Query, FloatArray]:
        """The question, and the states of its answer."""
        query = self._query(start, goal, costmap)
        params = self._params
        found = search(
            query,
            params.algorithm,
            params.range / costmap.resolution,
            params.max_iterations,
            params.max_planning_time,
            params.patience,
            seed,
        )
        self._improvement = tuple(
            (seconds, cost * costmap.resolution) for seconds, cost in found.improvement
        )
        if found.states is None:
            raise why_no_path(query, self._params, start, goal)
        return query, self._simplified(query, found, draws)

    def _query(self, start: Pose2D, goal: Pose2D, costmap: Costmap) -> Query:
        first = self._free_point(start, costmap)
        last = self._free_point(goal, costmap)
        if first is None:
            raise StartOccupiedError(occupied("start", start, costmap))
        if last is None:
            raise goal_occupied(goal, costmap)
        first_state = np.array(first)
        last_state = np.array(last)
        if self._params.state_space == "SE2":
            first_state = np.array((*first, start.yaw))
            last_state = np.array((*last, goal.yaw))
        return Query(
            costs=costmap.data,
            blocked=self._blocked,
            room=self._room(costmap.resolution),
            footprint=self._hull / costmap.resolution,
            first=first_state,
            last=last_state,
            cost_weight=self._params.cost_weight,
            turning_radius=self._params.minimum_turning_radius / costmap.resolution,
        )

    def _room(self, resolution: float) -> Room:
        """Radii of the discs that need room.

        The strip needs none where the costs keep the centre far enough off.
        """
        if self._shape is None:
            return Room(0.0, 0.0, self._params.allow_unknown)
        half_width = float(np.abs(self._hull[:, 1]).max())
        corridor = half_width / resolution
        if half_width + math.sqrt(2.0) * resolution <= self._shape.inscribed_radius:
            corridor = 0.0
        turning = float(np.hypot(*self._hull.T).max()) / resolution
        return Room(corridor, turning, self._params.allow_unknown)

    def _free_point(self, pose: Pose2D, costmap: Costmap) -> tuple[float, float] | None:
        """The pose, or the centre of the nearest free cell within the tolerance, in [cells]."""
        x, y = place_in_cells(pose, costmap)
        if is_free(costmap.data, self._blocked, x, y):
            return x, y
        radius = self._params.tolerance / costmap.resolution
        column, row = nearest_free_cell(costmap.data, self._blocked, int(x), int(y), radius)
        if column < 0:
            return None
        return column + 0.5, row + 0.5

    def _simplified(self, query: Query, found: OmplResult, draws: FloatArray) -> FloatArray:
        """The states with short cuts taken, in the plane, where that is wanted.

        Not where it would cost more.
        """
        assert found.states is not None
        if not self._params.simplify or query.has_yaw:
            return found.states
        shorter: FloatArray = shortcut(
            query.costs, query.blocked, query.room, found.states, query.cost_weight, draws
        )
        if path_cost(query, shorter) <= path_cost(query, found.states):
            return shorter
        return found.states

    def _poses(
        self, query: Query, states: FloatArray, start: Pose2D, goal: Pose2D, costmap: Costmap
    ) -> FloatArray:
        if query.has_yaw:
            pieces = [query.way(a, b)[1:] for a, b in zip(states[:-1], states[1:], strict=True)]
            dense = np.vstack((states[:1], *pieces))
            dense[:, :2] = (costmap.origin_x, costmap.origin_y) + dense[:, :2] * costmap.resolution
        else:
            if tuple(states[0]) != place_in_cells(start, costmap):
                states = np.vstack((place_in_cells(start, costmap), states))
            dense = self._smoothed(dense_poses(states, goal.yaw, costmap), costmap)
        if tuple(query.last[:2]) == place_in_cells(goal, costmap):
            dense[-1] = goal.as_array()  # to the last bit, for the path is kept by it
        return dense

    def _smoothed(self, poses: FloatArray, costmap: Costmap) -> FloatArray:
        """The path with its corners rounded as far as there is room, where that is wanted."""
        if not self._params.smooth:
            return poses
        for iterations in ROUNDINGS:
            smoother = SimpleSmoother(SimpleSmootherParams(max_its=iterations, do_refinement=False))
            rounder = smoother.smooth(Path(poses, 0.0), costmap).poses
            if self._is_free(rounder, costmap):
                return rounder
        return poses

    def _still_free(self, start: Pose2D, goal: Pose2D, costmap: Costmap) -> FloatArray | None:
        """What is left of the last path where it leads to the same goal, is near and free.

        Else None.
        """
        if self._kept is None or not np.array_equal(self._kept.poses[-1], goal.as_array()):
            return None
        poses = self._kept.poses
        distances = np.hypot(poses[:, 0] - start.x, poses[:, 1] - start.y)
        nearest = int(distances.argmin())
        if not self._is_on(start, poses[nearest], costmap.resolution):
            return None
        rest = poses[min(nearest + 1, len(poses) - 1) :]
        kept = np.vstack((start.as_array(), rest))
        if not self._is_free(kept, costmap):
            return None
        return kept

    def _is_free(self, poses: FloatArray, costmap: Costmap) -> bool:
        """Whether the robot has room along a path (N, 3) and where it turns on it."""
        cells = to_cells(poses, costmap)
        room = self._room(costmap.resolution)
        if self._params.state_space == "SE2":
            hull = self._hull / costmap.resolution
            body = (room.turning, room.allow_unknown)
            return bool(is_curve_free(costmap.data, self._blocked, hull, *body, cells))
        if not is_polyline_free(costmap.data, self._blocked, room, cells):
            return False
        return all(can_turn(costmap.data, self._blocked, room, x, y) for x, y in corners(cells))

    def _is_on(self, start: Pose2D, pose: FloatArray, cell: float) -> bool:
        """Whether the robot can go on from a path's nearest pose (3,).

        A car cannot step aside, nor turn on the spot.

        ``cell`` is the length of one in [m]; a car is on the path within a cell, and a cell's
        length of turning.
        """
        distance = math.hypot(pose[0] - start.x, pose[1] - start.y)
        if self._params.state_space != "SE2":
            return distance <= JOIN
        turn = abs(math.remainder(pose[2] - start.yaw, 2.0 * math.pi))
        return distance <= cell and turn <= cell / self._params.minimum_turning_radius
