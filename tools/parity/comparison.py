"""What the comparison of one case finds."""

from typing import Any

import numpy as np
import numpy.typing as npt

from navstack.types import BoolArray


class Comparison:
    """Collects how far navstack is from a recording.

    What is wrong, what differs for a known reason, and how much.
    """

    def __init__(self) -> None:
        self.largest = 0.0  # deviation of all that was compared within a tolerance, in its own unit
        self.wrong: list[str] = []
        self.allowed: list[str] = []
        self.missing: list[str] = []  # why there is nothing to be said of the case

    @property
    def is_equal(self) -> bool:
        """Whether nothing deviates, not even for a known reason."""
        return not self.wrong and not self.allowed and not self.missing

    def equal(self, what: str, ours: Any, theirs: Any) -> None:
        """Both must be the same; NaN equals NaN."""
        a, b = np.asarray(ours), np.asarray(theirs)
        if not self._same_shape(what, a, b):
            return
        differs = ~((a == b) | ((a != a) & (b != b)))
        if differs.any():
            self._count(what, differs, a, b)

    def near(
        self,
        what: str,
        ours: Any,
        theirs: Any,
        tolerance: float,
        relative: bool = False,
    ) -> None:
        """Both must agree within an absolute tolerance, or one ``relative`` to the recording."""
        a, b = np.asarray(ours, dtype=np.float64), np.asarray(theirs, dtype=np.float64)
        if not self._same_shape(what, a, b) or a.size == 0:
            return
        with np.errstate(invalid="ignore", divide="ignore"):
            deviation = np.where(a == b, 0.0, np.abs(a - b) / (np.abs(b) if relative else 1.0))
        deviation = np.where(np.isnan(deviation), np.inf, deviation)
        finite = deviation[np.isfinite(deviation)]
        if finite.size:
            self.largest = max(self.largest, float(finite.max()))
        differs = deviation > tolerance
        if differs.any():
            self._count(what, differs, a, b)

    def angles(self, what: str, ours: Any, theirs: Any, tolerance: float) -> None:
        """As :meth:`near`, for angles [rad] that may differ by whole turns."""
        a, b = np.asarray(ours, dtype=np.float64), np.asarray(theirs, dtype=np.float64)
        if not self._same_shape(what, a, b):
            return
        turn = a - b
        self.near(what, (turn + np.pi) % (2.0 * np.pi) - np.pi, np.zeros_like(turn), tolerance)

    def require(self, holds: bool, otherwise: str) -> None:
        """``holds`` must be true; the text says what is wrong otherwise."""
        if not holds:
            self.wrong.append(otherwise)

    def allow(self, why: str) -> None:
        """Something differs, and that is right."""
        if why not in self.allowed:
            self.allowed.append(why)

    def _same_shape(self, what: str, a: npt.NDArray[Any], b: npt.NDArray[Any]) -> bool:
        self.require(a.shape == b.shape, f"{what}: shape {a.shape}, recorded {b.shape}")
        return a.shape == b.shape

    def _count(
        self,
        what: str,
        differs: BoolArray,
        a: npt.NDArray[Any],
        b: npt.NDArray[Any],
    ) -> None:
        first = tuple(int(i) for i in np.argwhere(differs)[0])
        at = ""
        if first:
            at = f" at {list(first)}"
        self.wrong.append(
            f"{what}: {int(differs.sum())} of {differs.size} differ, first{at}: {a[first]}, "
            f"recorded {b[first]}"
        )
