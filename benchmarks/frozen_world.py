"""World ``published_2`` beside the published rows: drives what results/baseline lacks, prints docs/calibration.md's tables.

Usage: python benchmarks/frozen_world.py [--tables] [--workers N] [--stack NAME] [--place NAME]

Stacks drive seed 0, 400 deliveries at every place: three generated maps and the published one, if NAVSTACK_DATA
names a folder with costnav/sidewalk.png and sidewalk_navmesh.png. Nothing was fitted to them. --tables drives nothing;
--stack and --place, repeatable, drive some of the cells.
"""

import argparse
import dataclasses
import json
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import yaml
from scipy.stats import binomtest, fisher_exact

from harness.cli.driving import begin_run, resume_run
from harness.cli.signals import run_script
from harness.economics.valuation import OUTCOMES, Valuation, value
from harness.report.markdown import interval_text, table
from harness.report.published import PublishedMethod, load_published
from harness.statistics.interval import wilson_interval
from harness.statistics.paired import holm
from harness.storage.files import write_text
from harness.storage.shipped import shipped
from harness.study.places import Where
from harness.study.stored_run import load_run
from harness.task.study import make_study
from harness.world.map_import import ImportSettings, import_scene
from harness.world.scene_io import save_scene
from navstack.costmap.map_io import load_map
from navstack.errors import NavstackError

WORLD, SEED, EPISODES = "published_2", 0, 400
KEPT = Path(__file__).resolve().parents[1] / "results" / "baseline" / WORLD
OWN_MAP = "costnav"  # the published map, imported
GEOMETRY = "paper-amcl-geometry"  # as paper-amcl, its map the image of the real walls
PLACES = ("sidewalk", "sidewalk_1", "sidewalk_2", OWN_MAP)
METHODS = {  # stack -> published method that it stands for
    "paper-gps": "nav2_gps",
    "paper-gps-seen": "nav2_gps",
    "paper-amcl": "nav2_amcl",
    "paper-amcl-seen": "nav2_amcl",
    GEOMETRY: "nav2_amcl",
}
EARNING = ("nav2-gps-ekf", "mpc-gps-ekf", "evasive-gps-ekf")  # the first is the one that margins are held against
MESH_CORNER, GEOMETRY_CORNER = -100.875, -100.775  # [m] of the images, by the published file and by correlation with it
LEVEL = 0.05  # p below which equality is rejected
PROPERTY = ("mailbox_contacts", "trash_bin_contacts", "building_glass_contacts", "bollard_contacts")
PREDICTED = (  # key, name, unit, decimals, allowed ours / published; None: reported
    ("pedestrian_injury_usd_per_run", "pedestrian injury cost", "USD/run", 2, (1 / 1.5, 1.5)),
    ("avg_collision_impulse_ns", "total impulse", "N s/run", 1, (0.7, 1.3)),
    ("avg_distance_km", "distance", "km", 4, (0.75, 1.25)),
    ("avg_runtime_h", "run time", "h", 4, None),
    ("avg_velocity_mps", "speed", "m/s", 2, None),
)
NO_GATE = {("paper-amcl", "avg_distance_km")}


def p_text(p: float) -> str:
    """A p value with as many digits as matter."""
    return f"{p:.3f}" if p >= 0.001 else f"{p:.1g}"


@dataclass(frozen=True, slots=True)
class Cell:
    """A stack at a place."""

    stack: str
    place: str

    @property
    def folder(self) -> Path:
        return KEPT / self.place / self.stack


# In the order in which they are driven. The geometry image exists of the published map only.
CELLS = [
    *(Cell(stack, place) for stack in ("paper-gps", "paper-amcl") for place in PLACES),
    Cell(GEOMETRY, OWN_MAP),
    *(Cell("parked", place) for place in PLACES),
    *(Cell(stack, place) for stack in EARNING for place in PLACES),
    *(Cell(stack, place) for stack in ("paper-gps-seen", "paper-amcl-seen") for place in PLACES),
]


def published_map(folder: Path) -> Path | None:
    """The published map as a world, made in ``folder``, with the stack of AMCL on its geometry; None: no images."""
    images = Path(os.environ.get("NAVSTACK_DATA", "")) / "costnav"
    if not (images / "sidewalk_navmesh.png").exists():
        return None
    if not (folder / f"{OWN_MAP}.yaml").exists():
        folder.mkdir(parents=True, exist_ok=True)
        mesh = _described(folder, images / "sidewalk_navmesh.png", MESH_CORNER)
        geometry = _described(folder, images / "sidewalk.png", GEOMETRY_CORNER)
        served = _described(folder / "served", images / "sidewalk.png", MESH_CORNER)
        stack = yaml.safe_load((shipped("params") / "stacks" / "paper-amcl.yaml").read_text(encoding="utf-8"))
        write_text(folder / f"{GEOMETRY}.yaml", yaml.safe_dump({**stack, "localization_map": str(served)}))
        save_scene(import_scene(OWN_MAP, load_map(mesh), load_map(geometry), ImportSettings()), folder, OWN_MAP)
    return folder / f"{OWN_MAP}.yaml"


def _described(folder: Path, image: Path, corner: float) -> Path:
    """A map_server file for an image."""
    folder.mkdir(parents=True, exist_ok=True)
    values = {"image": str(image), "resolution": 0.05, "origin": [corner, corner, 0.0]}
    values |= {"mode": "trinary", "negate": 0, "occupied_thresh": 0.65, "free_thresh": 0.196}
    path = folder / f"{image.stem}.yaml"
    write_text(path, yaml.safe_dump(values))
    return path


def drive(cell: Cell, own_map: Path | None, workers: int | None) -> None:
    """Drive what a cell lacks of its deliveries; leaves the program where that does not end well."""
    folder, where = cell.folder, Where(workers=workers)
    if (folder / "summary.json").exists():
        return
    if (folder / "run.json").exists():
        status = resume_run(folder, where, as_json=False)
    else:
        stack, place = cell.stack, cell.place
        if place == OWN_MAP:
            assert own_map is not None
            stack, place = str(own_map.parent / f"{stack}.yaml") if stack == GEOMETRY else stack, str(own_map)
        study = make_study(stacks=[stack], episodes=EPISODES, seed=SEED, world=WORLD, map_name=place, workers=workers)
        status = begin_run(study, folder, where, as_json=False)
    if status:
        sys.exit(status)


def read(cell: Cell) -> tuple[list[str], Valuation]:
    """The outcomes of a cell's deliveries, and what they come to."""
    run = load_run(str(cell.folder))
    (stack,) = run.stacks
    return [row["outcome"] for row in stack.rows], value(stack.rows, stack, run.prices(), run.seed)


def verdict(p: float) -> str:
    return "**rejected**" if p < LEVEL else "not rejected"


def compared(row: Callable[[str, PublishedMethod, list[str], Valuation], list[list[str]]]) -> list[list[str]]:
    """Rows of every stack that stands for a published method."""
    published = load_published().methods
    return [line for stack, name in METHODS.items() for line in row(stack, published[name], *read(KEPT / stack))]


def shares() -> str:
    """Fisher's exact test of every outcome share, adjusted together (Holm)."""

    def tested(stack: str, method: PublishedMethod, outcomes: list[str], _: Valuation) -> list[list[str]]:
        rows = []
        for outcome in OUTCOMES:
            ours, n, share = outcomes.count(outcome), len(outcomes), getattr(method.measured, outcome)
            theirs = round(share * method.episodes)
            p_values.append(float(fisher_exact([[ours, n - ours], [theirs, method.episodes - theirs]]).pvalue))
            text = f"{interval_text(wilson_interval(ours, n), 3)} (n = {n})"
            rows.append([stack, outcome, text, f"{share:.2f} (n = {method.episodes})"])
        return rows

    p_values: list[float] = []
    rows = compared(tested)
    judged = zip(rows, p_values, holm(p_values), strict=True)
    lines = [[*row, p_text(p), p_text(adjusted), verdict(adjusted)] for row, p, adjusted in judged]
    return table(["stack", "outcome", "ours", "published", "p", "p (Holm)", ""], lines)


def predictions() -> str:
    """What the published rows tell beyond outcomes, within stated factors."""

    def predicted(stack: str, method: PublishedMethod, _: list[str], came_to: Valuation) -> list[list[str]]:
        rows = []
        for key, name, unit, decimals, gate in PREDICTED:
            ours, theirs = came_to.intervals[key], getattr(method.measured, key)
            ratio = ours.value / theirs
            allowed = None if (stack, key) in NO_GATE else gate
            said = ["--", "reported"]
            if allowed is not None:
                is_within = allowed[0] <= ratio <= allowed[1]
                said = [f"{allowed[0]:.2f} to {allowed[1]:.2f}", "within" if is_within else "**missed**"]
            texts = interval_text(ours, decimals), f"{theirs:.{decimals}f}", f"{ratio:.2f}"
            rows.append([stack, name, unit, *texts, *said])
        return rows

    return table(["stack", "quantity", "unit", "ours", "published", "ratio", "allowed", ""], compared(predicted))


def property_contacts() -> str:
    """Exact test of two Poisson rates (Przyborowski and Wilenski 1940)."""

    def counted(stack: str, method: PublishedMethod, outcomes: list[str], came_to: Valuation) -> list[list[str]]:
        n, episodes = len(outcomes), method.episodes
        ours = round(n * sum(came_to.measured[key] or 0.0 for key in PROPERTY))
        theirs = round(episodes * sum(getattr(method.measured, key) or 0.0 for key in PROPERTY))
        p = binomtest(ours, ours + theirs, n / (n + episodes)).pvalue if ours + theirs else 1.0
        return [[stack, f"{ours} in {n}", f"{theirs} in {episodes}", p_text(p), verdict(p)]]

    return table(["stack", "ours", "published", "p", ""], compared(counted))


def elsewhere() -> str:
    """The same world on other maps and with other people."""
    rows = []
    for condition in ELSEWHERE:
        for stack in STACKS:
            outcomes, came_to = read(KEPT / "elsewhere" / condition / stack)
            n = len(outcomes)
            means = (came_to.intervals[key] for key in (PREDICTED[0][0], "contribution_margin"))
            parts = [*(wilson_interval(outcomes.count(outcome), n) for outcome in OUTCOMES), *means]
            rows.append([condition, stack, str(n), *(interval_text(part, 2) for part in parts)])
    heading = ["where", "stack", "n", "SLA", "spoiled", "timeout", "assistance", "injuries [USD]", "margin [USD]"]
    return table(heading, rows)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tables", action="store_true", help="drive nothing")
    parser.add_argument("--workers", type=int)
    parser.add_argument("--stack", action="append", default=[], help="repeatable; default: all")
    parser.add_argument("--place", action="append", default=[], choices=PLACES, help="repeatable; default: all")
    asked = parser.parse_args()
    try:
        own_map = None if asked.tables else published_map(KEPT.parents[1] / "published_map")
        for cell in () if asked.tables else CELLS:
            is_asked = (not asked.stack or cell.stack in asked.stack) and (not asked.place or cell.place in asked.place)
            if is_asked and (own_map is not None or cell.place != OWN_MAP):
                drive(cell, own_map, asked.workers)
    except NavstackError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    run_script(main)
