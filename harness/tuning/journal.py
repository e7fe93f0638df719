"""The journal of a study: every episode is on disk at once, nothing is simulated twice."""

import contextlib
import json
import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import IO, Any

from harness.audit.pairs import EVENTS
from harness.economics.valuation import MEETINGS_LOSS
from harness.metrics.columns import EPISODE_COLUMNS, EVENT_COLUMNS, Row
from harness.storage.checksums import CHECKSUMS, OF_ALL, sealed, unsealed
from harness.storage.files import locked, no_links, require_real_folders, sync_folder, writing
from harness.storage.journal import trouble_with
from harness.storage.rescue import contents, is_in_place, lost_folder, rescued
from harness.storage.run_folder import JOURNAL, MOST_JOURNAL, MOST_LINE
from harness.storage.texts import clean_texts, quoted
from harness.tuning.evaluation import FIRST_TEST, MARGIN, Candidate, Value
from navstack.errors import InputError
from navstack.files import check_regular

REFUSED = "not driven: "  # begins the error of a candidate whose values no file can have
COLUMNS = {**EPISODE_COLUMNS, MARGIN: "double", MEETINGS_LOSS: "double"}

Key = tuple[tuple[tuple[str, Value], ...], int]  # of a candidate, and a mission


class Journal:
    """Finished episodes by candidate and mission, and the wall time of all sessions.

    Nobody else can write the folder meanwhile. Episodes without a result, whose worker was lost or
    took too long, are driven again in the next session: what was the machine's fault shall not stay
    the candidate's. Only those of the search that others followed stay as they are: what the
    sampler asked for afterwards rests on them.
    """

    def __init__(
        self,
        path: Path,
        searched: int = 0,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """Lock the folder and read what is finished.

        Args:
            path: of the study's folder.
            searched: number of missions of the search, which are those from 0 on.
            clock: [s].

        Raises:
            InputError: another program writes the folder, it cannot be written, or its journal is
                damaged.
        """
        self.path = path / JOURNAL
        self._rows: dict[Key, Row] = {}
        self._searched = searched
        self._clock, self._before = clock, 0.0
        self._ends: list[float] = []  # :attr:`elapsed` when each episode of the study ended
        self._began = clock()
        self._ended: float | None = None
        with writing(path), contextlib.ExitStack() as opening:
            require_real_folders(path)
            self._lock = opening.enter_context(locked(path))
            if self.path.exists():
                check_regular(self.path, MOST_JOURNAL)
            self._file: IO[bytes] = opening.enter_context(open(self.path, "ab+", opener=no_links))
            self._read()
            self._texts = contents(path, (*OF_ALL, CHECKSUMS))
            sync_folder(path)
            self._open = opening.pop_all()

    def __enter__(self) -> "Journal":
        return self

    def __exit__(self, *error: object) -> None:
        with contextlib.suppress(OSError):  # a full disk has been reported by then
            self._open.close()

    def __len__(self) -> int:
        return len(self._rows)

    @property
    def errors(self) -> list[str]:
        """What the episodes ended in that have no result."""
        found = (row.get("error") for row in self._rows.values())
        return [error for error in found if error is not None and not error.startswith(REFUSED)]

    @property
    def elapsed(self) -> float:
        """Wall time [s] of search and test so far; of earlier sessions up to their last episode."""
        return self._before + (self._clock() if self._ended is None else self._ended) - self._began

    @property
    def timed(self) -> int:
        """Episodes that :attr:`elapsed` is the time of."""
        return len(self._ends)

    @property
    def pace(self) -> float:
        """Wall time [s] that an episode has taken so far, without what preceded the first.

        That compiles.
        """
        return self.pace_of(self.timed)

    def pace_of(self, count: int) -> float:
        """The same of the first ``count`` episodes, or of all where there are fewer."""
        ends = self._ends[:count]
        if not ends:
            return 0.0
        if len(ends) == 1:
            return ends[0]
        return (ends[-1] - ends[0]) / (len(ends) - 1)

    @property
    def idle(self) -> float:
        """Wall time [s] since the last episode."""
        if not self._ends:
            return self.elapsed
        return self.elapsed - self._ends[-1]

    def stop_clock(self) -> None:
        """What is driven from now on, for the explanation, takes none of the study's time."""
        self._ended = self._clock()

    def get(self, candidate: Candidate, mission: int) -> Row | None:
        """The row of an episode; None: it is not finished."""
        row = self._rows.get((candidate.key, mission))
        if row is None:
            return None
        return {**row, "stack": candidate.name}

    def driven(self, candidates: Sequence[Candidate], first: int = FIRST_TEST) -> int:
        """How many missions, from the first on, all candidates have driven."""
        count = 0
        while all((each.key, first + count) in self._rows for each in candidates):
            count += 1
        return count

    def add(self, candidate: Candidate, mission: int, row: Row) -> None:
        """Put one finished episode on disk before returning.

        Raises:
            InputError: it cannot be written, or the folder is no longer there.
        """
        columns = {key: value for key, value in row.items() if key != EVENTS}
        episode = {"mission": mission, "row": columns, EVENTS: row[EVENTS]}
        record = {"values": dict(candidate.values), **episode, "elapsed_s": self.elapsed}
        line = json.dumps(record, allow_nan=False)
        try:
            self._file.write(sealed(line))
            self._file.flush()
            os.fsync(self._file.fileno())
            if not is_in_place(self._lock, self._file):
                folder = rescued(self.path.parent, self._texts, self._file)
                raise lost_folder(self.path.parent, folder, len(self) + 1)
        except OSError as error:
            raise InputError(
                f"study folder '{self.path.parent}' cannot be written ({error.strerror}); "
                f"{len(self)} finished "
                f"deliveries are kept; make room and go on with --resume {quoted(self.path.parent)}"
            ) from None
        self._keep(json.loads(line))
        if self._ended is None:
            self._ends.append(record["elapsed_s"])

    def _keep(self, record: Any) -> tuple[tuple[str, Value], ...]:
        candidate = Candidate("", dict(record["values"])).key
        self._rows[candidate, int(record["mission"])] = {
            **record["row"],
            EVENTS: list(record[EVENTS]),
        }
        return candidate

    def _read(self) -> None:
        """Take in the finished episodes; a last line that was cut off goes away."""
        place, end = 0, self._file.seek(0, os.SEEK_END)
        self._file.seek(0)
        self._last: tuple[tuple[str, Value], ...] = ()  # candidate of the last line
        for number, line in enumerate(iter(lambda: self._file.readline(MOST_LINE), b""), start=1):
            trouble = self._take_in(line)
            if trouble and place + len(line) >= end:
                break
            if trouble:
                raise InputError(
                    f"{self.path}: line {number} is damaged: {trouble}; a study resumes from a "
                    "whole one"
                )
            place += len(line)
        self._file.truncate(place)
        for key in [key for key, row in self._rows.items() if row.get("error") is not None]:
            candidate, mission = key
            if mission >= self._searched or candidate == self._last:
                del self._rows[key]

    def _take_in(self, line: bytes) -> str:
        """Keep a line's episode; returns what is wrong with it."""
        try:
            record = None
            if line.endswith(b"\n"):
                record = json.loads(unsealed(line))
            if record is None:
                return "cut off"
            record |= {part: clean_texts(record[part]) for part in ("row", EVENTS)}
            trouble = _trouble_with(record["row"])
            if trouble:
                return trouble
            self._last = self._keep(record)
            elapsed = float(record["elapsed_s"])
            if elapsed > self._before:
                self._ends.append(elapsed)
            self._before = elapsed
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            return f"{type(error).__name__}"
        return ""


def _trouble_with(row: Row) -> str:
    """What is wrong with an episode's row and the events in it; empty if nothing is."""
    events = row.get(EVENTS, [])
    if not isinstance(events, list) or any(set(event) - set(EVENT_COLUMNS) for event in events):
        return f"{EVENTS} are no rows of events.parquet"
    needed = ["stack"]
    if row.get("error") is None:
        needed.append("outcome")
    return trouble_with(
        {key: value for key, value in row.items() if key != EVENTS}, COLUMNS, needed
    )
