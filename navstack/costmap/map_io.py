"""Maps on disk: a YAML file and an image, as nav2_map_server of Jazzy has them (``map_io.cpp``).

That is Jazzy since 1.4.1 and later distributions. Before, transparent pixels of trinary maps were
averaged in, and thresholds were exclusive.
"""

import contextlib
import math
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image
from ruamel.yaml import YAML

from navstack.costmap.map_image import (
    MAX_WHOLE,
    Crop,
    MapImage,
    image_size,
    read_image,
    read_parts,
)
from navstack.costmap.occupancy_grid import FARTHEST, FREE, OCCUPIED, UNKNOWN, OccupancyGrid
from navstack.errors import MapError, ParameterError, did_you_mean
from navstack.params.strict import load_yaml
from navstack.types import Pose2D

Int8Array = npt.NDArray[np.int8]
FloatTable = npt.NDArray[np.float32]

RESOLUTIONS = (1e-4, 1e3)  # [m/cell] that make sense
MOST_FREE, LEAST_OCCUPIED = 25, 65  # occupancies that map_saver paints free and occupied

_WORDS = {
    "true": True,
    "yes": True,
    "on": True,
    "y": True,
    "false": False,
    "no": False,
    "off": False,
    "n": False,
}


@dataclass(frozen=True, slots=True)
class MapMetadata:
    """What a map's YAML file says."""

    image: Path
    resolution: float  # [m/cell]
    origin: Pose2D  # of the image's lower left corner in the map frame
    occupied_thresh: float  # occupancy of it and above is OCCUPIED
    free_thresh: float  # occupancy of it and below is FREE
    negate: bool  # True: bright is occupied
    mode: str  # 'trinary', 'scale' or 'raw'
    crop: Crop | None = None  # the part of the image that is read, which origin is that of


def load_map(yaml_path: Path | str) -> OccupancyGrid:
    """Read a map as nav2_map_server serves it; the image's first row is the grid's last.

    Raises:
        MapError: the YAML file or the image is missing, malformed, truncated or too large, or a
            value is out of range.
    """
    metadata = load_metadata(Path(yaml_path))
    image = read_image(metadata.image, metadata.crop)
    return _grid(image, metadata)


def load_squares(yaml_path: Path, side: int) -> Iterator[tuple[int, int, OccupancyGrid]]:
    """Column, row and cells of each square of ``side`` cells of a map of up to 400 million.

    Raises:
        MapError: as of :func:`load_map`.
    """
    metadata = load_metadata(yaml_path)
    whole = metadata.crop or Crop(0, 0, *image_size(metadata.image))
    if whole.width * whole.height > MAX_WHOLE:
        raise MapError(
            f"map image {metadata.image}: {whole.width} x {whole.height} pixels; allowed: 1 to "
            f"{MAX_WHOLE} pixels"
        )
    parts = [
        [left, bottom, min(side, whole.width - left), min(side, whole.height - bottom)]
        for bottom in range(0, whole.height, side)
        for left in range(0, whole.width, side)
    ]
    squares = [_cropped(metadata, part, yaml_path) for part in parts]
    crops = [Crop(whole.left + left, whole.bottom + bottom, *size) for left, bottom, *size in parts]
    images = read_parts(metadata.image, crops)
    for (left, bottom, *_), square, image in zip(parts, squares, images, strict=True):
        yield left // side, bottom // side, _grid(image, square)


def _grid(image: MapImage, metadata: MapMetadata) -> OccupancyGrid:
    cells = _MODES[metadata.mode](metadata)[image.grey[::-1]]
    if metadata.mode != "raw" and image.transparent is not None:
        cells[image.transparent[::-1]] = UNKNOWN
    return OccupancyGrid(cells, metadata.resolution, metadata.origin)


def load_metadata(path: Path) -> MapMetadata:
    """Read and check a map's YAML file; unknown keys are passed over, as nav2_map_server does.

    Raises:
        MapError: the file is missing or not YAML, a key is missing, or a value cannot be used.
    """
    try:
        content = load_yaml(path)
    except ParameterError as error:
        raise MapError(f"map {error}") from None
    if not isinstance(content, Mapping):
        raise MapError(
            f"map {path}: is not a mapping; "
            "expected image, resolution, origin, negate and two thresholds"
        )
    origin = _get(content, "origin", path)
    if not isinstance(origin, list) or len(origin) != 3:
        raise MapError(
            f"map {path}: origin {origin!r} is not a list [x, y, yaw] in metres and radians"
        )
    metadata = MapMetadata(
        image=_image_path(content, path),
        resolution=_number(_get(content, "resolution", path), "resolution", path),
        origin=Pose2D(*(_number(value, f"origin[{i}]", path) for i, value in enumerate(origin))),
        occupied_thresh=_number(_get(content, "occupied_thresh", path), "occupied_thresh", path),
        free_thresh=_number(_get(content, "free_thresh", path), "free_thresh", path),
        negate=_flag(_get(content, "negate", path), "negate", path),
        mode=str(content.get("mode", "trinary")).lower(),
    )
    _check(metadata, path)
    return _cropped(metadata, content.get("crop"), path)


def save_map(grid: OccupancyGrid, yaml_path: Path | str) -> None:
    """Write a map as nav2's map_saver does.

    The YAML file, and a PNG image of the same name beside it.

    Cells are 254 where free, 205 where unknown and 0 where occupied. Unlike map_saver's, numbers in
    the YAML keep all their digits (it keeps three).

    Raises:
        MapError: resolution or origin are out of range, or the folder cannot be written.
    """
    path = Path(yaml_path)
    metadata = MapMetadata(
        path.with_suffix(".png"), grid.resolution, grid.origin, 0.65, 0.196, False, "trinary"
    )
    _check(metadata, path)
    try:
        Image.fromarray(_paint(grid.data[::-1])).save(
            metadata.image, format="PNG", compress_type=zlib.Z_RLE
        )
        with path.open("w", encoding="utf-8") as file:
            _writer().dump(_as_yaml(metadata), file)
    except OSError as error:
        raise MapError(
            f"map {path}: cannot be written ({error.strerror or error}); check the folder"
        ) from None


def _get(content: Mapping[str, Any], key: str, path: Path) -> Any:
    if content.get(key) is None:
        given = ", ".join(str(name) for name in content)
        raise MapError(f"map {path}: key '{key}' is missing; the file has {given or 'none'}")
    return content[key]


def _image_path(content: Mapping[str, Any], path: Path) -> Path:
    name = _get(content, "image", path)
    if not isinstance(name, str) or not name:
        raise MapError(f"map {path}: image {name!r} is not a file name")
    return path.parent / name


def _cropped(metadata: MapMetadata, crop: Any, path: Path) -> MapMetadata:
    """The metadata of a part of the image; ``crop`` is this program's own key."""
    if crop is None:
        return metadata
    numbers = crop if isinstance(crop, list) else []
    is_whole = all(type(each) is int and each >= 0 for each in numbers)
    if len(numbers) != 4 or not is_whole or not all(numbers[2:]):
        raise MapError(
            f"map {path}: crop {crop!r} is not a list [left, bottom, width, height] in pixels"
        )
    part, origin = Crop(*numbers), metadata.origin
    x, y = part.left * metadata.resolution, part.bottom * metadata.resolution
    cos, sin = math.cos(origin.yaw), math.sin(origin.yaw)
    corner = Pose2D(origin.x + cos * x - sin * y, origin.y + sin * x + cos * y, origin.yaw)
    return replace(metadata, crop=part, origin=corner)


def _number(value: Any, key: str, path: Path) -> float:
    number = math.nan
    if not isinstance(value, bool):
        with contextlib.suppress(TypeError, ValueError, OverflowError):
            number = float(value)
    if not math.isfinite(number):
        raise MapError(f"map {path}: {key} {value!r} is not a finite number")
    return number


def _flag(value: Any, key: str, path: Path) -> bool:
    if isinstance(value, int):
        return bool(value)
    with contextlib.suppress(ValueError):  # quotes do not matter to nav2_map_server
        return bool(int(str(value)))
    if str(value).lower() in _WORDS:
        return _WORDS[str(value).lower()]
    raise MapError(f"map {path}: {key} {value!r} is neither 0 or 1 nor true or false")


def _check(metadata: MapMetadata, path: Path) -> None:
    low, high = RESOLUTIONS
    if metadata.resolution <= 0.0:
        raise MapError(f"map {path}: resolution {metadata.resolution} m/cell is not positive")
    if not low <= metadata.resolution <= high:
        raise MapError(
            f"map {path}: resolution {metadata.resolution} m/cell; allowed is {low:g} to {high:g}"
        )
    if max(abs(metadata.origin.x), abs(metadata.origin.y), abs(metadata.origin.yaw)) > FARTHEST:
        raise MapError(
            f"map {path}: origin {metadata.origin}; no coordinate may exceed {FARTHEST:g}"
        )
    _check_thresholds(metadata, path)
    if metadata.mode not in _MODES:
        near = did_you_mean(metadata.mode, _MODES)
        raise MapError(
            f"map {path}: unknown mode '{metadata.mode}'{near}; known: {', '.join(_MODES)}"
        )


def _check_thresholds(metadata: MapMetadata, path: Path) -> None:
    """Both are shares in their order; only ``scale`` needs room between them."""
    free, occupied = metadata.free_thresh, metadata.occupied_thresh
    if metadata.mode == "raw":
        return  # which has none
    given = f"map {path}: free_thresh {free} and occupied_thresh {occupied}"
    if not 0.0 <= free <= occupied <= 1.0:
        raise MapError(f"{given} must satisfy 0 <= free_thresh <= occupied_thresh <= 1")
    if metadata.mode == "scale" and free == occupied:
        raise MapError(f"{given} must differ in mode scale")


def _occupancies(metadata: MapMetadata) -> FloatTable:
    """The occupancy of each grey (256,), in single precision as Nav2 has it."""
    shades = np.arange(256, dtype=np.float32) / np.float32(255.0)
    if metadata.negate:
        return shades
    return np.float32(1.0) - shades


def _read_trinary(metadata: MapMetadata) -> Int8Array:
    occupancy = _occupancies(metadata)
    cells = np.full(occupancy.shape, UNKNOWN, dtype=np.int8)
    cells[occupancy >= np.float32(metadata.occupied_thresh)] = OCCUPIED
    cells[occupancy <= np.float32(metadata.free_thresh)] = FREE
    return cells


def _read_scale(metadata: MapMetadata) -> Int8Array:
    cells, span = _read_trinary(metadata), metadata.occupied_thresh - metadata.free_thresh
    above_free = _occupancies(metadata) - np.float32(metadata.free_thresh)
    between = np.floor(above_free / np.float32(span) * np.float32(100.0) + np.float32(0.5))
    return np.where(cells == UNKNOWN, between, cells).astype(np.int8)


def _read_raw(metadata: MapMetadata) -> Int8Array:
    percent = np.arange(256)  # negate has no effect on raw values
    return np.where(percent <= OCCUPIED, percent, UNKNOWN).astype(np.int8)


def _paint(cells: Int8Array) -> npt.NDArray[np.uint8]:
    pixels = np.full(cells.shape, 205, dtype=np.uint8)
    known = (cells >= 0) & (cells <= OCCUPIED)
    pixels[known & (cells >= LEAST_OCCUPIED)] = 0
    pixels[known & (cells <= MOST_FREE)] = 254
    return pixels


# mode -> the cell of each grey (256,)
_MODES: dict[str, Callable[[MapMetadata], Int8Array]] = {
    "trinary": _read_trinary,
    "scale": _read_scale,
    "raw": _read_raw,
}


def _writer() -> YAML:
    writer = YAML()
    writer.default_flow_style = None  # the origin on one line, as map_saver writes it
    return writer


def _as_yaml(metadata: MapMetadata) -> dict[str, Any]:
    return {
        "image": metadata.image.name,
        "mode": metadata.mode,
        "resolution": float(metadata.resolution),
        "origin": [float(metadata.origin.x), float(metadata.origin.y), float(metadata.origin.yaw)],
        "negate": 0,
        "occupied_thresh": float(metadata.occupied_thresh),
        "free_thresh": float(metadata.free_thresh),
    }
