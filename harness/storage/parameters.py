"""The parameter files of a run: a folder ``params/``, or one file that holds them all.

A run is written with the folder. A stored study keeps ``parameters.json.gz``, an object of file
names and texts, so that a few small files hold hundreds of parameter files.
"""

import atexit
import gzip
import json
import re
import shutil
import tempfile
import zlib
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

from harness.storage.documents import json_text
from harness.storage.files import replacing
from navstack.errors import InputError

FOLDER, PACKED = "params", "parameters.json.gz"
MOST_BYTES = 64 << 20  # of all files; hundreds of stacks have a hundredth of it
_NAME = re.compile(r"[^/\0]*[^/\0.][^/\0]*")  # of a file in the folder
_DAMAGES = (OSError, EOFError, zlib.error, ValueError, AttributeError, RecursionError)


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


def write_packed(run: Path, texts: Mapping[str, str]) -> None:
    """Write parameter files, given as texts by name, as the one file of a stored run."""
    with replacing(run / PACKED) as stream:
        stream.write(gzip.compress(json_text(texts).encode(), mtime=0))


@lru_cache(maxsize=64)
def _unpacked(packed: Path, changed: int) -> Path:
    """A temporary folder with the files as they were when the packed one was ``changed`` last."""
    try:
        with gzip.open(packed) as stream:
            content = stream.read(MOST_BYTES + 1)
        if len(content) > MOST_BYTES:
            raise ValueError(f"more than {MOST_BYTES} bytes")
        texts = {name: text.encode() for name, text in json.loads(content).items()}
        for name in texts:
            if not _NAME.fullmatch(name):
                raise ValueError(f"{name!r} is no name of a file")
    except _DAMAGES as error:
        raise InputError(f"{packed}: is damaged ({error}); take a whole copy") from None
    folder = Path(tempfile.mkdtemp(prefix="navbench-parameters-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    for name, text in texts.items():
        (folder / name).write_bytes(text)
    return folder
