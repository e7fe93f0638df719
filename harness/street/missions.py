"""Missions over a district's route graph, cut into legs that are driven one after the other."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.storage.shipped import ROUTE_GRAPH
from harness.street.graph_file import load_graph
from harness.street.route_graph import RouteGraph
from harness.street.routes import StreetRoute, draw_mission, reverse
from harness.world.map.scene import Scene
from harness.world.map.shapes import Rect
from harness.world.map.tiles import load_part
from navstack.errors import MapError
from navstack.types import FloatArray, Pose2D

LEG = 100.0  # [m] of a route, about a published delivery: longer ones are cut
DISTANCES = (300.0, 2500.0)  # [m] between start and goal at least, of a route at most
LEAST_SHARE = 0.3  # of a small district's diagonal: the least distance there
_AROUND = 30.0  # [m] of the world around a leg: as far as the shipped lidars see
_ROOM = 1.8  # [m] width of ground on which a leg may end
_SHORTEST = 5.0  # [m] between the ends of a leg
_MOST_FRUITLESS = 200  # missions in turn without a leg
_HEADING = 1.0  # [m] of the way that give the heading at an end


@dataclass(frozen=True, slots=True)
class Leg:
    """A part of a mission, and the part of the district around it."""

    folder: str  # of the district
    name: str  # of the district
    way: float  # [m] of the whole mission's route
    start: Pose2D
    goal: Pose2D
    window: Rect  # [m]
    signals: int = 0  # of crossings on it
    is_back: bool = False  # from the goal to the start of its mission

    def scene(self) -> Scene:
        """The part of the district around it.

        Raises:
            MapError: its tiles cannot be read.
        """
        at = self.start.x, self.start.y
        return load_part(Path(self.folder), self.name, self.window, at)


class StreetMissions:
    """Draws missions on a district; the same seed gives the same ones."""

    def __init__(
        self,
        folder: Path,
        seed: int,
        is_by_places: bool = False,
        distance: tuple[float, float] | None = None,
    ) -> None:
        """Read the route graph of a folder that ``navbench map osm`` wrote.

        Args:
            folder: of the district.
            seed: of the missions.
            is_by_places: they lead from shops to homes, else from anywhere to anywhere.
            distance: [km] between start and goal at least, of a route at most; None:
                :data:`DISTANCES`, less in a small district.

        Raises:
            MapError: there is none, or several are.
        """
        graphs = sorted(folder.glob(f"*{ROUTE_GRAPH}"))
        if len(graphs) != 1:
            raise MapError(
                f"{folder}: has {len(graphs)} files NAME{ROUTE_GRAPH}; give a folder with one "
                "district of navbench map osm"
            )
        self._folder, self._name = folder, graphs[0].name.removesuffix(ROUTE_GRAPH)
        self._graph = load_graph(graphs[0])
        self._rng, self._is_by_places = np.random.default_rng(seed), is_by_places
        self._missions: list[tuple[Leg, ...]] = []
        diagonal = float(np.hypot(*np.ptp(self._graph.points, axis=0)))
        self._distances = min(DISTANCES[0], LEAST_SHARE * diagonal), DISTANCES[1]
        if distance is not None:
            self._distances = 1000.0 * distance[0], 1000.0 * distance[1]

    def legs(self, number: int, is_round_trip: bool = False) -> tuple[Leg, ...]:
        """The legs of a mission by its number, in order; together they are its route.

        Of a round trip also those of the same way back.

        Raises:
            MapError: no mission has a route.
        """
        fruitless = 0
        while len(self._missions) <= number:
            fruitless += 1
            if fruitless > _MOST_FRUITLESS:
                raise MapError(
                    f"{self._folder}: {_MOST_FRUITLESS} missions in turn had no route with a leg "
                    f"of {_SHORTEST:g} m; its ways do not hang together: import a larger box"
                )
            drawn = draw_mission(self._graph, *self._distances, self._rng, self._is_by_places)
            legs: tuple[Leg, ...] = ()
            if drawn.route is not None:
                legs = self._legs_of(drawn.route)
            if drawn.route is not None and legs:
                legs += self._legs_of(reverse(drawn.route), is_back=True)
            if legs:
                self._missions.append(legs)
                fruitless = 0
        legs = self._missions[number]
        return tuple(leg for leg in legs if is_round_trip or not leg.is_back)

    def _legs_of(self, route: StreetRoute, is_back: bool = False) -> tuple[Leg, ...]:
        where = str(self._folder), self._name, route.length
        return tuple(
            Leg(*where, part.start, part.goal, part.box.grown(_AROUND), part.signals, is_back)
            for part in parts_of(route, self._graph)
        )


@dataclass(frozen=True, slots=True)
class RoutePart:
    """A part of a route."""

    start: Pose2D
    goal: Pose2D
    box: Rect  # [m]
    signals: int  # of crossings that it comes to


def parts_of(route: StreetRoute, graph: RouteGraph) -> list[RoutePart]:
    """A route in parts of about ``LEG``.

    They end on wide ground off crossings, where there is any near.
    """
    steps = np.hypot(*np.diff(route.points, axis=0).T)
    along = np.concatenate(((0.0,), np.cumsum(steps)))
    parts: list[RoutePart] = []
    signals = _signals(route, graph, along)
    cuts = _cuts(route, graph, along)
    for first, last in zip(cuts[:-1], cuts[1:], strict=True):
        inner = route.points[(along > first) & (along < last)]
        ends = _pose(route.points, along, first), _pose(route.points, along, last)
        line = np.vstack((ends[0].as_array()[:2], inner, ends[1].as_array()[:2]))
        if math.hypot(ends[0].x - ends[1].x, ends[0].y - ends[1].y) < _SHORTEST:
            continue
        low, high = line.min(axis=0).tolist(), line.max(axis=0).tolist()
        ahead = sum(first <= place < last for place in signals)
        parts.append(RoutePart(*ends, Rect(*low, *high), ahead))
    return parts


def _signals(route: StreetRoute, graph: RouteGraph, along: FloatArray) -> list[float]:
    """Distances along a route [m] at which it comes to crossings with a signal."""
    found: dict[int, float] = {}
    for number, place in zip(route.edges, along.tolist(), strict=False):
        edge = graph.edges[number]
        if edge.has_signals and edge.crossing >= 0:
            found.setdefault(edge.crossing, place)
    return list(found.values())


def _cuts(route: StreetRoute, graph: RouteGraph, along: FloatArray) -> list[float]:
    """Distances along a route [m] between which its legs lie, its ends included."""
    count = math.ceil(route.length / LEG)
    target = route.length / count
    places = np.arange(0.0, route.length)
    edges = [graph.edges[number] for number in route.edges]
    fits = np.array([edge.crossing < 0 and edge.width >= _ROOM for edge in edges])
    at = np.searchsorted(along, places, side="right") - 1
    roomy = places[fits[np.minimum(at, len(edges) - 1)]]
    cuts = [0.0]
    for number in range(1, count):
        ideal = number * target
        near = roomy[np.abs(roomy - ideal) < target / 3.0]
        if len(near):
            ideal = float(near[np.argmin(np.abs(near - ideal))])
        cuts.append(ideal)
    return [*cuts, route.length]


def _pose(points: FloatArray, along: FloatArray, place: float) -> Pose2D:
    """The pose [m], [rad] on a route at a distance from its begin, looking along it."""
    ahead = min(place, along[-1] - _HEADING)
    x, y = (np.interp((place, ahead, ahead + _HEADING), along, points[:, axis]) for axis in (0, 1))
    return Pose2D(float(x[0]), float(y[0]), math.atan2(y[2] - y[1], x[2] - x[1]))
