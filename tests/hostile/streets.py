"""Streets, routes over them, and what a user brings of a robot: files that cannot be used."""

import copy
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from .bags import chunk, connection, head, message
from .case import Case, Make, pipe, put

BOX = "24.9,60.1,24.9036,60.1018"
TOWN = """<osm version="0.6">
<node id="1" version="1" lon="24.9" lat="60.1009"/>
<node id="2" version="1" lon="24.9036" lat="60.1009"/>
<way id="1" version="1"><nd ref="1"/><nd ref="2"/><tag k="highway" v="footway"/></way>
</osm>
"""
GRAPH: dict[str, Any] = {
    "type": "FeatureCollection",
    "features": [
        {
            "properties": {"id": number, "frame": "map"},
            "geometry": {"type": "Point", "coordinates": [100.0 * number, 0.0]},
        }
        for number in range(2)
    ]
    + [
        {
            "properties": {"id": 2, "startid": 0, "endid": 1, "metadata": {"width": 2.0}},
            "geometry": {"type": "MultiLineString", "coordinates": []},
        }
    ],
}
URDF = (
    '<robot name="cart"><link name="base_link">'
    '<inertial><mass value="30"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
    '</inertial><collision><geometry><box size="0.6 0.4 0.2"/></geometry></collision></link>'
    '<link name="laser"/><joint name="s" type="fixed"><parent link="base_link"/>'
    '<child link="laser"/><origin xyz="0.1 0 0.3" rpy="0 0 0"/></joint></robot>'
)

# what is wrong with streets: text and another, what must be said
STREETS = {
    "a coordinate with blanks": ('lat="60.1009"', 'lat=" 5 "', "coordinate"),
    "a coordinate that is infinite": ('lon="24.9036"', 'lon="-inf"', "coordinate"),
    "a street across half the earth": ('lon="24.9036"', 'lon="1e400"', "m apart"),
    "a street of 3000 corners": (
        '<nd ref="2"/>',
        '<nd ref="2"/><nd ref="1"/>' * 1500,
        "nodes; at most",
    ),
}
Change = Callable[[dict[str, Any]], object]
# what is wrong with a graph: its change, what must be said
GRAPHS: dict[str, tuple[Change, str]] = {
    "all places are one": (lambda g: _point(g, 1).update(coordinates=[0.0, 0.0]), "two places"),
    "two points have one id": (lambda g: _told(g, 1).update(id=0), "id 0"),
    "an edge leads nowhere": (lambda g: _told(g, 2).update(endid=7), "endid 7"),
    "an id is a text": (lambda g: _told(g, 0).update(id="0"), "feature 0: id"),
    "metadata are a list": (lambda g: _told(g, 2).update(metadata=[1]), "metadata"),
    "a width is negative": (lambda g: _told(g, 2).update(metadata={"width": -3}), "width"),
    "a width is not a number": (lambda g: _told(g, 2).update(metadata={"width": 1e999}), "width"),
    "a crossing is infinite": (lambda g: _told(g, 2).update(metadata={"crossing": 1e999}), "cross"),
    "a coordinate is missing": (lambda g: _point(g, 0).update(coordinates=[1.0]), "feature 0"),
    "a coordinate is not a number": (lambda g: _point(g, 0).update(coordinates=["x", 0]), "'x'"),
    "a coordinate is astronomic": (lambda g: _point(g, 0).update(coordinates=[1e300, 0]), "1e+300"),
    "a geometry is nothing": (lambda g: g["features"][0].update(geometry=None), "feature 0"),
    "a feature is a number": (lambda g: g["features"].append(5), "feature 3"),
    "features are a mapping": (lambda g: g.update(features={}), "features"),
}
# what is wrong with a robot's description: text and another, what must be said
ROBOTS = {
    "a side is negative": ("0.6 0.4", "-0.6 0.4", "-0.6"),
    "a side is missing": ("0.6 0.4 0.2", "0.6 0.4", "geometry"),
    "a side is not a number": ("0.6 0.4", "nan 0.4", "nan"),
    "it is as large as a house": ("0.6 0.4", "600 0.4", "600"),
    "it has no extent": ("0.6 0.4 0.2", "0 0 0", "extent"),
    "its mass is negative": ('mass value="30"', 'mass value="-30"', "mass -30"),
    "its mass is not a number": ('mass value="30"', 'mass value="nan"', "mass nan"),
    "a link is astronomically far": ("0.1 0 0.3", "0.1 0 1e20", "origin"),
    "two links have one name": ('name="laser"/>', 'name="base_link"/>', "base_link"),
    "a link's name has a blank": ("laser", "the laser", "the laser"),
}


def _told(graph: dict[str, Any], number: int) -> Any:
    return graph["features"][number]["properties"]


def _point(graph: dict[str, Any], number: int) -> Any:
    return graph["features"][number]["geometry"]


def cases() -> Iterator[Case]:
    """All of them."""
    for title, (old, new, says) in STREETS.items():
        yield Case(f"streets: {title}", says, _osm(TOWN.replace(old, new)))
    yield Case("streets: a name of two lines", "map name", _osm(TOWN, "--name", "a\nb"))
    yield Case("streets: a name that is a pattern", "map name", _osm(TOWN, "--name", "*"))
    yield Case("streets: a name of nothing", "map name ''", _osm(TOWN, "--name", ""))
    yield Case("streets: a name of another file", "map name", _osm(TOWN, "--name", "a_graph"))
    for title, (change, says) in GRAPHS.items():
        yield Case(f"graph: {title}", says, _graph(change))
    yield Case("district: a folder without one", "is a folder", _district(lambda folder: None))
    yield Case(
        "district: a folder with a pipe",
        "is a folder",
        _district(lambda folder: pipe(folder / "town.yaml")),
    )
    yield Case("district: without its map", "no map of town", _district(_put_graph))
    yield Case("district: its image is missing", "town.png", _district(_without_image))
    yield Case("district: its image is a pipe", "town.png", _district(_with_pipe))
    for title, (old, new, says) in ROBOTS.items():
        yield Case(f"robot description: {title}", says, _urdf(URDF.replace(old, new)))
    yield Case("log: sensors without drives", "--sensors", _sensors)
    yield Case("log: two places to start", "--global starts", _localized)
    yield Case("drive: an end that is not a number", "nan", _drive("--seconds", "nan"))
    yield Case("drive: a datum beyond the pole", "95", _drive("--datum", "95", "0"))


def _osm(text: str, *more: str) -> Make:
    def make(folder: Path) -> list[str]:
        file = put(folder / "town.osm", text)
        return ["map", "osm", str(file), "--bbox", BOX, "--out", str(folder / "out"), *more]

    return make


def _graph(change: Change) -> Make:
    def make(folder: Path) -> list[str]:
        graph = copy.deepcopy(GRAPH)
        change(graph)
        return ["map", "routes", str(put(folder / "given.geojson", json.dumps(graph)))]

    return make


def _district(fill: Callable[[Path], object]) -> Make:
    def make(folder: Path) -> list[str]:
        (folder / "town").mkdir()
        fill(folder / "town")
        words = ["--stack", "parked", "--episodes", "1", "--pedestrians", "0", "--workers", "1"]
        return ["run", "--map", str(folder / "town"), *words, "--out", str(folder / "out")]

    return make


def _put_graph(town: Path) -> None:
    put(town / "town_graph.geojson", json.dumps(GRAPH))


def _without_image(town: Path) -> None:
    _put_graph(town)
    put(
        town / "town.yaml",
        "image: town.png\nresolution: 0.05\norigin: [0.0, 0.0, 0.0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n",
    )


def _with_pipe(town: Path) -> None:
    _without_image(town)
    pipe(town / "town.png")


def _log(folder: Path) -> str:
    return str(put(folder / "log.bag", head(500) + chunk(connection(0, b"/fix") + message(b"x"))))


def _urdf(text: str) -> Make:
    def make(folder: Path) -> list[str]:
        urdf = str(put(folder / "cart.urdf", text))
        return ["identify", _log(folder), "--urdf", urdf, "--out", str(folder / "robot.yaml")]

    return make


def _sensors(folder: Path) -> list[str]:
    words = ["--robot", "segway_e1", "--map", "sidewalk", "--sensors", "rtk_good"]
    return ["cost-log", _log(folder), *words]


def _localized(folder: Path) -> list[str]:
    words = ["--params", "gps_ekf", "--localizer", "amcl", "--map", "sidewalk", "--global"]
    out = ["--out", str(folder / "out.tum"), "--initial-pose", "0,0,0"]
    return ["localize", "--bag", _log(folder), *words, *out]


def _drive(*more: str) -> Make:
    return lambda folder: ["drive", "--params", "gps_ekf", *more]
