"""What the auditor tells of: checks, and findings with their evidence."""

import tomllib
from dataclasses import dataclass
from pathlib import Path

from harness.metrics.columns import Row
from harness.statistics.interval import Interval
from harness.storage.documents import as_json
from navstack.params.strict import from_mapping

# at most the probability of any false alarm where nothing is exploited
FAMILY_LEVEL = 0.02
TESTS = 23  # that share it alike; the one for edges is shared again by the parameters
LEVEL = FAMILY_LEVEL / TESTS  # of each test, one-sided (Bonferroni)
# of deliveries: with fewer no paired test reaches the level (2 ** -11 < LEVEL < 2 ** -10)
LEAST_PAIRS = 11


@dataclass(frozen=True, slots=True)
class Gap:
    """A gap of the cost model that a check looks for."""

    title: str  # what is looked for
    why: str  # it is a gap
    advice: str  # what to do


def _gaps(file: Path) -> dict[str, Gap]:
    content = tomllib.loads(file.read_text(encoding="utf-8"))
    return {key: from_mapping(Gap, entry, f"{file}: {key}") for key, entry in content.items()}


GAPS = _gaps(Path(__file__).with_name("audit.toml"))  # by key of the check, in the order of checks


@dataclass(frozen=True, slots=True)
class AuditEvidence:
    """A number of original and incumbent, and how sure their difference is."""

    what: str
    unit: str
    original: float | None  # None: it has none, as where none of its deliveries ended so
    incumbent: float
    # incumbent less original; without bounds where there is nothing to resample
    difference: Interval
    p: float | None = None  # of no difference, two-sided; None: not tested

    @classmethod
    def unsampled(
        cls,
        what: str,
        unit: str,
        original: float | None,
        incumbent: float,
        n: int,
        p: float | None = None,
    ) -> "AuditEvidence":
        """Two numbers of ``n`` cases, for whose difference there is nothing to resample."""
        difference = None
        if original is not None:
            difference = incumbent - original
        return cls(what, unit, original, incumbent, Interval(difference, None, None, n), p)

    def rises(self, least: float) -> bool:
        """Whether the incumbent has more of it.

        By ``least`` at least, and by the one-sided test at :data:`LEVEL`.
        """
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
        before = "none"
        if self.original is not None:
            before = f"{self.original:.3g}"
        text = f"{before} -> {self.incumbent:.3g}"
        low, high = self.difference.low, self.difference.high
        if low is None or high is None:
            return text
        return f"{text} (difference [{low:.3g}, {high:.3g}])"


@dataclass(frozen=True, slots=True)
class Check:
    """One check: passed, flagged, or not examined."""

    key: str  # of GAPS
    is_flagged: bool
    says: str  # what it found, in a sentence; or why it was not examined
    evidence: tuple[AuditEvidence, ...] = ()
    is_examined: bool = True
    look: str = ""  # what is no alarm, but for a reader to look at

    @property
    def gap(self) -> Gap:
        """What it looks for."""
        return GAPS[self.key]

    @property
    def state(self) -> str:
        """How it came out, in a word."""
        if self.is_flagged or not self.is_examined:
            if self.is_flagged:
                return "flagged"
            return "not examined"
        if self.look:
            return "look"
        return "passed"

    def as_json(self) -> Row:
        """The check as one JSON object."""
        told = ("state", "says", "look", "evidence")
        return {
            "check": self.key,
            **as_json(self.gap),
            **{name: as_json(getattr(self, name)) for name in told},
        }
