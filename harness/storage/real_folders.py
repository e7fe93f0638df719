"""Folders in a run folder, which may come from others: what is written there stays there."""

import re
from pathlib import Path

from navstack.errors import InputError

SUITE, FIGURES = "suite.yaml", "figures"  # in a suite's folder: its declaration, and a folder that it writes
CELL = re.compile(r"-seed\d+-")  # in the name of the run folder of a suite's cell


def require_real_folders(path: Path) -> None:
    """Check that no folder in a run folder is a link; nor, in a suite, the run folder itself or that of the figures.

    Any other run folder may be a link: it stands where the user said.

    Args:
        path: of the run folder; it need not exist.

    Raises:
        InputError: there is such a link; it could lead anywhere.
    """
    folders = list(path.iterdir()) if path.is_dir() else []
    suite = path.absolute().parent
    if CELL.search(path.name) and (suite / SUITE).is_file():
        folders += [path, suite / FIGURES]
    for folder in folders:
        if folder.is_symlink() and not folder.is_file():
            raise InputError(
                f"'{folder}' is a symbolic link, and a run is written to folders of its own only; put a real folder "
                "in its place, or remove it"
            )
