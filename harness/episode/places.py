"""Where a delivery is driven: on a map, or leg by leg on a district."""

from pathlib import Path
from typing import TYPE_CHECKING

from harness.episode.files import rules_of
from harness.execution.process_cache import kept
from harness.storage.shipped import is_district
from harness.task.mission import BY_PLACES, Mission
from harness.task.study import EpisodeTask
from navstack.errors import InputError

if TYPE_CHECKING:
    from harness.street.missions import Leg, StreetMissions


@kept(2)
def _street_missions(
    folder: str, seed: int, is_by_places: bool, distance: tuple[float, float] | None
) -> "StreetMissions":
    from harness.street.missions import StreetMissions

    return StreetMissions(Path(folder), seed, is_by_places, distance)


def legs_of(task: EpisodeTask) -> "tuple[Leg, ...]":
    """The legs of a mission on a district; those of the way back where its rules want it.

    Raises:
        InputError: a pose is given on a district, whose missions are drawn.
        MapError: the district cannot be read.
    """
    if task.start is not None or task.goal is not None:
        raise InputError(
            f"--start and --goal are for one map; missions on the district '{task.map_name}' are "
            "drawn: leave them out, or give one of its maps"
        )
    drawn = _street_missions(task.map_name, task.seed, task.missions == BY_PLACES, task.distance)
    return drawn.legs(task.episode, rules_of(task.rules).way_back)


def place_of(task: EpisodeTask) -> "str | Leg":
    """Where a delivery is driven: a map, or one leg on a district; raises as :func:`legs_of`."""
    if not is_district(task.map_name):
        return task.map_name
    return legs_of(task)[task.leg]


def street_mission(legs: "tuple[Leg, ...]") -> Mission:
    """The whole mission of these legs; its shortest path is the route there."""
    return Mission(legs[0].start, way_there(legs)[-1].goal, legs[0].way)


def way_there(legs: "tuple[Leg, ...]") -> "tuple[Leg, ...]":
    """Those that lead to the goal."""
    return tuple(leg for leg in legs if not leg.is_back)
