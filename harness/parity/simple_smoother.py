"""The simple smoother: paths before and after."""

from collections.abc import Iterator

from harness.parity.comparison import Comparison
from harness.parity.golden import GoldenFile
from harness.parity.part import Case
from navstack.costmap.costmap import Costmap
from navstack.params.smoothers import SimpleSmootherParams
from navstack.params.strict import from_mapping
from navstack.planning.simple_smoother import SimpleSmoother
from navstack.types import Path

FACTS = "smoother"
SUFFIXES = ("in", "out", "costmap")
TOLERANCE = 1e-5  # [m, rad]


def find(file: GoldenFile) -> Iterator[Case]:
    """Paths ``sm_<case>_in`` and ``_out`` on ``_costmap``."""
    for base in file.bases("_in", prefix="sm_"):
        arrays = frozenset(f"sm_{base}_{suffix}" for suffix in SUFFIXES)
        if arrays <= file.names and "params" in file.facts(FACTS, base):
            yield Case(f"sm_{base}", file, arrays)


def check(case: Case, comparison: Comparison) -> None:
    """Every pose of the smoothed path."""
    facts = case.file.facts(FACTS, case.name.removeprefix("sm_"))
    params = from_mapping(SimpleSmootherParams, facts["params"], case.title)
    costmap = Costmap(case["costmap"], facts["resolution"], *map(float, facts["origin"]))
    ours, theirs = SimpleSmoother(params).smooth(Path(case["in"]), costmap).poses, case["out"]
    comparison.near("positions", ours[:, :2], theirs[:, :2], TOLERANCE)
    if ours.shape == theirs.shape:
        comparison.angles("headings", ours[:, 2], theirs[:, 2], TOLERANCE)
