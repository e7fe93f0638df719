"""The worlds of the BARN challenge as maps, and its score.

A world is a Gazebo file of cylinders with the shortest path beside it, ``world_<i>.world`` and
``path_<i>.npy`` (Perille et al. 2020, "Benchmarking Metric Ground Navigation").
"""

import contextlib
import json
import math
import tokenize
import warnings
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.storage.files import write_text
from harness.storage.rows import Row
from harness.world.map.scene import Obstacle, Scene
from harness.world.map.scene_io import save_scene
from harness.world.map.shapes import fill_convex
from harness.world.outcome import ARRIVALS, Outcome
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from navstack.errors import InputError
from navstack.files import check_regular
from navstack.types import FloatArray, Pose2D

BARN = "barn"  # the suite that drives them
START, GOAL = Pose2D(-2.0, 3.0, 1.57), Pose2D(-2.0, 13.0, 1.57)
CELL, LOW, HIGH = 0.025, (-7.0, -2.0), (3.0, 16.0)  # [m] of the maps
PATH_CELL, PATH_ORIGIN = 0.15, (-4.575, 5.075)  # [m] of the cells in which paths are given
TOP_SPEED = 2.0  # [m/s] at which the optimal time is reckoned
CORNERS = 12  # of the polygon that stands for a circle; it is drawn around it
MOST_BYTES, MOST_CYLINDERS = 20_000_000, 5000
FARTHEST = 1e6  # [m] or [cells] of anything in a world
# what NumPy raises of a header that is none; it is read as Python's literals are
NO_HEADER = (
    OSError,
    ValueError,
    TypeError,
    KeyError,
    SyntaxError,
    OverflowError,
    RecursionError,
    MemoryError,
    tokenize.TokenError,
)
REAL = "iuf"  # kinds of NumPy's types that are real numbers
LONGEST = 200  # [characters] of what NumPy says of a file
MAPS = "maps"  # folder of the maps, in a study's folder
TIMES = "optimal_times.json"  # [s] of each map, in a study's folder


def world_numbers(folder: Path) -> list[int]:
    """The worlds of a folder.

    Raises:
        InputError: it has none.
    """
    numbers = sorted(
        int(path.stem[6:]) for path in folder.glob("world_*.world") if path.stem[6:].isdecimal()
    )
    if not numbers:
        raise InputError(
            f"--worlds {folder} has no world_<number>.world; give the folder of the challenge's "
            "worlds"
        )
    return numbers


def cylinders(path: Path) -> FloatArray:
    """Places and radii [m] of a world's cylinders, shape (n, 3).

    Raises:
        InputError: it is no such file.
    """
    try:
        check_regular(path, MOST_BYTES)
        models = ElementTree.parse(path).getroot().findall("world/model")
        found = [_cylinder(model) for model in models if model.find(".//cylinder") is not None]
    except (OSError, ElementTree.ParseError, AttributeError, TypeError, ValueError) as error:
        raise InputError(f"{path}: is no world of cylinders ({error})") from None
    values = np.array(found, dtype=np.float64).reshape(-1, 3)
    if (
        not 0 < len(values) <= MOST_CYLINDERS
        or not (np.abs(values) <= FARTHEST).all()  # nor is one of them NaN
        or not (values[:, 2] > 0.0).all()
    ):
        raise InputError(
            f"{path}: has {len(values)} cylinders; 1 to {MOST_CYLINDERS} with places and "
            f"radii up to {FARTHEST:g} m are read"
        )
    return values


def _cylinder(model: ElementTree.Element) -> tuple[float, float, float]:
    x, y = (model.findtext("pose") or "").split()[:2]
    return float(x), float(y), float(model.findtext(".//cylinder/radius") or "nan")


def map_names(worlds: Path, folder: Path) -> list[str]:
    """Files of the maps that :func:`make_maps` makes."""
    return [str(folder / MAPS / f"barn_{number}.yaml") for number in world_numbers(worlds)]


@contextlib.contextmanager
def made_maps(worlds: Path, folder: Path) -> Iterator[None]:
    """Make the maps, and take them away again where a study that is to have them is refused.

    Raises:
        InputError: a world or its path cannot be read.
        MapError: the folder cannot be written.
    """
    before = _files_of(folder)
    try:
        make_maps(worlds, folder)
        yield
    except BaseException:
        for file in _files_of(folder) - before:
            file.unlink(missing_ok=True)
        for each in (folder / MAPS, folder):
            with contextlib.suppress(OSError):  # it holds something else, or was never made
                each.rmdir()
        raise


def _files_of(folder: Path) -> set[Path]:
    """The maps and optimal times of a study's folder."""
    return {*(folder / MAPS).glob("*"), *folder.glob(TIMES)}


def make_maps(worlds: Path, folder: Path) -> None:
    """Write a map of each world into a study's folder, where it is missing, and the optimal times.

    All worlds are read before the first map is written: one that is refused leaves nothing behind.

    Raises:
        InputError: a world or its path cannot be read.
        MapError: the folder cannot be written.
    """
    numbers = world_numbers(worlds)
    times = {f"barn_{number}": optimal_time(worlds / f"path_{number}.npy") for number in numbers}
    files = dict(zip(numbers, map(Path, map_names(worlds, folder)), strict=True))
    posts = {
        file: cylinders(worlds / f"world_{number}.world")
        for number, file in files.items()
        if not file.exists()
    }
    for file, circles in posts.items():
        save_scene(scene_of(file.stem, circles), file.parent, file.stem)
    write_text(folder / TIMES, json.dumps(times, indent=1))


def scene_of(name: str, circles: FloatArray) -> Scene:
    """Cylinders of 1 m on open ground."""
    turn = 2.0 * math.pi * (np.arange(CORNERS) + 0.5) / CORNERS
    unit = np.column_stack((np.cos(turn), np.sin(turn))) / math.cos(math.pi / CORNERS)
    polygons = [circle[:2] + circle[2] * unit for circle in circles]
    solid = np.zeros(_ground().data.shape, dtype=bool)
    for polygon in polygons:
        fill_convex(solid, polygon, True, CELL, *LOW)
    geometry = OccupancyGrid(np.where(solid, np.int8(OCCUPIED), np.int8(FREE)), CELL, Pose2D(*LOW))
    return Scene(
        name,
        tuple(Obstacle("cylinder", polygon, 1.0) for polygon in polygons),
        (),
        geometry,
        _ground(),
    )


def _ground() -> OccupancyGrid:
    width, height = (round((high - low) / CELL) for low, high in zip(LOW, HIGH, strict=True))
    return OccupancyGrid(np.full((height, width), FREE, dtype=np.int8), CELL, Pose2D(*LOW))


def optimal_time(path: Path) -> float:
    """Time [s] of the given path, start and goal added to it, at top speed.

    Raises:
        InputError: it is no such file.
    """
    inner = _path_cells(path) * PATH_CELL + np.array(PATH_ORIGIN)
    corners = np.vstack(((START.x, START.y), inner, (GOAL.x, GOAL.y)))
    return float(np.linalg.norm(np.diff(corners, axis=0), axis=1).sum()) / TOP_SPEED


def _path_cells(path: Path) -> FloatArray:
    """The cells (n, 2) of a path.

    Raises:
        InputError: the file holds something else.
    """
    try:
        check_regular(path, MOST_BYTES)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of sizes that overflow, and headers of Python 2
            # mapped, so that a header cannot ask for more memory than the file has bytes
            stored = np.lib.format.open_memmap(path, mode="r")
    except NO_HEADER as error:
        why = str(error).partition("\n")[0][:LONGEST]
        raise InputError(f"{path}: is no path of a world ({why or type(error).__name__})") from None
    if stored.ndim != 2 or stored.shape[1] != 2 or not len(stored) or stored.dtype.kind not in REAL:
        raise InputError(
            f"{path}: is no path of a world: shape {stored.shape} of {stored.dtype}; (n, 2) real "
            "numbers are needed, n at least 1"
        )
    cells: FloatArray = np.array(stored, dtype=np.float64)
    if not (np.abs(cells) <= FARTHEST).all():
        raise InputError(
            f"{path}: is no path of a world: a cell is not finite, or beyond {FARTHEST:g}"
        )
    return cells


def score(arrived: bool, seconds: float, optimal: float, least: float = 4.0) -> float:
    """The challenge's score of one run.

    Optimal over actual time, that one held between ``least`` and 8 optimal ones.

    From 2026 on ``least`` is 2, so that 0.5 can be had instead of 0.25.
    """
    return optimal / min(max(seconds, least * optimal), 8.0 * optimal) if arrived else 0.0


@dataclass(frozen=True, slots=True)
class Score:
    """A stack's runs in the worlds."""

    runs: int
    arrived: int
    collided: int
    score: float  # mean, of 0.25
    newer_score: float  # the same as from 2026 on, of 0.5
    seconds: float | None  # mean of those that arrived; None: none did


def optimal_times(folder: Path) -> dict[str, float]:
    """Of each map of a study's folder [s]; none where the challenge's worlds were not driven.

    Raises:
        InputError: the file is damaged.
    """
    file = folder / TIMES
    if not file.is_file():
        return {}
    try:
        check_regular(file, MOST_BYTES)
        times = {
            str(name): float(seconds)
            for name, seconds in json.loads(file.read_text(encoding="utf-8")).items()
        }
        if not all(0.0 < seconds <= FARTHEST for seconds in times.values()):
            raise ValueError
        return times
    except (OSError, ValueError, TypeError, AttributeError, RecursionError):
        raise InputError(f"{file} is damaged; remove it and give --worlds again") from None


def score_of(rows: Iterable[Row], times: Mapping[str, float]) -> Score:
    """What the challenge says of finished runs.

    Args:
        rows: of ``episodes.parquet``, at least one.
        times: optimal ones [s], by map.
    """
    each = [
        (Outcome(row["outcome"]) in ARRIVALS, row["duration_s"], times[row["map"]], row["reason"])
        for row in rows
    ]
    taken = [seconds for has_arrived, seconds, _, _ in each if has_arrived]
    old, new = (
        np.mean([score(run[0], run[1], run[2], least) for run in each]) for least in (4.0, 2.0)
    )
    collided = sum(reason == "impulse" for *_, reason in each)
    return Score(
        len(each),
        len(taken),
        collided,
        float(old),
        float(new),
        float(np.mean(taken)) if taken else None,
    )
