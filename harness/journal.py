"""The records of finished deliveries: lines of a run's journal, or rows of the tables that it becomes."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import IO

from harness.table_files import Columns, Row, read_rows, trouble_with
from navstack.errors import InputError


def key_of(record: Row) -> tuple[int, int]:
    """Stack number and episode."""
    return record["row"]["stack_number"], record["row"]["episode"]


def line_of(record: Row) -> bytes:
    """A record (``row``, ``events``, ``timing``) as a line of a journal."""
    return json.dumps(record, allow_nan=False).encode() + b"\n"


def record_of(line: bytes) -> Row | None:
    """The record of a line; None: it was cut off or is damaged."""
    try:
        record = json.loads(line)
        whole = line.endswith(b"\n") and all(isinstance(number, int) for number in key_of(record))
        whole = whole and isinstance(record["events"], list) and isinstance(record["timing"], dict)
    except (ValueError, KeyError, TypeError, RecursionError):
        return None
    return dict(record) if whole else None


def events_at(journal: IO[bytes], place: int) -> list[Row]:
    """The events of the record that begins at a byte of a journal."""
    journal.seek(place)
    events: list[Row] = json.loads(journal.readline())["events"]
    return events


def finished_in_tables(path: Path, tables: Mapping[str, Columns]) -> list[Row]:
    """The records of a run whose journal has become tables, without their events.

    Raises:
        InputError: the tables are damaged.
    """
    rows, timings = (read_rows(path / f"{name}.parquet", tables[name]) for name in ("episodes", "timings"))
    if len(rows) != len(timings):
        raise InputError(f"run folder '{path}' has damaged tables: {len(rows)} episodes, {len(timings)} timings")
    for row in rows:
        trouble = trouble_with(row, tables["episodes"])
        if trouble:
            raise InputError(f"run folder '{path}' has damaged tables: episodes.parquet: {trouble}")
    return [{"row": row, "timing": timing} for row, timing in zip(rows, timings, strict=True)]


def with_events(records: Sequence[Row], path: Path, tables: Mapping[str, Columns]) -> Iterator[Row]:
    """The same records whole, as a journal has them."""
    events: dict[tuple[str, int], list[Row]] = {}
    for event in read_rows(path / "events.parquet", tables["events"]):
        events.setdefault((event["stack"], event["episode"]), []).append(event)
    for record in records:
        row = record["row"]
        yield {**record, "events": events.get((row["stack"], row["episode"]), [])}
