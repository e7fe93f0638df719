"""The files of a district, each with OpenStreetMap's credit."""

from pathlib import Path

from harness.storage.files import write_text
from harness.street.district import District, has_ground, scene_of, windows_of
from harness.street.osm_file import CREDIT
from harness.world.map.scene_io import made_of, save_scene


def save_maps(district: District, folder: Path, name: str) -> list[Path]:
    """Write the district as one map, or as tiles ``NAME_column_row`` of 200 m.

    Returns:
        The maps' YAML files; a tile without walkable ground has none.

    Raises:
        MapError: the folder cannot be written.
    """
    saved = []
    for suffix, window in windows_of(district.ground.box):
        if not has_ground(district, window):
            continue
        stem = f"{name}{suffix}"
        scene = scene_of(district, window, stem)
        save_scene(scene, folder, stem)
        for part in made_of(stem):
            file = folder / f"{part}.yaml"
            write_text(file, f"# {CREDIT}\n{file.read_text(encoding='utf-8')}")
        saved.append(folder / f"{stem}.yaml")
    return saved
