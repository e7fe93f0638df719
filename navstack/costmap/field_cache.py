"""Arrays that are slow to compute, kept on disk between runs and shared by a machine's processes.

The folder is ``$NAVSTACK_CACHE``, by default ``~/.cache/navbench``. Whatever is wrong with the
folder or a file in it, the array is computed anew and the caller never notices. Beyond
``MOST_BYTES`` the arrays that have not been used for longest go.

A file is an ordinary ``.npy`` file with a CRC-32 of all before it at its end. It is mapped into
memory, not read: processes that use the same array hold it once.

Fields of a part of a city that a robot crosses once are no use to anybody later:
:func:`passing_map` keeps them out of the folder.
"""

import contextlib
import hashlib
import mmap
import os
import re
import sys
import tempfile
import zlib
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

MOST_BYTES = 2_000_000_000  # of all arrays: those of a large map take some 150 MB
# cells of a map from which fields are worth a file that are quick to compute
SHARED_FROM = 1_000_000
_CHECK_BYTES = 4  # of the CRC-32, little endian
# arrays, and what is left of processes that were killed
_OURS = re.compile(r"[0-9a-f]{40}(\.np[yz]|-\w+\.partial)")
_is_passing: ContextVar[bool] = ContextVar("is_passing", default=False)


@contextlib.contextmanager
def passing_map() -> Iterator[None]:
    """Within it fields of maps are computed, not kept: the map is left soon."""
    before = _is_passing.set(True)
    try:
        yield
    finally:
        _is_passing.reset(before)


def cache_folder() -> Path:
    """The folder that holds the cached arrays; it may not exist yet."""
    given = os.environ.get("NAVSTACK_CACHE")
    if given:
        return Path(given)
    home = Path(os.path.expanduser("~"))
    if not home.is_absolute():  # a user without a name or a folder, as in containers
        return Path(tempfile.gettempdir()) / f"navbench-{os.getuid()}"
    return home / ".cache" / "navbench"


def content_key(name: str, *parts: Array | float | int | str) -> str:
    """A key that changes with the ``name`` of a computation and with everything that goes into it.

    Put a version into ``name`` and raise it whenever the computation changes, or old results come
    back.
    """
    # half the time of BLAKE2 where processors know SHA
    digest = hashlib.sha1(name.encode(), usedforsecurity=False)
    for part in parts:
        if isinstance(part, np.ndarray):
            digest.update(f"|{part.dtype.str}{part.shape}|".encode())
            digest.update(np.ascontiguousarray(part).data)
        else:
            digest.update(f"|{part!r}|".encode())
    return digest.hexdigest()


def shared_array(cells: int, compute: Callable[[], Array], name: str, *parts: Any) -> Array:
    """A computed array, from disk where a map has enough cells for that to be quicker.

    Args:
        cells: of the map.
        compute: makes the array.
        name: of the computation, see :func:`content_key`.
        parts: all that goes into it.
    """
    if cells < SHARED_FROM:
        return compute()
    if _is_passing.get():
        return np.ascontiguousarray(compute())
    return cached_array(content_key(name, *parts), compute)


def cached_array(
    key: bytes | str, compute: Callable[[], Array], *, is_of_map: bool = True
) -> Array:
    """The array that belongs to ``key``: from disk, or computed and then put there.

    Args:
        key: identifies the content completely (see :func:`content_key`); hashed to a file name.
        compute: makes the array; what it raises is passed on.
        is_of_map: whether it belongs to the map that is driven on, see :func:`passing_map`.

    Returns:
        A C-contiguous, writable array. Who writes to it gets pages of his own; the file stays as it
        is.
    """
    if is_of_map and _is_passing.get():
        return np.ascontiguousarray(compute())
    raw = key
    if isinstance(raw, str):
        raw = raw.encode()
    file = cache_folder() / f"{hashlib.blake2b(raw, digest_size=20).hexdigest()}.npy"
    known = _read(file)
    if known is not None:
        return known
    array = np.ascontiguousarray(compute())
    beaten = _read(file)  # another process was faster: hold its copy, not one more
    if beaten is not None:
        return beaten
    _write(file, array)
    _make_room(file.parent)
    mapped = _read(file)
    if mapped is None:
        return array
    return mapped


def give_back(array: Array) -> bool:
    """Put an array back to what :func:`cached_array` gave, and free the pages that were written to.

    Returns:
        Whether that was done: the array is mapped, and the system (Linux) reads such pages anew.
    """
    base: Any = array
    while isinstance(base, np.ndarray):
        base = base.base
    mapped = getattr(base, "obj", None)  # of a memoryview
    if sys.platform != "linux" or not isinstance(mapped, mmap.mmap):
        return False
    mapped.madvise(mmap.MADV_DONTNEED)
    return True


def _read(file: Path) -> Array | None:
    """The stored array; None when there is none or it is damaged."""
    try:
        with file.open("rb") as stream:
            shape, is_fortran, dtype = _header(stream)
            start, count = stream.tell(), int(np.prod(shape, dtype=np.int64))
            end = start + count * dtype.itemsize
            size = os.fstat(stream.fileno()).st_size
            if is_fortran or dtype.hasobject or size != end + _CHECK_BYTES:
                return None
            content = mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_COPY)
        if zlib.crc32(memoryview(content)[:end]) != int.from_bytes(content[end:], "little"):
            return None
        with contextlib.suppress(OSError):  # of somebody else
            os.utime(file)
        return np.frombuffer(content, dtype, count, start).reshape(shape)
    # a damaged header raises anything from OSError to SyntaxError; all mean: compute again
    except Exception:
        return None


def _header(stream: Any) -> tuple[tuple[int, ...], bool, "np.dtype[Any]"]:
    """Read the header of a ``.npy`` file: shape, whether columns come first, and type."""
    if np.lib.format.read_magic(stream) != (1, 0):
        raise ValueError("an unknown version")
    return np.lib.format.read_array_header_1_0(stream)


def _write(file: Path, array: Array) -> None:
    """Write beside the place and rename, so that nobody sees half a file."""
    try:
        file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(
            dir=file.parent, prefix=f"{file.stem}-", suffix=".partial", delete=False
        ) as stream:
            partial = Path(stream.name)
            try:
                np.lib.format.write_array(stream, array, version=(1, 0), allow_pickle=False)
                stream.flush()
                with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as written:
                    check = zlib.crc32(written)
                stream.write(check.to_bytes(_CHECK_BYTES, "little"))
                stream.close()
                os.replace(partial, file)
            finally:
                partial.unlink(missing_ok=True)
    except OSError:
        return  # read-only, full, or not a folder: go on without


def _make_room(folder: Path) -> None:
    """Remove the arrays that have not been used for longest; who has one mapped keeps it.

    Files that are not of this cache stay, wherever the folder is.
    """
    with contextlib.suppress(OSError):  # another process removes them just now
        ours = [file for file in folder.iterdir() if _OURS.fullmatch(file.name)]
        used = sorted((file.stat().st_mtime, file.stat().st_size, file) for file in ours)
        total = sum(size for _, size, _ in used)
        for _, size, file in used:
            if total <= MOST_BYTES:
                return
            file.unlink()
            total -= size
