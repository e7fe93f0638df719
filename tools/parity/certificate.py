"""The certificate: which recorded cases of Nav2's C++ navstack reproduces, and why not."""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numba.core.errors import NumbaError

from navstack.errors import InputError, NavstackError
from tools.parity import (
    amcl,
    amcl_localizer,
    amcl_particles,
    controllers,
    costmaps,
    dwb,
    inflation,
    planning,
    safety,
)
from tools.parity.comparison import Comparison
from tools.parity.golden import GoldenError, GoldenFile
from tools.parity.part import Case, Part

_LARGEST = float(np.finfo(np.float32).max)
PARTS = (
    Part("inflation_curves", inflation.find_curves, inflation.check_curve),
    Part("inflation", inflation.GRIDS, inflation.check_grid),
    Part("inflation_main", inflation.find_main_grids, inflation.check_main_grid),
    Part("obstacle_layer", costmaps.find_layers, costmaps.check_layers),
    Part("navfn", planning.find_navfn, planning.check_navfn),
    Part("simple_smoother", planning.SMOOTHED, planning.check_smoother),
    Part("dwb", dwb.SCENES, dwb.check_scene),
    Part("dwb_jazzy", dwb.find_sequences, dwb.check_sequence),
    Part("dwb_velocities", dwb.VELOCITIES, dwb.check_velocities),
    Part("dwb_plan", dwb.PLANS, dwb.check_plan),
    Part("rpp", controllers.RPP, controllers.check_rpp),
    Part("rotation_shim", controllers.SHIM, controllers.check_shim),
    Part("rotation_shim_main", controllers.SHIM_OF_MAIN, controllers.check_shim_of_main),
    Part("velocity_smoother", safety.SMOOTHED, safety.check_smoother),
    Part("collision_monitor", safety.find_times, safety.check_times),
    Part("collision_monitor_overflow", safety.find_overflows, safety.check_overflow),
    Part("collision_monitor_edges", safety.EDGES, safety.check_edges),
    Part("amcl_field", amcl.FIELDS, amcl.check_field),
    Part("amcl_weights", amcl.find_weights, amcl.check_weights),
    Part("amcl_localizer", amcl.find_weights, amcl_localizer.check_localizer),
    Part("amcl_generator", amcl_particles.find_generators, amcl_particles.check_generator),
    Part("amcl_motion", amcl_particles.MOTIONS, amcl_particles.check_motion),
    Part(
        "amcl_moments", amcl_particles.find_moments, amcl_particles.check_moments, "standard errors"
    ),
    Part("amcl_limits", amcl_particles.LIMITS, amcl_particles.check_limits),
    Part("amcl_resampling", amcl_particles.find_resamplings, amcl_particles.check_resampling),
    Part("amcl_clusters", amcl_particles.find_clusters, amcl_particles.check_clusters),
    Part(
        "amcl_spread", amcl_particles.find_spreads, amcl_particles.check_spread, "standard errors"
    ),
)
UNREAD = "unread"  # name of the row of arrays that no comparison has read
# grids and paths that were recorded for the clock only
INPUTS_OF_TIMINGS = re.compile(r"(costmap|path)\d+")

_CANNOT_RUN = (NavstackError, ArithmeticError, LookupError, TypeError, ValueError, NumbaError)


@dataclass(frozen=True, slots=True)
class Deviation:
    """A case that is not equal."""

    case: str
    why: str
    is_explained: bool  # the recording, not navstack, is to blame
    is_compared: bool = True  # False: the case lacks facts, or has values that nobody can give


@dataclass(frozen=True, slots=True)
class PartResult:
    """How one part fared."""

    part: str
    cases: int
    equal: int  # cases without any deviation
    largest_deviation: float | None  # of what was compared within a tolerance; None: nothing was
    largest_deviation_unit: str | None  # None: each quantity's own
    deviations: tuple[Deviation, ...]


def discover(files: Sequence[GoldenFile]) -> list[tuple[Part, Case]]:
    """Every case of every part; nothing but names and facts is read.

    Raises:
        GoldenError: a file's facts are of a kind that a part cannot search.
    """
    return [(part, case) for part in PARTS for file in files for case in _found(part, file)]


def _found(part: Part, file: GoldenFile) -> list[Case]:
    try:
        return list(part.find(file))
    except _CANNOT_RUN as error:
        raise file.unusable(
            f"holds facts in which no case of {part.name} can be looked for ({error})"
        ) from None


def unread(files: Sequence[GoldenFile]) -> list[str]:
    """The arrays that no comparison has read, as ``<file>/<array>``."""
    return sorted(
        f"{file.stem}/{name}"
        for file in files
        for name in file.names - file.read
        if not INPUTS_OF_TIMINGS.fullmatch(name)
    )


def compare(part: Part, case: Case) -> Comparison:
    """Run navstack on the inputs of a case and compare.

    Whatever keeps it from running is a deviation, and no array of the case is told as unread.

    Raises:
        GoldenError: the recording is damaged.
    """
    comparison = _compared(part, case)
    if comparison.missing or comparison.wrong:
        case.file.read.update(case.arrays)
    return comparison


def _compared(part: Part, case: Case) -> Comparison:
    comparison = Comparison()
    try:
        if (name := _too_large(case)) is not None:
            comparison.missing.append(
                f"cannot be compared ({name} holds a number beyond single precision)"
            )
            return comparison
        with np.errstate(all="ignore"):  # what is no number is found to differ
            part.check(case, comparison)
    except GoldenError:
        raise
    except (KeyError, InputError) as error:
        comparison.missing.append(
            f"cannot be compared ({type(error).__name__}: {' '.join(str(error).split())})"
        )
    except _CANNOT_RUN as error:
        comparison.require(
            False, f"cannot be run ({type(error).__name__}: {' '.join(str(error).split())})"
        )
    return comparison


def _too_large(case: Case) -> str | None:
    """What of a case holds a finite number that Nav2's single precision does not; None: nothing."""
    for name in sorted(case.arrays):
        values = case.file.stored(name)
        if values.dtype == np.float64 and (np.abs(values[np.isfinite(values)]) > _LARGEST).any():
            return name
    facts = [case.facts]
    while facts:
        for key, value in facts.pop().items():
            if isinstance(value, dict):
                facts.append(value)
            elif isinstance(value, float) and _LARGEST < abs(value) < math.inf:
                return str(key)
    return None


def certify(files: Sequence[GoldenFile]) -> list[PartResult]:
    """The results of all parts that have cases, in the order of :data:`PARTS`."""
    cases = discover(files)
    results = [_summary(part, [case for other, case in cases if other is part]) for part in PARTS]
    lost = tuple(
        Deviation(name, "no comparison of any case has read it", False) for name in unread(files)
    )
    results.append(PartResult(UNREAD, len(lost), 0, None, None, lost))
    return [result for result in results if result.cases]


def _summary(part: Part, cases: Sequence[Case]) -> PartResult:
    compared = [(case, compare(part, case)) for case in cases]
    deviations = tuple(_deviations(compared))
    largest = max((comparison.largest for _, comparison in compared), default=0.0)
    equal = len(cases) - len(deviations)
    return PartResult(part.name, len(cases), equal, largest, part.unit, deviations)


def _deviations(compared: Sequence[tuple[Case, Comparison]]) -> Iterator[Deviation]:
    for case, comparison in compared:
        if not comparison.is_equal:
            why = "; ".join((*comparison.missing, *comparison.wrong, *comparison.allowed))
            is_compared = not comparison.missing
            yield Deviation(case.title, why, is_compared and not comparison.wrong, is_compared)


def passes(results: Sequence[PartResult]) -> bool:
    """Whether there is any case at all, and every deviation is explained."""
    explained = all(deviation.is_explained for result in results for deviation in result.deviations)
    return any(result.cases for result in results if result.part != UNREAD) and explained


def document(results: Sequence[PartResult]) -> dict[str, Any]:
    """The certificate as plain values for JSON."""
    return {"parts": [asdict(result, dict_factory=_named) for result in results]}


def _named(values: list[tuple[str, Any]]) -> dict[str, Any]:
    return {name.removeprefix("is_"): value for name, value in values}
