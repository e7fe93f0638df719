"""Tables of a run folder: written whole or not at all, and read back within bounds.

A small Parquet file can unpack to any size.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.storage.files import replacing
from harness.storage.rows import Columns, Row, Rows, schema_of
from navstack.errors import InputError
from navstack.files import check_regular

if TYPE_CHECKING:
    import pyarrow.parquet as pq

MOST_VALUES = 100_000_000  # of a table, some 800 MB: 1.3 million deliveries, 6 million events
MOST_BYTES = 1_000_000_000  # of the file, of the columns as it holds them, and of the rows unpacked
# [bytes] of one column of text, as the file holds it: each of its values once
MOST_TEXT = 10_000_000
MOST_NUMBER = 1e300
ROWS_AT_ONCE = 10_000  # of a table in memory


@contextmanager
def opened_table(path: Path) -> "Iterator[pq.ParquetFile]":
    """A Parquet file. Of Arrow's own, names that are not UTF-8 could not be opened."""
    import pyarrow.parquet as pq

    with path.open("rb") as stream, pq.ParquetFile(stream) as file:
        yield file


def names_of_columns(path: Path) -> list[str]:
    """Of a Parquet file."""
    with opened_table(path) as file:
        names: list[str] = file.schema_arrow.names
    return names


def read_rows(path: Path, columns: Columns) -> Rows:
    """Rows of a table; columns that an older run lacks are null, and foreign ones are passed over.

    Args:
        path: a Parquet file.
        columns: what is wanted: column name -> Arrow type.

    Raises:
        InputError: the file cannot be read, is damaged, too large, or holds values of other types.
    """
    import pyarrow as pa

    wanted = schema_of(columns)
    batches: list[pa.RecordBatch] = []
    left = MOST_BYTES
    try:
        check_regular(path, MOST_BYTES)
        with opened_table(path) as file:
            stored = [name for name in columns if name in file.schema_arrow.names]
            if not stored:
                raise InputError(
                    f"{path}: has none of the columns of such a table: it belongs to no run"
                )
            _check_size(file.metadata, len(columns), path)
            for batch in file.iter_batches(batch_size=_rows_at_once(file.metadata), columns=stored):
                found = {
                    name: batch.column(name) if name in stored else pa.nulls(len(batch))
                    for name in columns
                }
                table = pa.table(found).cast(wanted)
                left -= table.nbytes
                if left < 0:
                    raise _too_much(path)
                batches += table.to_batches()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or 'it is damaged'})") from None
    except (pa.ArrowException, ValueError) as error:
        raise InputError(f"{path}: is damaged: {_first_line(error)}") from None
    return Rows(columns, batches)


def _check_size(metadata: Any, width: int, path: Path) -> None:
    if metadata.num_rows * width > MOST_VALUES:
        raise InputError(
            f"{path}: {metadata.num_rows} rows; at most {MOST_VALUES // width} are read"
        )
    groups = [metadata.row_group(i) for i in range(metadata.num_row_groups)]
    if (
        sum(group.total_byte_size for group in groups) > MOST_BYTES
        or _longest_text(metadata) > MOST_TEXT
    ):
        raise _too_much(path)


def _too_much(path: Path) -> InputError:
    return InputError(
        f"{path}: its columns hold more than any run; at most {MOST_BYTES} bytes are read"
    )


def _longest_text(metadata: Any) -> int:
    """Bytes of the largest column of text in a row group, as the file holds it.

    An upper bound of one value.
    """
    longest = 0
    for i in range(metadata.num_row_groups):
        group = metadata.row_group(i)
        for j in range(metadata.num_columns):
            column = group.column(j)
            if column.physical_type == "BYTE_ARRAY":
                longest = max(longest, column.total_uncompressed_size)
    return longest


def _rows_at_once(metadata: Any) -> int:
    """So many that their texts, each as long as could be, do not fill the memory."""
    return int(max(1, min(ROWS_AT_ONCE, MOST_BYTES // 4 // max(1, _longest_text(metadata)))))


def _first_line(error: Exception) -> str:
    return str(error).splitlines()[0] if str(error) else type(error).__name__


def is_of_kind(value: Any, kind: str) -> bool:
    """Whether a value goes into a column of this Arrow type; numbers must be finite."""
    if kind == "double":
        return (
            isinstance(value, int | float)
            and not isinstance(value, bool)
            and abs(value) <= MOST_NUMBER
        )
    if kind == "int64":
        return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**63
    return isinstance(value, str if kind == "string" else bool)


def write_table(path: Path, columns: Columns, rows: Iterable[Row]) -> None:
    """Write rows as Parquet, whole or not at all; a key that a row lacks is null."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    schema = schema_of(columns)
    rows = iter(rows)
    with replacing(path) as stream, pq.ParquetWriter(stream, schema) as writer:
        while batch := list(islice(rows, ROWS_AT_ONCE)):
            writer.write_table(
                pa.table(
                    {name: [row.get(name) for row in batch] for name in columns}, schema=schema
                )
            )
