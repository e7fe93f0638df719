"""What every controller does."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from navstack.control.decision import Alternative, DecisionRecord, Option
from navstack.costmap.costmap import Costmap
from navstack.errors import ParameterError
from navstack.types import Path, RobotState, Track, Twist2D


def limited_speed(largest: float, limit: float, is_percentage: bool) -> float:
    """The largest speed [m/s] under a speed limit, see :meth:`Controller.set_speed_limit`."""
    if limit == 0.0:
        return largest
    if is_percentage:
        return largest * limit / 100.0
    return limit


def limited_share(largest: float, limit: float, is_percentage: bool) -> float:
    """The share of the largest speed [m/s] that a speed filter's ``limit`` leaves."""
    if limit == 0.0:
        return 1.0
    if is_percentage:
        return limit / 100.0
    return limit / largest


def finite(measured: float) -> float:
    """A measured value; 0 where it is no finite number."""
    if math.isfinite(measured):
        return measured
    return 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Surroundings:
    """What a controller may know of the robot's vicinity."""

    costmap: Costmap  # local, in the map frame
    tracks: tuple[Track, ...] = ()  # of what moves about, now; none where nobody tracks


class Controller(ABC):
    """Follows a plan. A new plan is recognised as a new object."""

    wants_tracks = False  # whether it looks at what moves about
    # whether it is asked on after arrival, and without a plan drives to the goal's pose
    acts_at_rest = False

    _decision: DecisionRecord | None = None  # of the last cycle, where it is made at once

    def seed(self, rng: np.random.Generator) -> None:  # noqa: B027 - few draw
        """Draw all random numbers from ``rng`` from now on.

        A new navigation begins; :meth:`reset` follows.
        """

    @abstractmethod
    def reset(self) -> None:
        """Forget the previous attempt to follow a plan.

        A new one begins, maybe to the same goal.
        """

    def resume(self) -> None:  # noqa: B027 - few need it
        """Go on with the attempt after a time in which the robot was made to stand."""

    @abstractmethod
    def compute_velocity(
        self, state: RobotState, plan: Path, surroundings: Surroundings
    ) -> Twist2D:
        """The velocity to command now, in the base frame.

        Raises:
            ControlError: the plan cannot be followed; :class:`NoLegalVelocity` where every sample
                is rejected.
        """

    @property
    def decision(self) -> DecisionRecord | None:
        """How the last cycle since the reset was decided, failed ones included.

        None: there is none, or the controller keeps none.

        Made when it is asked for, which must be before the next cycle.
        """
        return self._decision

    @property
    def alternatives(self) -> tuple[Alternative, ...]:
        """What the last cycle's command was preferred to.

        Empty: nothing legal was left, or the controller keeps none.

        Made when it is asked for, which must be before the next cycle, and may take longer than the
        cycle itself.
        """
        return ()

    @property
    def options(self) -> tuple[Option, ...]:
        """Motions that the last cycle compared, the chosen one first.

        Made when it is asked for, like :attr:`alternatives`.
        """
        return ()

    def set_speed_limit(self, limit: float, is_percentage: bool) -> None:
        """Drive no faster than this from now on, over resets too (``setSpeedLimit``).

        Args:
            limit: [m/s], or in percent of the largest speed; 0: no limit any more.
            is_percentage: which of both.

        Raises:
            ParameterError: this controller cannot; one that can overrides the method.
        """
        unit = "%" if is_percentage else " m/s"
        raise ParameterError(
            f"{type(self).__name__} knows no speed limit, and a speed filter asks for "
            f"{limit:g}{unit}; use another controller, or remove the filter"
        )
