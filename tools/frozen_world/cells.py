"""What is driven in the published world: stacks at places, and the published map as worlds."""

import os
from dataclasses import dataclass
from pathlib import Path

import yaml

from harness.storage.files import write_text
from harness.storage.shipped import shipped
from harness.world.map.importer import ImportSettings, import_scene
from harness.world.map.scene_io import save_scene
from navstack.costmap.map_io import load_map

WORLD, SEED, EPISODES = "published_3", 8000, 400
ROOT = Path(__file__).resolve().parents[2]
KEPT = ROOT / "results" / "baseline" / WORLD
OWN_MAP = "costnav"  # the published map, imported
# [m] its curbs: 8 inches, Los Angeles' standard (Complete Streets Design Guide, E 633.4); assumed,
# and what other heights do
CURBS = {OWN_MAP: 0.20, "costnav_curb_0.15": 0.15, "costnav_curb_0.12": 0.12}
GEOMETRY = "paper-amcl-geometry"  # as paper-amcl, its map the image of the real walls
PLACES = ("sidewalk", "sidewalk_1", "sidewalk_2", *CURBS)
MAIN_PLACES = PLACES[:4]
METHODS = {  # stack -> published method that it stands for
    "paper-gps": "nav2_gps",
    "paper-gps-seen": "nav2_gps",
    "paper-amcl": "nav2_amcl",
    "paper-amcl-seen": "nav2_amcl",
    GEOMETRY: "nav2_amcl",
}
# the first is the one that margins are held against
EARNING = (
    "nav2-gps-ekf",
    "mpc-gps-ekf",
    "evasive-gps-ekf",
    "mppi-contact-gps-ekf",
    "dwb-contact-gps-ekf",
    "mppi-gps-ekf",
    "evasive-amcl-gps",
    "evasive-yielding-gps-ekf",
    "evasive-flow-gps-ekf",
    "smac-gps-ekf",
    "ompl-gps-ekf",
    "nav2-amcl-gps",
    "nav2-gps",
    "nav2-stock",
    "rpp-gps-ekf",
    "graceful-gps-ekf",
    "evasive-amcl",
    "nav2-amcl",
    "rpp-gps",
)
# [m] of the images, by the published file and by correlation with it
MESH_CORNER, GEOMETRY_CORNER = -100.875, -100.775


@dataclass(frozen=True, slots=True)
class Cell:
    """A stack at a place."""

    stack: str
    place: str


# In the order in which they are driven. The geometry image exists of the published map only.
CELLS = [
    Cell("paper-gps", OWN_MAP),
    Cell("paper-amcl", OWN_MAP),
    Cell(GEOMETRY, OWN_MAP),
    Cell("parked", OWN_MAP),
    *(Cell(stack, OWN_MAP) for stack in ("paper-gps-seen", "paper-amcl-seen")),
    *(Cell("paper-gps", place) for place in CURBS if place != OWN_MAP),
    *(
        Cell(stack, place)
        for stack in ("paper-gps", "paper-amcl", "parked", "paper-gps-seen", "paper-amcl-seen")
        for place in MAIN_PLACES[:3]
    ),
    *(Cell(stack, place) for stack in EARNING for place in MAIN_PLACES),
]


def published_map(folder: Path) -> Path | None:
    """The published map as worlds, made in ``folder``, with the stack of AMCL on its geometry.

    Returns:
        Its folder; None: no images.
    """
    images = Path(os.environ.get("NAVSTACK_DATA", "")) / "costnav"
    if not (images / "sidewalk_navmesh.png").exists():
        return None
    if not all((folder / f"{place}.yaml").exists() for place in CURBS):
        folder.mkdir(parents=True, exist_ok=True)
        mesh = _described(folder, images / "sidewalk_navmesh.png", MESH_CORNER)
        geometry = _described(folder, images / "sidewalk.png", GEOMETRY_CORNER)
        served = _described(folder / "served", images / "sidewalk.png", MESH_CORNER)
        stack = yaml.safe_load(
            (shipped("params") / "stacks" / "paper-amcl.yaml").read_text(encoding="utf-8")
        )
        write_text(
            folder / f"{GEOMETRY}.yaml", yaml.safe_dump({**stack, "localization_map": str(served)})
        )
        for place, curb in CURBS.items():
            settings = ImportSettings(curb_height=curb)
            scene = import_scene(place, load_map(mesh), load_map(geometry), settings)
            save_scene(scene, folder, place)
    return folder


def _described(folder: Path, image: Path, corner: float) -> Path:
    """A map_server file for an image."""
    folder.mkdir(parents=True, exist_ok=True)
    values = {"image": str(image), "resolution": 0.05, "origin": [corner, corner, 0.0]}
    values |= {"mode": "trinary", "negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196}
    path = folder / f"{image.stem}.yaml"
    write_text(path, yaml.safe_dump(values))
    return path
