"""One day of a fleet as a discrete-event simulation.

Robots wait at the hub, where they charge. The one that has waited longest takes the next order,
drives its legs there and back, and waits for help where a leg ends in trouble: first come, first
served, by an operator from afar or by a field worker who fetches it.
"""

import math
from collections import deque
from collections.abc import Generator
from dataclasses import dataclass, field
from enum import Enum
from typing import Any, TypeVar

import numpy as np
import simpy

from harness.economics.optional_prices import OptionalPrices
from harness.fleet.orders import (
    FIELD,
    SECONDS_PER_HOUR,
    SECONDS_PER_MINUTE,
    DayOrders,
    GroupWays,
    Way,
)
from harness.fleet.robots import FleetRobot, State
from harness.fleet.settings import FleetSettings

Returned = TypeVar("Returned")
Steps = Generator[simpy.Event, Any, Returned]  # of a process


class End(Enum):
    """How an order ends."""

    IN_TIME = "in_time"
    LATE = "late"  # delivered after the promised time
    SPOILED = "spoiled"  # delivered with too little of the cargo
    FAILED = "failed"  # the robot had to be fetched
    LOST = "lost"  # no robot took it in time


@dataclass(slots=True)
class Trip:
    """What became of an order."""

    placed: float  # [s] since 0:00
    end: End = End.LOST
    taken: float = math.nan  # [s] when a robot took it
    delivered: float = math.nan  # [s]


@dataclass(slots=True)
class DayLog:
    """What happened on a day."""

    trips: list[Trip] = field(default_factory=list)
    # number of the group, first leg and the one after the last, of all that was driven
    driven: list[tuple[int, int, int]] = field(default_factory=list)
    waits: list[float] = field(default_factory=list)  # [s] of robots for an operator
    field_waits: list[float] = field(default_factory=list)  # [s] of robots for a field worker
    helped: float = 0.0  # [s] that operators were busy
    failures: int = 0  # legs that ended in physical assistance
    ran_empty: int = 0  # batteries
    driven_until: float = 0.0  # [s] when the last robot had driven or been helped from afar
    home: float = 0.0  # [s] when the last robot was home


class FleetDay:
    """A day that can be run once."""

    def __init__(
        self,
        orders: DayOrders,
        settings: FleetSettings,
        optional: OptionalPrices,
        rng: np.random.Generator,
    ) -> None:
        """Everything stands at the hub, charged.

        Args:
            orders: of the day.
            settings: of the fleet.
            optional: whose times of help hold.
            rng: of the times of help.
        """
        self._orders, self._rng = orders, rng
        self._opens = settings.open_hour.value * SECONDS_PER_HOUR
        self._closes = settings.close_hour.value * SECONDS_PER_HOUR
        self._env = simpy.Environment(self._opens)
        self._operators = simpy.Resource(self._env, int(settings.operators.value))
        self._field = simpy.Resource(self._env, int(settings.field_workers.value))
        self._loading = settings.loading_time.value * SECONDS_PER_MINUTE
        self._handover = settings.handover_time.value * SECONDS_PER_MINUTE
        self._patience = settings.patience.value * SECONDS_PER_MINUTE
        self._promised = settings.promised_time.value * SECONDS_PER_MINUTE
        self._remote_time = optional.remote_assistance_time.value * SECONDS_PER_HOUR
        self._field_time = optional.on_site_time.value * SECONDS_PER_HOUR
        self._variation = settings.help_variation.value
        self._least = settings.least_charge.value * settings.battery_capacity.value
        self.robots = [
            FleetRobot(number, self._opens, settings)
            for number in range(int(settings.robots.value))
        ]
        self.log = DayLog()
        self._idle = deque(self.robots)
        self._waiting: deque[int] = deque()

    def run(self) -> None:
        """Until every accepted order has ended and every robot is charged again."""
        self._env.process(self._accept())
        self.log.driven_until = self.log.home = self._closes
        self._env.run()
        for robot in self.robots:
            robot.finish(self._closes)

    def _accept(self) -> Steps[None]:
        """Orders as they are placed."""
        env = self._env
        for number, placed in enumerate(self._orders.placed):
            yield env.timeout(placed - env.now)
            self.log.trips.append(Trip(placed))
            if self._idle:
                env.process(self._serve(self._idle.popleft(), number))
            else:
                self._waiting.append(number)

    def _next(self, robot: FleetRobot) -> None:
        """The order that has waited longest and is not lost yet; else the robot waits."""
        now, trips = self._env.now, self.log.trips
        while self._waiting:
            number = self._waiting.popleft()
            if now - trips[number].placed <= self._patience:
                self._env.process(self._serve(robot, number))
                return
        self._idle.append(robot)

    def _serve(self, robot: FleetRobot, number: int) -> Steps[None]:
        """One order, and what the robot needs before the next."""
        env, trip = self._env, self.log.trips[number]
        trip.taken = env.now
        robot.charge(env.now)
        hour = int(env.now / SECONDS_PER_HOUR) % len(self._orders.group_at_hour)
        group = self._orders.group_at_hour[hour]
        ways = self._orders.groups[group]
        way = ways.ways[number]
        yield env.timeout(self._loading)
        robot.enter(State.LOADING, env.now)
        is_there = yield from self._drive(robot, ways, group, way, way.start, way.turn)
        if is_there:
            yield env.timeout(self._handover)
            robot.enter(State.HANDOVER, env.now)
            self._deliver(trip, ways, way)
            yield from self._drive(robot, ways, group, way, way.turn, way.end)
        else:
            trip.end = End.FAILED
        self.log.home = max(self.log.home, env.now)
        charging = robot.seconds_to(self._least)
        if charging > 0.0:
            yield env.timeout(charging)
            robot.charge(env.now, State.CHARGING)
        self._next(robot)

    def _deliver(self, trip: Trip, ways: GroupWays, way: Way) -> None:
        trip.delivered = self._env.now
        if ways.spoiled[way.turn] > ways.spoiled[way.start]:
            trip.end = End.SPOILED
        elif trip.delivered - trip.placed > self._promised:
            trip.end = End.LATE
        else:
            trip.end = End.IN_TIME

    def _drive(
        self, robot: FleetRobot, ways: GroupWays, group: int, way: Way, start: int, end: int
    ) -> Steps[bool]:
        """Drive some legs of a way; returns whether the robot came to their end by itself."""
        state = State.OUT
        if start == way.turn:
            state = State.BACK
        trouble = way.first_trouble
        while ways.trouble_at[trouble] < start:
            trouble += 1
        place = start
        while place < end:
            stop = min(ways.trouble_at[trouble] + 1, end)
            share = yield from self._move(robot, ways, place, stop, state)
            self.log.driven.append((group, place, place + int(share * (stop - place))))
            place = stop
            if share < 1.0:
                self.log.ran_empty += 1
                yield from self._fetch(robot)
                return False
            while ways.trouble_at[trouble] == stop - 1:
                kind = ways.trouble_kind[trouble]
                trouble += 1
                if kind == FIELD:
                    self.log.failures += 1
                    yield from self._fetch(robot)
                    return False
                yield from self._help(robot)
        return True

    def _move(
        self, robot: FleetRobot, ways: GroupWays, place: int, stop: int, state: State
    ) -> Steps[float]:
        """Some legs without trouble; returns the share that the battery lasted for."""
        seconds = ways.seconds[stop] - ways.seconds[place]
        energy = ways.energy[stop] - ways.energy[place]
        share = robot.share_driven(seconds, energy)
        yield self._env.timeout(seconds * share)
        robot.enter(state, self._env.now, energy * share)
        self._note_driving()
        return share

    def _help(self, robot: FleetRobot) -> Steps[None]:
        """An operator helps from afar."""
        seconds = yield from self._attend(
            robot, self._operators, self._remote_time, self.log.waits, State.WAITING
        )
        self.log.helped += seconds
        self._note_driving()
        robot.enter(State.HELPED, self._env.now)

    def _fetch(self, robot: FleetRobot) -> Steps[None]:
        """A field worker brings the robot to the hub."""
        yield from self._attend(
            robot, self._field, self._field_time, self.log.field_waits, State.STRANDED
        )
        robot.enter(State.FETCHED, self._env.now)

    def _attend(
        self,
        robot: FleetRobot,
        staff: simpy.Resource,
        mean: float,
        waits: list[float],
        waiting: State,
    ) -> Steps[float]:
        """One of the staff attends to a robot that has been ``waiting``; returns for how long.

        It takes ``mean`` on average; how long it waited is added to ``waits``.
        """
        env = self._env
        with staff.request() as request:
            yield request
            waits.append(env.now - robot.since)
            robot.enter(waiting, env.now)
            seconds = self._draw(mean)
            yield env.timeout(seconds)
        return seconds

    def _note_driving(self) -> None:
        self.log.driven_until = max(self.log.driven_until, self._env.now)

    def _draw(self, mean: float) -> float:
        """A time of this mean [s]: gamma, with the settings' variation."""
        if not self._variation or not mean:
            return mean
        shape = self._variation**-2
        return self._rng.gamma(shape, mean / shape)
