"""The file of a graph of ways: GeoJSON as Nav2's route server reads it."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from harness.storage.files import write_text
from harness.street.route_graph import RouteGraph, WayEdge
from navstack.errors import MapError
from navstack.files import check_regular
from navstack.types import IntArray

_MOST_BYTES = 200_000_000  # of a file


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
    about = f'"type":"FeatureCollection","name":"graph","attribution":{json.dumps(graph.credit)}'
    write_text(path, f'{{{about},"features":[\n{lines}\n]}}\n')


def _feature(properties: dict[str, Any], kind: str, coordinates: Any) -> dict[str, Any]:
    geometry = {"type": kind, "coordinates": coordinates}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def _places(graph: RouteGraph, number: int) -> dict[str, Any]:
    """The shops and homes at a point, where there are any."""
    known = {"shops": graph.shops, "homes": graph.homes}
    there = {name: int(each[number]) for name, each in known.items() if each is not None}
    told = {name: count for name, count in there.items() if count}
    return {"metadata": told} if told else {}


def _counts(nodes: list[dict[str, Any]], kind: str) -> IntArray:
    told = [node["properties"].get("metadata", {}) for node in nodes]
    return np.array([int(each.get(kind, 0)) for each in told], dtype=np.int64)


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
    try:
        check_regular(path, _MOST_BYTES)
        content = json.loads(path.read_text(encoding="utf-8"))
        features = content["features"]
        nodes = [each for each in features if each["geometry"]["type"] == "Point"]
        ways = [each for each in features if each["geometry"]["type"] != "Point"]
        numbers = {node["properties"]["id"]: place for place, node in enumerate(nodes)}
        points = np.array([node["geometry"]["coordinates"][:2] for node in nodes], dtype=float)
        edges: dict[tuple[int, int], WayEdge] = {}
        for way in ways:
            properties = way["properties"]
            a, b = numbers[properties["startid"]], numbers[properties["endid"]]
            edges.setdefault((min(a, b), max(a, b)), _edge(properties.get("metadata", {})))
        shops, homes = _counts(nodes, "shops"), _counts(nodes, "homes")
    except OSError as error:
        raise MapError(f"{path}: cannot be read ({error.strerror})") from None
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise MapError(
            f"{path}: is no GeoJSON graph of Nav2's route server ({type(error).__name__}: {error})"
        ) from None
    if not edges or not np.isfinite(points).all():
        raise MapError(f"{path}: has no edge, or a point without coordinates")
    credit = str(content.get("attribution", ""))
    return RouteGraph(points, np.array(list(edges)), list(edges.values()), credit, shops, homes)


def _edge(told: dict[str, Any]) -> WayEdge:
    return WayEdge(
        str(told.get("class", "way")),
        float(told.get("width", 0.0)),
        int(told.get("crossing", -1)),
        bool(told.get("signals", False)),
    )
