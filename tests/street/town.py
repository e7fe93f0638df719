"""A town of one junction, as OpenStreetMap would have it: 200 m x 200 m."""

from collections.abc import Iterable
from pathlib import Path

WEST, SOUTH = 24.9, 60.1
_METRE_X, _METRE_Y = 1.0 / 55_600.0, 1.0 / 111_410.0  # [deg] there
Point = tuple[float, float]
BOX = f"{WEST},{SOUTH},{WEST + 200 * _METRE_X},{SOUTH + 200 * _METRE_Y}"


class Town:
    """Collects nodes and ways; coordinates in metres from the lower left corner."""

    def __init__(self) -> None:
        self._elements: list[str] = []
        self._nodes: dict[Point, int] = {}
        self._tags: dict[Point, dict[str, str]] = {}
        self._ways: list[str] = []

    def node(self, point: Point, **tags: str) -> int:
        self._tags.setdefault(point, {}).update(tags)
        return self._nodes.setdefault(point, len(self._nodes) + 1)

    def way(self, *points: Point, **tags: str) -> None:
        refs = [self.node(point) for point in points]
        self._ways.append(element("way", len(self._ways) + 1, refs, **tags))

    def write(self, path: Path) -> Path:
        nodes = [
            node_element(number, *point, **self._tags[point])
            for point, number in self._nodes.items()
        ]
        body = "\n".join([*nodes, *self._ways])
        path.write_text(f'<osm version="0.6">\n{body}\n</osm>\n', encoding="utf-8")
        return path


def node_element(number: int, x: float, y: float, **tags: str) -> str:
    """A node at a place in metres from the lower left corner."""
    lon, lat = WEST + x * _METRE_X, SOUTH + y * _METRE_Y
    place = f'lon="{lon:.9f}" lat="{lat:.9f}"'
    return f'<node id="{number}" version="1" {place}>{_tags(tags)}</node>'


def element(what: str, number: int, nodes: Iterable[int], inside: str = "", **tags: str) -> str:
    """A way or a relation of nodes and of other members."""
    refs = "".join(f'<nd ref="{node}"/>' for node in nodes)
    return f'<{what} id="{number}" version="1">{refs}{inside}{_tags(tags)}</{what}>'


def _tags(tags: dict[str, str]) -> str:
    return "".join(
        f'<tag k="{key.replace("__", ":")}" v="{value}"/>' for key, value in tags.items()
    )


def small_town() -> Town:
    """Two streets that cross, one with sidewalks tagged, one that says nothing; a building."""
    town = Town()
    town.way((0, 100), (60, 100), (100, 100), (200, 100), highway="residential", sidewalk="both")
    town.way((100, 0), (100, 100), (100, 200), highway="residential", lanes="2")
    town.node((60, 100), highway="crossing", crossing="traffic_signals", kerb="raised")
    square = ((120, 120), (160, 120), (160, 160), (120, 160), (120, 120))
    town.way(*square, building="apartments", building__levels="5")
    town.node((30, 95.5), amenity="waste_basket")
    town.node((40, 106), shop="bakery")
    town.node((40, 150), barrier="bollard")
    return town
