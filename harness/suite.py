"""A declared study: every stack in every map, world, density of people and seed, a run folder for each cell."""

import dataclasses
import itertools
import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from harness.benchmark import StackResult, summarize_study
from harness.durable_files import write_text
from harness.manifest import about, parameters
from harness.runs import create_run, require_usable
from harness.study import Study, make_study
from harness.table_files import Row
from navstack.errors import InputError, ParameterError
from navstack.params.strict import dump_dataclass, load_dataclass

DECLARATION = "suite.yaml"  # written last when a suite is created: a folder that has it can be resumed
MOST_CELLS = 1000


@dataclass(frozen=True, slots=True)
class Suite:
    """What is to be crossed with what. Names, or files relative to the suite's own."""

    title: str
    stacks: tuple[str, ...]
    episodes: int  # per stack and cell
    seeds: tuple[int, ...] = (0,)
    maps: tuple[str, ...] = ("sidewalk",)
    worlds: tuple[str, ...] = ("costnav",)
    pedestrians: tuple[int, ...] = ()  # empty: the worlds' own number
    people: str | None = None  # None: the worlds' own
    missions: str = "published"
    rules: str = "costnav"
    prices: str = "costnav"
    localizer: str | None = None
    robot: str | None = None
    record: str = "events"


@dataclass(frozen=True, slots=True)
class Cell:
    """One run of a suite, all stacks in it."""

    map_name: str
    world: str
    pedestrians: int | None
    seed: int

    @property
    def condition(self) -> tuple[str, str, int | None]:
        """What the cells of all seeds have in common."""
        return self.map_name, self.world, self.pedestrians

    @property
    def name(self) -> str:
        """Of its run folder."""
        people = "" if self.pedestrians is None else f"-people{self.pedestrians}"
        return f"{Path(self.map_name).stem}-{Path(self.world).stem}{people}-seed{self.seed}"


@dataclass(frozen=True, slots=True)
class Condition:
    """What the stacks did under one condition, all seeds together."""

    map_name: str
    world: str
    pedestrians: int | None
    seeds: tuple[int, ...]
    study: Study  # of its first seed
    results: tuple[StackResult, ...]


def load_suite(path: Path) -> Suite:
    """Read a suite file, files beside it as absolute paths.

    Raises:
        ParameterError: an unknown key, a value of the wrong kind, an empty list, too many cells, or two of one name.
    """
    suite = load_dataclass(Suite, path)
    for key in ("stacks", "seeds", "maps", "worlds"):
        if not getattr(suite, key):
            raise ParameterError(f"{path}: {key}: is empty; give at least one")
    beside = {key: tuple(_beside(path, name) for name in getattr(suite, key)) for key in ("stacks", "maps", "worlds")}
    single = {key: _beside(path, getattr(suite, key)) for key in ("rules", "prices")}
    optional = {key: _beside(path, value) for key in ("people", "robot") if (value := getattr(suite, key)) is not None}
    number = len(suite.maps) * len(suite.worlds) * max(len(suite.pedestrians), 1) * len(suite.seeds)
    if number > MOST_CELLS:
        raise ParameterError(f"{path}: {number} cells; at most {MOST_CELLS} are run")
    suite = dataclasses.replace(suite, **beside, **single, **optional)
    names = [cell.name for cell in cells(suite)]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise ParameterError(f"{path}: two cells are named '{twice}'; give each value once, and files different names")
    return suite


def _beside(path: Path, name: str) -> str:
    beside = path.parent / name
    return str(beside.absolute()) if beside.is_file() else name


def cells(suite: Suite) -> list[Cell]:
    """Every run of a suite; seeds vary fastest."""
    densities: Sequence[int | None] = suite.pedestrians or (None,)
    return [Cell(*values) for values in itertools.product(suite.maps, suite.worlds, densities, suite.seeds)]


def cell_study(suite: Suite, cell: Cell) -> Study:
    """The study of a cell.

    Raises:
        InputError: a value that ``navbench run`` would refuse too.
    """
    return make_study(
        stacks=suite.stacks,
        episodes=suite.episodes,
        seed=cell.seed,
        map_name=cell.map_name,
        pedestrians=cell.pedestrians,
        people=suite.people,
        world=cell.world,
        missions=suite.missions,
        localizer=suite.localizer,
        robot=suite.robot,
        prices=suite.prices,
        rules=suite.rules,
        record=suite.record,
    )


def create_suite(path: Path, suite: Suite, command: Sequence[str]) -> None:
    """Write a suite folder with the run folder of every cell in it, none of them begun.

    Raises:
        InputError: the folder exists and is not empty, or cannot be written.
    """
    require_usable(path)
    for cell in cells(suite):
        study = cell_study(suite, cell)
        create_run(path / cell.name, about(study, command), parameters(study))
    _write(path / DECLARATION, dump_dataclass(suite))


def write_overview(path: Path, document: Row) -> None:
    """Write ``suite.json``."""
    write_document(path / "suite.json", document)


def write_document(path: Path, document: Row) -> None:
    """Write a JSON document.

    Raises:
        InputError: it cannot be written.
    """
    _write(path, json.dumps(document, indent=2, sort_keys=True, allow_nan=False) + "\n")


def _write(path: Path, text: str) -> None:
    try:
        write_text(path, text)
    except OSError as error:
        raise InputError(f"'{path}' cannot be written ({error.strerror}); make room or choose another folder") from None


def stored_suite(path: Path) -> Suite:
    """The suite of a suite folder.

    Raises:
        InputError: the folder holds none.
    """
    if not (path / DECLARATION).is_file():
        raise InputError(f"'{path}' holds no suite: {DECLARATION} is missing; give the folder that a suite wrote")
    return load_suite(path / DECLARATION)


def summarize_condition(cells_of_it: Sequence[Cell], study: Study, records: Sequence[Row]) -> Condition:
    """Pool the finished episodes of the cells that differ in their seeds only."""
    first = cells_of_it[0]
    results = tuple(summarize_study(study, records))
    return Condition(*first.condition, tuple(cell.seed for cell in cells_of_it), study, results)
