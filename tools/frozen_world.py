"""World ``published_3`` beside the published rows.

Drives what is not kept, writes the tables of results/baseline/published_3/index.md.

Usage: python -m tools.frozen_world [--tables] [--workers N] [--stack NAME] [--place NAME]
           [--seed N --episodes N --out FOLDER]

Stacks drive seed 8000, 400 deliveries at every place: three generated maps and the published one,
if NAVSTACK_DATA names a folder with costnav/sidewalk.png and sidewalk_navmesh.png. Nothing was
fitted to them. --tables drives nothing; --stack and --place, repeatable, drive some of the cells.
With another seed the runs are kept in FOLDER, the tables are printed, and the page stays as it is.
"""

import argparse
import os
import re
import sys
from dataclasses import dataclass
from pathlib import Path

import yaml
from scipy.stats import fisher_exact

from harness.analysis.compare import compare, side_of
from harness.economics.valuation import OUTCOMES, Valuation, value
from harness.report.markdown import table
from harness.report.numbers import interval_text
from harness.report.published import load_published
from harness.statistics.interval import Interval, wilson_interval
from harness.statistics.paired import holm
from harness.storage.checksums import write_checksums
from harness.storage.files import write_text
from harness.storage.shipped import shipped
from harness.study.places import Where
from harness.study.stored_run import StoredRun, load_run
from harness.task.study import Study, make_study
from harness.world.map.importer import ImportSettings, import_scene
from harness.world.map.scene_io import save_scene
from navbench.api.driving import begin
from navbench.api.run import drive_rest
from navbench.cli.driving import print_driven
from navbench.cli.signals import run_script
from navstack.costmap.map_io import load_map
from navstack.errors import NavstackError

WORLD, SEED, EPISODES = "published_3", 8000, 400
ROOT = Path(__file__).resolve().parents[1]
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
EARNING = ("nav2-gps-ekf", "mpc-gps-ekf", "evasive-gps-ekf", "mppi-contact-gps-ekf")
# [m] of the images, by the published file and by correlation with it
MESH_CORNER, GEOMETRY_CORNER = -100.875, -100.775
FAMILIES = (  # of shares that are tested together: a stack for each published row
    ("paper-gps", "paper-amcl"),
    ("paper-gps", GEOMETRY),
    ("paper-gps-seen", "paper-amcl-seen"),
)
LEVEL = 0.05  # p below which equality is rejected
PREDICTED = (  # key, decimals, allowed ours / published; None: reported
    ("pedestrian_injury_usd_per_run", 2, (1 / 1.5, 1.5)),
    ("avg_collision_impulse_ns", 1, None),
    ("avg_distance_km", 4, (0.75, 1.25)),
    ("avg_velocity_mps", 2, None),
    ("avg_runtime_h", 4, None),
)
PAGE = KEPT / "index.md"
BEGIN, END = "<!-- tools/frozen_world.py writes what follows -->", "<!-- tables end -->"
STANDING = 172.0  # [s] that the published NavDP, which hardly moves, takes for a run


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
    *(Cell(stack, OWN_MAP) for stack in EARNING),
    *(Cell("paper-gps", place) for place in CURBS if place != OWN_MAP),
    *(Cell(stack, place) for stack in EARNING for place in MAIN_PLACES[:3]),
    *(
        Cell(stack, place)
        for stack in ("paper-gps", "paper-amcl", "parked", "paper-gps-seen", "paper-amcl-seen")
        for place in MAIN_PLACES[:3]
    ),
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


@dataclass(frozen=True, slots=True)
class Drive:
    """What is driven where, and kept where."""

    seed: int
    episodes: int
    kept: Path
    workers: int | None
    own_maps: Path | None  # folder of the published map's worlds; None: no images

    def folder(self, cell: Cell) -> Path:
        """The run folder of a cell."""
        return self.kept / cell.place / cell.stack

    def is_driven(self, cell: Cell) -> bool:
        """Whether a cell has all its deliveries."""
        return (self.folder(cell) / "summary.json").exists()

    def drive(self, cell: Cell) -> None:
        """Drive what a cell lacks of its deliveries.

        Leaves the program where that does not end well.
        """
        folder, where = self.folder(cell), Where(workers=self.workers)
        if self.is_driven(cell):
            return
        if (folder / "run.json").exists():
            driven = drive_rest(folder, where)
        else:
            driven = begin(self._study(cell), folder, where)
        status = print_driven(driven, as_json=False)
        if status:
            sys.exit(status)
        if self.own_maps is not None:  # what is kept names no folder of this machine
            manifest = folder / "run.json"
            text = manifest.read_text(encoding="utf-8").replace(f"{self.own_maps}/", "")
            write_text(manifest, text)
            write_checksums(folder)

    def _study(self, cell: Cell) -> Study:
        stack, place = cell.stack, cell.place
        if place in CURBS:
            assert self.own_maps is not None
            place = str(self.own_maps / f"{place}.yaml")
        if stack == GEOMETRY:
            stack = str(self.own_maps / f"{stack}.yaml")
        return make_study(
            stacks=[stack],
            episodes=self.episodes,
            seed=self.seed,
            world=WORLD,
            map_name=place,
            workers=self.workers,
        )


@dataclass(frozen=True, slots=True)
class Delivered:
    """What a cell's deliveries came to."""

    run: StoredRun
    outcomes: list[str]
    came_to: Valuation


def read(folder: Path) -> Delivered:
    """The deliveries of a cell that is driven."""
    run = load_run(str(folder))
    (stack,) = run.stacks
    outcomes = [row["outcome"] for row in stack.rows]
    return Delivered(run, outcomes, value(stack.rows, stack, run.prices(), run.seed))


def p_text(p: float) -> str:
    """A p value, in bold where equality is rejected."""
    text = f"p = {p:.3f}"
    if p < 0.001:
        text = "p < 0.001"
    if p < LEVEL:
        text = f"**{text}**"
    return text


def shares(driven: dict[Cell, Delivered]) -> str:
    """Fisher's exact test of every outcome share, a family's eight adjusted together (Holm)."""
    methods = load_published().methods
    lines: list[list[str]] = []
    for place in PLACES:
        for family in FAMILIES:
            cells = [Cell(stack, place) for stack in family]
            if not all(cell in driven for cell in cells):
                continue
            counts = [
                (cell, outcome, driven[cell].outcomes) for cell in cells for outcome in OUTCOMES
            ]
            p_values = []
            for cell, outcome, ours in counts:
                method = methods[METHODS[cell.stack]]
                theirs = round(getattr(method.measured, outcome) * method.episodes)
                k, n = ours.count(outcome), len(ours)
                p_values.append(
                    float(fisher_exact([[k, n - k], [theirs, method.episodes - theirs]]).pvalue)
                )
            parts = [
                f"{interval_text(wilson_interval(ours.count(outcome), len(ours)), 3)}, {p_text(p)}"
                for (_, outcome, ours), p in zip(counts, holm(p_values), strict=True)
            ]
            rows = [[place, cell.stack, *parts[4 * k : 4 * k + 4]] for k, cell in enumerate(cells)]
            lines += [row for row in rows if row[:2] not in [line[:2] for line in lines]]
    for name, method in methods.items():
        if name in METHODS.values():
            lines.append(
                [
                    "published",
                    name,
                    *(f"{getattr(method.measured, outcome):.2f}" for outcome in OUTCOMES),
                ]
            )
    return table(["place", "stack", "SLA", "spoiled", "time-out", "assistance"], lines)


def predictions(driven: dict[Cell, Delivered]) -> str:
    """What the published rows tell beyond outcomes.

    Ours, and its ratio to the published, in bold where not allowed.
    """
    lines = []
    for cell, delivered in driven.items():
        if cell.stack not in METHODS:
            continue
        line = [cell.place, cell.stack]
        method = load_published().methods[METHODS[cell.stack]]
        for key, decimals, gate in PREDICTED:
            ours = interval_text(delivered.came_to.intervals[key], decimals)
            ratio = f"{mean_of(delivered, key) / getattr(method.measured, key):.2f}"
            if gate is not None and not gate[0] <= float(ratio) <= gate[1]:
                ratio = f"**{ratio}**"
            line.append(f"{ours}: {ratio}")
        lines.append(line)
    heading = ["injuries [USD]", "impulse [N s]", "distance [km]", "speed [m/s]", "time [h]"]
    return table(["place", "stack", *heading], lines)


def mean_of(delivered: Delivered, key: str) -> float:
    """A mean over deliveries that is defined."""
    mean = delivered.came_to.intervals[key].value
    assert mean is not None, key
    return mean


def standing(driven: dict[Cell, Delivered]) -> str:
    """What it costs to stand for as long as the published NavDP takes."""
    theirs = load_published().methods["navdp"].measured.pedestrian_injury_usd_per_run
    lines = []
    for cell, delivered in driven.items():
        if cell.stack != "parked":
            continue
        cost = delivered.came_to.intervals["pedestrian_injury_usd_per_run"]
        share = STANDING / (3600.0 * mean_of(delivered, "avg_runtime_h"))
        value, low, high = (
            None if each is None else each * share for each in (cost.value, cost.low, cost.high)
        )
        scaled = interval_text(Interval(value, low, high, cost.n), 2)
        ratio = mean_of(delivered, "pedestrian_injury_usd_per_run") * share / theirs
        lines.append([cell.place, scaled, f"{ratio:.2f}"])
    return table(
        ["place", f"injuries in {STANDING:g} s of standing [USD]", "of the published"], lines
    )


def earnings(driven: dict[Cell, Delivered]) -> str:
    """Who earns money, and the differences on the same missions, adjusted (Holm)."""
    cells = [cell for cell in driven if cell.stack in EARNING]
    against = {cell: Cell(EARNING[0], cell.place) for cell in cells if cell.stack != EARNING[0]}
    pairs = {
        cell: compare(
            side_of(driven[other].run), side_of(driven[cell].run), ["contribution_margin"]
        )
        for cell, other in against.items()
        if other in driven
    }
    found = {cell: pair.differences["contribution_margin"].paired for cell, pair in pairs.items()}
    adjusted = dict(zip(found, holm([each.p for each in found.values()]), strict=True))
    lines = []
    for cell in cells:
        outcomes, means = driven[cell].outcomes, driven[cell].came_to.intervals
        texts = [interval_text(wilson_interval(outcomes.count("sla"), len(outcomes)), 3)]
        texts += [
            interval_text(means[key], 2)
            for key in ("pedestrian_injury_usd_per_run", "contribution_margin")
        ]
        paired = "--"
        if cell in found:
            paired = f"{interval_text(found[cell].difference, 2)}, {p_text(adjusted[cell])}"
        lines.append([cell.place, cell.stack, *texts, paired])
    heading = ["SLA", "injuries [USD]", "margin [USD]", f"minus {EARNING[0]} [USD], p (Holm)"]
    return table(["place", "stack", *heading], lines)


def drive_asked(drive: Drive, asked: argparse.Namespace) -> None:
    """Drive the cells that are asked for, as far as their map is there."""
    for cell in CELLS:
        is_known = drive.own_maps is not None or cell.place not in CURBS
        is_stack = not asked.stack or cell.stack in asked.stack
        is_place = not asked.place or cell.place in asked.place
        if is_known and is_stack and is_place:
            drive.drive(cell)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tables", action="store_true", help="drive nothing")
    parser.add_argument("--workers", type=int)
    parser.add_argument("--stack", action="append", default=[], help="repeatable; default: all")
    parser.add_argument(
        "--place", action="append", default=[], choices=PLACES, help="repeatable; default: all"
    )
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--episodes", type=int, default=EPISODES)
    parser.add_argument("--out", type=Path, default=KEPT)
    asked = parser.parse_args()
    if (asked.seed, asked.episodes) != (SEED, EPISODES) and asked.out == KEPT:
        parser.error(
            f"with another seed or number than {SEED} and {EPISODES} name a folder by --out"
        )
    own_maps = published_map(ROOT / "results" / "published_map")
    drive = Drive(asked.seed, asked.episodes, asked.out, asked.workers, own_maps)
    try:
        if not asked.tables:
            drive_asked(drive, asked)
        driven = {cell: read(drive.folder(cell)) for cell in CELLS if drive.is_driven(cell)}
        aligned = "\n\n".join(part(driven) for part in (shares, predictions, standing, earnings))
        # as the other tables of the page
        tables = re.sub(r" +(?= \|)", "", re.sub("-{4,}", "---", aligned))
        print(tables)
        if asked.out != KEPT:
            return
        before, begin, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
        write_text(PAGE, f"{before}{begin}\n\n{tables}\n\n{END}{rest.partition(END)[2]}")
    except NavstackError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    run_script(main)
