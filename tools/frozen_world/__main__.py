"""World ``paper_loose_bucket`` beside the published rows.

Drives what is not kept, writes the tables of results/baseline/published_3/index.md and the page
of all stacks, results/baseline/study.

Usage: python -m tools.frozen_world [--tables] [--workers N] [--stack NAME] [--place NAME]
           [--seed N --episodes N] [--work FOLDER]

Stacks drive seed 8000, 400 deliveries at every place: three generated maps and the published one,
if NAVSTACK_DATA names a folder with costnav/sidewalk.png and sidewalk_navmesh.png. Nothing was
fitted to them. Tables are of the cells that are driven, which may be some: the rest goes on later.
--tables drives nothing; --stack and --place, repeatable, drive some of the cells.
Run folders are in FOLDER (results/frozen_world), packed ones in results/baseline/published_3. With
another seed nothing is packed, and the page stays as it is.
"""

import argparse
import re
import sys
from pathlib import Path

from harness.storage.files import write_text
from navbench.cli.signals import run_script
from navstack.errors import NavstackError
from tools.frozen_world.cells import (
    CELLS,
    CURBS,
    EPISODES,
    KEPT,
    PLACES,
    ROOT,
    SEED,
    published_map,
)
from tools.frozen_world.drive import Drive
from tools.frozen_world.study_page import write_study
from tools.frozen_world.tables import earnings, predictions, read, shares, standing

PAGE = KEPT / "index.md"
BEGIN, END = "<!-- tools/frozen_world writes what follows -->", "<!-- tables end -->"


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
        "--place",
        action="append",
        default=[],
        choices=PLACES,
        help="repeatable; default: all",
    )
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--episodes", type=int, default=EPISODES)
    parser.add_argument("--work", type=Path, default=ROOT / "results" / "frozen_world")
    asked = parser.parse_args()
    is_frozen = (asked.seed, asked.episodes) == (SEED, EPISODES)
    own_maps = published_map(ROOT / "results" / "published_map")
    drive = Drive(
        seed=asked.seed,
        episodes=asked.episodes,
        work=asked.work / f"seed_{asked.seed}",
        kept=KEPT if is_frozen else None,
        workers=asked.workers,
        own_maps=own_maps,
    )
    try:
        if not asked.tables:
            drive_asked(drive, asked)
        if is_frozen:
            for place in PLACES:
                drive.keep(place)
        names = {cell: drive.find(cell) for cell in CELLS}
        driven = {cell: read(name) for cell, name in names.items() if name is not None}
        aligned = "\n\n".join(part(driven) for part in (shares, predictions, standing, earnings))
        # as the other tables of the page
        tables = re.sub(r" +(?= \|)", "", re.sub("-{4,}", "---", aligned))
        print(tables)
        if not is_frozen:
            return
        before, begin, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
        write_text(PAGE, f"{before}{begin}\n\n{tables}\n\n{END}{rest.partition(END)[2]}")
        write_study()
    except NavstackError as error:
        sys.exit(str(error))


if __name__ == "__main__":
    run_script(main)
