"""A made-up world for tests of the search: no simulation, known optimum."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from harness.metrics.columns import Row
from harness.tuning.evaluation import MARGIN, Candidate
from harness.tuning.space.space import Parameter, Space

SPACE = Space(
    "made-up",
    "Two numbers, a whole one and a switch",
    (
        Parameter("x", ("node.x",), 0.9, 0.0, 1.0),
        Parameter("scale", ("node.scale",), 1.0, 0.01, 100.0, is_log=True),
        Parameter("count", ("node.count",), 3, 1.0, 9.0, is_int=True),
        Parameter("fast", ("node.fast",), False, choices=(False, True)),
    ),
)


@dataclass
class MadeUp:
    """Contacts grow more with the distance from the optimum; counts what it drives."""

    failing: str = ""  # name of a candidate whose episodes have errors
    rash_within: float = 0.0  # of the optimum: who is that near earns much, and is late more often
    driven: dict[object, Row] = field(default_factory=dict)
    stop_after: int | None = None  # episodes, then an interrupt

    def rows(self, candidate: Candidate, missions: Sequence[int]) -> list[Row]:
        return [self._row(candidate, mission) for mission in missions]

    def _row(self, candidate: Candidate, mission: int) -> Row:
        if candidate.name == self.failing:
            return {"error": "its worker died", MARGIN: None}
        key = (candidate.key, mission)
        if key not in self.driven:
            if self.stop_after is not None and len(self.driven) >= self.stop_after:
                raise KeyboardInterrupt
            self.driven[key] = self._new(candidate, mission)
        return self.driven[key]

    def _new(self, candidate: Candidate, mission: int) -> Row:
        point = SPACE.original | {
            path.removeprefix("node."): value for path, value in candidate.values.items()
        }
        off = abs(float(point["x"]) - 0.3) + abs(np.log10(float(point["scale"])) - 1.0) / 2.0
        off += abs(float(point["count"]) - 6.0) / 8.0 + (0.0 if point["fast"] else 0.3)
        danger = float(np.random.default_rng(mission).random())
        contacts = int(danger < off / 2.0)
        is_rash = off < self.rash_within
        is_late = danger > (0.8 if is_rash else 0.97)
        outcome = "timeout" if is_late else "sla"
        return {
            "error": None,
            "outcome": outcome,
            "duration_s": 60.0 + off,
            MARGIN: 3.49 + 1000.0 * is_rash - 40.0 * contacts - 0.01 * off,
        }
