"""The people of a world."""

import copy
import math
from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from harness.world.people.errands import Errands
from harness.world.people.params import PedestrianParams
from harness.world.people.walk_kernels import walk
from harness.world.physics.body_state import BodyState
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.types import FloatArray, Pose2D

# state of somebody who is not there: infinitely far from everything
ABSENT = (math.inf, math.inf, 0.0, 0.0)
FAR_AWAY = BodyState(x=1e6, y=1e6)  # of a robot that nobody meets


class PedestrianModel(ABC):
    """Moves people through a world; what they walk into is the physics' business."""

    takes_pushes: ClassVar[bool] = False  # whether :meth:`displaced` has an effect

    @abstractmethod
    def reset(self, rng: np.random.Generator, robot: Pose2D) -> None:
        """Start an episode with a robot at its start; all chance comes from ``rng``."""

    @abstractmethod
    def step(self, dt: float) -> None:
        """Move everybody by ``dt`` [s]."""

    def steps(self, dt: float, times: int) -> None:
        """Take ``times`` steps of ``dt`` [s]."""
        for _ in range(times):
            self.step(dt)

    @property
    @abstractmethod
    def states(self) -> FloatArray:
        """Everybody now, (n, 4): x, y [m], vx, vy [m/s] in the map frame. Never changed afterwards.

        n is the same throughout an episode; who is not there yet, or not any more, is
        :data:`ABSENT`.
        """

    @property
    def errands(self) -> Errands | None:
        """Where those are going who make way for the robot; None: nobody does."""
        return None

    def twin(self) -> "PedestrianModel":
        """The same people once more: they go on by themselves from where these are now."""
        return copy.deepcopy(self)

    def see_robot(self, robot: BodyState) -> None:  # noqa: B027 - most people are blind
        """Look at the robot; called before every tick."""

    def displaced(  # noqa: B027
        self,
        person: int,
        x: float,
        y: float,
        vx: float,
        vy: float,
    ) -> None:
        """Go on from where the physics pushed ``person``: x, y [m], vx, vy [m/s], map frame."""


class RandomWalkPedestrians(PedestrianModel):
    """Everybody walks from goal to goal, as published.

    They neither avoid nor yield, to the robot or to each other, and change speed and direction at
    once. What one does depends on nobody else: see :class:`Errands`.
    """

    def __init__(self, params: PedestrianParams, walkable: OccupancyGrid) -> None:
        """Prepare the paths on a map; keep the object for all episodes on it.

        Args:
            params: how people walk.
            walkable: FREE where people may be.

        Raises:
            MapError: nothing is walkable.
        """
        self._errands = Errands(params, walkable)
        self._positions = np.zeros((params.count, 2))
        self._restless = np.zeros(params.count, dtype=np.bool_)
        self._states = np.zeros((params.count, 4))

    @property
    def states(self) -> FloatArray:
        """See :class:`PedestrianModel`."""
        return self._states

    def reset(self, rng: np.random.Generator, robot: Pose2D) -> None:
        """See :class:`PedestrianModel`; everybody starts walking."""
        self._positions = self._errands.reset(rng, robot)
        self.step(0.0)

    def step(self, dt: float) -> None:
        """See :class:`PedestrianModel`."""
        self.steps(dt, 1)

    def steps(self, dt: float, times: int) -> None:
        """See :class:`PedestrianModel`."""
        errands, states = self._errands, np.empty_like(self._states)
        while times > 0:
            moved, restless = walk(
                dt,
                times,
                errands.walks,
                self._positions,
                states,
                self._restless,
            )
            times -= moved
            if restless:
                for i in np.flatnonzero(self._restless):
                    errands.set_out(int(i))
        self._states = states
