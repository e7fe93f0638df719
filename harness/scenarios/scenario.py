"""A scenario file: who stands where, what happens, and what must come of it."""

from collections.abc import Iterable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from navstack.action_codes import REASONS
from navstack.errors import ParameterError, UnknownNameError
from navstack.params.strict import load_dataclass
from navstack.types import Pose2D

Point = tuple[float, float]  # x, y [m] in the map frame
Area = tuple[float, float, float, float]  # x0, y0, x1, y1 [m]: a rectangle parallel to the axes

EXPECTATIONS = ("pass", "known_to_fail")
LONGEST = 300.0  # [s] of simulated time
MOST_ACTORS = 200


@dataclass(frozen=True, slots=True)
class Thing:
    """Something solid that somebody put down."""

    box: Area
    kind: str = "parked"  # as in a scene's obstacles
    height: float = 1.5  # [m]
    on_map: bool = False  # whether the robot's map shows it

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: the box is empty or flat.
        """
        x0, y0, x1, y1 = self.box
        if not (x0 < x1 and y0 < y1 and 0.0 < self.height <= 100.0):
            raise ParameterError(
                f"thing: box {list(self.box)}, height {self.height} m; needed are x0 < x1 and y0 "
                "< y1"
            )


@dataclass(frozen=True, slots=True)
class PersonScript:
    """Somebody who walks along waypoints, blind to everything; one waypoint: stands there."""

    waypoints: tuple[Point, ...]
    name: str = "person"
    speed: float = 1.3  # [m/s]
    starts_at: float = 0.0  # [s]
    # [m] between the robot and this person from which he walks; None: at once
    starts_near: float | None = None
    leaves: bool = False  # is gone at the last waypoint, else stands there

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: no waypoint, or a speed or time out of range.
        """
        if not self.waypoints:
            raise ParameterError(f"person '{self.name}': waypoints are missing; give at least one")
        if not 0.0 < self.speed <= 10.0 or not 0.0 <= self.starts_at <= LONGEST:
            raise ParameterError(
                f"person '{self.name}': speed {self.speed} m/s, starts_at {self.starts_at} s; "
                f"allowed are more than 0 to 10 and 0 to {LONGEST:g}"
            )
        if self.starts_near is not None and self.starts_near <= 0.0:
            raise ParameterError(
                f"person '{self.name}': starts_near {self.starts_near:g} m, where the robot never "
                "is; give more than 0"
            )


@dataclass(frozen=True, slots=True)
class Drawing:
    """A small place drawn with letters, the northern edge first.

    See :mod:`harness.scenarios.drawing`.
    """

    rows: str  # one line each
    letter: float = 0.5  # [m] side of the square that a letter stands for
    origin: Point = (0.0, 0.0)  # of the lower left corner


@dataclass(frozen=True, slots=True)
class Checks:
    """What must come of it; each that is given is checked. See :mod:`harness.scenarios.checks`."""

    no_collision: bool = False  # the robot touches nobody and nothing
    not_at_fault: bool = False  # who touches the robot walked into it while it stood
    no_injury: bool = False  # no contact with a person that the published rule counts
    arrives_within: float | None = None  # [s]
    gives_up_with: str | None = None  # Nav2's name of the error
    stays_off: tuple[str, ...] = ()  # kinds of ground on which no wheel or caster ever stands
    keeps_out_of: tuple[Area, ...] = ()  # where the base frame's origin never is
    # [m] between the surfaces of the robot and of any person
    never_closer_than: float | None = None
    moves_at_most: float | None = None  # [m] from the start
    believes_within: float | None = None  # [m] of the truth, at any time

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: a number below 0, or a rectangle in which nothing can be.
            UnknownNameError: an error that Nav2 does not have.
        """
        if self.gives_up_with is not None and self.gives_up_with not in REASONS:
            raise UnknownNameError("checks: gives_up_with", self.gives_up_with, REASONS)
        for name, value in self.asked.items():
            if isinstance(value, float) and value < 0.0:
                raise ParameterError(f"checks: {name} {value:g} is below 0")
        for x0, y0, x1, y1 in self.keeps_out_of:
            if not (x0 < x1 and y0 < y1):
                raise ParameterError(
                    f"checks: keeps_out_of {[x0, y0, x1, y1]} has no area; needed are x0 < x1 and "
                    "y0 < y1"
                )

    @property
    def asked(self) -> dict[str, Any]:
        """The checks that are given, by name; 0 is a number, and given."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {
            name: value
            for name, value in values.items()
            if value is not None and value is not False and value != ()
        }


@dataclass(frozen=True, slots=True)
class Scenario:
    """One situation."""

    title: str  # a sentence
    start: Pose2D
    goal: Pose2D
    checks: Checks
    map: str | None = None  # a built-in map or a map_server file; either it or a drawing
    drawing: Drawing | None = None
    things: tuple[Thing, ...] = ()
    people: tuple[PersonScript, ...] = ()
    gps_outages: tuple[tuple[float, float], ...] = ()  # [s] from, to: no fix arrives
    stack: str = "nav2-gps"  # a name of params/stacks or a file
    world: str = "easy"  # its physics and bodies; its people stay at home
    seed: int = 0
    time_limit: float = 60.0  # [s] of simulated time
    expect: str = "pass"  # of EXPECTATIONS
    fails: tuple[str, ...] = ()  # the checks that are known to fail
    reason: str = ""  # why they do

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            ParameterError: a value out of range, no check, or a failure without reason.
            UnknownNameError: an unknown expectation.
        """
        if self.expect not in EXPECTATIONS:
            raise UnknownNameError("expect", self.expect, EXPECTATIONS)
        is_known = self.expect == "known_to_fail"
        if is_known != bool(self.reason) or is_known != bool(self.fails):
            raise ParameterError(
                "'fails' and 'reason' go with 'expect: known_to_fail'; give all three or none"
            )
        stranger = next((name for name in self.fails if name not in self.checks.asked), None)
        if stranger is not None:
            raise ParameterError(
                f"fails: '{stranger}' is not among its checks: {', '.join(self.checks.asked)}"
            )
        if not self.title.strip() or not self.title.rstrip().endswith("."):
            raise ParameterError(
                f"title '{self.title}' is not a sentence that ends with a full stop"
            )
        if (self.map is None) == (self.drawing is None):
            raise ParameterError("either 'map' or 'drawing' must be given")
        if not self.checks.asked:
            raise ParameterError("checks: none is given")
        if not 0.0 < self.time_limit <= LONGEST or not 0 <= self.seed < 2**63:
            raise ParameterError(
                f"time_limit {self.time_limit} s, seed {self.seed}; allowed: up to {LONGEST:g}, "
                "from 0"
            )
        within = self.checks.arrives_within
        if within is not None and within > self.time_limit:
            raise ParameterError(
                f"checks: arrives_within {within:g} s is beyond the time_limit "
                f"{self.time_limit:g} s"
            )
        _require_in_time(self.people, self.time_limit)
        if len(self.people) + len(self.things) > MOST_ACTORS:
            raise ParameterError(
                f"{len(self.people)} people and {len(self.things)} things; at most {MOST_ACTORS} "
                "in all"
            )


def _require_in_time(people: Iterable[PersonScript], time_limit: float) -> None:
    """Check that nobody sets out after the end [s].

    Raises:
        ParameterError: somebody does.
    """
    for person in people:
        if person.starts_at >= time_limit:
            raise ParameterError(
                f"person '{person.name}': starts_at {person.starts_at:g} s is not before the "
                f"time_limit {time_limit:g} s"
            )


def load_scenario(path: Path) -> Scenario:
    """Read a scenario file.

    Raises:
        InputError: it cannot be read, or a key or value cannot be used; the message names the file.
    """
    try:
        return load_dataclass(Scenario, path)
    except (ParameterError, UnknownNameError) as error:
        message = str(error)
        if not message.startswith(str(path)):
            message = f"{path}: {message}"
        raise ParameterError(message) from None
