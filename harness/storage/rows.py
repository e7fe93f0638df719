"""Rows of a table in Arrow's columns: 0.7 MB for 1000 deliveries, of which dicts take 9 MB."""

import itertools
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, cast, overload

if TYPE_CHECKING:
    import pyarrow as pa

Row = dict[str, Any]
Columns = Mapping[str, str]  # column name -> Arrow type

AT_ONCE = 1000  # rows that are dicts at a time


class Rows(Sequence[Row]):
    """A sequence of rows, each made when it is asked for; ask :func:`values` for a column of many.

    It can be appended to. An interrupt leaves the new row in it or not, nothing else.
    """

    def __init__(self, columns: Columns, batches: "Iterable[pa.RecordBatch]" = ()) -> None:
        """``batches`` have all columns."""
        self._columns = columns
        # the last ones are still dicts
        self._kept: tuple[list[pa.RecordBatch], list[Row]] = (list(batches), [])

    def __len__(self) -> int:
        batches, last = self._kept
        return sum(int(batch.num_rows) for batch in batches) + len(last)

    def __iter__(self) -> Iterator[Row]:
        batches, last = self._kept
        for batch in batches:
            for begin in range(0, batch.num_rows, AT_ONCE):
                yield from batch.slice(begin, AT_ONCE).to_pylist()
        yield from map(self._whole, last)

    @overload
    def __getitem__(self, index: int) -> Row: ...
    @overload
    def __getitem__(self, index: slice) -> "Rows": ...
    def __getitem__(self, index: int | slice) -> "Row | Rows":
        if isinstance(index, slice):
            return self.take(range(len(self))[index])
        number = range(len(self))[index]
        batches, last = self._kept
        for batch in batches:
            if number < batch.num_rows:
                return cast(Row, batch.slice(number, 1).to_pylist()[0])
            number -= batch.num_rows
        return self._whole(last[number])

    def append(self, row: Row) -> None:
        """Add a row; keys that are no columns are dropped, columns that it lacks are null."""
        if len(self._kept[1]) >= AT_ONCE:
            self._kept = (self._batches(), [])
        self._kept[1].append(row)

    def drop_last(self) -> None:
        """Take the row out that was appended last."""
        self._kept[1].pop()

    def values(self, name: str) -> list[Any]:
        """A column; None where it is null."""
        batches, last = self._kept
        if name not in self._columns:
            return [None] * len(self)
        whole = itertools.chain.from_iterable(batch.column(name).to_pylist() for batch in batches)
        return [*whole, *(row.get(name) for row in last)]

    def take(self, numbers: Sequence[int]) -> "Rows":
        """The rows of these numbers, in their order."""
        import pyarrow as pa

        table = pa.Table.from_batches(self._batches(), schema_of(self._columns))
        return Rows(self._columns, table.take(pa.array(numbers, pa.int64())).to_batches())

    def where(self, is_wanted: Callable[..., bool], *names: str) -> "Rows":
        """The rows whose values in some columns are as wanted."""
        columns = [self.values(name) for name in names]
        numbers = []
        for number, cells in enumerate(zip(*columns, strict=True)):
            if is_wanted(*cells):
                numbers.append(number)
        return self.take(numbers)

    def _whole(self, row: Row) -> Row:
        return {name: row.get(name) for name in self._columns}

    def _batches(self) -> "list[pa.RecordBatch]":
        """All rows as Arrow keeps them."""
        import pyarrow as pa

        batches, last = self._kept
        if not last:
            return batches
        columns = {name: [row.get(name) for row in last] for name in self._columns}
        return [*batches, pa.record_batch(columns, schema=schema_of(self._columns))]


def values(rows: Sequence[Mapping[str, Any]], name: str) -> list[Any]:
    """A column of rows; None where it is null or missing."""
    if isinstance(rows, Rows):
        return rows.values(name)
    return [row.get(name) for row in rows]


def take(rows: Sequence[Row], numbers: Sequence[int]) -> Sequence[Row]:
    """The rows of these numbers, in their order."""
    if isinstance(rows, Rows):
        return rows.take(numbers)
    return [rows[number] for number in numbers]


def schema_of(columns: Columns) -> "pa.Schema":
    """The schema of a table with these columns."""
    import pyarrow as pa

    return pa.schema([(name, pa.type_for_alias(kind)) for name, kind in columns.items()])
