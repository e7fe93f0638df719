"""The parameter files of a run: a folder ``params/``, or one file that holds them all.

A run is written with the folder. A stored study keeps ``parameters.json``, an object of file names
and texts, so that a few files hold hundreds of parameter files.
"""

import atexit
import json
import shutil
import tempfile
from functools import lru_cache
from pathlib import Path

from navstack.errors import InputError
from navstack.params.strict import read_text

FOLDER, PACKED = "params", "parameters.json"


def parameter_folder(run: Path) -> Path:
    """The folder with a run's parameter files.

    Packed ones are written to a temporary folder of this process, once.

    Raises:
        InputError: the packed file is damaged.
    """
    folder, packed = run / FOLDER, run / PACKED
    if folder.is_dir() or not packed.is_file():
        return folder
    return _unpacked(packed.absolute(), packed.stat().st_mtime_ns)


@lru_cache(maxsize=64)
def _unpacked(packed: Path, changed: int) -> Path:
    """A temporary folder with the files as they were when the packed one was ``changed`` last."""
    try:
        texts = json.loads(read_text(packed))
        folder = Path(tempfile.mkdtemp(prefix="navbench-parameters-"))
        atexit.register(shutil.rmtree, folder, ignore_errors=True)
        for name, text in texts.items():
            if Path(name).name != name:
                raise ValueError(f"'{name}' is no file name")
            (folder / name).write_text(text, encoding="utf-8")
    except (ValueError, AttributeError, TypeError, RecursionError) as error:
        raise InputError(f"{packed}: is damaged ({error}); take a whole copy") from None
    return folder
