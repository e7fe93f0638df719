"""Where orders begin and end: shops and homes of an OpenStreetMap extract, at points of a graph."""

import dataclasses
from collections.abc import Sequence

import numpy as np
import shapely

from harness.street.osm_file import Extract, MappedThing
from harness.street.route_graph import RouteGraph
from navstack.types import IntArray

# tags of wiki.openstreetmap.org/wiki/Key:amenity and Key:building; every shop=* counts, too
FOOD = ("restaurant", "fast_food", "cafe", "pharmacy")
HOMES = ("apartments", "residential", "house", "detached", "semidetached_house", "terrace")
ADDRESS = "addr:housenumber"
USES = ("shop", "amenity", "office", "tourism", "leisure", "craft", "healthcare")
_REACH = 40.0  # [m] from the middle of a house or shop to the way


def with_places(graph: RouteGraph, extract: Extract) -> RouteGraph:
    """The graph with the number of shops and homes at each of its points.

    A home is a building, how many live there is not known; or, where no building is one, an
    address that is mapped as a point.
    """
    things = [*extract.points, *extract.areas]
    shops = [each for each in things if _sells(each.tags)]
    homes = [each for each in extract.areas if _is_home(each.tags)]
    if not homes:
        homes = [each for each in extract.points if _is_address(each.tags)]
    return dataclasses.replace(graph, shops=_counts(graph, shops), homes=_counts(graph, homes))


def _is_home(tags: dict[str, str]) -> bool:
    """Whether somebody lives there; of many buildings only the address is mapped."""
    building = tags.get("building")
    return building in HOMES or (building == "yes" and _is_address(tags))


def _is_address(tags: dict[str, str]) -> bool:
    """Whether a thing has an address, and no use but to live there that is told."""
    return ADDRESS in tags and not any(use in tags for use in USES)


def _sells(tags: dict[str, str]) -> bool:
    return tags.get("shop", "no") not in ("no", "vacant") or tags.get("amenity") in FOOD


def _counts(graph: RouteGraph, things: Sequence[MappedThing]) -> IntArray:
    """How many are on the way to each point (N,): at the nearer end of the nearest edge."""
    counts: IntArray = np.zeros(len(graph.points), dtype=np.int64)
    if not things:
        return counts
    middles = shapely.centroid([thing.geometry for thing in things])
    edges = shapely.STRtree(shapely.linestrings(graph.points[graph.pairs]))
    near, numbers = edges.query_nearest(middles, max_distance=_REACH, all_matches=False)
    places = shapely.get_coordinates(middles)[near]
    ends = graph.pairs[numbers]
    away = np.hypot(*(graph.points[ends] - places[:, np.newaxis]).T).T
    nearer = ends[np.arange(len(ends)), away.argmin(axis=1)]
    np.add.at(counts, nearer, 1)
    return counts
