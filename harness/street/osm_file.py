"""The things of an OpenStreetMap extract that a street is made of, in metres."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from pyproj import Proj

from harness.street.osm_order import in_order
from harness.street.rules import is_below_or_above
from harness.world.map.shapes import Rect
from navstack.errors import InputError, MapError
from navstack.files import check_regular
from navstack.types import FloatArray

CREDIT = "(c) OpenStreetMap contributors, ODbL 1.0, openstreetmap.org/copyright"
MOST_BYTES = 200_000_000  # of a file; a city's extract
MOST_EXTENT = 5000.0  # [m] of a box
AROUND = 30.0  # [m] beyond the box that is read
MOST_CORNERS = 2000  # of a way, as OpenStreetMap allows
_SUFFIXES = (".pbf", ".osm", ".osm.gz", ".osm.bz2", ".osm.xml")
_NODE_KEYS = (
    "highway barrier amenity shop natural emergency kerb man_made advertising traffic_sign "
    "addr:housenumber"
).split()
_AREA_KEYS = "building highway area:highway place landuse leisure natural waterway".split()
_LINE_KEYS = ("highway", "barrier", "waterway", "railway")  # other ways count as areas only


@dataclass(frozen=True, slots=True)
class GeoBox:
    """A box of latitudes and longitudes."""

    west: float  # [deg]
    south: float
    east: float
    north: float

    def __post_init__(self) -> None:
        """Check the order and the range of the sides.

        Raises:
            InputError: it is no box on Earth.
        """
        in_order = -180.0 <= self.west < self.east <= 180.0
        if not in_order or not -85.0 <= self.south < self.north <= 85.0:
            raise InputError(
                f"--bbox {self.west},{self.south},{self.east},{self.north} is no box; give west, "
                "south, east and north in degrees, west < east and south < north"
            )


@dataclass(frozen=True, slots=True, eq=False)
class MappedThing:
    """A node, a way or an area with its tags."""

    tags: dict[str, str]
    geometry: shapely.Geometry  # [m] x east, y north of the box's lower left corner
    nodes: tuple[int, ...] = ()  # of a line, one for each corner, or the node's own number


@dataclass(frozen=True, slots=True, eq=False)
class Extract:
    """What of a file lies in a box."""

    geo: GeoBox
    box: Rect  # [m] the same box
    points: list[MappedThing]
    lines: list[MappedThing]
    areas: list[MappedThing]
    covered: float = 1.0  # share of the box that the file says to have


def read_extract(path: Path, geo: GeoBox | None = None) -> Extract:
    """Read what lies in a box of a file.

    Args:
        path: a .osm.pbf, .osm, .osm.gz or .osm.bz2 file.
        geo: the box; None: the one that the file's header names, else the one around its nodes.

    Raises:
        InputError: the box is no box, or the file has nothing there.
        MapError: the file is missing, too large, broken, or no such file; or osmium is missing.
    """
    osmium = _osmium()
    if not path.name.endswith(_SUFFIXES):
        raise MapError(f"{path}: is no OpenStreetMap file; give one of {', '.join(_SUFFIXES)}")
    try:
        check_regular(path, MOST_BYTES)
    except OSError as error:
        raise MapError(
            f"{path}: cannot be read ({error.strerror}); give an extract of at most "
            f"{MOST_BYTES / 1e6:.0f} MB, e.g. of osmium extract --bbox W,S,E,N"
        ) from None
    try:
        box, covered = _box_of(osmium, path, geo)
        with in_order(osmium, path) as ordered:
            found = dataclasses.replace(_read(osmium, ordered, box), covered=covered)
    except (RuntimeError, ValueError, osmium.InvalidLocationError) as error:
        reason = str(error).splitlines()[0]
        raise MapError(
            f"{path}: is broken or cut off ({reason}); download the extract again"
        ) from None
    if not found.lines and not found.areas:
        _box_of_nodes(osmium, path)
        raise InputError(f"{path}: has no way in the box; check --bbox W,S,E,N")
    return found


def _osmium() -> Any:
    try:
        import osmium
    except ImportError:
        raise MapError(
            "OpenStreetMap files need the package osmium; pip install 'navbench[street]'"
        ) from None
    return osmium


def _box_of(osmium: Any, path: Path, geo: GeoBox | None) -> tuple[GeoBox, float]:
    """The box that is read, and the share of it that the file says to have."""
    with osmium.io.Reader(str(path)) as reader:
        stated = reader.header().box()
    if not stated.valid() and geo is not None:
        return geo, 1.0
    if not stated.valid():
        stated = _box_of_nodes(osmium, path)
    low, high = stated.bottom_left, stated.top_right
    if geo is None:
        return GeoBox(low.lon, low.lat, high.lon, high.lat), 1.0
    across = min(geo.east, high.lon) - max(geo.west, low.lon)
    up = min(geo.north, high.lat) - max(geo.south, low.lat)
    if across <= 0.0 or up <= 0.0:
        raise InputError(
            f"--bbox {geo.west},{geo.south},{geo.east},{geo.north} lies outside of {path.name}, "
            f"which has {low.lon},{low.lat},{high.lon},{high.lat}"
        )
    return geo, across * up / ((geo.east - geo.west) * (geo.north - geo.south))


def _box_of_nodes(osmium: Any, path: Path) -> Any:
    """The box around all nodes of a file.

    Raises:
        InputError: it has none.
    """
    box = osmium.io.Header().box()
    for node in osmium.FileProcessor(str(path), osmium.osm.NODE):
        if node.location.valid():
            box.extend(node.location)
    if not box.valid():
        raise InputError(
            f"{path}: has no node; give an extract of ways with their nodes, from Overpass e.g. "
            "with (._;>;);out;"
        )
    return box


def _read(osmium: Any, path: Path, geo: GeoBox) -> Extract:
    project = Proj(proj="aeqd", ellps="WGS84", lat_0=geo.south, lon_0=geo.west)
    width, depth = project(geo.east, geo.south)[0], project(geo.west, geo.north)[1]
    if max(width, depth) > MOST_EXTENT:
        sides = f"{geo.west:.4f},{geo.south:.4f},{geo.east:.4f},{geo.north:.4f}"
        raise InputError(
            f"--bbox {sides} is {width:.0f} x {depth:.0f} m; give one of at most "
            f"{MOST_EXTENT:.0f} m a side"
        )
    box = Rect(0.0, 0.0, float(width), float(depth))
    grown = shapely.box(*_bounds(box.grown(AROUND)))
    filters = osmium.filter.KeyFilter(*{*_NODE_KEYS, *_AREA_KEYS, *_LINE_KEYS})
    objects = osmium.FileProcessor(str(path)).with_areas(filters).with_filter(filters)
    factory = osmium.geom.WKBFactory()
    found: dict[str, list[MappedThing]] = {"point": [], "line": [], "area": []}
    for one in objects:
        tags = dict(one.tags)
        if one.deleted or is_below_or_above(tags):
            continue
        for kind, shape, nodes in _shapes(osmium, factory, one):
            geometry = shapely.transform(shape, lambda lonlat: _metres(project, lonlat))
            if shapely.intersects(grown, geometry):
                _check_line(kind, one.id, geometry)
                found[kind].append(MappedThing(tags, geometry, nodes))
    return Extract(geo, box, found["point"], found["line"], found["area"])


Shape = tuple[str, shapely.Geometry, tuple[int, ...]]


def _shapes(osmium: Any, factory: Any, one: Any) -> list[Shape]:
    """Kind, geometry [deg] and nodes of an object's parts; empty: it has no shape."""
    if one.is_way():
        return _lines(one)
    try:
        if one.is_node():
            return [("point", shapely.from_wkb(factory.create_point(one)), (one.id,))]
        if one.is_area() and not _is_loop(one):
            return [("area", shapely.from_wkb(factory.create_multipolygon(one)), ())]
    except (RuntimeError, osmium.InvalidLocationError):
        return []  # an area that the extract cuts off
    return []


def _lines(way: Any) -> list[Shape]:
    """The parts of a way between nodes that the file leaves out, as an extract does at its edge."""
    if not any(key in way.tags for key in _LINE_KEYS):
        return []
    parts: list[list[tuple[tuple[float, float], int]]] = [[]]
    for node in way.nodes:
        if not node.location.valid():
            parts.append([])
            continue
        place = node.lon, node.lat
        if not parts[-1] or parts[-1][-1][0] != place:
            parts[-1].append((place, node.ref))
    found: list[Shape] = []
    for part in parts:
        if len(part) > 1:
            places, nodes = zip(*part, strict=True)
            found.append(("line", shapely.LineString(places), nodes))
    return found


def _check_line(kind: str, number: int, geometry: shapely.Geometry) -> None:
    """Check a way for what OpenStreetMap cannot have, and what would take hours to lay.

    Raises:
        ValueError: it has too many corners, or two of them are a whole box apart.
    """
    if kind != "line":
        return
    corners = shapely.get_coordinates(geometry)
    if len(corners) > MOST_CORNERS:
        raise ValueError(f"way {number} has {len(corners)} nodes; at most {MOST_CORNERS}")
    farthest = float(np.hypot(*np.diff(corners, axis=0).T).max())
    if not farthest <= MOST_EXTENT:
        raise ValueError(
            f"way {number} has nodes {farthest:.0f} m apart; at most {MOST_EXTENT:.0f} m"
        )


def _is_loop(area: Any) -> bool:
    """Whether a closed way is a line that ends where it begins, as a path around a pond."""
    is_line = "highway" in area.tags or ("barrier" in area.tags and "building" not in area.tags)
    return bool(area.from_way()) and is_line and area.tags.get("area") != "yes"


def _metres(project: Proj, lonlat: FloatArray) -> FloatArray:
    return np.stack(project(lonlat[:, 0], lonlat[:, 1]), axis=1)


def _bounds(rect: Rect) -> tuple[float, float, float, float]:
    return rect.x0, rect.y0, rect.x1, rect.y1
