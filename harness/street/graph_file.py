"""The file of a graph of ways: GeoJSON as Nav2's route server reads it."""

import contextlib
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from harness.storage.files import write_text
from harness.street.route_graph import RouteGraph, WayEdge
from harness.world.map.shapes import Rect
from navstack.costmap.occupancy_grid import FARTHEST
from navstack.errors import MapError
from navstack.files import check_regular

_MOST_BYTES = 200_000_000  # of a file
PLACES = ("shops", "homes")  # counted at a point
_WIDEST = 1000.0  # [m] of a way
_EXPECTED = "a graph of navbench map osm or of Nav2's route server is expected"


def save_graph(graph: RouteGraph, path: Path) -> None:
    """Write a graph as GeoJSON for Nav2's route server.

    Points have ``id`` and ``frame``; edges have ``id``, ``startid``, ``endid``, ``cost`` [m] and
    ``metadata``, one for each direction (nav2_route, GeoJsonGraphFileLoader, of Kilted).

    Raises:
        InputError: the file cannot be written.
    """
    features: list[dict[str, Any]] = []
    for number, point in enumerate(graph.points.tolist()):
        properties = {"id": number, "frame": "map", **_places(graph, number)}
        features.append(_feature(properties, "Point", point))
    count = len(graph.points)
    for (a, b), edge, cost in zip(
        graph.pairs.tolist(), graph.edges, graph.lengths.tolist(), strict=True
    ):
        for start, end in ((a, b), (b, a)):
            line = [graph.points[start].tolist(), graph.points[end].tolist()]
            properties = {
                "id": count,
                "startid": start,
                "endid": end,
                "cost": round(cost, 3),
                "overridable": True,
                "metadata": _metadata(edge),
            }
            features.append(_feature(properties, "MultiLineString", [line]))
            count += 1
    lines = ",\n".join(json.dumps(each, separators=(",", ":")) for each in features)
    about: dict[str, Any] = {"type": "FeatureCollection", "name": "graph"}
    about["attribution"] = graph.credit
    if graph.box is not None:
        about["bbox"] = [graph.box.x0, graph.box.y0, graph.box.x1, graph.box.y1]
    head = json.dumps(about, separators=(",", ":")).removesuffix("}")
    write_text(path, f'{head},"features":[\n{lines}\n]}}\n')


def _feature(properties: dict[str, Any], kind: str, coordinates: Any) -> dict[str, Any]:
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def _places(graph: RouteGraph, number: int) -> dict[str, Any]:
    """The shops and homes at a point, where there are any."""
    known = dict(zip(PLACES, (graph.shops, graph.homes), strict=True))
    there = {name: int(each[number]) for name, each in known.items() if each is not None}
    told = {name: count for name, count in there.items() if count}
    return {"metadata": told} if told else {}


def _metadata(edge: WayEdge) -> dict[str, Any]:
    told: dict[str, Any] = {"class": edge.kind, "width": edge.width}
    if edge.crossing >= 0:
        told |= {"crossing": edge.crossing, "signals": edge.has_signals}
    return told


def load_graph(path: Path) -> RouteGraph:
    """Read a graph of this program or of Nav2; an edge of one direction leads both ways.

    Raises:
        MapError: it cannot be read, or is no such graph.
    """
    content = _content(path)
    numbers: dict[int, int] = {}
    points: list[tuple[float, float]] = []
    at: dict[str, list[int]] = {kind: [] for kind in PLACES}
    edges: dict[tuple[int, int], WayEdge] = {}
    ways = []
    for number, feature in enumerate(content["features"]):
        with _told_of(f"{path}: feature {number}"):
            if _mapping(_mapping(feature, "")["geometry"], "geometry")["type"] != "Point":
                ways.append((number, feature))
                continue
            name = _whole(_properties(feature)["id"], "id", 0)
            if name in numbers:
                raise ValueError(f"id {name} is another point's; give each its own")
            numbers[name] = len(points)
            points.append(_place(feature["geometry"]["coordinates"]))
            told = _mapping(_properties(feature).get("metadata") or {}, "metadata")
            for kind, counts in at.items():
                counts.append(_whole(told.get(kind, 0), kind, 0))
    for number, way in ways:
        with _told_of(f"{path}: feature {number}"):
            properties = _properties(way)
            a, b = (_point(numbers, properties, key) for key in ("startid", "endid"))
            told = _mapping(properties.get("metadata") or {}, "metadata")
            edges.setdefault((min(a, b), max(a, b)), _edge(told))
    if not any(points[a] != points[b] for a, b in edges):
        raise MapError(f"{path}: has no edge between two places; give a graph of streets")
    shops, homes = (np.array(at[kind], dtype=np.int64) for kind in PLACES)
    graph = RouteGraph(
        np.array(points),
        np.array(list(edges)),
        list(edges.values()),
        str(content.get("attribution", "")),
        shops,
        homes,
    )
    with _told_of(f"{path}: bbox"):
        return replace(graph, box=_box(content.get("bbox"), graph))


def _content(path: Path) -> dict[str, Any]:
    """What a file says; it has a list of features."""
    try:
        check_regular(path, _MOST_BYTES)
        content = json.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise MapError(f"{path}: cannot be read ({error.strerror}); {_EXPECTED}") from None
    except (ValueError, RecursionError) as error:
        raise MapError(f"{path}: is no JSON ({error}); {_EXPECTED}") from None
    if not isinstance(content, dict) or not isinstance(content.get("features"), list):
        raise MapError(f"{path}: has no list 'features'; {_EXPECTED}")
    return content


def _box(bounds: Any, graph: RouteGraph) -> Rect | None:
    """The box that GeoJSON's ``bbox`` gives; one in other units than a graph's is none."""
    if not isinstance(bounds, list) or len(bounds) != 4:
        return None
    low, high = _place(bounds[:2]), _place(bounds[2:])
    if (graph.points < low).any() or (graph.points > high).any():
        return None
    return Rect(*low, *high)


@contextlib.contextmanager
def _told_of(what: str) -> Iterator[None]:
    try:
        yield
    except KeyError as error:
        raise MapError(f"{what}: has no {error}; {_EXPECTED}") from None
    except ValueError as error:
        raise MapError(f"{what}: {error}") from None


def _mapping(value: Any, name: str) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError(f"{name or 'it'} is {value!r:.40}, not a mapping; {_EXPECTED}")
    return value


def _properties(feature: dict[str, Any]) -> dict[str, Any]:
    return _mapping(feature["properties"], "properties")


def _whole(value: Any, name: str, least: int) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise ValueError(f"{name} {value!r:.40} is no whole number from {least} on")
    return value


def _number(value: Any, name: str, least: float, most: float) -> float:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if not is_number or not least <= value <= most:
        raise ValueError(f"{name} {value!r:.40} is no number from {least:g} to {most:g}")
    return float(value)


def _place(coordinates: Any) -> tuple[float, float]:
    if not isinstance(coordinates, list) or len(coordinates) < 2:
        raise ValueError(f"coordinates {coordinates!r:.40} are not [x, y] in metres")
    x, y = (_number(each, "coordinate", -FARTHEST, FARTHEST) for each in coordinates[:2])
    return x, y


def _point(numbers: dict[int, int], properties: dict[str, Any], key: str) -> int:
    name = _whole(properties[key], key, 0)
    if name not in numbers:
        raise ValueError(f"{key} {name} is the id of no point")
    return numbers[name]


def _edge(told: dict[str, Any]) -> WayEdge:
    return WayEdge(
        str(told.get("class", "way")),
        _number(told.get("width", 0.0), "width", 0.0, _WIDEST),
        _whole(told.get("crossing", -1), "crossing", -1),
        bool(told.get("signals", False)),
    )
