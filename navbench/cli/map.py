"""``navbench map``: make or import a sidewalk world, or show any map beside what is known of the paper's."""

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click
import numpy as np

from harness.report.blocks import Table, declared
from harness.report.map_picture import VIEWS, draw_map
from harness.report.tables import print_blocks, report_console
from harness.statistics.bootstrap import bootstrap_mean
from harness.storage.files import require_folder
from harness.task.mission import SAMPLINGS, MissionSampler
from harness.world.map.importer import ImportSettings, import_scene
from harness.world.map.scene import Scene
from harness.world.map.scene_io import check_map_name, load_scene, made_of, map_files, save_scene
from harness.world.map.sidewalk import write
from harness.world.map.statistics import (
    GAP_PERCENTILES,
    PUBLISHED,
    PUBLISHED_EDGES,
    SPACING_PERCENTILES,
    WIDTH_PERCENTILES,
    EdgeStatistics,
    MapStatistics,
    measure,
    measure_edges,
)
from navbench.cli.options import JSON
from navbench.cli.streams import print_json
from navstack.costmap.map_io import load_map
from navstack.errors import InputError, MapError, UnknownNameError

MEASURES = (  # label, key of the document, form
    ("Navigation mesh [m2]", "walkable_area_m2", ",.0f"),
    ("  connected parts", "connected_parts", "d"),
    ("  width at the medial axis [m], percentile", "widths_m", ".2f"),
    ("Furniture of 0.05-10 m2, pieces", "furniture_pieces", "d"),
    ("  share of 0.3-1 m2", "furniture_medium_share", ".2f"),
    ("  to the nearest other piece [m], percentile", "furniture_spacings_m", ".2f"),
    (
        "Edges of the mesh: nothing for a lidar within 0.5 m, share",
        "edges_open_half_metre_share",
        ".2f",
    ),
    ("  within 1 m, share", "edges_open_metre_share", ".2f"),
    ("  the others' gap to what stands there [m], percentile", "edge_gaps_m", ".2f"),
)
LENGTH_PERCENTILES = (5, 10, 25, 50, 75, 90, 95)
# [m] of shortest paths on the paper's map
PUBLISHED_MEAN_LENGTHS = {"published": 102.0, "uniform": 129.0}

Row = dict[str, Any]


@click.group()
def map() -> None:
    """Make a sidewalk world, import one, or show any map beside what is known of the paper's.

    \b
    Examples:
      navbench map new --seed 7 --name my_town --out my_maps
      navbench map import --mesh mesh.yaml --geometry geometry.yaml --name my_town --out my_maps
      navbench map show my_maps/my_town.yaml --out town.png
      navbench map show sidewalk --view navmesh --out mesh.png --json
    """


@map.command(
    "new", help="Generate a sidewalk world like the paper's and save it as a map; print its path."
)
@click.option(
    "--seed", type=int, default=0, show_default=True, help="Same seed, same world; 0 or more."
)
@click.option("--name", required=True, help="The map's name: NAME.yaml and the files beside it.")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path(),
    help="Folder; default: the current one.",
)
def new(seed: int, name: str, out: Path) -> None:
    """Generate a world and say which map it is.

    Raises:
        InputError: the seed is negative, the name is no map's name, or such a map is there already.
        MapError: the folder cannot be written.
    """
    if seed < 0:
        raise InputError(f"--seed {seed} is out of range; give 0 or more")
    _require_new(name, out)
    write(seed, out, name)
    sys.stdout.write(f"{out / name}.yaml\n")


def _require_new(name: str, out: Path) -> None:
    """Check that a map of this name can be made in a folder, and make the folder."""
    check_map_name(name)
    there = next(
        (file for file in sorted(out.glob(f"{name}*")) if file.stem in made_of(name)), None
    )
    if there is not None:
        raise InputError(f"{there} exists already; give another --name or --out")
    require_folder(out)


@map.command(
    "import",
    help="Make a map of two map_server maps of one place, with roads and curbs; print its path.",
)
@click.option(
    "--mesh",
    type=click.Path(path_type=Path),
    required=True,
    help="YAML file: free where people walk.",
)
@click.option(
    "--geometry",
    type=click.Path(path_type=Path),
    required=True,
    help="YAML file: occupied where walls are.",
)
@click.option("--name", required=True, help="The map's name: NAME.yaml and the files beside it.")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path(),
    help="Folder; default: the current one.",
)
@click.option(
    "--curb",
    type=float,
    default=0.12,
    show_default=True,
    help="Height [m] of curbs; 0: level ground.",
)
@click.option(
    "--margin", type=float, default=0.3, show_default=True, help="Pavement [m] beyond the mesh."
)
def import_map(
    mesh: Path, geometry: Path, name: str, out: Path, curb: float, margin: float
) -> None:
    """Import a place and say which map it is.

    Raises:
        InputError: the name is no map's name, or such a map is there already.
        MapError: a map or an option cannot be used, or the folder cannot be written.
    """
    settings = ImportSettings(curb_height=curb, margin=margin)
    _require_new(name, out)
    save_scene(import_scene(name, load_map(mesh), load_map(geometry), settings), out, name)
    sys.stdout.write(f"{out / name}.yaml\n")


@map.command(
    "show",
    help="Measure MAP, a built-in map or a map_server YAML file, beside the paper's; draw it.",
)
@click.argument("map_name", metavar="MAP")
@click.option("--out", type=click.Path(path_type=Path), help="Picture to write (PNG, PDF or SVG).")
@click.option(
    "--view",
    default="zones",
    show_default=True,
    help="What the picture shows: zones, navmesh or keepout.",
)
@click.option(
    "--samples",
    type=int,
    default=200,
    show_default=True,
    help="Missions drawn to measure their paths.",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Of those missions.")
@JSON
def show(
    map_name: str, out: Path | None, view: str, samples: int, seed: int, as_json: bool
) -> None:
    """Measure a map, draw missions on it and, where a file is given, its picture.

    Raises:
        InputError: an option is out of range or the map is not known.
        MapError: the map cannot be used, or the picture cannot be written.
    """
    if view not in VIEWS:
        raise UnknownNameError("--view", view, VIEWS)
    if samples < 2 or seed < 0:
        raise InputError(
            f"--samples {samples} --seed {seed} are out of range; give at least 2 samples and a seed from 0"
        )
    scene = load_scene(map_name)
    if out is not None:
        _require_no_part_of(map_name, out)
        draw_map(scene, out, view=view)
    document = map_document(scene, samples, seed)
    if as_json:
        print_json(document)
        return
    console = report_console()
    missions = _missions_sheet(document)
    print_blocks([_measures_sheet(document), missions], console)
    if not missions.rows:
        console.print("No room for missions")
    if out is not None:
        console.print(f"picture: {out}", soft_wrap=True)


def _require_no_part_of(map_name: str, out: Path) -> None:
    """Check that a picture does not take the place of a file of the map."""
    if any(out.exists() and file.exists() and out.samefile(file) for file in map_files(map_name)):
        raise InputError(f"--out '{out}' is a file of the map itself; give another name")


def map_document(scene: Scene, samples: int, seed: int) -> Row:
    """What ``--json`` prints: the map's measures, the paper's, and path lengths of missions drawn on the map."""
    grid = scene.geometry
    return {
        "schema": 1,
        "map": scene.name,
        "size_m": [round(cells * grid.resolution, 6) for cells in (grid.width, grid.height)],
        "resolution_m": grid.resolution,
        "measured": _measures(measure(scene), measure_edges(scene)),
        "published": _measures(PUBLISHED, PUBLISHED_EDGES)
        | {"mean_shortest_path_m": PUBLISHED_MEAN_LENGTHS},
        "missions": {sampling: _lengths(scene, sampling, samples, seed) for sampling in SAMPLINGS},
    }


def _measures(world: MapStatistics, edges: EdgeStatistics | None) -> Row:
    return {
        "walkable_area_m2": world.walkable_area,
        "connected_parts": world.connected_parts,
        "widths_m": _by_percentile(WIDTH_PERCENTILES, world.widths),
        "furniture_pieces": world.pieces,
        "furniture_medium_share": world.medium_share if world.pieces else None,
        "furniture_spacings_m": _by_percentile(SPACING_PERCENTILES, world.spacings),
        "edges_open_half_metre_share": edges.open_half_metre if edges else None,
        "edges_open_metre_share": edges.open_metre if edges else None,
        "edge_gaps_m": _by_percentile(GAP_PERCENTILES, edges.gaps if edges else ()),
    }


def _by_percentile(at: tuple[int, ...], values: tuple[float, ...]) -> dict[str, float | None]:
    return {str(p): value for p, value in zip(at, values or (None,) * len(at), strict=True)}


def _lengths(scene: Scene, sampling: str, samples: int, seed: int) -> Row | None:
    """Shortest paths of missions; None where the map has no room for them."""
    rng = np.random.default_rng(seed)
    try:
        sampler = MissionSampler(scene.navigation_mesh, sampling)
        lengths = np.array([sampler.sample(rng).shortest_path for _ in range(samples)])
    except MapError:
        return None
    percentiles = np.percentile(lengths, LENGTH_PERCENTILES).tolist()
    return {
        "mean_shortest_path_m": bootstrap_mean(lengths, np.random.default_rng(seed)).as_json(),
        "shortest_paths_m": _by_percentile(LENGTH_PERCENTILES, tuple(percentiles)),
        "seed": seed,
    }


def _measures_sheet(document: Row) -> Table:
    rows: list[tuple[str, str, str]] = []
    for label, key, form in MEASURES:
        ours, theirs = document["measured"][key], document["published"][key]
        if isinstance(ours, Mapping):
            rows += [
                (f"{label} {p}", _number(value, form), _number(theirs[p], form))
                for p, value in ours.items()
            ]
        else:
            rows.append((label, _number(ours, form), _number(theirs, form)))
    width, depth = document["size_m"]
    return declared("map", rows, map_name=document["map"], width=width, depth=depth)


def _missions_sheet(document: Row) -> Table:
    rows, n = [], 0
    for sampling, drawn in document["missions"].items():
        if drawn:
            mean = drawn["mean_shortest_path_m"]
            n = mean["n"]
            percentiles = [f"{value:.0f}" for value in drawn["shortest_paths_m"].values()]
            interval, published = (
                f"{mean['low']:.0f}-{mean['high']:.0f}",
                f"{PUBLISHED_MEAN_LENGTHS[sampling]:.0f}",
            )
            rows.append((sampling, f"{mean['value']:.0f}", interval, *percentiles, published))
    headers = (
        "Missions",
        "Mean",
        "95 % interval",
        *(f"{p} %" for p in LENGTH_PERCENTILES),
        "The paper's mean",
    )
    return Table(f"Shortest path of {n} missions [m]", headers, rows)


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)
