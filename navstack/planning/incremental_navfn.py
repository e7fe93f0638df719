"""NavFn that keeps its potential between plans to one goal.

A plugin of our own, for replanning at 1 Hz.
"""

import math

import numpy as np

from navstack.costmap.costmap import (
    INSCRIBED_INFLATED_OBSTACLE,
    LETHAL_OBSTACLE,
    NO_INFORMATION,
    Costmap,
)
from navstack.params.planners import IncrementalNavfnParams, NavfnParams
from navstack.planning.endpoints import (
    face_along_last_step,
    goal_occupied,
    require_on_map,
    single_pose,
)
from navstack.planning.incremental_kernels import crosses_costlier, take_in_changes
from navstack.planning.navfn import NavfnPlanner, cell, end_at
from navstack.planning.navfn_kernels import (
    COST_NEUTRAL,
    COST_OBSTACLE,
    POT_HIGH,
    PRIORITY_STEP,
    cost_tables,
)
from navstack.planning.planner import Planner
from navstack.planning.potential_field import PotentialField, flat_costs
from navstack.types import ByteArray, FloatArray, Path, Pose2D

WAITING_CELLS = 200_000  # per buffer; a wave that is taken up again starts from its whole edge
# of potential (1 m of free cells) beyond the robot, so that straying does not end the field
MARGIN = 1000.0
# upper bound of the last stretch's cost, in multiples of its cost through free cells
COSTLY_SHARE = 2.0
# of potential (2 m of free cells); twice that beyond the robot's, a field is not spread again
HALF_REACH = 2000.0


class IncrementalNavfn(Planner):
    """NavFn's Dijkstra with the potential rooted at the goal instead of at the robot.

    While the goal stays, a plan is a descent from the robot. Cells that have become costlier matter
    only where the path crosses them: without them the field is a lower bound, and a path that
    attains it is the best. Cells that have become cheaper always matter. Changes that matter are
    applied: potentials below the lowest affected one stay, the others are computed again up to the
    robot, except in cells too far off its way.

    Changes are looked for within ``change_radius`` of the robot only (along x and y), which must
    cover the reach of the sensors and the way between two plans. Elsewhere a costlier cell is
    noticed when the path crosses it, a cheaper one when the robot comes near. Whatever the field
    cannot answer (occupied start or goal, no path) NavfnPlanner does.
    """

    def __init__(self, params: IncrementalNavfnParams) -> None:
        self._params = params
        self._field = PotentialField(params.allow_unknown, WAITING_CELLS)
        self._crossing, _ = cost_tables(params.allow_unknown)
        # the costs that the potential stands for
        self._known: ByteArray = np.empty(0, dtype=np.uint8)
        self._key: tuple[object, ...] = ()  # what the field was made for
        # potentials below this are final for the known costs, except in gaps
        self._sound_below = 0.0
        # lowest potential from which the field was spread again; above it there may be gaps
        self._gap_level = math.inf
        self._gap_limit = math.inf  # lower bound of the cost of ways through gaps
        self._robot = 0  # where it stood at the last plan
        self._fallback = NavfnPlanner(
            NavfnParams(
                tolerance=params.tolerance,
                allow_unknown=params.allow_unknown,
                use_final_approach_orientation=params.use_final_approach_orientation,
            )
        )

    def reset(self, rng: np.random.Generator) -> None:
        """Forget the field: a plan must not depend on the deliveries before.

        ``rng`` is not used.
        """
        self._key = ()
        self._field.forget()
        self._fallback.reset(rng)

    def plan(
        self,
        start: Pose2D,
        goal: Pose2D,
        costmap: Costmap,
        stamp: float = 0.0,
    ) -> Path:
        """A path from ``start`` to ``goal``; errors as :class:`NavfnPlanner`."""
        require_on_map(start, goal, costmap)
        if self._params.tolerance == 0.0 and costmap.cost_at(goal.x, goal.y) == LETHAL_OBSTACLE:
            raise goal_occupied(goal, costmap)
        if (start.x, start.y) == (goal.x, goal.y):
            return Path(
                single_pose(start, goal, self._params.use_final_approach_orientation), stamp
            )
        robot = cell(start, costmap)
        source = cell(goal, costmap)
        if not (self._is_open(robot, costmap) and self._is_open(source, costmap)):
            return self._fallback.plan(start, goal, costmap, stamp)
        points = self._descend(robot, source, costmap)
        if points is None:
            return self._fallback.plan(start, goal, costmap, stamp)
        poses = np.zeros((len(points), 3))
        poses[:, :2] = (costmap.origin_x, costmap.origin_y) + points * costmap.resolution
        poses = end_at(poses, goal)
        if self._params.use_final_approach_orientation:
            face_along_last_step(poses, start.yaw)
        return Path(poses, stamp)

    def _descend(self, robot: int, source: int, costmap: Costmap) -> FloatArray | None:
        """Points (N, 2) in [cells] from the robot's cell to the goal's through a current field."""
        key = (source, costmap.data.shape, costmap.resolution, costmap.origin_x, costmap.origin_y)
        if key != self._key:
            return self._descend_anew(key, robot, source, costmap)
        for only_cheaper in (True, False):
            self._take_in_changes(robot, costmap, only_cheaper)
            if not self._repair(robot, source, costmap):
                break
            points = self._field.descend(robot, source)
            if points is not None and not self._crosses_costlier(points, costmap):
                return points
        return self._descend_anew(key, robot, source, costmap)

    def _descend_anew(
        self,
        key: tuple[object, ...],
        robot: int,
        source: int,
        costmap: Costmap,
    ) -> FloatArray | None:
        """As :meth:`_descend`, with a field from nothing."""
        self._key = key
        self._known = flat_costs(costmap).copy()
        self._gap_level = math.inf
        self._gap_limit = math.inf
        self._robot = robot
        self._sound_below = self._field.expand(costmap, source, robot, margin=MARGIN) - float(
            PRIORITY_STEP
        )
        return self._field.descend(robot, source)

    def _take_in_changes(self, robot: int, costmap: Costmap, only_cheaper: bool) -> None:
        """Compare the costs about the robot with those known, and lower the sound level."""
        reach = math.ceil(self._params.change_radius / costmap.resolution)
        column = robot % costmap.size_x
        row = robot // costmap.size_x
        x0 = max(1, column - reach)
        xn = min(costmap.size_x - 1, column + reach + 1)
        y0 = max(1, row - reach)
        yn = min(costmap.size_y - 1, row + reach + 1)
        costs = (flat_costs(costmap), self._known, self._crossing)
        level = take_in_changes(
            self._field.flat, *costs, costmap.size_x, (x0, xn, y0, yn), only_cheaper
        )
        self._sound_below = min(self._sound_below, float(level))

    def _repair(self, robot: int, source: int, costmap: Costmap) -> bool:
        """Spread the field anew above the sound level unless the robot stands below.

        False: it has to be renewed.
        """
        guess = self._follow(robot, costmap.size_x)
        potential = float(self._field.flat[robot])
        if potential + HALF_REACH > self._gap_limit:
            self._sound_below = min(self._sound_below, self._gap_level)
        elif potential + 2.0 * float(COST_OBSTACLE) < self._sound_below:
            return True
        if not self._resume(robot, source, costmap, min(potential, guess) + 2.0 * HALF_REACH):
            return False
        potential = float(self._field.flat[robot])
        if potential + HALF_REACH <= self._gap_limit:
            return True
        # a detour: no better way costs more than it
        self._sound_below = min(self._sound_below, self._gap_level)
        return self._resume(robot, source, costmap, potential + 2.0 * HALF_REACH)

    def _resume(
        self,
        robot: int,
        source: int,
        costmap: Costmap,
        limit: float,
    ) -> bool:
        """Spread the field anew above the sound level, up to ways that cost ``limit``."""
        level = self._sound_below
        if level <= 2.0 * float(COST_OBSTACLE):
            return False
        known = Costmap(
            self._known.reshape(costmap.data.shape),
            costmap.resolution,
            costmap.origin_x,
            costmap.origin_y,
        )
        if limit >= float(POT_HIGH):
            limit = math.inf
        reached = self._field.resume(known, source, robot, level, MARGIN, limit)
        self._sound_below = reached - float(PRIORITY_STEP)
        if level <= self._gap_level:
            self._gap_level = level
            self._gap_limit = limit
        else:
            self._gap_limit = min(self._gap_limit, limit)
        return self._sound_below > 0.0

    def _follow(self, robot: int, width: int) -> float:
        """Lower the least cost of ways over the gaps by what the robot has moved since.

        Returns:
            A guess of what the way from here costs at most: the last one's, and the way from there
            back.
        """
        row, column = divmod(robot, width)
        last_row, last_column = divmod(self._robot, width)
        moved = math.hypot(row - last_row, column - last_column) * float(COST_NEUTRAL)
        self._gap_limit -= moved
        guess = float(self._field.flat[self._robot]) + COSTLY_SHARE * moved
        self._robot = robot
        return guess

    def _crosses_costlier(self, points: FloatArray, costmap: Costmap) -> bool:
        """Whether the path leads through a cell that costs more than the field knows."""
        return bool(
            crosses_costlier(
                points, flat_costs(costmap), self._known, self._crossing, costmap.size_x
            )
        )

    def _is_open(self, n: int, costmap: Costmap) -> bool:
        """Whether NavFn can cross a cell: on the map, off its border, not an obstacle."""
        row, column = divmod(n, costmap.size_x)
        if not (0 < row < costmap.size_y - 1 and 0 < column < costmap.size_x - 1):
            return False
        cost = costmap.data[row, column]
        return bool(
            cost < INSCRIBED_INFLATED_OBSTACLE
            or (cost == NO_INFORMATION and self._params.allow_unknown)
        )
