"""What every critic does."""

from abc import ABC, abstractmethod
from typing import Any, NamedTuple

import numpy as np

from navstack.control.mppi.rollouts import MppiRollouts
from navstack.control.mppi.scene import MppiScene
from navstack.params.mppi import MppiParams
from navstack.types import Float32Array


class CriticScores(NamedTuple):
    """What a critic says of B trajectories."""

    raw: Float32Array  # (B,) before weight and power
    colliding: int = 0  # trajectories in collision, as far as the critic looks for that


class MppiCritic(ABC):
    """Scores trajectories: each costs ``(weight * raw) ** power``."""

    wants_tracks = False  # whether it looks at what moves about

    def __init__(self, name: str, params: MppiParams) -> None:
        """``name`` is the field of ``params`` that has the critic's own parameters."""
        self.name = name
        self._own: Any = getattr(params, name)
        self.weight = float(getattr(self._own, "cost_weight", 1.0))
        self.power = int(self._own.cost_power)

    @abstractmethod
    def score(self, rollouts: MppiRollouts, scene: MppiScene) -> CriticScores | None:
        """Raw scores; None: it does not count in this situation."""

    def weighted(self, raw: Float32Array) -> Float32Array:
        """Raw scores as they count; a power of 0 is as 1."""
        costs: Float32Array = raw * raw.dtype.type(self.weight)
        if self.power <= 1:
            return costs
        # an infinite cost counts as such; where all are, there is no legal velocity
        with np.errstate(over="ignore"):
            return costs**self.power
