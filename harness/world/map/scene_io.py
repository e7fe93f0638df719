"""Scenes on disk: three map_server maps and the typed objects as GeoJSON.

``NAME.yaml`` + ``NAME.png``: the geometry, a map that Nav2's map_server reads.
``NAME_walkable.yaml`` + ``NAME_walkable.png``: where feet and wheels may be, up to curb and wall,
in the same frame. ``NAME_navmesh.yaml`` + ``NAME_navmesh.png``: the navigation mesh, drawn within
the walkable ground, in the same frame. ``NAME.geojson``: obstacles and zones, coordinates in metres
in the map frame. Only the first is needed: a user's own map becomes a scene with obstacles raised
from its occupied cells, its free cells are walkable, and without a mesh the walkable ground is the
mesh.
"""

import contextlib
import os
from pathlib import Path

import numpy as np

from harness.storage import shipped as resources
from harness.world.map.extrude import extrude
from harness.world.map.geojson import load_objects, objects_text
from harness.world.map.scene import Scene
from navstack.costmap.field_cache import cached_array, content_key
from navstack.costmap.map_image import MAX_BYTES
from navstack.costmap.map_io import load_map, load_metadata, save_map
from navstack.costmap.occupancy_grid import (
    FREE,
    OCCUPIED,
    SOLID_FROM,
    OccupancyGrid,
    align,
)
from navstack.errors import InputError, MapError, UnknownNameError
from navstack.files import check_regular

FREE_BELOW = 20  # [%] occupancy below which it is walkable (map_server's free_thresh)
MOST_READ = 4096  # characters of a file in which a map names its image
_WALKABLE, _MESH = "_walkable", "_navmesh"
# endings of files beside a map
_PARTS = (_WALKABLE, _MESH, resources.ROUTE_GRAPH.removesuffix(".geojson"))
_PATTERNS = "*?[]"  # what a search for a map's files would take for a pattern


def map_names() -> list[str]:
    """The maps that come with the program."""
    return [
        name
        for name in resources.names(resources.shipped("maps"))
        if not name.endswith((_WALKABLE, _MESH))
    ]


def made_of(name: str) -> tuple[str, ...]:
    """The stems of the files of a map of our own."""
    return (name, f"{name}{_WALKABLE}", f"{name}{_MESH}")


def check_map_name(name: str) -> None:
    """Check a name for a new map.

    Raises:
        InputError: it is no plain file name, or has an ending that stands for a part of another
            map.
    """
    if (
        not name
        or Path(name).name != name
        or name.startswith(".")
        or name.endswith((*_PARTS, ".yaml"))
        or not name.isprintable()
        or any(sign in name for sign in _PATTERNS)
    ):
        raise InputError(
            f"map name '{name}' cannot be used; give a plain file name without folder, suffix and "
            f"{_PATTERNS}, which does not end with {', '.join(_PARTS)}"
        )


def load_scene(name_or_path: str | Path, with_mesh: bool = True) -> Scene:
    """Read a shipped map by its name, or any map_server YAML file by its path.

    Args:
        name_or_path: of the map.
        with_mesh: read the navigation mesh, too; False: it is made anew if it is asked for.

    Raises:
        UnknownNameError: no shipped map has this name.
        MapError: a file is missing, too large or cannot be used.
    """
    path = _resolve(str(name_or_path))
    geometry = align(_load_grid(path))
    given_ground = _load_companion(path, _WALKABLE, geometry)
    walkable = given_ground or _free_part(geometry)
    mesh = None
    if with_mesh:
        mesh = _load_companion(path, _MESH, geometry)
    objects_path = path.with_suffix(".geojson")
    credit = ""
    if objects_path.exists():
        obstacles, zones, credit = load_objects(objects_path)
    else:
        obstacles, zones = extrude(geometry, geometry.data >= SOLID_FROM), ()
    return Scene(
        path.stem,
        obstacles,
        zones,
        geometry,
        walkable,
        mesh,
        credit,
        is_ground_given=given_ground is not None,
    )


def map_files(name_or_path: str | Path) -> list[Path]:
    """The files of which :func:`load_scene` makes a map, those that there are.

    Raises:
        UnknownNameError: no shipped map has this name.
        MapError: a YAML file cannot be used.
    """
    path = _resolve(str(name_or_path))
    possible = (path, _beside(path, _WALKABLE), _beside(path, _MESH))
    maps = [each for each in possible if each.exists()]
    return [*maps, *(load_metadata(each).image for each in maps), path.with_suffix(".geojson")]


def walkable_beside(path: Path) -> Path | None:
    """The map of the walkable ground beside a map_server YAML file; None: there is none."""
    companion = _beside(path, _WALKABLE)
    return companion if companion.exists() else None


def mesh_beside(path: Path) -> Path:
    """The map of the navigation mesh beside a map_server YAML file, if there is one."""
    return _beside(path, _MESH)


def save_scene(scene: Scene, folder: Path, name: str) -> None:
    """Write a scene's files into a folder.

    Raises:
        MapError: the folder cannot be written.
    """
    path = Path(folder) / f"{name}.yaml"
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.with_suffix(".geojson").write_text(objects_text(scene), encoding="utf-8")
    except OSError as error:
        raise MapError(f"map folder {folder}: cannot be written ({error.strerror})") from None
    save_map(scene.geometry, path)
    save_map(scene.walkable, path.with_name(f"{name}{_WALKABLE}.yaml"))
    if scene.drawn_mesh is not None:
        save_map(scene.drawn_mesh, path.with_name(f"{name}{_MESH}.yaml"))


def _load_grid(path: Path) -> OccupancyGrid:
    """A map_server map.

    Its cells are kept in the cache, because decoding a large image takes longer than reading it.

    Raises:
        MapError: the map cannot be used.
    """
    metadata = load_metadata(path)
    try:
        check_regular(metadata.image, MAX_BYTES)
        content = path.read_bytes() + metadata.image.read_bytes()
    except OSError:
        return load_map(path)  # which says what is wrong
    key = content_key("map cells 2", np.frombuffer(content, dtype=np.uint8))
    return OccupancyGrid(
        cached_array(key, lambda: load_map(path).data), metadata.resolution, metadata.origin
    )


def _load_companion(path: Path, suffix: str, geometry: OccupancyGrid) -> OccupancyGrid | None:
    """The map beside another one whose name has a suffix more; None: there is none."""
    companion = _beside(path, suffix)
    if not companion.exists():
        return None
    grid = align(_load_grid(companion))
    if (grid.data.shape, grid.resolution, grid.origin) != (
        geometry.data.shape,
        geometry.resolution,
        geometry.origin,
    ):
        raise other_cells(companion, path)
    return grid


def other_cells(companion: Path, path: Path) -> MapError:
    """What is said where a map beside another one has other cells."""
    return MapError(
        f"map {companion}: its size, resolution or origin differs from {path.name}'s; all must be "
        "equal"
    )


def _beside(path: Path, suffix: str) -> Path:
    return path.with_name(f"{path.stem}{suffix}.yaml")


def _free_part(geometry: OccupancyGrid) -> OccupancyGrid:
    """The walkable ground of a map of which nothing more is known."""
    is_free = (geometry.data >= FREE) & (geometry.data < FREE_BELOW)
    cells = np.where(is_free, np.int8(FREE), np.int8(OCCUPIED))
    return OccupancyGrid(cells, geometry.resolution, geometry.origin)


def _no_map(folder: Path) -> str:
    """What a map is, and which files of a folder may be one."""
    found = sorted(path for path in folder.glob("*.yaml") if path.is_file())  # no pipe
    files = [path for path in found if "image:" in _head(path)]
    advice = "give the YAML file that map_server's map_saver wrote beside its image"
    if files:
        advice = f"give its file {files[0]}"
    return (
        f"map '{folder}' is a folder; {advice}, or a name: {', '.join(map_names())} "
        "(navbench map osm makes a district)"
    )


def _head(file: Path) -> str:
    """The beginning of a file; empty where it cannot be read."""
    with contextlib.suppress(OSError), file.open(encoding="utf-8", errors="replace") as opened:
        return opened.read(MOST_READ)
    return ""


def _resolve(name_or_path: str) -> Path:
    given = Path(name_or_path)
    if name_or_path not in map_names() and os.path.isdir(given):
        raise MapError(_no_map(given))
    if given.suffix in (".yaml", ".yml") or len(given.parts) > 1:
        return given
    if name_or_path not in map_names():
        if os.path.isfile(given):
            raise MapError(
                f"map '{name_or_path}' has no suffix .yaml; give the map_server file that names "
                "the image, or a name of a built-in map"
            )
        raise UnknownNameError("map", name_or_path, map_names())
    return resources.shipped("maps") / f"{name_or_path}.yaml"
