"""The particle filter of AMCL: weights, resampling, random particles, clusters (``pf.c``)."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from navstack.localization.free_space import FreeSpace
from navstack.localization.kld import label_clusters, origin_near, resample
from navstack.params.amcl import AmclParams
from navstack.types import FloatArray, IntArray, Pose2D

_TINY = 1e-300  # in place of 0, of which there is no logarithm
# [m] of their mean along x and y: all particles are, where they have converged
CONVERGED_WITHIN = 0.5


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
        deviations = np.sqrt(np.maximum(values, 0.0))
        draws = rng.standard_normal((self._params.most_particles, 3)) * deviations
        self._start_over(mean.as_array() + draws @ axes.T)

    def spread_uniform(self, rng: np.random.Generator) -> None:
        """Start from anywhere on the map that is free: global localization."""
        self._start_over(self._free_space.draw(self._params.most_particles, rng))

    def weigh(self, likelihoods: FloatArray, best: float) -> None:
        """Multiply the weights by likelihoods (N,) of a scan.

        ``best``: if every return ended on an obstacle.
        """
        total = self.multiply(likelihoods)
        if total > 0.0:
            self._averages.follow(total / len(self.weights), float(likelihoods.max()) / best)

    def multiply(self, likelihoods: FloatArray) -> float:
        """Multiply the weights by likelihoods (N,) of anything.

        The products' sum, 0: nothing fits and all count alike.

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
        """Draw new particles from the weighted ones, and some elsewhere if weights have fallen.

        Args:
            rng: for all draws.
            draw_strays: gives so many poses (N, 3) for particles from elsewhere, one or more; None:
                there are none.
            least_share: of particles from elsewhere, however the weights are.
        """
        given, share = self._params, 0.0
        if draw_strays is not None:
            share = max(self.share_of_strays, least_share)
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


def cluster_particles(
    poses: FloatArray, weights: FloatArray, as_one: bool = False
) -> list[Cluster]:
    """The clusters of particles, or all of them ``as_one``.

    The variance of yaw is the circular one, -2 ln R. As in Nav2, R is the resultant's length
    without division by the cluster's weight, so that a light cluster has a large variance.
    """
    labels: IntArray = np.zeros(len(poses), dtype=np.int64)
    if not as_one:
        labels = label_clusters(poses)
    origin_x, origin_y = origin_near(poses)
    x, y, yaw = (poses - (origin_x, origin_y, 0.0)).T
    terms = (np.ones(len(poses)), x, y, np.cos(yaw), np.sin(yaw), x * x, x * y, y * y)
    sums = np.array([np.bincount(labels, weights * term) for term in terms])
    found = []
    for weight, sx, sy, cos, sin, xx, xy, yy in sums.T.tolist():
        mx, my = sx / weight, sy / weight
        covariance = np.zeros((3, 3))
        covariance[0, 0] = max(xx / weight - mx * mx, 0.0)
        covariance[0, 1] = covariance[1, 0] = xy / weight - mx * my
        covariance[1, 1] = max(yy / weight - my * my, 0.0)
        covariance[2, 2] = -2.0 * math.log(min(max(math.hypot(cos, sin), _TINY), 1.0))
        pose = Pose2D(origin_x + mx, origin_y + my, math.atan2(sin, cos))
        found.append(Cluster(weight, pose, covariance))
    return found


LEAST_FALL = 0.1  # [-] of the fast average of fits: smaller ones are chance, as people pass by


class LikelihoodAverages:
    """AMCL is lost when a fast average of the scans' likelihood falls below a slow one.

    These are the averages of Nav2 (``pf.c``), after Augmented MCL (Probabilistic Robotics, table
    8.3).

    They start at their first value, and again after random particles were drawn, so that random
    particles do not accumulate. A weight is a likelihood divided by the number of particles. The
    averages are therefore insensitive: the first value is that of widely spread particles, and
    fewer particles look like a better fit.
    """

    def __init__(self, slow_rate: float, fast_rate: float) -> None:
        self._rates = slow_rate, fast_rate
        self.clear()

    def clear(self) -> None:
        """Start over."""
        self._averages = [0.0, 0.0]  # slow, fast
        self._count = 0

    def follow(self, weight: float, fit: float) -> None:
        """Take in a scan.

        Args:
            weight: mean of the particles' weights times the scan's likelihood.
            fit: greatest likelihood of the scan for any particle, as a share of the best possible.
        """
        self._count += 1
        value = self._choose(weight, fit)
        for i, rate in enumerate(self._rates):
            self._averages[i] += self._share_of_new(rate) * (value - self._averages[i])

    def _choose(self, weight: float, fit: float) -> float:
        """What is averaged."""
        return weight

    def _share_of_new(self, rate: float) -> float:
        """How much the newest value counts."""
        if self._count == 1:
            return 1.0
        return rate

    @property
    def share_of_strays(self) -> float:
        """The share of random particles that the next resampling brings.

        How far the fast average has fallen.
        """
        slow, fast = self._averages
        if slow <= fast:
            return 0.0
        return 1.0 - fast / slow

    def after_strays(self) -> None:
        """Random particles were drawn."""
        self.clear()


class LastingAverages(LikelihoodAverages):
    """Averages for random particles that the scan has picked.

    These do no harm, and may come until one is right.

    Each average is the plain mean until its rate takes over, and lasts. It is of the fit, which
    does not change with the number of particles or returns, nor with the random particles as long
    as one of all is right. Looking for poses that fit is slow, so that a fall of less than
    ``LEAST_FALL`` brings none.
    """

    def _choose(self, weight: float, fit: float) -> float:
        return fit

    def _share_of_new(self, rate: float) -> float:
        if rate <= 0.0:
            return 0.0
        return max(rate, 1.0 / self._count)

    @property
    def share_of_strays(self) -> float:
        """See the base class."""
        share = super().share_of_strays
        if share < LEAST_FALL:
            return 0.0
        return share

    def after_strays(self) -> None:
        """They last."""


def averages_of(params: AmclParams) -> LikelihoodAverages:
    """The averages that go with the parameters' kind of random particles."""
    kind = LastingAverages if params.recovery_candidates > 0 else LikelihoodAverages
    return kind(params.recovery_alpha_slow, params.recovery_alpha_fast)
