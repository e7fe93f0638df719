"""``navbench map``: make or import a sidewalk world, or show any map."""

import dataclasses
import sys
from collections.abc import Mapping
from pathlib import Path

import click

from harness.report.blocks import Table, declared
from harness.report.tables import print_blocks, report_console
from navbench.api import maps
from navbench.api.maps import LENGTH_PERCENTILES, PUBLISHED_MEAN_LENGTHS, Row
from navbench.cli.options import JSON
from navbench.cli.streams import print_json
from navbench.cli.street.osm import OUT, losses, osm, routes, tiles

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
NAME = click.option(
    "--name", required=True, help="The map's name: NAME.yaml and the files beside it."
)


@click.group()
def map() -> None:
    """Make a sidewalk world, import one, or show any map beside what is known of the paper's.

    \b
    Examples:
      navbench map new --seed 7 --name my_town --out my_maps
      navbench map import --mesh mesh.yaml --geometry geometry.yaml --name my_town --out my_maps
      navbench map osm map.osm --bbox 24.9,60.1,24.9036,60.1018 --out my_maps
      navbench map show my_maps/my_town.yaml --out town.png
      navbench map show sidewalk --view navmesh --out mesh.png --json
    """


@map.command(
    "new", help="Generate a sidewalk world like the paper's and save it as a map; print its path."
)
@click.option(
    "--seed", type=int, default=0, show_default=True, help="Same seed, same world; 0 or more."
)
@NAME
@OUT
def new(seed: int, name: str, out: Path) -> None:
    """Generate a world and say which map it is."""
    sys.stdout.write(f"{maps.make_map(name, seed, out)}\n")


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
@NAME
@OUT
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
    """Import a place and say which map it is."""
    made = maps.import_map(name, mesh, geometry, out, curb=curb, margin=margin)
    sys.stdout.write(f"{made}\n")


map.add_command(osm)
map.add_command(tiles)
map.add_command(routes)
map.add_command(losses)


@map.command(
    "show",
    help="Measure MAP, a built-in map or a map_server YAML file; draw it.",
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
@click.option(
    "--paper", "beside_paper", is_flag=True, help="Show the measures of the paper's map beside."
)
@JSON
def show(
    map_name: str,
    out: Path | None,
    view: str,
    samples: int,
    seed: int,
    beside_paper: bool,
    as_json: bool,
) -> None:
    """Measure a map, draw missions on it and, where a file is given, its picture."""
    measured = maps.measure_map(map_name, samples=samples, seed=seed, picture=out, view=view)
    if as_json:
        print_json(measured)
        return
    console = report_console()
    tables = [_measures_sheet(measured), _missions_sheet(measured)]
    missions = tables[1]
    if not beside_paper:
        tables = [without_last_column(table) for table in tables]
    print_blocks(tables, console)
    if not missions.rows:
        console.print("No room for missions")
    if out is not None:
        console.print(f"picture: {out}", soft_wrap=True)


def without_last_column(table: Table) -> Table:
    """A table without the column of the paper's map."""
    rows = [row[:-1] for row in table.rows]
    return dataclasses.replace(table, headers=table.headers[:-1], rows=rows)


def _measures_sheet(measured: Row) -> Table:
    rows: list[tuple[str, str, str]] = []
    for label, key, form in MEASURES:
        ours, theirs = measured["measured"][key], measured["published"][key]
        if isinstance(ours, Mapping):
            first, second = (
                ", ".join(_number(each[p], form) for p in ours) for each in (ours, theirs)
            )
            rows.append((f"{label}s {', '.join(ours)}", first, second))
        else:
            rows.append((label, _number(ours, form), _number(theirs, form)))
    width, depth = measured["size_m"]
    return declared("map", rows, map_name=measured["map"], width=width, depth=depth)


def _missions_sheet(measured: Row) -> Table:
    rows, n = [], 0
    for sampling, drawn in measured["missions"].items():
        if drawn:
            mean = drawn["mean_shortest_path_m"]
            n = mean["n"]
            percentiles = [f"{value:.0f}" for value in drawn["shortest_paths_m"].values()]
            interval = f"{mean['low']:.0f}-{mean['high']:.0f}"
            published = f"{PUBLISHED_MEAN_LENGTHS[sampling]:.0f}"
            rows.append((sampling, f"{mean['value']:.0f}", interval, *percentiles, published))
    shares = (f"{percent} %" for percent in LENGTH_PERCENTILES)
    headers = ("Missions", "Mean", "95 % interval", *shares, "The paper's mean")
    return Table(f"Shortest path of {n} missions [m]", headers, rows)


def _number(value: float | None, form: str) -> str:
    return "-" if value is None else format(value, form)
