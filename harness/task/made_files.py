"""Files that are made of a user's, until the run's folder has what stands in them."""

import atexit
import hashlib
import tempfile
from functools import cache
from pathlib import Path

DIGITS = 12  # of the digest that tells files of one name apart


def made_file(name: str, text: str) -> Path:
    """A file of a name with a text, in a temporary folder of this process."""
    digest = hashlib.sha256(text.encode("utf-8", "replace")).hexdigest()[:DIGITS]
    path = _folder() / digest / name
    path.parent.mkdir(exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def is_made(file: str) -> bool:
    """Whether a file is one of :func:`made_file`."""
    return _folder() in Path(file).parents


@cache
def _folder() -> Path:
    folder = tempfile.TemporaryDirectory(prefix="navbench-made-")
    atexit.register(folder.cleanup)
    return Path(folder.name).resolve()
