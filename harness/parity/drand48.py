"""The random numbers of the recordings: POSIX ``drand48`` and Nav2's normal numbers made from it."""

import math

import numpy as np

from navstack.types import FloatArray

_FACTOR, _ADDEND, _MASK = 0x5DEECE66D, 0xB, (1 << 48) - 1  # POSIX.1-2017, drand48()
_SEED_LOW = 0x330E  # the low 16 bits that srand48() sets


class Drand48:
    """The sequence after ``srand48(seed)``."""

    def __init__(self, seed: int) -> None:
        self._state = (seed << 16) + _SEED_LOW

    def uniform(self) -> float:
        """The next number in [0, 1)."""
        self._state = (_FACTOR * self._state + _ADDEND) & _MASK
        return self._state / (1 << 48)

    def normal(self) -> float:
        """The next standard normal number, by the polar method (``pf_pdf.c``)."""
        while True:
            first, second = self._symmetric(), self._symmetric()
            squared = first * first + second * second
            if 0.0 < squared <= 1.0:
                return second * math.sqrt(-2.0 * math.log(squared) / squared)

    def uniforms(self, count: int) -> FloatArray:
        """The next ``count`` uniform numbers."""
        return np.array([self.uniform() for _ in range(count)])

    def normals(self, count: int) -> FloatArray:
        """The next ``count`` standard normal numbers."""
        return np.array([self.normal() for _ in range(count)])

    def _symmetric(self) -> float:
        """The next number in (-1, 1) but -1, for which another is drawn."""
        while (drawn := self.uniform()) == 0.0:
            pass
        return 2.0 * drawn - 1.0
