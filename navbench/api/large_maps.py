"""Maps that are too large for one: cut once into a district, which the cache keeps."""

import hashlib
import shutil
from pathlib import Path

from harness.storage.files import locked, writing
from harness.storage.shipped import is_district, is_file
from harness.world.map.scene_io import walkable_beside
from navbench.api.progress import say
from navstack.costmap.field_cache import cache_folder
from navstack.costmap.map_image import MAX_PIXELS, MAX_WHOLE, image_size
from navstack.costmap.map_io import load_metadata
from navstack.errors import MapError


def drivable(map_name: str) -> str:
    """A map as it was given, or the district that one above 20 million cells is cut into.

    Raises:
        InputError: another program is cutting it, or the cache cannot be written.
        MapError: the map is turned, or has no way.
    """
    path = Path(map_name)
    if not is_file(map_name) or not path.is_file() or not _is_too_large(path):
        return map_name
    files = [path, load_metadata(path).image]
    ground = walkable_beside(path)
    if ground is not None:
        files += [ground, load_metadata(ground).image]
    key = hashlib.sha256(b"".join(each.read_bytes() for each in files)).hexdigest()[:16]
    district = cache_folder() / "districts" / key / path.stem
    if not is_district(str(district)):
        _cut(path, district)
    say(f"note: {map_name} is driven on in tiles: {district}")
    return str(district)


def _cut(path: Path, district: Path) -> None:
    from navbench.api.street import cut_map

    with writing(district.parent):
        district.parent.mkdir(parents=True, exist_ok=True)
        with locked(district.parent):
            shutil.rmtree(district, ignore_errors=True)  # what a killed program left
            cut_map(path, out=district)


def _is_too_large(path: Path) -> bool:
    """Whether a map has to be cut into tiles; errors are left to the reader of the whole map."""
    try:
        metadata = load_metadata(path)
        width, height = image_size(metadata.image)
    except MapError:
        return False
    if metadata.crop is not None:
        width, height = metadata.crop.width, metadata.crop.height
    return MAX_PIXELS < width * height <= MAX_WHOLE
