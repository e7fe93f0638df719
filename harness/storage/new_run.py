"""A run folder as it begins: its name, its manifest and its parameters."""

import contextlib
import itertools
import shutil
import time
from collections.abc import Iterator, Mapping
from pathlib import Path

from harness.storage.checksums import write_checksums
from harness.storage.documents import json_text
from harness.storage.files import (
    LOCK,
    locked,
    require_folder,
    require_real_folders,
    write_text,
    writing,
)
from harness.storage.rows import Row
from harness.storage.texts import quoted
from navstack.errors import InputError

MANIFEST = "run.json"  # written last when a run is created: a folder that has it can be resumed
OF_STACKS = "of_stacks"  # in the manifest of packed runs: what each said of its own, by stack
BEGUN = "run.begun"  # there while a run is created
LONGEST = 100  # characters of stacks in the name of a folder
# in params/: what such a study declares
ABLATION, CHECK, TUNING = "ablation.yaml", "check.yaml", "tuning.yaml"
MEETINGS_FILE = "missions.jsonl"  # of a study by meetings, in place of tables
# what a tuning leaves when it is finished: its document, and a stack that drives its file
TUNING_DOCUMENT, TUNED_STACK = "tune.json", "tuned.yaml"


@contextlib.contextmanager
def output_folder(out: Path | None, name: str) -> Iterator[Path]:
    """The folder that a user gave for what is to be written, or a new one.

    The new one goes again where nothing is written.

    Args:
        out: what was given; None: ``results/<time>-<name>`` below the current directory; where
            there is one of the same second, with a number behind it.
        name: of what is written; a long one is cut.

    Raises:
        InputError: nothing can be written there.
    """
    if out is not None:
        yield out
        return
    folder = _claimed(Path("results") / f"{time.strftime('%Y%m%d-%H%M%S')}-{name[:LONGEST]}")
    try:
        yield folder
    finally:
        with contextlib.suppress(OSError):  # something is in it
            folder.rmdir()
            folder.parent.rmdir()


def _claimed(first: Path) -> Path:
    """A new folder of this name, or with a number behind it, which no other program has."""
    require_folder(first)
    folder = first
    with writing(first):
        first.parent.mkdir(exist_ok=True)
        for number in itertools.count(2):
            with contextlib.suppress(FileExistsError):
                folder.mkdir()
                break
            folder = first.with_name(f"{first.name}-{number}")
    return folder


def require_usable(path: Path) -> None:
    """Check that a run folder can be made at a path.

    Raises:
        InputError: it exists and is not empty, or cannot be written.
    """
    left_over = (path / BEGUN).is_file() and not (path / MANIFEST).exists()
    if path.is_dir() and not left_over and any(entry.name != LOCK for entry in path.iterdir()):
        resume = f", or --resume {quoted(path)}" if (path / MANIFEST).is_file() else ""
        raise InputError(
            f"output folder '{path}' is not empty; give --out a new or empty folder{resume}"
        )
    require_folder(path)


def create_run(path: Path, about: Row, parameters: Mapping[str, str]) -> None:
    """Write what is known before the first episode.

    Args:
        path: must be absent or empty, or what is left of a program that was killed in here.
        about: content of ``run.json``.
        parameters: file name -> text, for ``params/``.

    Raises:
        InputError: the folder exists and is not empty, is in use, or cannot be written.
    """
    require_usable(path)
    require_real_folders(path)
    with writing(path):
        path.mkdir(parents=True, exist_ok=True)
        with locked(path):
            require_usable(path)  # another program may have been quicker
            write_text(path / BEGUN, "")
            if (path / "params").exists():
                shutil.rmtree(path / "params")
            (path / "params").mkdir()
            for name, text in parameters.items():
                write_text(path / "params" / name, text)
            manifest = json_text(about)
            write_checksums(path, {MANIFEST: manifest})  # a folder with a manifest has them
            write_text(path / MANIFEST, manifest)
            (path / BEGUN).unlink()
    point_latest(path)


def point_latest(path: Path) -> None:
    """Let ``latest`` beside the run point to it.

    Only in a folder named results, and never over a real file.
    """
    path = path.resolve()
    link = path.parent / "latest"
    if path.parent.name != "results" or (link.exists() and not link.is_symlink()):
        return
    try:
        link.unlink(missing_ok=True)
        link.symlink_to(path.name)
    except OSError:
        return  # a file system without links; the folder itself is complete
