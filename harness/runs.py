"""Run folders: finished episodes are on disk before the next one begins, and the folder tells how to repeat them."""

import contextlib
import json
import os
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Any

from navstack.errors import InputError

JOURNAL = "journal.jsonl"  # rows in the order they finished; becomes the Parquet files when the run is closed

Row = dict[str, Any]
Columns = dict[str, str]  # column name -> Arrow type


def default_folder(name: str) -> Path:
    """``results/<time>-<name>`` below the current directory."""
    return Path("results") / f"{time.strftime('%Y%m%d-%H%M%S')}-{name}"


def require_usable(path: Path) -> None:
    """Check that a run folder can be made at a path.

    Raises:
        InputError: it exists and is not empty, or cannot be written.
    """
    if path.is_dir() and any(path.iterdir()):
        raise InputError(f"output folder '{path}' is not empty; give --out a new or empty folder")
    existing = next(folder for folder in (path, *path.absolute().parents) if folder.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK):
        raise InputError(f"output folder '{path}' cannot be written; choose another")


class RunFolder:
    """One run on disk. Use as a context manager; closing writes the tables, also after an interrupt."""

    def __init__(
        self, path: Path, about: dict[str, Any], parameters: dict[str, str], tables: dict[str, Columns]
    ) -> None:
        """Create the folder and write what is known before the first episode.

        Args:
            path: must be absent or empty.
            about: content of ``run.json``.
            parameters: file name -> text, for ``params/``.
            tables: columns of ``episodes``, ``events`` and ``timings``.

        Raises:
            InputError: the folder exists and is not empty, or cannot be written.
        """
        self.path = path
        self._tables = tables
        self._rows: list[Row] = []
        require_usable(path)
        try:
            (path / "params").mkdir(parents=True, exist_ok=True)
            (path / "run.json").write_text(json.dumps(about, indent=2, sort_keys=True) + "\n", encoding="utf-8")
            for name, text in parameters.items():
                (path / "params" / name).write_text(text, encoding="utf-8")
            self._journal: IO[str] = (path / JOURNAL).open("a", encoding="utf-8")
        except OSError as error:
            raise InputError(f"output folder '{path}' cannot be written ({error.strerror}); choose another") from None

    def __enter__(self) -> "RunFolder":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def add(self, record: Row) -> None:
        """Put one finished episode (``row``, ``events``, ``timing``) on disk before returning."""
        line = json.dumps(record, allow_nan=False) + "\n"
        try:
            self._journal.write(line)
            self._journal.flush()
            os.fsync(self._journal.fileno())
        except OSError as error:
            raise self._failed(error) from None
        self._rows.append(record)

    def add_recording(self, name: str, arrays: Mapping[str, Any]) -> None:
        """Keep the trajectories of one episode as ``recordings/<name>.npz``."""
        import numpy as np

        folder = self.path / "recordings"
        folder.mkdir(exist_ok=True)
        np.savez_compressed(folder / f"{name}.npz", **arrays)

    def write_summary(self, summary: dict[str, Any]) -> None:
        """Write ``summary.json``."""
        text = json.dumps(summary, indent=2, sort_keys=True, allow_nan=False)
        (self.path / "summary.json").write_text(text + "\n", encoding="utf-8")

    def close(self) -> None:
        """Turn the journal into the three tables, ordered by stack and episode whatever the order of work."""
        if self._journal.closed:
            return
        with contextlib.suppress(OSError):  # a full disk has been reported by then
            self._journal.close()
        ordered = sorted(self._rows, key=lambda record: (record["row"]["stack_number"], record["row"]["episode"]))
        rows = {
            "episodes": [record["row"] for record in ordered],
            "events": [event for record in ordered for event in record["events"]],
            "timings": [record["timing"] for record in ordered],
        }
        try:
            for table, columns in self._tables.items():
                write_table(self.path / f"{table}.parquet", columns, rows[table])
            (self.path / JOURNAL).unlink()
        except OSError as error:
            raise self._failed(error) from None
        _point_latest(self.path)

    def _failed(self, error: OSError) -> InputError:
        kept = f"{len(self._rows)} finished deliveries are kept in {self.path / JOURNAL}"
        return InputError(f"run folder '{self.path}' cannot be written ({error.strerror}); {kept}")


def write_table(path: Path, columns: Columns, rows: Sequence[Row]) -> None:
    """Write rows as Parquet, whole or not at all; a key that a row lacks is null."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    schema = pa.schema([(name, pa.type_for_alias(kind)) for name, kind in columns.items()])
    table = pa.table({name: [row.get(name) for row in rows] for name in columns}, schema=schema)
    partial = path.with_suffix(".partial")
    pq.write_table(table, partial)
    partial.replace(path)


def _point_latest(path: Path) -> None:
    """Let ``latest`` beside the run point to it; only in a folder named results, and never over a real file."""
    link = path.parent / "latest"
    if path.parent.name != "results" or (link.exists() and not link.is_symlink()):
        return
    try:
        link.unlink(missing_ok=True)
        link.symlink_to(path.name)
    except OSError:
        return  # a file system without links; the folder itself is complete
