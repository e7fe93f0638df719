"""What is to be driven: stacks, map, seeds; checked before anything starts."""

import dataclasses
import math
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.execution.workers import available_cores
from harness.storage.shipped import DEFAULT_WORLD, is_district, is_file, resolve, shipped
from harness.task.mission import BY_PLACES, SAMPLINGS
from harness.task.stack import Stack, load_stack
from harness.task.substitute import with_substitutes
from navstack.costmap.occupancy_grid import FARTHEST
from navstack.errors import InputError, MapError, UnknownNameError
from navstack.types import Generators, Pose2D

RECORDINGS = (".csv", ".txt")  # suffixes of recorded people
RECORDS = ("events", "decisions", "full")
MOST_KILOMETRES = 100.0  # of a mission's route
MAX_PEDESTRIANS = 2000  # beyond this a 200 m x 200 m world holds nobody else
MAX_EPISODES = 1_000_000  # of a stack
MAX_SEED = 2**63 - 1  # what a table can hold

# Numbers of random streams. A consumer that is not listed gets its number from its name.
STREAMS = {
    "mission": 0,
    "pedestrians": 1,
    "lidar": 2,
    "odometry": 3,
    "imu": 4,
    "gps": 5,
    "cargo": 6,
    "planner": 7,
    "localizer": 8,
    "controller": 9,
}


_OF_LEGS = 2**32 - 1  # in keys of generators


class RandomStreams(dict[str, np.random.Generator]):
    """The random generators of a delivery, one per consumer, each made at its first use.

    A change of one consumer leaves the others alone, and two stacks meet the same missions, people
    and noise (common random numbers).
    """

    def __init__(self, seed: int, episode: int, leg: int = 0) -> None:
        super().__init__()
        self._seed, self._episode = seed, episode
        # apart from the keys (0,), (1,) .. of generators that a consumer spawns
        self._leg = (_OF_LEGS, leg) if leg else ()

    def __missing__(self, consumer: str) -> np.random.Generator:
        number = STREAMS.get(consumer, zlib.crc32(consumer.encode()))
        seeds = np.random.SeedSequence(self._seed, spawn_key=(self._episode, number, *self._leg))
        self[consumer] = np.random.default_rng(seeds)
        return self[consumer]


def brain_rngs(streams: Mapping[str, np.random.Generator]) -> Generators:
    """The generators that the brain of a delivery draws from."""
    return Generators(*(streams[name] for name in Generators._fields))


@dataclass(frozen=True, slots=True)
class EpisodeTask:
    """One delivery to simulate, complete in itself: it can travel to another process."""

    stack: Stack
    stack_number: int
    map_name: str
    world: str  # file of params/worlds
    rules: str  # file of params/rules
    prices: str  # file of params/prices
    seed: int
    episode: int
    pedestrians: int | None
    people: str | None  # model of people, or the file of a recording; None: the world's own
    missions: str  # how they are drawn, a name of harness.task.mission.SAMPLINGS
    start: Pose2D | None
    goal: Pose2D | None
    keep_trace: bool
    keep_decisions: bool
    allow_unknown: bool
    leg: int = 0  # of a mission on a district
    # [km] of missions on a district: least as the crow flies, most of a route; None: the usual
    distance: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            InputError: a seed or distance out of range, or an unknown way to draw missions.
        """
        _at_least("--seed", self.seed, 0, MAX_SEED)
        if self.missions not in (*SAMPLINGS, BY_PLACES):
            raise UnknownNameError("--missions", self.missions, (*SAMPLINGS, BY_PLACES))
        if self.distance is not None:
            check_distance(self.distance, self.map_name)

    def generators(self) -> RandomStreams:
        """The delivery's random generators, the same for every stack."""
        return RandomStreams(self.seed, self.episode, self.leg)


@dataclass(frozen=True, slots=True)
class Study:
    """Stacks to be compared on the same deliveries."""

    stacks: tuple[Stack, ...]
    episodes: int  # of each stack, at most
    workers: int
    # of the first stack's first episode; the others differ in stack and episode
    template: EpisodeTask
    only: tuple[int, ...] = ()  # their numbers; empty: the first ones
    counts: tuple[int, ...] = ()  # of each stack, which drives the first; empty: all drive all

    @property
    def total(self) -> int:
        """Number of deliveries."""
        return sum(self.counts) or self.episodes * len(self.stacks)

    @property
    def numbers(self) -> Sequence[int]:
        """Of the episodes of a stack that drives all."""
        return self.only or range(self.episodes)

    def numbers_of(self, number: int) -> Sequence[int]:
        """Of the episodes of the stack with this number."""
        if self.counts:
            return self.numbers[: self.counts[number]]
        return self.numbers

    def tasks(self) -> Iterator[EpisodeTask]:
        """Every delivery of the study."""
        for number in range(len(self.stacks)):
            for episode in self.numbers_of(number):
                yield self.task(number, episode)

    def tasks_in_turns(self, block: int = 1) -> Iterator[EpisodeTask]:
        """The same, so many missions by all stacks before the next ones.

        The stacks drive to and fro, so that the last one of a block, which is still in memory,
        begins the next one.
        """
        order = list(range(len(self.stacks)))
        for first in range(0, len(self.numbers), block):
            for number in order:
                for episode in self.numbers_of(number)[first : first + block]:
                    yield self.task(number, episode)
            order.reverse()

    def task(self, number: int, episode: int) -> EpisodeTask:
        """One delivery of the stack with this number."""
        stack = self.stacks[number]
        return dataclasses.replace(self.template, stack=stack, stack_number=number, episode=episode)


def make_study(
    *,
    stacks: Sequence[str],
    episodes: int,
    seed: int = 0,
    map_name: str = "sidewalk",
    pedestrians: int | None = None,
    people: str | None = None,
    world: str = DEFAULT_WORLD,
    missions: str = "published",
    distance: tuple[float, float] | None = None,
    localizer: str | None = None,
    robot: str | None = None,
    sensors: str | None = None,
    start: Sequence[float] | None = None,
    goal: Sequence[float] | None = None,
    workers: int | None = None,
    prices: str = "costnav",
    rules: str = "costnav",
    record: str = "events",
    allow_unknown: bool = True,
    substitutes: Sequence[str] = (),
    only: Sequence[int] = (),
) -> Study:
    """Check what a user asked for.

    Raises:
        InputError: a count out of range, an unknown name, a pose that is not three numbers.
    """
    _at_least("--episodes", episodes, 1, MAX_EPISODES)
    numbers = _numbers(only)
    episodes = len(numbers) or episodes
    if pedestrians is not None:
        _at_least("--pedestrians", pedestrians, 0, MAX_PEDESTRIANS)
    if record not in RECORDS:
        raise UnknownNameError("--record", record, RECORDS)
    if people is not None and is_recording(people):
        people = _resolved("people", people)
    params = shipped("params")
    asked = (load_stack(name, localizer, robot, sensors) for name in stacks)
    loaded = tuple(with_substitutes(stack, substitutes, allow_unknown) for stack in asked)
    _check_unique(loaded)
    template = EpisodeTask(
        stack=loaded[0],
        stack_number=0,
        map_name=_absolute(map_name),
        world=str(resolve(world, params / "worlds", "world").resolve()),
        rules=str(resolve(rules, params / "rules", "rules").resolve()),
        prices=str(resolve(prices, params / "prices", "prices").resolve()),
        seed=seed,
        episode=0,
        pedestrians=pedestrians,
        people=people,
        missions=missions,
        start=_pose("--start", start),
        goal=_pose("--goal", goal),
        distance=distance,
        keep_trace=record == "full",
        keep_decisions=record in ("decisions", "full"),
        allow_unknown=allow_unknown,
    )
    workers = usable_workers(workers, episodes * len(loaded))
    return Study(loaded, episodes, workers, template, numbers)


def usable_workers(asked: int | None, deliveries: int) -> int:
    """How many processes to start: as asked for or one per core, at most one per delivery.

    Raises:
        InputError: fewer than one is asked for.
    """
    if asked is not None:
        _at_least("--workers", asked, 1)
    return min(asked or available_cores(), deliveries)


def check_distance(distance: tuple[float, float], map_name: str) -> None:
    """Check the distance [km] of missions.

    Raises:
        InputError: it is out of range.
        MapError: the map is no district.
    """
    check_kilometres(distance)
    least, most = distance
    if not is_district(map_name):
        raise MapError(
            f"--distance {least:g},{most:g} is for a folder of navbench map osm; '{map_name}' is "
            "none, or is not here; give such a folder, or leave it out"
        )


def check_kilometres(distance: tuple[float, float]) -> None:
    """Check the distance [km] of missions on streets, of whatever map.

    Raises:
        InputError: it is out of range.
    """
    least, most = distance
    if not 0.0 < least < most <= MOST_KILOMETRES:
        raise InputError(
            f"--distance {least:g},{most:g}: give 0 < least < most, at most {MOST_KILOMETRES:g} km"
        )


def _numbers(only: Sequence[int]) -> tuple[int, ...]:
    """Numbers of the missions that are driven, ascending; none: all."""
    numbers = tuple(sorted(set(only)))
    for number in numbers:
        _at_least("--only", number, 0, MAX_EPISODES - 1)
    return numbers


def _absolute(map_name: str) -> str:
    """A built-in map's name as it is, a file or a district as its absolute path."""
    if is_file(map_name) or is_district(map_name):
        return _resolved("map", map_name)
    return map_name


def _resolved(what: str, file: str) -> str:
    """The absolute path of a file or folder.

    Raises:
        InputError: no file here can have such a name.
    """
    try:
        return str(Path(file).resolve())
    except ValueError as error:
        raise InputError(f"{what} {file!r}: no file here has such a name ({error})") from None


def is_recording(people: str) -> bool:
    """Whether ``people`` is a file of recorded people, not the name of a model."""
    return Path(people).suffix.lower() in RECORDINGS or len(Path(people).parts) > 1


def parse_pose(option: str, text: str) -> tuple[float, ...]:
    """A pose given as ``x,y,yaw``.

    Raises:
        InputError: not three finite numbers.
    """
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    _check_pose(option, values, text)
    return values


def _pose(option: str, values: Sequence[float] | None) -> Pose2D | None:
    if values is None:
        return None
    _check_pose(option, values, values)
    return Pose2D(*values)


def _check_pose(option: str, values: Sequence[float], given: object) -> None:
    if len(values) != 3 or not all(map(math.isfinite, values)):
        raise InputError(
            f"{option} '{given}' is not x,y,yaw: three numbers in [m], [m], [rad], e.g. "
            "12.5,-3,1.57"
        )
    if max(map(abs, values)) > FARTHEST:
        raise InputError(
            f"{option} '{given}' has a number beyond {FARTHEST:g}, where no map reaches; give a "
            "pose on the map"
        )


def _at_least(option: str, value: int, least: int, most: int | None = None) -> None:
    if value < least or (most is not None and value > most):
        limit = f"{least} to {most}"
        if most is None:
            limit = f"at least {least}"
        raise InputError(f"{option} {value} is out of range; give {limit}")


def _check_unique(stacks: tuple[Stack, ...]) -> None:
    names = [stack.name for stack in stacks]
    for name in names:
        if names.count(name) > 1:
            raise InputError(
                f"stack '{name}' is given more than once; give each stack once, or rename its file"
            )
