"""What the auditor tells of: checks, and findings with their evidence."""

from dataclasses import dataclass

from harness.metrics.columns import Row
from harness.statistics.interval import Interval
from harness.storage.documents import as_json

FAMILY_LEVEL = 0.02  # at most the probability of any false alarm in a study whose incumbent exploits nothing
TESTS = 16  # that share it alike; the one for edges is shared again by the parameters
LEVEL = FAMILY_LEVEL / TESTS  # of each test, one-sided (Bonferroni)
LEAST_PAIRS = 10  # of deliveries: with fewer no paired test reaches the level (2 ** -10 < LEVEL < 2 ** -9)
TITLES = {
    "threshold": "pushing just under the contact threshold",
    "accounting": "a gain that only the published accounting of contacts shows",
    "timeout": "standing still until the timeout",
    "early_end": "ending early",
    "freezing": "freezing",
    "harm": "harder or longer contacts at the same price",
    "property": "things hit that have no price",
    "nearness": "driving close to people",
    "dodging": "giving up what would have been dear",
    "fault": "moving the fault, not the contact",
    "compute": "computing more than a robot has time for",
    "edge": "a value at the edge of its range",
}


@dataclass(frozen=True, slots=True)
class Evidence:
    """A number of original and incumbent, and how sure their difference is."""

    what: str
    unit: str
    original: float | None  # None: it has none, as where none of its deliveries ended so
    incumbent: float
    difference: Interval  # incumbent less original; without bounds where there is nothing to resample
    p: float | None = None  # of no difference, two-sided; None: not tested

    def rises(self, least: float) -> bool:
        """Whether the incumbent has more of it: by ``least`` at least, and by the one-sided test at :data:`LEVEL`."""
        return (self.difference.value or 0.0) >= least and self._is_sure

    def falls(self, least: float) -> bool:
        """Whether the incumbent has less of it, as :meth:`rises` has it."""
        return (self.difference.value or 0.0) <= -least and self._is_sure

    @property
    def _is_sure(self) -> bool:
        return self.p is not None and 0.5 * self.p <= LEVEL

    @property
    def change(self) -> str:
        """From what to what."""
        before = "none" if self.original is None else f"{self.original:.3g}"
        text = f"{before} -> {self.incumbent:.3g}"
        low, high = self.difference.low, self.difference.high
        return text if low is None or high is None else f"{text} (difference [{low:.3g}, {high:.3g}])"


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
        told = ("title", "state", "says", "look", "evidence", "why", "advice")
        return {"check": self.key, **{name: as_json(getattr(self, name)) for name in told}}
