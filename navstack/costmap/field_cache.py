"""Arrays that are dear to compute, kept on disk between runs.

The folder is ``$NAVSTACK_CACHE``, by default ``~/.cache/navbench``. The cache is only a cache: whatever is wrong with
the folder or a file in it, the array is computed anew and the caller never notices.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def cache_folder() -> Path:
    """The folder that holds the cached arrays; it may not exist yet."""
    given = os.environ.get("NAVSTACK_CACHE")
    return Path(given) if given else Path(os.path.expanduser("~")) / ".cache" / "navbench"


def content_key(name: str, *parts: Array | float | int | str) -> str:
    """A key that changes with the ``name`` of a computation and with everything that goes into it.

    Put a version into ``name`` and raise it whenever the computation changes, or old results come back.
    """
    digest = hashlib.blake2b(name.encode(), digest_size=20)
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(f"|{part.dtype.str}{part.shape}|".encode())
            digest.update(part.tobytes())
        else:
            digest.update(f"|{part!r}|".encode())
    return digest.hexdigest()


def cached_array(key: bytes | str, compute: Callable[[], Array]) -> Array:
    """The array that belongs to ``key``: from disk, or computed and then put there.

    Args:
        key: identifies the content completely (see :func:`content_key`); hashed to a file name.
        compute: makes the array; what it raises is passed on.

    Returns:
        A C-contiguous, writable array.
    """
    raw = key.encode() if isinstance(key, str) else key
    file = cache_folder() / f"{hashlib.blake2b(raw, digest_size=20).hexdigest()}.npz"
    known = _read(file)
    if known is not None:
        return known
    array = np.ascontiguousarray(compute())
    _write(file, array)
    return array


def _read(file: Path) -> Array | None:
    """The stored array; None when there is none or it is damaged (the zip container checks its CRC-32)."""
    try:
        with np.load(file, allow_pickle=False) as stored:
            return np.ascontiguousarray(stored["array"])
    except Exception:  # a damaged archive raises anything from OSError to zlib.error; all mean: compute again
        return None


def _write(file: Path, array: Array) -> None:
    """Write beside the place and rename, so that no reader and no second process sees half a file."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=file.parent, suffix=".partial", delete=False) as stream:
            partial = Path(stream.name)
            try:
                np.savez(stream, array=array)
                stream.close()
                os.replace(partial, file)
            finally:
                partial.unlink(missing_ok=True)
    except OSError:
        return  # read-only, full, or not a folder: go on without
