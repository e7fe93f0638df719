"""DWB's sampled velocities by themselves, and the densified plan that seeds its map grids."""

from collections.abc import Iterator

from harness.parity.comparison import Comparison
from harness.parity.dwb import FREQUENCY, make_params
from harness.parity.golden import GoldenFile
from harness.parity.part import Case
from navstack.control.dwb.rollouts import RolloutGenerator
from navstack.control.plan_handling import densify
from navstack.types import Twist2D

RESOLUTION = 0.05  # [m] of the grid that plans are densified for
POINT_TOLERANCE = 1e-9  # [m]


def find_velocities(file: GoldenFile) -> Iterator[Case]:
    """Samples ``twists_<case>``; the fact is the velocity alone, or the velocity and changed parameters."""
    for name in sorted(file.names):
        if name.startswith("twists_") and name in file.meta and "base_params" in file.meta:
            yield Case(name, file, frozenset((name,)))


def check_velocities(case: Case, comparison: Comparison) -> None:
    """All samples in their order, to the last bit."""
    facts = case.file.meta[case.name]
    velocity, overrides = (facts["vel"], facts["over"]) if isinstance(facts, dict) else (facts, {})
    generator = RolloutGenerator(make_params(case.file, overrides), FREQUENCY)
    comparison.equal("velocities", generator.sampler.sample(Twist2D(*velocity)), case.file[case.name])


def find_plans(file: GoldenFile) -> Iterator[Case]:
    """Plans ``adjust_<case>_in`` and ``_out``."""
    for base in file.bases("_in", prefix="adjust_"):
        name = f"adjust_{base}"
        if f"{name}_out" in file:
            yield Case(name, file, frozenset((f"{name}_in", f"{name}_out")))


def check_plan(case: Case, comparison: Comparison) -> None:
    """The points, filled up where a gap exceeds two cells."""
    ours = densify(case["in"], case.facts.get("resolution", RESOLUTION))
    comparison.near("points", ours, case["out"][:, :2], POINT_TOLERANCE)
