"""Measures of a district: lengths, widths, furniture, and how much the rules filled in."""

from typing import Any

import numpy as np
import shapely

from harness.street.district import District
from harness.street.osm_file import CREDIT
from harness.street.route_graph import RouteGraph
from harness.street.walks import Walk

Row = dict[str, Any]


def measure_district(district: District, graph: RouteGraph) -> Row:
    """The statistics of ``navbench map osm``; units are in the keys."""
    ground, geo = district.ground, district.extract.geo
    frame = shapely.box(*ground.box.polygon[0], *ground.box.polygon[2])
    parts = shapely.area(shapely.get_parts(ground.walkable))
    by_kind: dict[str, list[tuple[Walk, float]]] = {}
    for walk in ground.walks:
        length = float(shapely.intersection(walk.line, frame).length)
        if length > 0.0:
            by_kind.setdefault(walk.kind, []).append((walk, length))
    crossings = [walk for walk, _ in by_kind.pop("crossing", [])]
    total = sum(length for walks in by_kind.values() for _, length in walks)
    return {
        "credit": CREDIT,
        "bbox": [geo.west, geo.south, geo.east, geo.north],
        "size_m": [round(ground.box.width, 1), round(ground.box.depth, 1)],
        "walkable_area_m2": round(float(parts.sum()), 1),
        "largest_part_share": round(float(parts.max(initial=0.0) / parts.sum()), 4),
        "walks": {kind: _lengths(walks) for kind, walks in sorted(by_kind.items())},
        "crossings": {
            "n": len(crossings),
            "signals": sum(walk.has_signals for walk in crossings),
            "raised_kerbs": sum(walk.has_step for walk in crossings),
            "filled_share": _share([walk.source == "rule" for walk in crossings]),
        },
        "furniture": _pieces(district, total),
        "furniture_moved": district.furniture.moved,
        "buildings": sum(kind == "building_glass" for kind, _, _ in ground.built),
        "graph": measure_graph(graph),
    }


def _lengths(walks: list[tuple[Walk, float]]) -> Row:
    lengths = np.array([length for _, length in walks])
    total = float(lengths.sum())
    widths = [walk.width for walk, _ in walks]
    filled = lengths[[walk.source == "rule" for walk, _ in walks]].sum()
    tagged = lengths[[walk.has_width for walk, _ in walks]].sum()
    low, median, high = np.percentile(widths, (0, 50, 100)).round(2).tolist()
    return {
        "length_m": round(total, 1),
        "filled_share": round(float(filled) / total, 4),
        "tagged_width_share": round(float(tagged) / total, 4),
        "widths_m": {"least": low, "median": median, "most": high},
    }


def _pieces(district: District, length: float) -> Row:
    found = district.furniture
    counts = found.mapped + found.filled
    return {
        kind: {
            "n": count,
            "filled_share": round(found.filled[kind] / count, 4),
            "per_100m": _per_100m(count, length),
        }
        for kind, count in counts.most_common()
    }


def _per_100m(count: int, length: float) -> float | None:
    """Pieces per 100 m of way; None: the district has areas for people only."""
    if length == 0.0:
        return None
    return round(100.0 * count / length, 3)


def measure_graph(graph: RouteGraph) -> Row:
    """Size and length [m] of a graph, and the share of it that hangs together."""
    part = np.bincount(graph.components[graph.pairs[:, 0]], weights=graph.lengths)
    return {
        "points": len(graph.points),
        "edges": len(graph.edges),
        "length_m": round(float(graph.lengths.sum()), 1),
        "connected_share": round(float(part.max() / part.sum()), 4),
    }


def _share(flags: list[bool]) -> float | None:
    if not flags:
        return None
    return round(sum(flags) / len(flags), 4)
