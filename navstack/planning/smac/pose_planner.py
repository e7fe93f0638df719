"""Hybrid-A* and A* on a state lattice, as nav2_smac_planner has them."""

import math
from abc import abstractmethod
from pathlib import Path as FilePath

import numpy as np

from navstack.costmap.costmap import INSCRIBED_INFLATED_OBSTACLE, Costmap
from navstack.params.smac import REEDS_SHEPP, SmacHybridParams, SmacLatticeParams, iterations_of
from navstack.planning.dubins import is_curve_free
from navstack.planning.endpoints import in_one_cell, require_on_map, single_pose, to_cells
from navstack.planning.ompl_kernels import blocked_table
from navstack.planning.planner import Planner, RobotShape, convex_hull
from navstack.planning.smac.common import (
    in_cells,
    in_metres,
    no_way,
    require_free_goal,
    searched,
    smoothed,
)
from navstack.planning.smac.motions import Motions, arcs, lattice, read_lattice
from navstack.planning.smac.pose_kernels import Found, search_poses
from navstack.planning.smac.pose_problem import Expansion, Goal, Penalties, SearchGround
from navstack.types import FloatArray, Path, Pose2D

LATTICE_RADIUS = 0.5  # [m] of turning, as Nav2's default lattice file has it
COARSE = 2  # cells along the edge of a square of the heuristic, where it is downsampled


class _PosePlanner(Planner):
    """A* over motions, with the way on the grid as heuristic and curves that end a search early.

    Where Jazzy differs: the footprint is held exactly against the squares of obstacles at every
    cell of a motion, not its outline at the motion's end; of Reeds and Shepp's curves to the goal
    only those without a change of direction are tried; a smoothed path that would touch something
    is dropped for the one before; the limit of time is one of iterations.
    """

    def __init__(
        self, params: SmacHybridParams | SmacLatticeParams, shape: RobotShape | None = None
    ) -> None:
        """``shape`` None: the costs alone say where the robot can be."""
        self._params = params
        self._blocked = blocked_table(INSCRIBED_INFLATED_OBSTACLE - 1, params.allow_unknown)
        self._hull = convex_hull(shape)

    @abstractmethod
    def _motions(self, costmap: Costmap) -> tuple[Motions, float, bool]:
        """The motions, the turning radius [cells], and whether some lead backwards."""

    def plan(
        self,
        start: Pose2D,
        goal: Pose2D,
        costmap: Costmap,
        stamp: float = 0.0,
    ) -> Path:
        """A path from ``start`` to ``goal`` that the robot can drive as it stands.

        See :class:`Planner`.

        Raises:
            PlanningError: a pose outside the map, an occupied goal with tolerance 0, or no path.
        """
        require_on_map(start, goal, costmap)
        used = searched(costmap, self._params)
        if in_one_cell(start, goal, used):
            return Path(single_pose(start, goal, False), stamp)
        require_free_goal(goal, used, self._params.tolerance, self._blocked)
        ground = self._ground(used)
        motions, radius, reverses = self._motions(used)
        first = in_cells(start, used)
        last = in_cells(goal, used)
        target = self._goal(last, motions, radius, reverses, used.resolution)
        heading = nearest_heading(motions, start.yaw)
        # the full resolution, as upstream: on a downsampled costmap curves reach farther
        way = self._expansion(radius, reverses, costmap.resolution)
        found = search_poses(ground, motions, first, heading, target, self._penalties(), way)
        if found.node < 0:
            raise no_way(start, goal, found.iterations, target.max_iterations)
        poses = in_metres(self._poses(found, motions, first, last), used)
        if self._params.smooth_path:
            poses = self._smoothed(poses, used, ground)
        return Path(poses, stamp)

    def _ground(self, costmap: Costmap) -> SearchGround:
        hull = self._hull / costmap.resolution
        reach = float(np.hypot(*hull.T).max())
        room = np.zeros(costmap.data.shape, dtype=np.uint8)
        return SearchGround(
            costmap.data, self._blocked, hull, reach, self._params.allow_unknown, room
        )

    def _goal(
        self,
        pose: FloatArray,
        motions: Motions,
        radius: float,
        reverses: bool,
        resolution: float,
    ) -> Goal:
        params = self._params
        window = 0.5 * params.lookup_table_size / resolution
        coarse = 1
        if reverses:
            window = 0.0
        if params.downsample_obstacle_heuristic:
            coarse = COARSE
        return Goal(
            pose,
            nearest_heading(motions, pose[2]),
            params.tolerance / resolution,
            iterations_of(params),
            params.max_on_approach_iterations,
            coarse,
            window,
            radius,
        )

    def _penalties(self) -> Penalties:
        return Penalties(*(getattr(self._params, f"{name}_penalty") for name in Penalties._fields))

    def _expansion(self, radius: float, reverses: bool, resolution: float) -> Expansion:
        params = self._params
        longest = params.analytic_expansion_max_length / resolution
        return Expansion(
            params.analytic_expansion_ratio,
            longest,
            int(params.analytic_expansion_max_cost),
            radius,
            reverses,
        )

    def _poses(
        self,
        found: Found,
        motions: Motions,
        first: FloatArray,
        last: FloatArray,
    ) -> FloatArray:
        """The way (n, 3) [cells], every pose of its motions, up to the goal if it was reached."""
        nodes = found.nodes
        chain = [found.node]
        while nodes.parents[chain[-1]] >= 0:
            chain.append(nodes.parents[chain[-1]])
        pieces = [first[None, :]]
        for before, n in zip(chain[:0:-1], chain[-2::-1], strict=True):
            b = nodes.headings[before]
            k = nodes.by[n]
            piece = motions.poses[b, k, : motions.counts[b, k]].copy()
            piece[:, :2] += nodes.places[before]
            pieces.append(piece)
        if len(found.curve):
            pieces.append(found.curve[1:])
        poses = np.vstack(pieces)
        if np.hypot(*(poses[-1, :2] - last[:2])) <= math.sqrt(2.0):
            poses[-1] = last
        return poses

    def _smoothed(self, poses: FloatArray, costmap: Costmap, ground: SearchGround) -> FloatArray:
        """The path smoothed, if the robot has room on it."""
        better = smoothed(poses, costmap, self._params.smoother)
        cells = to_cells(better, costmap)
        is_free = is_curve_free(
            ground.costs,
            ground.blocked,
            ground.footprint,
            ground.reach,
            ground.allow_unknown,
            cells[1:],
        )
        if not is_free:
            return poses
        return better


class SmacHybrid(_PosePlanner):
    """Hybrid-A*: arcs and lines from any place, headings in bins (Dolgov et al., 2008)."""

    _params: SmacHybridParams

    def _motions(self, costmap: Costmap) -> tuple[Motions, float, bool]:
        # a cell at least, as upstream
        radius = max(self._params.minimum_turning_radius / costmap.resolution, 1.0)
        reverses = self._params.motion_model_for_search == REEDS_SHEPP
        return arcs(self._params.angle_quantization_bins, radius, reverses), radius, reverses


class SmacLattice(_PosePlanner):
    """A* on a state lattice, from cell centre to cell centre (Pivtoraiko and Kelly, 2005)."""

    _params: SmacLatticeParams

    def _motions(self, costmap: Costmap) -> tuple[Motions, float, bool]:
        file = FilePath(self._params.lattice_filepath)
        if self._params.lattice_filepath and file.is_file():
            motions, metres = read_lattice(file, costmap.resolution)
            return motions, metres / costmap.resolution, False
        radius = LATTICE_RADIUS / costmap.resolution
        return lattice(radius), radius, False


def nearest_heading(motions: Motions, yaw: float) -> int:
    """The number of the heading nearest to a yaw [rad]."""
    apart = np.abs((motions.headings - yaw + math.pi) % (2.0 * math.pi) - math.pi)
    return int(np.argmin(apart))
