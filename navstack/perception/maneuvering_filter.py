"""Bodies that mostly go straight and sometimes turn sharply.

An interacting multiple model filter of two models.
"""

import math

import numpy as np

from navstack.perception.track_filter import TrackFilter
from navstack.types import BoolArray, FloatArray, IntArray


class ManeuveringFilter:
    """Two :class:`TrackFilter`, for people who go straight and who turn, mixed by likelihood.

    The equations are Blom and Bar-Shalom's (1988, IEEE Transactions on Automatic Control 33), as in
    ``filterpy.kalman.IMMEstimator``. A body changes from going straight to turning and back at
    random, as in a continuous-time Markov chain whose mean times are given.
    """

    def __init__(
        self,
        straight: TrackFilter,
        turning: TrackFilter,
        straight_time: float,
        turning_time: float,
    ) -> None:
        """No bodies yet.

        Args:
            straight: of little process noise.
            turning: of much.
            straight_time: [s] between two turns, on average.
            turning_time: [s] of a turn, on average.
        """
        self._models = (straight, turning)
        self._rates = (1.0 / straight_time, 1.0 / turning_time)
        self._weights = np.empty((2, 0))  # how likely each body is in each model

    def __len__(self) -> int:
        return len(self._models[0])

    @property
    def states(self) -> FloatArray:
        """Mean x, y [m], vx, vy [m/s] of each body (N, 4)."""
        return _mean(self._weights, [model.states for model in self._models])

    @property
    def covariances(self) -> FloatArray:
        """Covariance of each body (N, 4, 4), with the spread of the two models."""
        return self._spread(self._weights, self.states)

    def predict(self, duration: float) -> None:
        """Mix the models, and move all bodies on by ``duration`` [s]."""
        both = sum(self._rates)
        decay = math.exp(-both * duration)
        to_turn, to_straight = (rate / both * (1.0 - decay) for rate in self._rates)
        passing = np.array(((1.0 - to_turn, to_turn), (to_straight, 1.0 - to_straight)))
        weights = passing.T @ self._weights
        mixed = []
        for j in (0, 1):
            shares = passing[:, j, None] * self._weights / weights[j]
            states = _mean(shares, [model.states for model in self._models])
            mixed.append((states, self._spread(shares, states)))
        for model, (states, covariances) in zip(self._models, mixed, strict=True):
            model.states = states
            model.covariances = covariances
            model.predict(duration)
        self._weights = weights

    def ahead(self, bodies: IntArray, duration: float) -> tuple[FloatArray, FloatArray]:
        """States (K, 4) and covariances (K, 4, 4) of some bodies ``duration`` [s] later."""
        weights = self._weights[:, bodies]
        parts = [model.ahead(bodies, duration) for model in self._models]
        mean = _mean(weights, [states for states, _ in parts])
        return mean, _mixture(weights, mean, parts)

    def distances(self, places: FloatArray, variances: FloatArray) -> FloatArray:
        """Squared Mahalanobis distances (N, M) to measured places, of the nearer model."""
        near, far = (model.distances(places, variances) for model in self._models)
        return np.minimum(near, far)

    def update(self, bodies: IntArray, places: FloatArray, variances: FloatArray) -> None:
        """Take in one measured place (2,) [m] for each of ``bodies`` (K,)."""
        if not len(bodies):
            return
        likelihoods = np.array([model.update(bodies, places, variances) for model in self._models])
        weights = self._weights[:, bodies] * np.maximum(likelihoods, 1e-300)
        self._weights[:, bodies] = weights / weights.sum(axis=0)

    def add(self, places: FloatArray, variances: FloatArray) -> None:
        """Begin to follow bodies at places (K, 2) [m]; they may move anywhere."""
        for model in self._models:
            model.add(places, variances)
        both = sum(self._rates)
        new = np.repeat([[self._rates[1] / both], [self._rates[0] / both]], len(places), axis=1)
        self._weights = np.concatenate((self._weights, new), axis=1)

    def keep(self, chosen: BoolArray) -> None:
        """Forget all bodies but the ``chosen`` (N,) ones."""
        for model in self._models:
            model.keep(chosen)
        self._weights = self._weights[:, chosen]

    def _spread(self, weights: FloatArray, mean: FloatArray) -> FloatArray:
        return _mixture(
            weights, mean, [(model.states, model.covariances) for model in self._models]
        )


def _mean(weights: FloatArray, states: list[FloatArray]) -> FloatArray:
    """Means (N, 4) of two models' states, weighted (2, N)."""
    mean: FloatArray = weights[0, :, None] * states[0] + weights[1, :, None] * states[1]
    return mean


def _mixture(
    weights: FloatArray, mean: FloatArray, parts: list[tuple[FloatArray, FloatArray]]
) -> FloatArray:
    """Covariances (N, 4, 4) of mixtures of normal distributions about their means (N, 4)."""
    total = np.zeros((len(mean), 4, 4))
    for weight, (states, covariances) in zip(weights, parts, strict=True):
        off = states - mean
        total += weight[:, None, None] * (covariances + off[:, :, None] * off[:, None, :])
    return total
