"""Where a lost robot may be: poses anywhere on the map from which a scan fits it."""

import numpy as np

from navstack.localization.amcl_kernels import sum_over_beams
from navstack.localization.amcl_sensor_models import SensorModel
from navstack.localization.free_space import FreeSpace
from navstack.localization.likelihood_field import LikelihoodField
from navstack.types import FloatArray, LaserScan

COARSE_BEAMS = 40  # of the first look
COARSE_CELL = 0.2  # [m] of the field that is looked at first
COARSE_SIGMA = 0.5  # [m] of the first look: a candidate this far off still shows
FAMILIES = 100  # candidates that are followed up
OFFSPRING = 40  # of each in a step
STEPS = ((0.4, 0.06), (0.1, 0.015))  # [m, rad] standard deviations about the best so far


class ScanGuide:
    """Draws particles that a scan suggests (sensor resetting: Lenser & Veloso 2000).

    Nav2 draws them anywhere. Many candidates from all free space are looked at with a few beams and
    a wide likelihood; the best are moved about, step by step closer, and the likeliest of each
    family is kept.
    """

    def __init__(
        self, free_space: FreeSpace, field: LikelihoodField, model: SensorModel, candidates: int
    ) -> None:
        self._free_space, self._model = free_space, model
        self._coarse = field.thinned(max(round(COARSE_CELL / field.resolution), 1))
        self._candidates = candidates

    def draw(self, count: int, scan: LaserScan, rng: np.random.Generator) -> FloatArray:
        """Poses (count, 3) anywhere on the map; see :meth:`pick`."""
        return self.pick(self._free_space.draw(self._candidates, rng), count, scan, rng)

    def pick(
        self, poses: FloatArray, count: int, scan: LaserScan, rng: np.random.Generator
    ) -> FloatArray:
        """Of candidates (N, 3) the likeliest (count, 3), moved closer.

        Over and over again if there are not enough.
        """
        best, _ = self.refine(poses, scan, rng)
        return best[np.arange(count) % len(best)]

    def refine(
        self, poses: FloatArray, scan: LaserScan, rng: np.random.Generator
    ) -> tuple[FloatArray, FloatArray]:
        """The likeliest of candidates (N, 3), moved closer, and their likelihoods.

        Returns:
            (n, 3) and (n,), the likeliest first; n is ``FAMILIES`` or N if that is less.
        """
        families = min(FAMILIES, len(poses))
        # stable: which of equal ones another selection takes depends on the processor
        order = np.argsort(-self._coarse_fit(poses, scan), kind="stable")
        best, fits = poses[order[:families]], np.empty(families)
        for length, angle in STEPS:
            around = np.repeat(best[:, None], OFFSPRING, axis=1)
            around[:, 1:] += rng.standard_normal(around[:, 1:].shape) * (length, length, angle)
            likelihoods = self._model.likelihoods(around.reshape(-1, 3), scan, False)
            likelihoods = likelihoods.reshape(len(best), OFFSPRING)
            best = around[np.arange(len(best)), likelihoods.argmax(axis=1)]
            fits = likelihoods.max(axis=1)
            order = np.argsort(-fits, kind="stable")
            best, fits = best[order], fits[order]
        return best, fits

    def _coarse_fit(self, poses: FloatArray, scan: LaserScan) -> FloatArray:
        ends = self._model.beams(scan).ends() / self._coarse.resolution
        ends = ends[:: max(len(ends) // COARSE_BEAMS, 1)]
        values = np.exp(-((self._coarse.distances / COARSE_SIGMA) ** 2) / 2.0)
        return sum_over_beams(
            self._coarse.codes,
            values,
            self._coarse.to_cells(poses),
            np.ascontiguousarray(ends),
            0.0,
        )
