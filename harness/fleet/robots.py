"""A robot of the fleet: what it does, and its battery."""

from enum import Enum
from typing import NamedTuple

from harness.fleet.orders import SECONDS_PER_HOUR
from harness.fleet.settings import FleetSettings


class State(Enum):
    """What a robot does."""

    READY = "ready"  # at the hub, where it charges
    CHARGING = "charging"  # too empty for an order
    LOADING = "loading"
    OUT = "out"  # to the customer
    HANDOVER = "handover"
    BACK = "back"
    WAITING = "waiting"  # for an operator
    HELPED = "helped"
    STRANDED = "stranded"  # waits for a field worker
    FETCHED = "fetched"


BUSY = (State.LOADING, State.OUT, State.HANDOVER, State.BACK)  # it earns money
TROUBLED = (State.WAITING, State.HELPED, State.STRANDED, State.FETCHED)


class Span(NamedTuple):
    """A time in one state [s since 0:00]."""

    state: State
    start: float
    end: float


class FleetRobot:
    """Its state and its battery up to the last change; time passes in :meth:`enter`.

    What it drew, what it charged, and its charge are in [Wh].
    """

    def __init__(self, number: int, opens: float, settings: FleetSettings) -> None:
        """Charged, at the hub.

        Args:
            number: from 0.
            opens: [s] when the day begins.
            settings: of the fleet.
        """
        self.number = number
        self.since = opens  # [s] of the last change
        self.capacity = settings.battery_capacity.value
        self.level = self.capacity  # charge
        self.driven = 0.0  # drawn to move
        self.idled = 0.0  # drawn by what always runs
        self.charged = 0.0
        self.spans: list[Span] = []
        self._idle = settings.idle_power.value / SECONDS_PER_HOUR  # [Wh/s]
        self._charger = settings.charge_power.value / SECONDS_PER_HOUR

    def enter(self, state: State, now: float, energy: float = 0.0) -> None:
        """It was in this state until now, away from the hub, and drew energy [Wh] to move.

        An empty battery gives nothing: what idles is off then.
        """
        idle = min(self._idle * (now - self.since), max(self.level - energy, 0.0))
        self.level = max(self.level - energy - idle, 0.0)
        self.driven += energy
        self.idled += idle
        self._note(state, now)

    def charge(self, now: float, state: State = State.READY) -> None:
        """It stood at the hub until now."""
        seconds = now - self.since
        idle = self._idle * seconds
        gained = min(self._charger * seconds, self.capacity - self.level + idle)
        self.level += gained - idle
        self.idled += idle
        self.charged += gained
        self._note(state, now)

    def finish(self, closes: float) -> None:
        """Stand at the hub until the fleet closes [s]; then it is off, and charges overnight."""
        if closes > self.since:
            self.charge(closes)
        self.charged += self.capacity - self.level
        self.level = self.capacity

    def seconds_to(self, level: float) -> float:
        """How long it must charge to reach a charge [Wh]; 0 where it has."""
        return max(level - self.level, 0.0) / (self._charger - self._idle)

    def share_driven(self, seconds: float, energy: float) -> float:
        """The share of a drive that its battery lasts for."""
        need = energy + self._idle * seconds
        if need <= self.level:
            return 1.0
        return self.level / need

    def _note(self, state: State, now: float) -> None:
        if now > self.since:
            self.spans.append(Span(state, self.since, now))
        self.since = now
