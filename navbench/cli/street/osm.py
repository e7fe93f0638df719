"""``navbench map osm``, ``tiles``, ``routes`` and ``losses``: districts."""

from pathlib import Path

import click

from harness.report.numbers import counted, number_text
from harness.report.street.screen import routes_blocks, street_blocks
from harness.report.tables import print_blocks, report_console
from harness.storage.texts import quoted
from navbench.api import street
from navbench.api.runs import load
from navbench.cli.options import JSON
from navbench.cli.streams import print_json
from navbench.cli.values import Numbers

MOST_SQUARES = 10  # on a screen
OUT = click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path(),
    help="Folder; default: the current one.",
)


@click.command(
    "osm", help="Make maps, a route graph and statistics of FILE, an OpenStreetMap extract."
)
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@click.option(
    "--bbox",
    type=Numbers(),
    metavar="W,S,E,N",
    help="Part to read, in degrees; default: the file's own box, else that of its nodes.",
)
@click.option("--name", help="The maps' name; default: the file's.")
@OUT
@click.option(
    "--seed",
    type=int,
    default=0,
    show_default=True,
    help="Of what is filled in where the mapping is silent.",
)
@JSON
def osm(
    file: Path,
    bbox: tuple[float, float, float, float] | None,
    name: str | None,
    out: Path,
    seed: int,
    as_json: bool,
) -> None:
    """Import streets and say what was found."""
    found = street.import_osm(file, name, out, bbox=bbox, seed=seed)
    if as_json:
        print_json(found)
        return
    print_blocks(street_blocks(found), report_console())
    click.echo(found["credit"])
    click.echo(f"next: navbench run --map {quoted(out)} --stack nav2-gps-ekf --episodes 20")


@click.command(
    "tiles", help="Cut FILE, a map_server YAML file too large for one map, and make a route graph."
)
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@click.option("--name", help="The tiles' name; default: the file's.")
@OUT
@JSON
def tiles(file: Path, name: str | None, out: Path, as_json: bool) -> None:
    """Cut a map and say what came of it."""
    found = street.cut_map(file, name, out)
    if as_json:
        print_json(found)
        return
    (width, depth), graph = found["size_m"], found["graph"]
    ways, connected = graph["length_m"] / 1000.0, 100.0 * graph["connected_share"]
    click.echo(f"{file.name}: {width:.0f} x {depth:.0f} m; {counted(len(found['maps']), 'map')}")
    click.echo(f"ways: {ways:.1f} km, {connected:.0f} % of it connected")
    click.echo(f"next: navbench run --map {quoted(out)} --stack nav2-gps-ekf --episodes 20")


@click.command(
    "routes", help="Draw missions on GRAPH, a route graph in GeoJSON, and find their routes."
)
@click.argument("graph", metavar="GRAPH", type=click.Path(path_type=Path))
@click.option("--missions", type=int, default=1000, show_default=True, help="How many are drawn.")
@click.option(
    "--distance",
    type=Numbers(),
    default="0.3,2.5",
    show_default=True,
    metavar="LEAST,MOST",
    help="Least distance as the crow flies and most length of the route [km].",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Of the missions.")
@JSON
def routes(
    graph: Path, missions: int, distance: tuple[float, float], seed: int, as_json: bool
) -> None:
    """Find routes for drawn missions and say how many there are."""
    found = street.route_missions(graph, missions=missions, distance=distance, seed=seed)
    if as_json:
        print_json(found)
        return
    print_blocks(routes_blocks(found), report_console())


@click.command("losses", help="Draw where on a district's streets RUN lost money, by 25 m squares.")
@click.argument("run", metavar="RUN[:STACK]")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("losses.png"),
    show_default=True,
    help="Picture to write (PNG, PDF or SVG).",
)
@JSON
def losses(run: str, out: Path, as_json: bool) -> None:
    """Draw the losses and name the dearest squares."""
    found = street.street_losses(load(run), out)
    if as_json:
        print_json(found)
        return
    missions = counted(found["missions"], "mission")
    click.echo(
        f"{found['stack']}: {found['lost_usd']:.2f} USD lost in {missions}, "
        f"{found['driven_km']:.2f} km"
    )
    for square in found["squares"][:MOST_SQUARES]:
        place = f"({square['x_m']:.0f}, {square['y_m']:.0f}) m"
        rate = number_text(square["lost_usd_per_m"], 3)
        click.echo(f"  {place}: {square['lost_usd']:.2f} USD, {rate} USD/m")
    click.echo(found["credit"])
    click.echo(f"picture: {out}")
