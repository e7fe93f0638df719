"""Streets of OpenStreetMap: imported as maps, and routes along them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from harness.analysis.street_losses import SQUARE, in_pieces, lose
from harness.metrics.columns import LEG_COLUMNS
from harness.report.markdown import markdown_text
from harness.report.street.losses import draw_losses
from harness.report.street.picture import draw_district
from harness.report.street.screen import street_page
from harness.statistics.interval import wilson_interval
from harness.storage.files import (
    arriving_together,
    require_folder,
    require_no_input,
    write_text,
)
from harness.storage.rows import values
from harness.storage.shipped import ROUTE_GRAPH, district_files, is_district
from harness.storage.tables import read_rows
from harness.street.district import District, build_district
from harness.street.graph_file import load_graph, save_graph
from harness.street.large_map import cut, left_behind
from harness.street.osm_file import GeoBox, read_extract
from harness.street.places import with_places
from harness.street.route_graph import RouteGraph, build_graph
from harness.street.routes import draw_mission
from harness.street.saving import save_maps
from harness.street.statistics import measure_district, measure_graph
from harness.study.stored_run import leg_file, repriced
from harness.task.study import check_kilometres
from harness.world.map.scene_io import check_map_name
from harness.world.outcome import Outcome
from navbench.api.progress import count_shown, say
from navbench.api.runs import Run
from navstack.errors import InputError

LENGTH_PERCENTILES = (5, 50, 95)
_WHOLE = 0.99  # share of a box; less is told
STEPS = 6  # of an import, that progress counts
_PICTURE = "_picture.png"
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
    _require_new(out, name)
    told: Row = {"schema": 1, "file": file.name, "seed": seed}
    with count_shown("steps", STEPS) as tell:
        extract = read_extract(file, geo)
        if extract.covered < _WHOLE:
            say(
                f"note: {100.0 * (1.0 - extract.covered):.0f} % of the box lie beyond what "
                f"{file.name} says to have; nothing is mapped there"
            )
        tell()
        district = build_district(extract, seed)
        tell()
        graph = with_places(build_graph(district), extract)
        tell()
        with arriving_together(out, name) as made:
            told["maps"] = [str(out / each.name) for each in save_maps(district, made, name)]
            tell()
            told |= _drawn_and_measured(district, graph, made, name, tell)
            page = markdown_text(street_page(told, f"{name}{_PICTURE}"))
            write_text(made / f"{name}_statistics.md", f"# {name}\n\n{page}")
        tell()
    return told


def cut_map(file: Path, name: str | None = None, out: Path = Path()) -> Row:
    """Make a district, tiles and a route graph, of a map_server map of up to 400 million cells.

    Args:
        file: its YAML file.
        name: of the tiles; None: that of the file.
        out: folder.

    Returns:
        What ``navbench map tiles --json`` prints.

    Raises:
        InputError: the name cannot be used, or such a map is there already.
        MapError: the map cannot be read or has no way, or the folder cannot be written.
    """
    if name is None:
        name = file.stem
    _require_new(out, name)
    with arriving_together(out, name) as made:
        district = cut(file, made, name)
        for each in left_behind(file):
            say(f"note: {each} has no part in the tiles")
        graph = district.graph()
        save_graph(graph, made / f"{name}{ROUTE_GRAPH}")
    return {
        "schema": 1,
        "file": file.name,
        "size_m": [district.box.width, district.box.depth],
        "maps": [str(out / each.name) for each in district.files],
        "graph": measure_graph(graph),
    }


def _drawn_and_measured(
    district: District, graph: RouteGraph, out: Path, name: str, tell: Callable[[], None]
) -> Row:
    """Write route graph and picture, and return the statistics; ``tell`` hears of each step."""
    save_graph(graph, out / f"{name}{ROUTE_GRAPH}")
    draw_district(district, graph, out / f"{name}{_PICTURE}")
    tell()
    return measure_district(district, graph)


def _require_new(out: Path, name: str) -> None:
    """Check that maps of a new name can be written to a folder.

    Raises:
        InputError: the name or the folder cannot be used, or such a map is there already.
    """
    check_map_name(name)
    written = _written(out, name)
    if written:
        raise InputError(f"{written[0]} exists already; give another --name or --out")
    require_folder(out)


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
    check_kilometres(distance)
    if missions < 1 or seed < 0:
        raise InputError(
            f"--missions {missions} --seed {seed}: give at least 1 mission, and a seed from 0"
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
        "beyond_box": sum(mission.beyond for mission in drawn),
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


def street_losses(run: Run, picture: Path) -> Row:
    """Draw where on a district's streets a stack lost money.

    Args:
        run: with one stack, on a folder of ``import_osm``.
        picture: a .png, .pdf or .svg file.

    Returns:
        What ``navbench map losses --json`` prints: squares by loss, the dearest first.

    Raises:
        InputError: the run has several stacks, is not on a district, or did not simulate the cargo,
            or the picture is a file of the district.
        MapError: the district's graph cannot be read.
    """
    stored, folder = run.stored, Path(run.stored.about["map_name"])
    if len(stored.stacks) != 1:
        raise InputError(f"{run.folder} has {len(stored.stacks)} stacks; give one as FOLDER:stack")
    if not stored.has_legs:
        raise InputError(f"{run.folder} was not driven on a folder of navbench map osm")
    if not is_district(str(folder)):
        raise InputError(f"{run.folder}: its district {folder} is not here; put it there again")
    require_no_input("picture", picture, district_files(folder))
    prices = stored.prices()
    stack = repriced(stored.stacks[0], stored.events, prices)
    if not stack.rows or Outcome.ARRIVED.value in values(stack.rows, "outcome"):
        raise InputError(f"{run.folder}: no mission finished with its cargo simulated")
    graph = in_pieces(load_graph(next(folder.glob(f"*{ROUTE_GRAPH}"))))
    legs = [read_rows(leg_file(run.folder, row), LEG_COLUMNS) for row in stack.rows]
    events = [event for event in stored.events if event["stack"] == stack.name]
    found = lose(stack.rows, events, legs, graph, prices)
    draw_losses(found, graph, picture)
    dearest = sorted(found.usd.items(), key=lambda each: -each[1])
    return {
        "schema": 1,
        "stack": stack.name,
        "missions": len(stack.rows),
        "lost_usd": sum(found.usd.values()),
        "driven_km": sum(found.driven.values()) / 1000.0,
        "squares": [
            {
                "x_m": (square[0] + 0.5) * SQUARE,
                "y_m": (square[1] + 0.5) * SQUARE,
                "lost_usd": usd,
                "lost_usd_per_m": found.per_metre(square),
            }
            for square, usd in dearest
            if usd > 0.0
        ],
        "credit": graph.credit,
    }
