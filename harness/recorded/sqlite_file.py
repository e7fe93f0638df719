"""Storage files of ROS 2 in SQLite (``.db3``).

Tables ``topics`` and ``messages`` of rosbag2_storage_sqlite3.
"""

import contextlib
import math
import sqlite3
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import quote

from harness.recorded.bag_file import (
    LARGEST_MESSAGE,
    MOST_TOPICS,
    BagError,
    BagFile,
    DamageError,
    Topic,
)

MAGIC = b"SQLite format 3\x00"
# of SQLite's machine between two looks at the clock; [s] for one row
_STEPS, _LONGEST = 1_000_000, 60.0
_COLUMNS = ("id", "name", "type", "serialization_format")


class SqliteFile(BagFile):
    """A ``.db3`` file, opened to be read only.

    What it holds as tables is read, and nothing that it would compute.
    """

    def __init__(self, path: Path, types: frozenset[str]) -> None:
        """Open the file."""
        super().__init__(path, types)
        self._database = sqlite3.connect(f"file:{quote(str(path.resolve()))}?immutable=1", uri=True)
        self._database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, LARGEST_MESSAGE)
        self._database.set_progress_handler(self._is_late, _STEPS)
        self._database.text_factory = lambda content: content.decode(errors="replace")
        self._deadline = time.monotonic() + _LONGEST

    def close(self) -> None:
        """Let go of the file."""
        self._database.close()

    def _is_late(self) -> bool:
        return time.monotonic() > self._deadline

    def _scan(self) -> None:
        self._read_tables()
        log = self.path.with_name(f"{self.path.name}-wal")
        if log.exists() and log.stat().st_size > 0:
            raise DamageError(
                f"was never closed by its recorder: the last messages stand in {log.name}, which "
                "is not read"
            )

    def _read_tables(self) -> None:
        wanted: dict[int, int] = {}
        with self._telling_damage():
            self._database.execute("PRAGMA trusted_schema = OFF")
            self._database.execute(
                "PRAGMA writable_schema = ON"
            )  # else SQLite reads nothing of a file that was cut off
            self._require_tables()
            rows = self._rows(f"SELECT {', '.join(_COLUMNS)} FROM topics LIMIT {MOST_TOPICS + 1}")
            for key, name, kind, encoding in rows:
                topic = self.add_topic(Topic(str(name), str(kind), str(encoding)))
                if kind in self.types and encoding == "cdr":
                    wanted[key] = topic
            last = -math.inf
            for row, key, arrival in self._rows(
                "SELECT rowid, topic_id, timestamp FROM messages ORDER BY rowid"
            ):
                if row <= last:  # so reads a page of which a part is missing
                    raise DamageError(f"is damaged after message {last}")
                last = row
                if key in wanted:
                    if not isinstance(arrival, int):
                        raise DamageError("has a message without time")
                    self.add_message(wanted[key], arrival, row, 0, 0)

    def _require_tables(self) -> None:
        """Refuse views and virtual tables in place of the tables.

        They could compute without end.
        """
        for table, columns in (
            ("topics", _COLUMNS),
            ("messages", ("topic_id", "timestamp", "data")),
        ):
            found = self._database.execute(
                "SELECT type, sql FROM sqlite_master WHERE name = ?", (table,)
            ).fetchall()
            is_table = (
                len(found) == 1
                and found[0][0] == "table"
                and "VIRTUAL" not in str(found[0][1]).upper()
            )
            stored = set()  # without columns that are computed
            if is_table:
                rows = self._database.execute(f"PRAGMA table_info({table})")
                stored = {row[1] for row in rows}
            if not stored.issuperset(columns):
                raise BagError(
                    f"bag '{self.path}' is an SQLite file, but has no table '{table}' as ROS 2 "
                    "writes it"
                )

    def _rows(self, query: str) -> Iterator[tuple[Any, ...]]:
        for row in self._database.execute(query):
            self._deadline = time.monotonic() + _LONGEST
            yield row

    def read(self, *place: int) -> bytes:
        """See :meth:`BagFile.read`."""
        self._deadline = time.monotonic() + _LONGEST
        with self._telling_damage():
            row = self._database.execute(
                "SELECT data FROM messages WHERE rowid = ?", place[:1]
            ).fetchone()
        if row is None or not isinstance(row[0], bytes):
            raise DamageError(f"message {place[0]} has no data")
        return row[0]

    @contextlib.contextmanager
    def _telling_damage(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            raise DamageError(f"SQLite cannot read on: {error}") from None
