"""Drives the cells that are missing, and keeps what is driven in few files."""

import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

from harness.storage.checksums import write_checksums
from harness.storage.files import write_text
from harness.storage.manifest_file import read_manifest
from harness.storage.new_run import MANIFEST
from harness.study.places import Where
from harness.study.stored_run import load_run
from harness.task.study import Study, make_study
from navbench.api.driving import begin
from navbench.api.run import drive_rest
from navbench.cli.driving import print_driven
from tools.frozen_world.cells import CURBS, GEOMETRY, WORLD, Cell
from tools.pack_runs import pack


@dataclass(frozen=True, slots=True)
class Drive:
    """What is driven where, and kept where."""

    seed: int
    episodes: int
    work: Path  # a run folder for each cell
    kept: Path | None  # one for each place, packed; None: nothing is kept
    workers: int | None
    own_maps: Path | None  # folder of the published map's worlds; None: no images

    def find(self, cell: Cell) -> str | None:
        """The run of a cell, as commands take it; None: it lacks deliveries."""
        if is_driven(self._folder(cell)):
            return str(self._folder(cell))
        if self.kept is not None and cell.stack in _stacks(self.kept / cell.place):
            return f"{self.kept / cell.place}:{cell.stack}"
        return None

    def drive(self, cell: Cell) -> None:
        """Drive what a cell lacks of its deliveries.

        Leaves the program where that does not end well.
        """
        if self.find(cell) is not None:
            return
        folder, where = self._folder(cell), Where(workers=self.workers)
        if (folder / MANIFEST).exists():
            driven = drive_rest(folder, where)
        else:
            driven = begin(self._study(cell), folder, where)
        status = print_driven(driven, as_json=False)
        if status:
            sys.exit(status)

    def keep(self, place: str) -> None:
        """Pack what is driven at a place, beside what is kept of it."""
        assert self.kept is not None
        kept = self.kept / place
        runs = [kept] if _stacks(kept) else []
        for folder in sorted((self.work / place).glob("*")):
            if folder.name not in _stacks(kept) and is_driven(folder):
                self._forget_folders(folder)
                runs.append(folder)
        if runs[-1:] in ([], [kept]):
            return
        packed = self.work / f"{place}.packed"
        shutil.rmtree(packed, ignore_errors=True)
        pack(runs, packed, "unknown")
        shutil.rmtree(kept, ignore_errors=True)
        kept.parent.mkdir(parents=True, exist_ok=True)
        shutil.move(packed, kept)

    def _folder(self, cell: Cell) -> Path:
        return self.work / cell.place / cell.stack

    def _forget_folders(self, run: Path) -> None:
        """What is kept names no folder of this machine."""
        if self.own_maps is None:
            return
        manifest = run / MANIFEST
        text = manifest.read_text(encoding="utf-8").replace(f"{self.own_maps}/", "")
        write_text(manifest, text)
        write_checksums(run)

    def _study(self, cell: Cell) -> Study:
        stack, place = cell.stack, cell.place
        if place in CURBS:
            assert self.own_maps is not None
            place = str(self.own_maps / f"{place}.yaml")
        if stack == GEOMETRY:
            assert self.own_maps is not None
            stack = str(self.own_maps / f"{stack}.yaml")
        return make_study(
            stacks=[stack],
            episodes=self.episodes,
            seed=self.seed,
            world=WORLD,
            map_name=place,
            workers=self.workers,
        )


def is_driven(folder: Path) -> bool:
    """Whether a run folder has all its deliveries; an interrupted one has some."""
    return (folder / "summary.json").exists() and load_run(str(folder)).is_whole


def _stacks(run: Path) -> list[str]:
    """The stacks of a packed run; none: there is no such run."""
    if not (run / MANIFEST).exists():
        return []
    return [stack["name"] for stack in read_manifest(run)["stacks"]]
