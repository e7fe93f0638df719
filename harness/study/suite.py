"""A declared study: every stack in every map, world, density of people, sensors and seed.

It may be driven in pieces: some stacks first, or the first deliveries of all.
"""

import dataclasses
import itertools
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.storage.shipped import DEFAULT_WORLD
from harness.storage.texts import name_of, quoted
from harness.task.study import Study, make_study, parse_pose
from navstack.errors import InputError, ParameterError, UnknownNameError
from navstack.params.strict import load_dataclass

MOST_CELLS = 2000
# that may be given as files
_FILES = ("stacks", "maps", "worlds", "sensors", "rules", "prices", "people", "robot")
_OF_ALL_CELLS = (
    "people",
    "missions",
    "localizer",
    "robot",
    "prices",
    "rules",
    "record",
    "start",
    "goal",
)


@dataclass(frozen=True, slots=True)
class Suite:
    """What is to be crossed with what. Names, or files relative to the suite's own."""

    title: str
    stacks: tuple[str, ...]
    episodes: int  # per stack and cell
    seeds: tuple[int, ...] = (0,)
    maps: tuple[str, ...] = ("sidewalk",)
    worlds: tuple[str, ...] = (DEFAULT_WORLD,)
    pedestrians: tuple[int, ...] = ()  # empty: the worlds' own number
    sensors: tuple[str, ...] = ()  # empty: the stacks' own
    people: str | None = None  # None: the worlds' own
    missions: str = "published"
    rules: str = "costnav"
    prices: str = "costnav"
    localizer: str | None = None
    robot: str | None = None
    record: str = "events"
    start: str | None = None  # x,y,yaw of every start; None: drawn
    goal: str | None = None


@dataclass(frozen=True, slots=True)
class Condition:
    """What the cells of all stacks and seeds have in common."""

    map_name: str
    world: str
    pedestrians: int | None
    sensors: str | None


@dataclass(frozen=True, slots=True)
class Cell:
    """One run of a suite: a stack under a condition."""

    stack: str
    condition: Condition
    seed: int

    @property
    def stack_name(self) -> str:
        """Of the stack, which may be given as a file."""
        return name_of(self.stack)

    @property
    def name(self) -> str:
        """Of its run folder."""
        return f"{self.group}-{self.stack_name}"

    @property
    def group(self) -> str:
        """Name of the run folder that a stored suite has for all stacks on the same missions."""
        where = self.condition
        parts = [name_of(where.map_name), name_of(where.world)]
        if where.pedestrians is not None:
            parts.append(f"people{where.pedestrians}")
        if where.sensors is not None:
            parts.append(name_of(where.sensors))
        return "-".join([*parts, f"seed{self.seed}"])


@dataclass(frozen=True, slots=True)
class Portion:
    """What of a suite is to be driven now."""

    stacks: tuple[str, ...] = ()  # by name; empty: all
    maps: tuple[str, ...] = ()  # by name; empty: all
    episodes: int | None = None  # the first so many of each cell; None: all

    def cells(self, suite: Suite) -> list[Cell]:
        """The cells of a suite that it covers.

        Raises:
            InputError: the suite has no such stack or map, or not so many episodes.
        """
        stacks = _chosen("--stack", self.stacks, suite.stacks)
        maps = _chosen("--map", self.maps, suite.maps)
        if self.episodes is not None and not 1 <= self.episodes <= suite.episodes:
            raise InputError(
                f"--episodes {self.episodes} is out of range; the suite declares 1 to "
                f"{suite.episodes}"
            )
        return [
            cell
            for cell in cells(suite)
            if cell.stack_name in stacks and name_of(cell.condition.map_name) in maps
        ]

    @property
    def options(self) -> str:
        """As they are given on a command line."""
        episodes = "" if self.episodes is None else f" --episodes {self.episodes}"
        named = [*(("stack", name) for name in self.stacks), *(("map", name) for name in self.maps)]
        return "".join(f" --{option} {quoted(name)}" for option, name in named) + episodes


def _chosen(option: str, asked: Sequence[str], declared: Sequence[str]) -> set[str]:
    """Names of what is asked for of what a suite declares; nothing asked: all."""
    known = [name_of(name) for name in declared]
    for name in asked:
        if name_of(name) not in known:
            raise UnknownNameError(option, name, known)
    return {name_of(name) for name in asked or declared}


def load_suite(path: Path, maps: Sequence[str] = ()) -> Suite:
    """Read a suite file, files beside it as absolute paths; ``maps`` stand in place of its own.

    Raises:
        ParameterError: an unknown key, a value of the wrong kind, an empty list, too many cells, or
            two of one name.
    """
    suite = load_dataclass(Suite, path)
    if maps:
        suite = dataclasses.replace(suite, maps=tuple(maps))
    for key in ("stacks", "seeds", "maps", "worlds"):
        if not getattr(suite, key):
            raise ParameterError(f"{path}: {key}: is empty; give at least one")
    number = len(suite.stacks) * len(conditions(suite)) * len(suite.seeds)
    if number > MOST_CELLS:
        raise ParameterError(f"{path}: {number} cells; at most {MOST_CELLS} are run")
    files: dict[str, Any] = {key: _beside(path, getattr(suite, key)) for key in _FILES}
    suite = dataclasses.replace(suite, **files)
    names = [cell.name for cell in cells(suite)]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ParameterError(
            f"{path}: two cells are named '{twice}'; give each value once, and files different "
            "names"
        )
    return suite


def _beside(path: Path, name: Any) -> Any:
    """A name, or the names of a list, of what stands beside a file as its absolute path.

    None stays so.
    """
    if name is None or isinstance(name, tuple):
        return name and tuple(_beside(path, each) for each in name)
    beside = path.parent / name
    return str(beside.absolute()) if os.path.isfile(beside) else name


def conditions(suite: Suite) -> list[Condition]:
    """Every map, world, number of people and sensors of a suite."""
    densities: Sequence[int | None] = suite.pedestrians or (None,)
    sensors: Sequence[str | None] = suite.sensors or (None,)
    crossed = itertools.product(suite.maps, suite.worlds, densities, sensors)
    return [Condition(*values) for values in crossed]


def cells(suite: Suite) -> list[Cell]:
    """Every run of a suite; seeds vary fastest, then stacks."""
    return [
        Cell(stack, where, seed)
        for where in conditions(suite)
        for stack in suite.stacks
        for seed in suite.seeds
    ]


def cell_study(suite: Suite, cell: Cell, episodes: int) -> Study:
    """The study of a cell, with its first episodes.

    Raises:
        InputError: a value that ``navbench run`` would refuse too.
    """
    shared: dict[str, Any] = {key: getattr(suite, key) for key in _OF_ALL_CELLS}
    for key in ("start", "goal"):
        if shared[key] is not None:
            shared[key] = parse_pose(f"--{key}", shared[key])
    where = dataclasses.asdict(cell.condition)
    return make_study(stacks=[cell.stack], episodes=episodes, seed=cell.seed, **where, **shared)
