"""People who make way: the social force model."""

import copy
import math

import numpy as np

from harness.world.people.edges import Edges
from harness.world.people.errands import Errands
from harness.world.people.params import PedestrianParams
from harness.world.people.pedestrians import PedestrianModel
from harness.world.people.social_force_kernels import (
    LOST,
    RESTLESS,
    walk_among_others,
)
from harness.world.people.social_forces import force_constants
from harness.world.physics.body_state import BodyState
from harness.world.physics.robot import RobotParams
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.types import BoolArray, FloatArray, IntArray, Pose2D

_MOST_STEP = 1.0 / 60.0  # [s] of the integration; longer steps are divided


class SocialForcePedestrians(PedestrianModel):
    """Everybody walks from goal to goal and gives way to others, to walls and to the robot.

    Helbing & Molnar 1995 with their parameters, and the body compression of Helbing, Farkas &
    Vicsek 2000. Left out: fluctuations, attractions (nobody walks in company), and friction between
    bodies. Ours: the robot counts as a person of its size; walls are the edges of the walkable
    area, which nobody crosses; a pushed person looks for a new path when no straight line leads
    back to the old one.
    """

    takes_pushes = True

    def __init__(
        self,
        params: PedestrianParams,
        walkable: OccupancyGrid,
        robot: RobotParams,
    ) -> None:
        """Prepare the paths on a map; keep the object for all episodes on it.

        Args:
            params: how people walk.
            walkable: FREE where people may be.
            robot: whom they give way to.

        Raises:
            MapError: nothing is walkable.
        """
        n = params.count
        self._errands = Errands(params, walkable)
        network = self._errands.network
        self._forces = force_constants(params, robot.half_size, network.agent_radius)
        self._robot_center = robot.center
        self._edges = Edges(network.edge_distances(), network.walkable, network.frame)
        self._robot = np.zeros(6)
        self._unaware = params.social_force.unaware
        self._aware: BoolArray = np.ones(n, dtype=np.bool_)
        self._looks = np.zeros(n)
        self._needs: IntArray = np.zeros(n, dtype=np.int64)
        self._states = np.zeros((n, 4))

    @property
    def states(self) -> FloatArray:
        """See :class:`PedestrianModel`."""
        return self._states

    @property
    def errands(self) -> Errands:
        """See :class:`PedestrianModel`."""
        return self._errands

    def twin(self) -> "SocialForcePedestrians":
        """See :class:`PedestrianModel`; both keep the same map."""
        shared = (self._errands.network, self._edges)
        return copy.deepcopy(self, {id(each): each for each in shared})

    def reset(self, rng: np.random.Generator, robot: Pose2D) -> None:
        """See :class:`PedestrianModel`; everybody starts from a standstill."""
        starts = self._errands.reset(rng, robot)
        self._states = np.hstack((starts, np.zeros_like(starts)))
        self._looks = np.zeros(len(starts))
        if self._unaware > 0.0:
            self._aware = rng.random(len(starts)) >= self._unaware
        self.see_robot(BodyState(robot.x, robot.y, robot.yaw))

    def see_robot(self, robot: BodyState) -> None:
        """See :class:`PedestrianModel`."""
        cos, sin = math.cos(robot.yaw), math.sin(robot.yaw)
        cx, cy = self._robot_center
        self._robot[:] = (
            robot.x + cos * cx - sin * cy,
            robot.y + sin * cx + cos * cy,
            cos,
            sin,
            cos * robot.vx - sin * robot.vy,
            sin * robot.vx + cos * robot.vy,
        )

    def displaced(self, person: int, x: float, y: float, vx: float, vy: float) -> None:
        """See :class:`PedestrianModel`."""
        self._states = self._states.copy()
        self._states[person] = (x, y, vx, vy)

    def step(self, dt: float) -> None:
        """See :class:`PedestrianModel`."""
        parts = max(1, math.ceil(dt / _MOST_STEP - 1e-9))
        for _ in range(parts):
            self._advance(dt / parts)

    def _advance(self, dt: float) -> None:
        errands, after = self._errands, np.empty_like(self._states)
        if walk_among_others(
            dt,
            self._forces,
            self._robot,
            self._aware,
            errands.walks,
            self._looks,
            self._states,
            self._edges,
            after,
            self._needs,
        ):
            self._provide(after)
        self._states = after

    def _provide(self, states: FloatArray) -> None:
        for i in np.flatnonzero(self._needs == RESTLESS):
            self._errands.set_out(int(i))
        for i in np.flatnonzero(self._needs == LOST):
            self._errands.find_back(int(i), float(states[i, 0]), float(states[i, 1]))
