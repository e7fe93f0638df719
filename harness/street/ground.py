"""The ground of a district: where people walk, where cars drive, what is built on."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import shapely

from harness.street.alleys import alleys
from harness.street.bends import around_bends
from harness.street.crossings import more_crossings
from harness.street.links import links_between, without_medians
from harness.street.osm_file import Extract, MappedThing
from harness.street.rules import (
    RULES,
    carriageway_width,
    is_for_cars_only,
    is_open,
    tagged_height,
    walk_kind,
    walk_width,
)
from harness.street.walks import (
    Street,
    Walk,
    drawn_walks,
    side_walks,
    street_areas,
    streets_of,
)
from harness.world.map.scene import Obstacle
from harness.world.map.shapes import Rect
from navstack.errors import InputError
from navstack.types import FloatArray

_LEAST_AREA = 0.05  # [m2] of a piece that stays
_NO_WAY = (
    "the box has no sidewalk, footway or area for people, and no street tagged sidewalk=both, left "
    "or right; choose another box"
)
_SIMPLER = 0.05  # [m] by which outlines may move
_SMALL_SHARE = 0.25  # [-] of the largest part: a smaller one stays only if it is mapped
_PLAZAS = ("pedestrian", "footway", "path", "living_street")
_COVERED = ("yes", "arcade", "colonnade")
_HEADROOM = 2.0  # [m] a building that begins higher stands in nobody's way
_WATERWAYS = ("river", "canal", "stream", "ditch", "drain")
_RAILS = ("rail", "light_rail", "subway", "narrow_gauge", "monorail")  # trams share the street
_BESIDE_RAILS = 1.5  # [m] from the middle of rails or of a stream, a track's half width and more
_GREEN = {"landuse": ("grass", "meadow"), "leisure": ("park", "garden"), "natural": ("scrub",)}


@dataclass(eq=False)
class DistrictGround:
    """A district without furniture; polygons in [m], x east, y north of the lower left corner."""

    box: Rect
    streets: list[Street]
    walks: list[Walk]  # crossings too
    plazas: shapely.Geometry  # areas for people
    roads: shapely.Geometry  # carriageways without what is for people
    walkable: shapely.Geometry  # without what is solid and crossings with raised kerbs
    green: shapely.Geometry
    # buildings and barriers: kind of the obstacle, ground [m], height [m]
    built: list[tuple[str, shapely.Geometry, float]] = field(default_factory=list)

    @cached_property
    def solid(self) -> list[Obstacle]:
        """What is built, in convex pieces."""
        return [
            Obstacle(kind, piece, height)
            for kind, shape, height in self.built
            for piece in convex_pieces(shape)
        ]


def lay_ground(extract: Extract, rng: np.random.Generator) -> DistrictGround:
    """Make the ground of what an extract says and the rules fill in.

    Raises:
        InputError: no sidewalk, footway, area for people or street tagged with a sidewalk is there.
    """
    streets, walks = streets_of(extract), drawn_walks(extract)
    plazas = _union([area.geometry for area in extract.areas if _is_plaza(area)])
    beside = [walk.line for walk in walks if walk.kind not in ("crossing", "service")]
    sides = side_walks(streets, shapely.union_all([*beside, plazas]), rng)
    sides, medians = without_medians(sides, streets)
    sides += around_bends(streets, sides)
    if not beside and plazas.is_empty and not any(walk.source == "tag" for walk in sides):
        raise InputError(_NO_WAY)
    ways = [*(walk for walk in walks if walk.kind != "crossing"), *sides]
    walks += more_crossings(extract, streets, walks, sides)
    box = shapely.box(extract.box.x0, extract.box.y0, extract.box.x1, extract.box.y1)
    carriageways = _union([*(street.polygon for street in streets), *street_areas(extract)])
    level = [walk.polygon.buffer(0.01) for walk in walks if not walk.has_step]
    raised = _union([walk.polygon for walk in walks if walk.has_step])
    drawn = _union([plazas, *level, shapely.difference(raised, carriageways)])
    buildings = _buildings(extract, box)
    barriers = _barriers(extract, box, drawn)
    solid = [shape for _, shape, _ in [*buildings, *barriers]]
    built = _union(solid)
    shared = alleys(streets, ways, medians, solid)
    sides_ground = shapely.difference(_union([walk.polygon for walk in sides]), carriageways)
    passed = shapely.union_all([*level, sides_ground, carriageways])
    built = shapely.union(built, shapely.difference(_steps(extract), passed))
    tagged = _union([walk.polygon for walk in sides if walk.source == "tag"])
    people = _union([drawn, sides_ground, *(walk.polygon for walk in shared)])
    walkable = shapely.intersection(shapely.difference(people, built), box)
    motorways = [street.polygon for street in streets if is_for_cars_only(street.tags)]
    closed = [built, shapely.intersection(raised, carriageways), *motorways]
    closed = _union([*closed, *_water_and_rails(extract)])
    links = links_between(walkable, closed, carriageways)
    people = shapely.union_all([people, *(link.polygon for link in links)])
    walks += sides + shared + links
    walkable = shapely.intersection(shapely.difference(people, built), box)
    mapped = shapely.union(drawn, shapely.intersection(sides_ground, tagged))
    walkable = _joined_or_mapped(_polygons(walkable).simplify(_SIMPLER), mapped)
    if walkable.is_empty:
        raise InputError(_NO_WAY)
    roads = shapely.intersection(shapely.difference(carriageways, people), box)
    green = _union([area.geometry for area in extract.areas if _is_green(area)])
    green = shapely.intersection(green, box)
    return DistrictGround(
        extract.box,
        streets,
        walks,
        shapely.intersection(plazas, box),
        _polygons(roads).simplify(_SIMPLER),
        walkable,
        _polygons(shapely.difference(green, shapely.union(people, carriageways))),
        [*buildings, *barriers],
    )


def _union(shapes: list[shapely.Geometry]) -> shapely.Geometry:
    return shapely.union_all([shape for shape in shapes if not shape.is_empty], grid_size=0.001)


def _polygons(shape: shapely.Geometry) -> shapely.Geometry:
    """The polygons of a geometry, without slivers."""
    parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon"]
    return shapely.MultiPolygon([part for part in parts if part.area > _LEAST_AREA])


def _joined_or_mapped(walkable: shapely.Geometry, mapped: shapely.Geometry) -> shapely.Geometry:
    """The walkable ground without small parts that only the rules put there and nothing joins."""
    parts = shapely.get_parts(walkable)
    small = _SMALL_SHARE * float(shapely.area(parts).max(initial=0.0))
    shapely.prepare(mapped)
    return shapely.MultiPolygon(
        [part for part in parts if part.area >= small or shapely.intersects(mapped, part)]
    )


def _is_plaza(area: MappedThing) -> bool:
    kinds = area.tags.get("highway"), area.tags.get("area:highway")
    return bool(set(kinds) & set(_PLAZAS)) and is_open(area.tags)


def _is_green(area: MappedThing) -> bool:
    return any(area.tags.get(key) in values for key, values in _GREEN.items())


def _water_and_rails(extract: Extract) -> list[shapely.Geometry]:
    """What nobody walks over where no way is mapped; a bridge is one."""
    areas = [area.geometry for area in extract.areas if _is_water(area.tags)]
    lines = [
        line.geometry.buffer(_BESIDE_RAILS)
        for line in extract.lines
        if line.tags.get("waterway") in _WATERWAYS or line.tags.get("railway") in _RAILS
    ]
    return [*areas, *lines]


def _is_water(tags: dict[str, str]) -> bool:
    is_bank = tags.get("waterway") in ("riverbank", "dock")
    return (
        is_bank or tags.get("natural") == "water" or tags.get("landuse") in ("basin", "reservoir")
    )


def _steps(extract: Extract) -> shapely.Geometry:
    """Stairs: no wheel gets over them. Mappers begin them in the middle of the way below."""
    half = 0.5 * RULES.walk_widths["steps"]
    stairs = [way.geometry for way in extract.lines if walk_kind(way.tags) == "steps"]
    return _union([line.buffer(half, cap_style="flat") for line in stairs])


def _buildings(
    extract: Extract, box: shapely.Geometry
) -> list[tuple[str, shapely.Geometry, float]]:
    """Kind, footprint [m] and height [m]; passages and covered ways lead through."""
    passages = []
    for way in extract.lines:
        is_passage = way.tags.get("tunnel") == "building_passage"
        is_covered = way.tags.get("covered") in _COVERED
        if (is_passage or is_covered) and "highway" in way.tags:
            passages.append(way.geometry.buffer(0.5 * _passage_width(way.tags)))
    through = _union(passages)
    found = []
    for area in extract.areas:
        if area.tags.get("building", "no") in ("no", "roof", "carport") or _is_aloft(area.tags):
            continue
        shape = shapely.difference(shapely.intersection(area.geometry, box), through)
        found.append(("building_glass", _polygons(shape).simplify(_SIMPLER), _height(area.tags)))
    return found


def _is_aloft(tags: dict[str, str]) -> bool:
    """Whether a building leaves the ground free, as one that bridges a way."""
    lowest = tagged_height(tags, "min_height")
    level = tags.get("building:min_level", "")
    return (lowest is not None and lowest > _HEADROOM) or (level.isdecimal() and int(level) >= 1)


def _passage_width(tags: dict[str, str]) -> float:
    if tags["highway"] in RULES.carriageways:
        return carriageway_width(tags)
    kind = walk_kind(tags)
    if not kind:
        return RULES.walk_widths["footway"]
    return walk_width(tags, kind)[0]


def _height(tags: dict[str, str]) -> float:
    tagged = tagged_height(tags)
    levels = tags.get("building:levels", "")
    if tagged is not None:
        return tagged
    if levels.isdecimal() and 1 <= int(levels) <= 100:
        return int(levels) * RULES.building["storey"]
    return RULES.building["height"]


def _barriers(
    extract: Extract, box: shapely.Geometry, ways: shapely.Geometry
) -> list[tuple[str, shapely.Geometry, float]]:
    """Fences, walls and hedges: kind, ground [m], height [m]; a drawn way leads through."""
    found = []
    shapely.prepare(ways)
    for thing in extract.lines:
        entry = RULES.barriers.get(thing.tags.get("barrier", ""))
        if entry is None:
            continue
        kind, thickness, height = entry
        tagged = tagged_height(thing.tags)
        if tagged is not None:
            height = tagged
        line = shapely.intersection(thing.geometry, box)
        if shapely.intersects(ways, line):
            line = shapely.difference(line, ways)
        shape = line.buffer(0.5 * thickness, cap_style="flat", join_style="mitre")
        found.append((kind, _polygons(shape), height))
    return found


def convex_pieces(shape: shapely.Geometry) -> list[FloatArray]:
    """Convex counter-clockwise polygons (N, 2) [m] that cover an area."""
    pieces: list[FloatArray] = []
    for polygon in shapely.get_parts(shape):
        parts = [polygon]
        if polygon.convex_hull.area - polygon.area > 1e-3:
            parts = shapely.get_parts(shapely.constrained_delaunay_triangles(polygon)).tolist()
        for part in parts:
            ring = shapely.orient_polygons(part).exterior
            corners = np.round(shapely.get_coordinates(ring)[:-1], 3)
            if part.area > 1e-3 and shapely.Polygon(corners).is_valid:
                pieces.append(corners)
    return pieces
