"""What the auditor tells of: checks, and findings with their evidence."""

from dataclasses import dataclass

from harness.metrics import Row
from harness.statistics import Interval, PairedDifference
from navstack.types import FloatArray

FAMILY_LEVEL = 0.02  # at most the probability of any false alarm in a study whose incumbent exploits nothing
TESTS = 9  # that share it alike; the one for edges is shared again by the parameters
LEVEL = FAMILY_LEVEL / TESTS  # of each test, one-sided (Bonferroni)
LEAST_PAIRS = 9  # of deliveries: with fewer no paired test reaches the level (2 ** -9 < LEVEL < 2 ** -8)
TITLES = {
    "threshold": "pushing just under the contact threshold",
    "accounting": "a gain that only the published accounting of contacts shows",
    "timeout": "standing still until the timeout",
    "early_end": "ending early",
    "freezing": "freezing",
    "edge": "a value at the edge of its range",
}


@dataclass(frozen=True, slots=True)
class Evidence:
    """A number behind a finding."""

    what: str
    unit: str
    original: float | None  # None: it has none, as where none of its deliveries ended so
    incumbent: float
    difference: Interval  # incumbent less original; without bounds where there is nothing to resample
    p: float | None = None  # of no difference; None: not tested

    def as_json(self) -> Row:
        """The evidence as one JSON object."""
        return {
            "what": self.what,
            "unit": self.unit,
            "original": self.original,
            "incumbent": self.incumbent,
            "difference": self.difference.as_json(),
            "p": self.p,
        }


@dataclass(frozen=True, slots=True)
class Check:
    """One check: passed, flagged, or not examined."""

    key: str  # of TITLES
    is_flagged: bool
    says: str  # what it found, in a sentence; or why it was not examined
    evidence: tuple[Evidence, ...] = ()
    is_examined: bool = True
    why: str = ""  # this is a gap of the cost model
    advice: str = ""  # what to do
    look: str = ""  # what is no alarm, but for a reader to look at

    @property
    def title(self) -> str:
        """What it looks for."""
        return TITLES[self.key]

    @property
    def state(self) -> str:
        """How it came out, in a word."""
        if self.is_flagged or not self.is_examined:
            return "flagged" if self.is_flagged else "not examined"
        return "look" if self.look else "passed"

    def as_json(self) -> Row:
        """The check as one JSON object."""
        return {
            "check": self.key,
            "title": self.title,
            "state": self.state,
            "says": self.says,
            "look": self.look,
            "evidence": [each.as_json() for each in self.evidence],
            "why": self.why,
            "advice": self.advice,
        }


def evidence(what: str, unit: str, original: FloatArray, incumbent: FloatArray, paired: PairedDifference) -> Evidence:
    """Evidence from a paired comparison of deliveries, shape (n,) each."""
    return Evidence(what, unit, float(original.mean()), float(incumbent.mean()), paired.difference, paired.p)


def rises(paired: PairedDifference, least: float) -> bool:
    """Whether the incumbent has more of it: by ``least`` at least, and by the one-sided test at :data:`LEVEL`."""
    return (paired.difference.value or 0.0) >= least and is_sure(paired.p)


def is_sure(p: float) -> bool:
    """Whether a two-sided p is enough for a test on the side that the difference is on."""
    return 0.5 * p <= LEVEL
