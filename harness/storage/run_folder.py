"""Run folders: finished episodes are on disk before the next one begins.

So a run goes on where it was cut off.
"""

import contextlib
import os
from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO, Any

from harness.storage.checksums import CHECKSUMS, OF_ALL, note_tables
from harness.storage.documents import json_text
from harness.storage.files import (
    locked,
    no_links,
    replacing,
    require_real_folders,
    sync_folder,
    write_text,
)
from harness.storage.journal import (
    drop_errors,
    events_at,
    finished_in_tables,
    line_of,
    records_in,
    records_of,
)
from harness.storage.new_run import point_latest
from harness.storage.rescue import (
    contents,
    copy_files,
    is_in_place,
    lost_folder,
    opened_folder,
    rescued,
)
from harness.storage.rows import Columns, Row, Rows
from harness.storage.tables import read_rows, write_table
from harness.storage.texts import quoted
from navstack.errors import InputError
from navstack.files import check_regular

SUMMARY = "summary.json"
JOURNAL = "journal.jsonl"  # episodes in the order they finished; there as long as some are missing
RECORDED = "recordings"  # folder of what is recorded of each episode
MOST_JOURNAL = 10_000_000_000  # [bytes] of a whole journal
MOST_LINE = 20_000_000  # [bytes] of one delivery in it


class RunFolder:
    """A run on disk, at its beginning or cut off.

    Closing writes the tables, also after an interrupt.

    Nobody else can write the folder meanwhile. The deliveries and their timings are in memory, as
    columns; events stay on disk.
    """

    def __init__(
        self, path: Path, tables: Mapping[str, Columns], total: int, drops_errors: bool = False
    ) -> None:
        """Lock the folder and read what is finished.

        Args:
            path: of a run that :func:`create_run` made.
            tables: columns of ``episodes``, ``events`` and ``timings``.
            total: number of episodes that make the run complete.
            drops_errors: whether what ended in an error of the machine is forgotten.

        Raises:
            InputError: another program writes the folder, it cannot be written, or its tables are
                damaged.
        """
        self.path = path.resolve()  # a link may point elsewhere before the run ends
        self._lost: Path | None = None  # the folder that it could not stay in
        self._troubles: list[str] = []  # with lines of the journal
        self._tables, self._total = tables, total
        self._forget()
        self._journal: IO[bytes] | None = None
        self._has_summary = False  # of this session
        self._open = contextlib.ExitStack()
        with self._writing(), contextlib.ExitStack() as opening:
            require_real_folders(path)
            path = self.path
            self._lock = opening.enter_context(locked(path))
            self._inside = opening.enter_context(opened_folder(path))
            has_tables = (path / "episodes.parquet").exists()
            if has_tables and not (path / JOURNAL).exists():
                self.rows, self.timings = finished_in_tables(path, tables)
                if not self.is_complete or (drops_errors and any(self.rows.values("error"))):
                    self._unpack()
            if (path / JOURNAL).exists():
                check_regular(path / JOURNAL, MOST_JOURNAL)
            if drops_errors and (path / JOURNAL).exists():
                drop_errors(path / JOURNAL, MOST_LINE)
            if not (has_tables and self.is_complete) or (path / JOURNAL).exists():
                self._journal = opening.enter_context(open(path / JOURNAL, "ab+", opener=no_links))
                self._read_journal(self._journal)
                self._texts = contents(path, (*OF_ALL, CHECKSUMS))
                self._recorded = {file.name for file in (path / RECORDED).glob("*")}
                sync_folder(path)
            self._open = opening.pop_all()

    def __enter__(self) -> "RunFolder":
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    @property
    def is_complete(self) -> bool:
        """Whether every episode is finished."""
        return len(self.rows) >= self._total

    @property
    def is_closed(self) -> bool:
        """Whether its tables are final: then nothing in the folder changes any more."""
        return self._journal is None

    @property
    def finished(self) -> set[tuple[int, int]]:
        """Stack number and episode of what is finished."""
        return set(self._keys())

    def add(self, record: Row) -> None:
        """Put one finished episode (``row``, ``events``, ``timing``) on disk before returning.

        Raises:
            InputError: it cannot be written, or the folder is no longer there; the message tells
                where the finished episodes are.
        """
        if self._journal is None:
            raise ValueError(f"run folder '{self.path}' is closed or complete")
        self._stay()
        place, before = self._journal.seek(0, os.SEEK_END), len(self.rows)
        with self._writing():
            try:
                self._journal.write(line_of(record))
                # an interrupt while the disk works finds it in the journal and here
                self._keep(record, place)
                self._journal.flush()
                os.fsync(self._journal.fileno())
            except OSError:
                if len(self.rows) > before:
                    self.rows.drop_last()
                raise
        self._tell()

    def add_recording(self, name: str, arrays: Mapping[str, Any]) -> None:
        """Keep the trajectories of one episode as ``recordings/<name>.npz``.

        To be called before :meth:`add`.
        """
        import numpy as np

        def write() -> None:
            with replacing(self._recording(f"{name}.npz")) as stream:
                np.savez_compressed(stream, **arrays)

        self._write(write)

    def add_table(self, name: str, columns: Columns, rows: Sequence[Row]) -> None:
        """Keep a table of one episode as ``recordings/<name>.parquet``.

        To be called before :meth:`add`.
        """
        self._write(lambda: write_table(self._recording(f"{name}.parquet"), columns, rows))

    def write_summary(self, summary: Row) -> None:
        """Write ``summary.json``."""
        self._write(lambda: write_text(self._inside / SUMMARY, json_text(summary)))
        self._has_summary = True
        if self.is_closed:
            self._write(lambda: note_tables(self._inside))

    @property
    def lacks_summary(self) -> bool:
        """Whether nobody has summed up its tables, as where the program was interrupted then."""
        return not (self._inside / SUMMARY).exists()

    def close(self) -> None:
        """Turn the journal into the three tables, by stack and episode whatever the order of work.

        Raises:
            InputError: it cannot be written, or the folder was not there any more.
        """
        with self._open:
            if self._journal is None:
                return
            try:
                if not self._has_summary:  # that of fewer deliveries
                    (self._inside / SUMMARY).unlink(missing_ok=True)
                self._write(self._write_tables)
                if self.is_complete:
                    (self._inside / JOURNAL).unlink()
            finally:
                journal, self._journal = self._journal, None
                with contextlib.suppress(OSError):  # a full disk has been reported by then
                    journal.close()
            point_latest(self.path)
            self._tell()

    def _write_tables(self) -> None:
        journal = self._journal
        assert journal is not None
        keys = self._keys()
        order = sorted(range(len(keys)), key=keys.__getitem__)
        rows: dict[str, Iterable[Row]] = {
            "episodes": self.rows.take(order),
            "events": (event for i in order for event in events_at(journal, self._places[i])),
            "timings": self.timings.take(order),
        }
        for table, columns in self._tables.items():
            write_table(self._inside / f"{table}.parquet", columns, rows[table])
        note_tables(self._inside)

    def _write(self, write: Callable[[], None]) -> None:
        """Write into the folder; where it went in the midst of that, again into the new one."""
        while True:
            self._stay()
            try:
                with self._writing():
                    write()
            except InputError:
                if self._is_in_place:
                    raise
            if self._is_in_place:
                return

    @property
    def _is_in_place(self) -> bool:
        return self._journal is None or is_in_place(self._lock, self._journal)

    def _stay(self) -> None:
        """Go on in a new folder with all that is finished where this one is no longer at its path.

        What another program may have put there stays as it is.
        """
        if self._journal is None or self._is_in_place:
            return
        self._lost = self.path
        with self._writing():
            self.path = rescued(self.path, self._texts, self._journal)
            self._lock = self._open.enter_context(locked(self.path))
            before, self._inside = self._inside, self._open.enter_context(opened_folder(self.path))
            self._journal.close()
            journal = open(self.path / JOURNAL, "ab+", opener=no_links)
            self._journal = self._open.enter_context(journal)
            if before != self._lost:  # else, on a system without such paths, it is another folder
                copy_files(before / RECORDED, self._inside / RECORDED, sorted(self._recorded))

    def _tell(self) -> None:
        """Stop, once, where the run could not stay in its folder."""
        lost, self._lost = self._lost, None
        if lost is not None:
            here = {file.name for file in (self.path / RECORDED).glob("*")}
            raise lost_folder(lost, self.path, len(self.rows), len(self._recorded - here))

    def _unpack(self) -> None:
        """Make tables a journal again: the run was complete and has been extended since."""
        with replacing(self.path / JOURNAL) as journal:
            for record in records_of(self.rows, self.timings, self.path, self._tables):
                journal.write(line_of(record))
        self._forget()

    def _forget(self) -> None:
        """Begin without a finished episode."""
        self.rows, self.timings = Rows(self._tables["episodes"]), Rows(self._tables["timings"])
        self._places = array("q")  # [bytes] where each record begins in the journal

    def _keys(self) -> list[tuple[int, int]]:
        """Stack number and episode of each finished episode."""
        return list(zip(self.rows.values("stack_number"), self.rows.values("episode"), strict=True))

    def _keep(self, record: Row, place: int) -> None:
        """Take in an episode: wholly once its row is there.

        That holds whatever an interrupt or a full disk left before.
        """
        while len(self.timings) > len(self.rows):
            self.timings.drop_last()
        del self._places[len(self.rows) :]
        self._places.append(place)
        self.timings.append(record["timing"])
        self.rows.append(record["row"])

    def _read_journal(self, journal: IO[bytes]) -> None:
        """Take in the finished episodes; a last line that was cut off goes away."""
        end, size = 0, journal.seek(0, os.SEEK_END)
        journal.seek(0)
        lines = iter(lambda: journal.readline(MOST_LINE), b"")
        for record, place, length in records_in(lines, size, self._tables, self._troubles.append):
            self._keep(record, place)
            end = place + length
        journal.truncate(end)

    @property
    def notes(self) -> list[str]:
        """What was wrong with the journal, in a line at most."""
        if not self._troubles:
            return []
        more = f", and {len(self._troubles) - 1} lines more" if len(self._troubles) > 1 else ""
        return [
            f"{self.path / JOURNAL}: {self._troubles[0]}{more}; what they told of is driven again"
        ]

    @contextlib.contextmanager
    def _writing(self) -> Iterator[None]:
        """Say in one line that the folder cannot be written, and what is kept."""
        try:
            yield
        except OSError as error:
            told = f"run folder '{self.path}' cannot be written ({error.strerror or error})"
            if not self.rows:
                raise InputError(f"{told}; make room or choose another") from None
            kept = f"{len(self.rows)} finished deliveries are kept in {self.path / JOURNAL}"
            raise InputError(
                f"{told}; {kept}; make room and go on with --resume {quoted(self.path)}"
            ) from None

    def _recording(self, name: str) -> Path:
        """The file of a recording."""
        (self._inside / RECORDED).mkdir(exist_ok=True)
        self._recorded.add(name)
        return self._inside / RECORDED / name


def count_finished(path: Path) -> int:
    """Number of finished episodes of a run, which another program may be writing.

    Raises:
        InputError: its table is damaged.
    """
    if (path / JOURNAL).is_file():
        with (path / JOURNAL).open("rb") as journal:
            return sum(
                line.endswith(b"\n") for line in iter(lambda: journal.readline(MOST_LINE), b"")
            )
    table = path / "episodes.parquet"
    if not table.is_file():
        return 0
    return len(read_rows(table, {"episode": "int64"}))
