"""Golden vectors: inputs and outputs of Nav2's own C++, recorded in ``.npz`` files."""

import json
import os
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np

from navstack.errors import InputError
from navstack.files import check_regular

META = "meta_json"  # the array that holds the facts of a file's cases as JSON text

MOST_BYTES = 200_000_000  # of a file, and of one array in it

_UNREADABLE = (
    *(OSError, EOFError, ValueError, KeyError, zipfile.BadZipFile, zlib.error),
    *(MemoryError, RecursionError),  # a header that claims too much, facts nested without end
)


class GoldenError(InputError):
    """A folder or a file of golden vectors cannot be used."""


def golden_folder() -> Path:
    """Where the golden vectors are: ``NAVSTACK_GOLDEN``, else ``tests/golden`` of a checkout."""
    usual = Path(__file__).resolve().parents[2] / "tests" / "golden"
    return Path(os.environ.get("NAVSTACK_GOLDEN") or usual)


class GoldenFile:
    """One file of vectors: arrays by name, read on demand, and the facts of ``meta_json``."""

    def __init__(self, path: Path) -> None:
        """Open a file; only its names and its facts are read.

        Raises:
            GoldenError: it is not a whole ``.npz`` file, or holds no ``meta_json``.
        """
        self.path = path
        try:
            check_regular(path, MOST_BYTES)
            arrays = np.load(path, allow_pickle=False)
        except _UNREADABLE as error:
            raise self.unusable(f"is not a readable .npz file ({_reason(error)})") from None
        if not isinstance(arrays, np.lib.npyio.NpzFile):
            raise self.unusable("is a single array, not an .npz file")
        members = arrays.zip.infolist() if arrays.zip else []
        largest = max((member.file_size for member in members), default=0)
        if largest > MOST_BYTES:
            raise self.unusable(f"holds an array of {largest} bytes, at most {MOST_BYTES} are read")
        self._arrays = arrays
        self.read: set[str] = set()  # names of the arrays that were asked for
        self.names = frozenset(arrays.files) - {META}  # of the arrays
        self.meta: dict[str, Any] = self._read_meta()

    @property
    def stem(self) -> str:
        """The file's name without its suffix."""
        return self.path.stem

    def __contains__(self, name: str) -> bool:
        return name in self.names

    def __getitem__(self, name: str) -> np.ndarray:
        """The array of a name, which counts as read from now on.

        Raises:
            GoldenError: the file is damaged there.
        """
        array = self.stored(name)
        self.read.add(name)
        return array

    def stored(self, name: str) -> np.ndarray:
        """As ``[name]``, without counting as read."""
        if name not in self.names:
            raise KeyError(name)
        try:
            return self._arrays[name]
        except _UNREADABLE as error:
            raise self.unusable(f"is damaged at array '{name}' ({_reason(error)})") from None

    def bases(self, suffix: str, prefix: str = "") -> list[str]:
        """What stands between ``prefix`` and ``suffix`` in the names of arrays, sorted."""
        long_enough = len(prefix) + len(suffix)
        return sorted(
            name[len(prefix) : len(name) - len(suffix)]
            for name in self.names
            if name.startswith(prefix) and name.endswith(suffix) and len(name) > long_enough
        )

    def facts(self, *keys: str) -> dict[str, Any]:
        """The facts under nested keys of ``meta_json``; empty where there are none."""
        found: Any = self.meta
        for key in keys:
            if not isinstance(found, dict):
                return {}
            found = found.get(key)
        if not isinstance(found, dict):
            return {}
        return found

    def _read_meta(self) -> dict[str, Any]:
        if META not in self._arrays.files:
            raise self.unusable(f"holds no '{META}'")
        try:
            meta = json.loads(str(self._arrays[META]))
        except _UNREADABLE as error:
            raise self.unusable(
                f"holds a '{META}' that cannot be read ({_reason(error)})"
            ) from None
        if not isinstance(meta, dict):
            raise self.unusable(f"holds a '{META}' that is no mapping of cases")
        return meta

    def unusable(self, trouble: str) -> GoldenError:
        """The error that says why this file cannot be used."""
        return GoldenError(
            f"{self.path}: {trouble}; a file of golden vectors is wanted: record it again or "
            "remove it"
        )


def read_folder(folder: Path) -> list[GoldenFile]:
    """The files of a folder of golden vectors, by name.

    Raises:
        GoldenError: there is no such folder, no ``.npz`` file in it, or one that cannot be used.
    """
    if not folder.is_dir():
        raise GoldenError(
            f"golden folder '{folder}' is not a folder; give a folder of .npz files of golden "
            "vectors"
        )
    paths = sorted(folder.glob("*.npz"))
    if not paths:
        raise GoldenError(
            f"golden folder '{folder}' holds no .npz file; give a folder of golden vectors"
        )
    return [GoldenFile(path) for path in paths]


def _reason(error: Exception) -> str:
    lines = (getattr(error, "strerror", None) or str(error)).splitlines()
    return next(iter(lines), type(error).__name__)
