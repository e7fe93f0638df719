"""A part of the program whose time is taken, with its plain twin and what Nav2's C++ took.

The C++ was timed once on another machine of this class, a bar and not a fair race: unmodified Nav2
sources (Jazzy f4108e5b1, main a3a97043e), compiled outside ROS by g++ 12.2 with -O2, one thread of
an AMD EPYC virtual machine with 2 cores; medians with a noise of 5 to 10 %, grids of 4020 x 4020
for 4000 x 4000. Most of them stand in the golden vectors, too (``timing_ms`` in their facts).
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from harness.storage.shipped import shipped
from navstack.costmap.map_io import load_map
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import NavstackError
from tools.bench.timing import Step
from tools.parity.golden import GoldenFile, golden_folder

TWIN = "numpy twin"
MEASURED = "measured in turn in this run; results agree"
SOURCE = "Nav2's C++ (g++ 12.2 -O2), recorded on another machine of this class: indicative"


class TwinError(NavstackError):
    """A kernel and its plain twin do not agree: then neither time means anything."""


@dataclass(frozen=True, slots=True)
class Prepared:
    """A component that is ready to be timed.

    It is compiled, and has been shown to agree with its twin.
    """

    ours: Step
    twin: Step | None = None


@dataclass(frozen=True, slots=True)
class Component:
    """One part."""

    name: str
    prepare: Callable[[], Prepared]  # raises TwinError where the twin does not agree
    recorded_ms: float | None = None  # [ms] median of Nav2's own C++
    target: float | None = None  # of ours / recorded


def require_agreement(
    name: str,
    ours: npt.ArrayLike,
    twin: npt.ArrayLike,
    tolerance: float = 0.0,
) -> None:
    """Check that two results are alike.

    Raises:
        TwinError: they are not, by more than ``tolerance``, relative to the largest value.
    """
    found, expected = np.asarray(ours, dtype=np.float64), np.asarray(twin, dtype=np.float64)
    if found.shape != expected.shape:
        raise TwinError(
            f"{name}: the kernel gives the shape {found.shape}, its numpy twin {expected.shape}"
        )
    unlike = np.isfinite(found) != np.isfinite(expected)
    known = np.isfinite(found) & np.isfinite(expected)
    largest = float(np.abs(expected[known]).max(initial=0.0))
    off = float(np.abs(found[known] - expected[known]).max(initial=0.0))
    if unlike.any() or off > tolerance * largest:
        raise TwinError(
            f"{name}: the kernel and its numpy twin differ by {off:g} (largest value {largest:g}; "
            "allowed is "
            f"{tolerance:g} of it), {int(unlike.sum())} of {found.size} values are finite in one "
            "only"
        )


def golden(name: str) -> GoldenFile:
    """A file of golden vectors: the scenes on which the C++ was timed.

    Raises:
        GoldenError: it cannot be read.
    """
    return GoldenFile(golden_folder() / f"{name}.npz")


@lru_cache(maxsize=4)
def shipped_map(name: str) -> OccupancyGrid:
    """A map that comes with the program."""
    return load_map(shipped("maps") / f"{name}.yaml")
