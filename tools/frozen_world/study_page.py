"""The page of every stack in the default world, as that of a suite: costs, prices, break-even."""

import tempfile
from pathlib import Path

from harness.report.suite.document import write_results
from harness.report.suite.results import read_results
from harness.storage.shipped import DEFAULT_WORLD
from harness.study.suite import Suite, cells
from harness.study.suite_folder import declare
from tools.frozen_world.cells import (
    CELLS,
    EARNING,
    EPISODES,
    KEPT,
    MAIN_PLACES,
    OWN_MAP,
    ROOT,
    SEED,
)

STUDY = ROOT / "results" / "baseline" / "study"
TITLE = "What every stack earns in the default world"
SHIPPED = tuple(place for place in MAIN_PLACES if place != OWN_MAP)


def write_study(folder: Path = STUDY) -> None:
    """Write the page and its figures, of what is kept and what is missing on the shipped maps."""
    others = (cell.stack for cell in CELLS if cell.place in SHIPPED)
    stacks = tuple(dict.fromkeys((*EARNING, *others)))
    suite = Suite(TITLE, stacks, EPISODES, maps=SHIPPED, worlds=(DEFAULT_WORLD,), seeds=(SEED,))
    with tempfile.TemporaryDirectory() as name:
        declared = Path(name)
        declare(declared, suite)
        for cell in cells(suite):
            place = declared / cell.group
            if not place.exists():
                place.symlink_to(KEPT / cell.condition.map_name)
        for file in write_results(read_results(declared), folder):
            if file.suffix == ".pdf":  # the page shows the same as PNG
                file.unlink()
