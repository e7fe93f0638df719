"""Numba's files of compiled code, of which none that is damaged or somebody else's is run.

Numba trusts whatever lies in its cache. A file that was cut off, by a power cut or a full disk,
raises anything when it is read, and a changed byte may be run. The index tells of code a moment
before the code is on disk: a program that is killed between leaves the code of an earlier source,
or of other types, under the new name. Here each file ends with a CRC-32 of all before it, and the
code is kept with what it was compiled from and for. Whatever does not fit is compiled anew, and
what cannot be written is compiled again next time.
"""

import contextlib
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any, BinaryIO

from numba.core.caching import IndexDataCacheFile

from navstack.files import check_of, is_whole


class CheckedCacheFile(IndexDataCacheFile):
    """The index and the code of one kernel."""

    def save(self, key: Any, data: Any) -> None:
        """Keep code for types, where the disk has room and may be written."""
        numbas: Any = super()  # untyped
        with contextlib.suppress(OSError):
            numbas.save(key, (self._source_stamp, key, data))

    def load(self, key: Any) -> Any:
        """The code for types; None: there is none that fits."""
        numbas: Any = super()
        found = None
        with contextlib.suppress(Exception):  # classes that an earlier source had
            found = numbas.load(key)
        if found is None or found[:2] != (self._source_stamp, key):
            return None
        return found[2]

    def _load_index(self) -> Any:
        if not is_whole(Path(self._index_path)):
            return {}
        numbas: Any = super()
        return numbas._load_index()

    def _load_data(self, name: str) -> Any:
        numbas: Any = super()
        if not is_whole(Path(numbas._data_path(name))):
            return None
        return numbas._load_data(name)

    @contextlib.contextmanager
    def _open_for_write(self, filepath: str) -> Iterator[BinaryIO]:
        with super()._open_for_write(filepath) as file:
            content = io.BytesIO()
            yield content
            file.write(content.getvalue())
            file.write(check_of(content.getvalue()))
