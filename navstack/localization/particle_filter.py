"""The particle filter of AMCL: weights, resampling, recovery by random particles, clusters (``pf.c``)."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from navstack.localization.amcl_averages import averages_of
from navstack.localization.free_space import FreeSpace
from navstack.localization.kld import label_clusters, resample
from navstack.params.amcl import AmclParams
from navstack.types import FloatArray, IntArray, Pose2D

_TINY = 1e-300  # in place of 0, of which there is no logarithm
CONVERGED_WITHIN = 0.5  # [m] of their mean along x and y: all particles are, where they have converged


@dataclass(frozen=True, slots=True, eq=False)
class Cluster:
    """Particles that stand close together, or all of them."""

    weight: float
    pose: Pose2D  # mean
    covariance: FloatArray  # (3, 3) of x, y, yaw


class ParticleFilter:
    """Particles with weights; a generator is given whenever chance is needed."""

    def __init__(self, params: AmclParams, free_space: FreeSpace) -> None:
        self._params = params
        self._averages = averages_of(params)
        self._free_space = free_space
        self._start_over(np.zeros((1, 3)))

    def _start_over(self, poses: FloatArray) -> None:
        self.poses = poses  # (N, 3) x, y [m], yaw [rad] in the map frame; yaw is not normalised
        self.weights = np.full(len(poses), 1.0 / len(poses))
        self.has_converged = False
        self._averages.clear()

    def spread_normal(self, mean: Pose2D, covariance: FloatArray, rng: np.random.Generator) -> None:
        """Start from a normal distribution with covariance (3, 3)."""
        values, axes = np.linalg.eigh(covariance)
        draws = rng.standard_normal((self._params.most_particles, 3)) * np.sqrt(np.maximum(values, 0.0))
        self._start_over(mean.as_array() + draws @ axes.T)

    def spread_uniform(self, rng: np.random.Generator) -> None:
        """Start from anywhere on the map that is free: global localization."""
        self._start_over(self._free_space.draw(self._params.most_particles, rng))

    def weigh(self, likelihoods: FloatArray, best: float) -> None:
        """Multiply the weights by likelihoods (N,) of a scan; ``best``: if every return ended on an obstacle."""
        total = self.multiply(likelihoods)
        if total > 0.0:
            self._averages.follow(total / len(self.weights), float(likelihoods.max()) / best)

    def multiply(self, likelihoods: FloatArray) -> float:
        """Multiply the weights by likelihoods (N,) of anything; the products' sum, 0: nothing fits and all count alike.

        The averages by which the filter takes itself to be lost are of scans, and stay as they are.
        """
        products = self.weights * likelihoods
        total = float(products.sum())
        if not total > 0.0:
            self.weights = np.full(len(self.poses), 1.0 / len(self.poses))
            return 0.0
        self.weights = products / total
        return total

    @property
    def share_of_strays(self) -> float:
        """The share of random particles that the next resampling brings."""
        return self._averages.share_of_strays

    def resample(
        self,
        rng: np.random.Generator,
        draw_strays: Callable[[int, np.random.Generator], FloatArray] | None,
        least_share: float = 0.0,
    ) -> None:
        """Draw new particles from the weighted ones, and some from elsewhere if the weights have fallen.

        Args:
            rng: for all draws.
            draw_strays: gives so many poses (N, 3) for particles from elsewhere, one or more; None: there are none.
            least_share: of particles from elsewhere, however the weights are.
        """
        given, share = self._params, 0.0 if draw_strays is None else max(self.share_of_strays, least_share)
        draws = rng.random((2, given.most_particles))
        is_stray = draws[1] < share
        strays = np.empty((given.most_particles, 3))
        if draw_strays is not None and is_stray.any():
            strays[is_stray] = draw_strays(int(is_stray.sum()), rng)
        if share > 0.0:
            self._averages.after_strays()
        self.poses = resample(
            self.poses,
            np.cumsum(self.weights),
            strays,
            is_stray,
            draws[0],
            given.min_particles,
            given.pf_err,
            given.pf_z,
        )
        self.weights = np.full(len(self.poses), 1.0 / len(self.poses))
        self.has_converged = stand_close(self.poses)

    def clusters(self) -> list[Cluster]:
        """The clusters, numbered as they appear among the particles."""
        return cluster_particles(self.poses, self.weights)

    def overall(self) -> Cluster:
        """All particles as one cluster."""
        return cluster_particles(self.poses, self.weights, as_one=True)[0]


def stand_close(poses: FloatArray) -> bool:
    """Whether all poses (N, 3) are within ``CONVERGED_WITHIN`` of their mean."""
    places = poses[:, :2]
    return bool((np.abs(places - places.mean(axis=0)) <= CONVERGED_WITHIN).all())


def cluster_particles(poses: FloatArray, weights: FloatArray, as_one: bool = False) -> list[Cluster]:
    """The clusters of particles, or all of them ``as_one``.

    The variance of yaw is the circular one, -2 ln R. As in Nav2, R is the resultant's length without division by the
    cluster's weight, so that a light cluster has a large variance.
    """
    labels: IntArray = np.zeros(len(poses), dtype=np.int64) if as_one else label_clusters(poses)
    x, y = poses[:, 0], poses[:, 1]
    terms = (np.ones(len(poses)), x, y, np.cos(poses[:, 2]), np.sin(poses[:, 2]), x * x, x * y, y * y)
    sums = np.array([np.bincount(labels, weights * term) for term in terms])
    found = []
    for weight, sx, sy, cos, sin, xx, xy, yy in sums.T.tolist():
        mx, my = sx / weight, sy / weight
        covariance = np.zeros((3, 3))
        covariance[0, 0] = max(xx / weight - mx * mx, 0.0)
        covariance[0, 1] = covariance[1, 0] = xy / weight - mx * my
        covariance[1, 1] = max(yy / weight - my * my, 0.0)
        covariance[2, 2] = -2.0 * math.log(min(max(math.hypot(cos, sin), _TINY), 1.0))
        found.append(Cluster(weight, Pose2D(mx, my, math.atan2(sin, cos)), covariance))
    return found
