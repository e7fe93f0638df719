"""Maps: made, imported, measured and drawn."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from harness.report.map_picture import VIEWS, draw_map
from harness.statistics.bootstrap import bootstrap_mean
from harness.storage.files import arriving_together, require_folder, require_no_input
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
from navbench.api.progress import say
from navstack.costmap.map_io import load_map
from navstack.costmap.occupancy_grid import FREE
from navstack.errors import InputError, MapError, UnknownNameError

BLOCKED = 0.1  # [m2] of a mesh within solid things from which on that is told
LENGTH_PERCENTILES = (5, 10, 25, 50, 75, 90, 95)
# [m] of shortest paths on the paper's map
PUBLISHED_MEAN_LENGTHS = {"published": 102.0, "uniform": 129.0}

Row = dict[str, Any]


def make_map(name: str, seed: int = 0, out: Path = Path()) -> Path:
    """Generate a sidewalk world like the paper's and save it as a map.

    Args:
        name: the map's: ``NAME.yaml`` and the files beside it.
        seed: same seed, same world; 0 or more.
        out: folder.

    Returns:
        The map's YAML file.

    Raises:
        InputError: the seed is negative, the name is no map's name, such a map is there already, or
            the folder cannot be written.
        MapError: a file of it cannot be written.
    """
    if seed < 0:
        raise InputError(f"--seed {seed} is out of range; give 0 or more")
    _require_new(name, out)
    with arriving_together(out, name) as made:
        write(seed, made, name)
    return out / f"{name}.yaml"


def import_map(
    name: str,
    mesh: Path,
    geometry: Path,
    out: Path = Path(),
    *,
    curb: float = 0.12,
    margin: float = 0.3,
) -> Path:
    """Make a map of two map_server maps of one place, with roads and curbs.

    Args:
        name: the map's.
        mesh: YAML file: free where people walk.
        geometry: YAML file: occupied where walls are.
        out: folder.
        curb: height [m] of curbs; 0: level ground.
        margin: pavement [m] beyond the mesh.

    Returns:
        The map's YAML file.

    Raises:
        InputError: the name is no map's name, such a map is there already, or the folder cannot be
            written.
        MapError: a map or a number cannot be used, or a file cannot be written.
    """
    _require_new(name, out)
    settings = ImportSettings(curb_height=curb, margin=margin)
    scene = import_scene(name, load_map(mesh), load_map(geometry), settings)
    with arriving_together(out, name) as made:
        save_scene(scene, made, name)
    blocked = (scene.navigation_mesh.data == FREE) & (scene.walkable.data != FREE)
    area = float(blocked.sum()) * scene.navigation_mesh.resolution**2
    if area >= BLOCKED:
        say(
            f"note: {area:.1f} m2 of the mesh are solid in the geometry; missions may begin and "
            "end in there"
        )
    return out / f"{name}.yaml"


def _require_new(name: str, out: Path) -> None:
    """Check that a map of this name can be made in a folder."""
    check_map_name(name)
    names = made_of(name)
    there = next((file for file in sorted(out.glob(f"{name}*")) if file.stem in names), None)
    if there is not None:
        raise InputError(f"{there} exists already; give another --name or --out")
    require_folder(out)


def measure_map(
    map: str,  # noqa: A002 - as the option is called
    *,
    samples: int = 200,
    seed: int = 0,
    picture: Path | None = None,
    view: str = "zones",
) -> Row:
    """A map's measures, the paper's, and lengths of shortest paths of missions drawn on it.

    Args:
        map: a built-in map or a map_server YAML file.
        samples: missions of each kind.
        seed: of those missions.
        picture: file to draw the map in (PNG, PDF or SVG); None: none.
        view: what the picture shows: zones, navmesh or keepout.

    Returns:
        What ``navbench map show --json`` prints.

    Raises:
        InputError: a number out of range, an unknown map or view, or the picture is a file of the
            map.
        MapError: the map cannot be used, or the picture cannot be written.
    """
    if view not in VIEWS:
        raise UnknownNameError("--view", view, VIEWS)
    if samples < 2 or seed < 0:
        raise InputError(
            f"--samples {samples} --seed {seed} are out of range; "
            "give at least 2 samples and a seed from 0"
        )
    scene = load_scene(map)
    if picture is not None:
        require_no_input("--out", picture, map_files(map))
        draw_map(scene, picture, view=view)
    grid = scene.geometry
    published = _measures(PUBLISHED, PUBLISHED_EDGES)
    return {
        "schema": 1,
        "map": scene.name,
        "size_m": [round(cells * grid.resolution, 6) for cells in (grid.width, grid.height)],
        "resolution_m": grid.resolution,
        "measured": _measures(measure(scene), measure_edges(scene)),
        "published": published | {"mean_shortest_path_m": PUBLISHED_MEAN_LENGTHS},
        "missions": {sampling: _lengths(scene, sampling, samples, seed) for sampling in SAMPLINGS},
    }


def _measures(world: MapStatistics, edges: EdgeStatistics | None) -> Row:
    found: Row = {
        "walkable_area_m2": world.walkable_area,
        "connected_parts": world.connected_parts,
        "widths_m": _by_percentile(WIDTH_PERCENTILES, world.widths),
        "furniture_pieces": world.pieces,
        "furniture_medium_share": world.medium_share if world.pieces else None,
        "furniture_spacings_m": _by_percentile(SPACING_PERCENTILES, world.spacings),
    }
    if edges is None:
        shares: Row = {"edges_open_half_metre_share": None, "edges_open_metre_share": None}
        return found | shares | {"edge_gaps_m": _by_percentile(GAP_PERCENTILES, ())}
    return found | {
        "edges_open_half_metre_share": edges.open_half_metre,
        "edges_open_metre_share": edges.open_metre,
        "edge_gaps_m": _by_percentile(GAP_PERCENTILES, edges.gaps),
    }


def _by_percentile(at: Sequence[int], values: Sequence[float]) -> dict[str, float | None]:
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
        "shortest_paths_m": _by_percentile(LENGTH_PERCENTILES, percentiles),
        "seed": seed,
    }
