"""How much of a table is unpacked at once."""

from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from harness.storage import tables


@pytest.mark.parametrize(("most", "rows"), [(40, 10_000), (4, 10_000), (0.4, 1000), (4e-3, 10), (4e-6, 1)])
def test_long_texts_are_unpacked_in_few_rows_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, most: float, rows: int
) -> None:
    pq.write_table(
        pa.table({"error": ["a" * 900, "b"], "episode": [1, 2]}), tmp_path / "a.parquet", use_dictionary=False
    )
    metadata = pq.ParquetFile(tmp_path / "a.parquet").metadata
    size = metadata.row_group(0).column(0).total_uncompressed_size
    monkeypatch.setattr(tables, "MOST_BYTES", int(most * 10_000 * size) + 1)
    assert tables._rows_at_once(metadata) == rows
