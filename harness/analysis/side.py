"""One of two stacks that are compared."""

from dataclasses import dataclass

from harness.economics.rates import event_rates
from harness.statistics.interval import Interval
from harness.study.stored_run import StoredRun, StoredStack


@dataclass(frozen=True, slots=True)
class Side:
    """A stack and the run that it is of."""

    run: StoredRun
    stack: StoredStack

    @property
    def label(self) -> str:
        """How it is called in a report."""
        return f"{self.run.folder.name}:{self.stack.name}"

    @property
    def seconds(self) -> float | None:
        """Wall time [s] of a worker for a delivery, on average; None: the run does not tell."""
        return self.run.seconds_a_delivery(self.stack.name)

    @property
    def rates(self) -> dict[str, Interval]:
        """Events per distance and time, over all of its finished deliveries."""
        return event_rates(self.stack.rows, self.run.prices())
