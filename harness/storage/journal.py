"""The records of finished deliveries.

Lines of a run's journal, or rows of the tables that it becomes.
"""

import json
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO

from harness.storage.checksums import sealed, unsealed
from harness.storage.files import no_links, replacing
from harness.storage.rows import Columns, Row, Rows
from harness.storage.tables import is_of_kind, read_rows
from harness.storage.texts import clean_texts
from navstack.errors import InputError

LARGEST = 1e12  # of any number; more is no measurement of ours
PARTS = {"row", "events", "timing"}  # of a record
KEYS = ("stack", "stack_number", "seed", "episode")  # of every delivery
NEEDED = (
    "stack",
    "map",
    "seed",
    "episode",
    "outcome",
    "distance_m",
    "duration_s",
    "average_speed_mps",
)
NEEDED_OF_TIMINGS = ("wall_s", "real_time_factor")
LONGEST = 200  # [characters] of what is told of a damaged value


def key_of(record: Row) -> tuple[int, int]:
    """Stack number and episode."""
    return record["row"]["stack_number"], record["row"]["episode"]


def line_of(record: Row) -> bytes:
    """A record (``row``, ``events``, ``timing``) as a line of a journal."""
    return sealed(json.dumps(record, allow_nan=False))


def record_of(line: bytes) -> Row | None:
    """The record of a line, its texts cleaned; None: it was cut off or is damaged."""
    try:
        record = json.loads(unsealed(line))
        whole = (
            line.endswith(b"\n")
            and set(record) == PARTS
            and all(isinstance(number, int) for number in key_of(record))
        )
        whole = whole and isinstance(record["events"], list) and isinstance(record["timing"], dict)
        record = clean_texts(record)
    except (ValueError, KeyError, TypeError, RecursionError):
        return None
    if whole:
        return dict(record)
    return None


def records_in(
    lines: Iterable[bytes],
    size: int,
    tables: Mapping[str, Columns],
    complain: Callable[[str], None],
) -> Iterator[tuple[Row, int, int]]:
    """The records of a journal, each with its place and length [bytes].

    A last line that was cut off is none.

    Args:
        lines: of the journal.
        size: [bytes] of all lines.
        tables: columns of ``episodes``, ``events`` and ``timings``; what an episode's row lacks of
            them is null.
        complain: takes what is wrong with another line, which is passed over.
    """
    end = 0
    known: set[tuple[int, int]] = set()
    for number, line in enumerate(lines, start=1):
        begin, end = end, end + len(line)
        record = record_of(line)
        if record is None and end >= size:
            return
        trouble = "damaged or there twice"
        if record is not None and (found := _trouble_in(record, tables)):
            record, trouble = None, f"damaged: {found}"
        if record is None or key_of(record) in known:
            complain(f"line {number} is {trouble}")
            continue
        known.add(key_of(record))
        yield (
            {**record, "row": {**dict.fromkeys(tables["episodes"]), **record["row"]}},
            begin,
            len(line),
        )


def drop_errors(path: Path, most: int) -> None:
    """Take the deliveries that ended in an error of the machine out of a journal.

    Args:
        path: of the journal.
        most: [bytes] of a line.
    """
    with open(path, "rb", opener=no_links) as journal, replacing(path) as kept:
        for line in iter(lambda: journal.readline(most), b""):
            record = record_of(line)
            if record is None or record["row"].get("error") is None:
                kept.write(line)


def events_at(journal: IO[bytes], place: int) -> list[Row]:
    """The events of the record that begins at a byte of a journal."""
    journal.seek(place)
    events: list[Row] = clean_texts(json.loads(unsealed(journal.readline()))["events"])
    return events


def finished_in_tables(path: Path, tables: Mapping[str, Columns]) -> tuple[Rows, Rows]:
    """The deliveries and timings of a run whose journal has become tables.

    Raises:
        InputError: the tables are damaged.
    """
    rows, timings = (
        read_rows(path / f"{name}.parquet", tables[name]) for name in ("episodes", "timings")
    )
    if len(rows) != len(timings):
        raise InputError(
            f"run folder '{path}' has damaged tables: {len(rows)} episodes, {len(timings)} timings"
        )
    for number, (row, timing) in enumerate(zip(rows, timings, strict=True), start=1):
        if trouble := _trouble_in({"row": row, "timing": timing}, tables):
            raise InputError(
                f"run folder '{path}' has damaged tables: row {number}, {trouble}; a run resumes "
                "from whole tables"
            )
    return rows, timings


def records_of(
    rows: Rows,
    timings: Rows,
    path: Path,
    tables: Mapping[str, Columns],
) -> Iterator[Row]:
    """The same with their events, as a journal has them.

    Raises:
        InputError: the table of the events is damaged.
    """
    events: dict[tuple[str, int], list[Row]] = {}
    for number, event in enumerate(read_rows(path / "events.parquet", tables["events"]), start=1):
        if trouble := trouble_with(event, tables["events"]):
            raise InputError(f"{path / 'events.parquet'}: is damaged: row {number}: {trouble}")
        events.setdefault((event["stack"], event["episode"]), []).append(event)
    for row, timing in zip(rows, timings, strict=True):
        yield {
            "row": row,
            "events": events.get((row["stack"], row["episode"]), []),
            "timing": timing,
        }


def _trouble_in(record: Row, tables: Mapping[str, Columns]) -> str:
    """What is wrong with a record, with or without events; empty if nothing is."""
    row, timing = record["row"], record["timing"]
    needed: Sequence[str] = (*KEYS, *NEEDED)
    needed_times: Sequence[str] = NEEDED_OF_TIMINGS
    if row.get("error") is not None:
        needed, needed_times = KEYS, ()
    found = [("episode", trouble_with(row, tables["episodes"], needed))]
    for event in record.get("events", ()):
        found.append(("event", trouble_with(event, tables["events"])))
    found.append(("timing", trouble_with(timing, tables["timings"], needed_times)))
    return next((f"{part}: {trouble}" for part, trouble in found if trouble), "")


def trouble_with(row: object, columns: Columns, needed: Sequence[str] = ()) -> str:
    """What is wrong with a row of a table; empty if nothing is.

    A table may lack columns that are needed of it.
    """
    if not isinstance(row, dict):
        return f"{type(row).__name__} in place of a row"
    # the first two may stand in every row
    kinds = {"stack": "string", "outcome": "string", **columns}
    for name, value in row.items():
        if isinstance(value, list | dict):
            return _shown(f"{name} is a {type(value).__name__}")
        if value is not None and not (name in kinds and is_of_kind(value, kinds[name])):
            return _shown(f"{name} {value!r} is not a value of such a row")
        if _is_odd(value, columns.get(name)):
            return _shown(f"{name} {value!r} is no measurement")
    missing = next((name for name in needed if name in columns and row.get(name) is None), None)
    if missing is None:
        return ""
    return f"{missing} is missing"


def _is_odd(value: object, kind: str | None) -> bool:
    """Whether a value of the right type can be no measurement."""
    return kind == "double" and isinstance(value, int | float) and not abs(value) <= LARGEST


def _shown(text: str) -> str:
    """A text from a file as it may stand in one line."""
    return "".join(char if char.isprintable() else "?" for char in text[:LONGEST])
