"""Where orders begin and end: shops and homes of an OpenStreetMap extract, at points of a graph."""

import dataclasses
from collections.abc import Iterable

import numpy as np

from harness.street.osm_file import Extract, MappedThing
from harness.street.route_graph import RouteGraph
from navstack.types import IntArray

# tags of wiki.openstreetmap.org/wiki/Key:amenity and Key:building; every shop=* counts, too
FOOD = ("restaurant", "fast_food", "cafe", "pharmacy")
HOMES = ("apartments", "residential", "house", "detached", "semidetached_house", "terrace")
_REACH = 40.0  # [m] from the middle of a house or shop to the way


def with_places(graph: RouteGraph, extract: Extract) -> RouteGraph:
    """The graph with the number of shops and homes at each of its points.

    A home is a building; how many live there is not known.
    """
    things = [*extract.points, *extract.areas]
    shops = [each for each in things if _sells(each.tags)]
    homes = [each for each in extract.areas if each.tags.get("building") in HOMES]
    return dataclasses.replace(graph, shops=_counts(graph, shops), homes=_counts(graph, homes))


def _sells(tags: dict[str, str]) -> bool:
    return tags.get("shop", "no") not in ("no", "vacant") or tags.get("amenity") in FOOD


def _counts(graph: RouteGraph, things: Iterable[MappedThing]) -> IntArray:
    """How many are nearest to each point (N,)."""
    counts: IntArray = np.zeros(len(graph.points), dtype=np.int64)
    for thing in things:
        middle = thing.geometry.centroid
        distance, number = graph.tree.query((middle.x, middle.y))
        if distance <= _REACH:
            counts[number] += 1
    return counts
