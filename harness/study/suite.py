"""A declared study: every stack in every map, world, density of people and seed, a run folder for each cell.

It may be driven in pieces: some stacks first, or the first deliveries of all. What a cell has is kept and added to.
"""

import dataclasses
import itertools
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.storage.documents import write_file
from harness.storage.manifest_file import extend_run
from harness.storage.new_run import MANIFEST, create_run
from harness.storage.parameters import parameter_folder
from harness.storage.shipped import DEFAULT_WORLD
from harness.storage.texts import name_of
from harness.study.manifest import about, load_study, parameters
from harness.study.stored_run import MOST_PEOPLE
from harness.task.study import Study, make_study, parse_pose
from navstack.errors import InputError, ParameterError, UnknownNameError
from navstack.files import check_regular
from navstack.params.nav2_file.yaml_text import load_text
from navstack.params.strict import dump_dataclass, load_dataclass, read_text

DECLARATION = "suite.yaml"  # a folder that has it can be resumed
TABLE = "episodes.parquet"
MOST_CELLS = 2000
# stem of its file in params/, and what it is called
PEOPLE, RECORDING = "people", "recording of people"
# that may be given as files
_FILES = ("stacks", "maps", "worlds", "rules", "prices", "people", "robot")
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
        people = "" if where.pedestrians is None else f"-people{where.pedestrians}"
        return f"{name_of(where.map_name)}-{name_of(where.world)}{people}-seed{self.seed}"


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
        return "".join(f" --{option} {name}" for option, name in named) + episodes


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
    number = (
        len(suite.stacks)
        * len(suite.maps)
        * len(suite.worlds)
        * max(len(suite.pedestrians), 1)
        * len(suite.seeds)
    )
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
    """Every map, world and number of people of a suite."""
    densities: Sequence[int | None] = suite.pedestrians or (None,)
    return [Condition(*values) for values in itertools.product(suite.maps, suite.worlds, densities)]


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


def declare(path: Path, suite: Suite) -> None:
    """Write what a suite folder is to hold.

    Raises:
        InputError: it cannot be written.
    """
    write_file(path / DECLARATION, dump_dataclass(suite))


def begin(path: Path, suite: Suite, cell: Cell, episodes: int, command: Sequence[str]) -> None:
    """Make the run folder of a cell, or let one that has fewer episodes have more, driven as those that it has.

    Raises:
        InputError: the folder cannot be written, or is in use; a value that ``navbench run`` would refuse too; cells
            that were begun before have another world, other rules or other prices than today's.
    """
    folder = path / cell.name
    if not is_begun(path, cell):
        study = cell_study(suite, cell, episodes)
        texts = parameters(study)
        begun = [other for other in cells(suite) if is_begun(path, other)]
        alike = [other for other in begun if _world_of(other) == _world_of(cell)]
        # these were held against the others when they were begun
        for other in {*begun[:1], *alike[:1]}:
            _require_common(path, other, cell, texts)
        create_run(folder, about(study, command), texts)
    elif load_study(folder).episodes < episodes:
        extend_run(folder, episodes)


def run_of(path: Path, cell: Cell) -> str | None:
    """The run of a cell as :func:`harness.study.stored_run.load_run` takes it.

    None: it has no tables yet.
    """
    if (path / cell.name / TABLE).is_file():
        return str(path / cell.name)
    if (path / cell.group / TABLE).is_file():
        return f"{path / cell.group}:{cell.stack_name}"
    return None


def is_begun(path: Path, cell: Cell) -> bool:
    """Whether a suite folder has a run folder for a cell."""
    return (path / cell.name / MANIFEST).is_file()


def _world_of(cell: Cell) -> tuple[str, int | None]:
    return cell.condition.world, cell.condition.pedestrians


def _require_common(path: Path, begun: Cell, cell: Cell, texts: Mapping[str, str]) -> None:
    """Check that a cell to begin has the rules, the prices and, where that is the same, the world of another."""
    folder, names = path / begun.name, ["rules.yaml", "prices.yaml"]
    if _world_of(begun) == _world_of(cell):
        names += ["world.yaml", RECORDING]
    other = [name for name in _differing(folder, texts) if name in names]
    if other:
        raise InputError(
            f"'{path / cell.name}' would be driven with another {other[0]} than '{folder}', whose "
            "deliveries the "
            "same suite has; restore the file, or begin the suite in a new folder"
        )


def _differing(folder: Path, texts: Mapping[str, str]) -> list[str]:
    """Which parameters of a run folder are others than these, by the names of their files."""
    files = (
        file
        for file in parameter_folder(folder).iterdir()
        if file.suffix == ".yaml" or file.stem == PEOPLE
    )
    then, now = _contents({file.name: _text_of(file) for file in files}), _contents(texts)
    return [name for name in sorted({*now, *then}) if now.get(name) != then.get(name)]


def _text_of(file: Path) -> str:
    if file.suffix == ".yaml":
        return read_text(file)
    check_regular(file, MOST_PEOPLE)
    return file.read_text(encoding="utf-8", errors="replace")


def _contents(texts: Mapping[str, str]) -> dict[str, Any]:
    """Parameters as they compare: the content of files, and the recording of people as it is."""
    found: dict[str, Any] = {
        RECORDING: [text for name, text in texts.items() if Path(name).stem == PEOPLE]
    }
    return found | {
        name: load_text(text, name) for name, text in texts.items() if name.endswith(".yaml")
    }


def require_alike(path: Path, cell: Cell, study: Study) -> None:
    """Check that what a cell holds was driven with the parameters that it would be driven with now.

    Raises:
        InputError: it was not.
    """
    folder = path / cell.name
    other = _differing(folder, parameters(study))
    if load_study(folder).template.missions != study.template.missions:
        other.append("way to draw missions")
    if other:
        raise InputError(
            f"run folder '{folder}' was driven with another {other[0]} than today's; remove the "
            "folder to drive it "
            f"anew, or go on with the old one by --resume {path}"
        )


def stored_suite(path: Path) -> Suite:
    """The suite of a suite folder.

    Raises:
        InputError: the folder holds none.
    """
    if not (path / DECLARATION).is_file():
        raise InputError(
            f"'{path}' holds no suite: {DECLARATION} is missing; give the folder that a suite wrote"
        )
    return load_suite(path / DECLARATION)


def require_same(path: Path, suite: Suite) -> None:
    """Check that a suite is the one that a folder holds, maybe with other cells added or left out.

    Raises:
        InputError: it has none of the cells that the folder has, or differs in what all cells have
            in common.
    """
    stored = stored_suite(path)
    known = {cell.name for cell in cells(suite)}
    begun = [cell.name for cell in cells(stored) if is_begun(path, cell)]
    shared = ("missions", "people", "localizer", "robot", "record")
    other = [key for key in shared if getattr(stored, key) != getattr(suite, key)]
    if other or (begun and known.isdisjoint(begun)):
        what = (
            f"{other[0]} is another"
            if other
            else f"none of its runs, {begun[0]} for one, is of this suite"
        )
        raise InputError(f"'{path}' holds the suite '{stored.title}': {what}; give another --out")
