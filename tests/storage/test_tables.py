"""How much of a table is unpacked at once."""

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from harness.storage import tables
from navstack.errors import InputError


@pytest.mark.parametrize(
    ("most", "rows"), [(40, 10_000), (4, 10_000), (0.4, 1000), (4e-3, 10), (4e-6, 1)]
)
def test_long_texts_are_unpacked_in_few_rows_at_once(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    most: float,
    rows: int,
) -> None:
    pq.write_table(
        pa.table({"error": ["a" * 900, "b"], "episode": [1, 2]}),
        tmp_path / "a.parquet",
        use_dictionary=False,
    )
    metadata = pq.ParquetFile(tmp_path / "a.parquet").metadata
    size = metadata.row_group(0).column(0).total_uncompressed_size
    monkeypatch.setattr(tables, "MOST_BYTES", int(most * 10_000 * size) + 1)
    assert tables._rows_at_once(metadata) == rows


@pytest.mark.parametrize(("spare", "is_read"), [(0, True), (-1, False)])
def test_a_table_may_unpack_to_as_many_bytes_as_are_allowed(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    spare: int,
    is_read: bool,
) -> None:
    """Twenty thousand numbers that are all alike are a small file, and unpacked in two batches."""
    path, columns = tmp_path / "a.parquet", {"episode": "int64"}
    tables.write_table(path, columns, ({"episode": 7} for _ in range(20_000)))
    unpacked = sum(batch.nbytes for batch in pq.ParquetFile(path).iter_batches(10_000))
    monkeypatch.setattr(tables, "MOST_BYTES", unpacked + spare)
    if is_read:
        assert len(tables.read_rows(path, columns)) == 20_000
    else:
        with pytest.raises(
            InputError,
            match=f"its columns hold more than any run; at most {unpacked - 1} bytes are",
        ):
            tables.read_rows(path, columns)
