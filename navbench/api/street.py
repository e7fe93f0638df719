"""Streets of OpenStreetMap: imported as maps, and routes along them."""

from pathlib import Path
from typing import Any

import numpy as np

from harness.report.markdown import markdown_text
from harness.report.street.picture import draw_district
from harness.report.street.screen import street_page
from harness.statistics.interval import wilson_interval
from harness.storage.files import require_folder, write_text
from harness.storage.shipped import ROUTE_GRAPH
from harness.street.district import build_district
from harness.street.graph_file import load_graph, save_graph
from harness.street.osm_file import GeoBox, read_extract
from harness.street.route_graph import build_graph
from harness.street.routes import draw_mission
from harness.street.saving import save_maps
from harness.street.statistics import measure_district
from harness.world.map.scene_io import check_map_name
from navstack.errors import InputError

LENGTH_PERCENTILES = (5, 50, 95)
_WRITTEN = (".yaml", ".geojson", ".png", ".md")
Row = dict[str, Any]


def import_osm(
    file: Path,
    name: str | None = None,
    out: Path = Path(),
    *,
    bbox: tuple[float, float, float, float] | None = None,
    seed: int = 0,
) -> Row:
    """Make maps, a route graph, a picture and statistics of an OpenStreetMap extract.

    Args:
        file: a .osm.pbf, .osm, .osm.gz or .osm.bz2 file.
        name: of the maps; None: that of the file.
        out: folder.
        bbox: west, south, east and north [deg]; None: what the file's header names.
        seed: of what the rules fill in; 0 or more.

    Returns:
        What ``navbench map osm --json`` prints.

    Raises:
        InputError: the box, the name or the seed cannot be used, such a map is there already, or
            the box has no way for people.
        MapError: the file cannot be read, or the folder cannot be written.
    """
    if seed < 0:
        raise InputError(f"--seed {seed} is out of range; give 0 or more")
    geo = None
    if bbox is not None:
        geo = GeoBox(*bbox)
    if name is None:
        name = file.name.split(".")[0]
    check_map_name(name)
    if written := _written(out, name):
        raise InputError(f"{written[0]} exists already; give another --name or --out")
    require_folder(out)
    district = build_district(read_extract(file, geo), seed)
    graph = build_graph(district)
    told: Row = {"schema": 1, "file": file.name, "seed": seed}
    try:
        maps = save_maps(district, out, name)
        told["maps"] = [str(each) for each in maps]
        save_graph(graph, out / f"{name}{ROUTE_GRAPH}")
        picture = out / f"{name}_picture.png"
        draw_district(district, graph, picture)
        told |= measure_district(district, graph)
        page = markdown_text(street_page(told, picture.name))
        write_text(out / f"{name}_statistics.md", f"# {name}\n\n{page}")
    except BaseException:  # a full disk or an interrupt: half a district is none
        for each in _written(out, name):
            each.unlink()
        raise
    return told


def _written(out: Path, name: str) -> list[Path]:
    """The files of a district of this name in a folder."""
    found = [*out.glob(f"{name}.*"), *out.glob(f"{name}_*")]
    return sorted(each for each in found if each.suffix in _WRITTEN)


def route_missions(
    graph: Path, *, missions: int = 1000, distance: tuple[float, float] = (0.3, 2.5), seed: int = 0
) -> Row:
    """Draw missions on a route graph and find their routes.

    Args:
        graph: a GeoJSON file of ``import_osm`` or of Nav2's route server.
        missions: how many are drawn.
        distance: [km] least distance as the crow flies, and most length of a route.
        seed: of the missions; 0 or more.

    Returns:
        What ``navbench map routes --json`` prints.

    Raises:
        InputError: a number is out of range, or the graph is too small for such missions.
        MapError: the graph cannot be read.
    """
    low, high = distance
    if not 0.0 < low < high or missions < 1 or seed < 0:
        raise InputError(
            f"--distance {low:g},{high:g} --missions {missions} --seed {seed}: give 0 < least < "
            "most, at least 1 mission, and a seed from 0"
        )
    ways, rng = load_graph(graph), np.random.default_rng(seed)
    drawn = [draw_mission(ways, 1000.0 * low, 1000.0 * high, rng) for _ in range(missions)]
    routes = [mission.route for mission in drawn if mission.route is not None]
    lengths: list[float | None] = [None] * len(LENGTH_PERCENTILES)
    crossings = signals = None
    if routes:
        found = np.percentile([route.length for route in routes], LENGTH_PERCENTILES)
        lengths = found.round(1).tolist()
        crossings = float(np.mean([route.crossings for route in routes]))
        signals = float(np.mean([route.signals for route in routes]))
    return {
        "schema": 1,
        "graph": graph.name,
        "credit": ways.credit,
        "seed": seed,
        "distance_km": [low, high],
        "routed_share": wilson_interval(len(routes), missions).as_json(),
        "lengths_m": dict(zip(map(str, LENGTH_PERCENTILES), lengths, strict=True)),
        "crossings_mean": crossings,
        "signals_mean": signals,
        "missions": [
            {
                "start": ways.points[each.start].tolist(),
                "goal": ways.points[each.goal].tolist(),
                "length_m": None if each.route is None else round(each.route.length, 1),
            }
            for each in drawn
        ],
    }
