"""No compiled code is run that is damaged, or of another source or other types."""

from pathlib import Path
from typing import Any

import pytest

from navstack.kernel_cache import CheckedCacheFile

FLOATS, INTS = ("float64",), ("int64",)


def kernel(folder: Path, stamp: bytes = b"source") -> Any:
    make: Any = CheckedCacheFile
    return make(str(folder), "kernel", stamp)


def test_code_is_kept_by_its_types(tmp_path: Path) -> None:
    kernel(tmp_path).save(FLOATS, b"of floats")
    kernel(tmp_path).save(INTS, b"of ints")
    assert kernel(tmp_path).load(FLOATS) == b"of floats"
    assert kernel(tmp_path).load(INTS) == b"of ints"
    assert kernel(tmp_path).load(("bool",)) is None
    assert kernel(tmp_path, b"another source").load(INTS) is None


@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("damage", ["emptied", "cut off", "zeros", "one byte"])
def test_what_is_damaged_counts_as_absent(tmp_path: Path, ending: str, damage: str) -> None:
    kernel(tmp_path).save(FLOATS, b"code of floats")
    (file,) = tmp_path.glob(f"*.{ending}")
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    size = len(content)
    known = {"emptied": b"", "cut off": content[:-9], "zeros": bytes(size), "one byte": content}
    file.write_bytes(known[damage])
    assert kernel(tmp_path).load(FLOATS) is None
    kernel(tmp_path).save(FLOATS, b"new code")
    assert kernel(tmp_path).load(FLOATS) == b"new code"


@pytest.mark.parametrize("other", ["source", "types"])
def test_other_code_under_the_name_that_the_index_tells_is_not_taken(
    tmp_path: Path, other: str
) -> None:
    if other == "source":
        kernel(tmp_path, b"an earlier source").save(FLOATS, b"old code")
    else:
        kernel(tmp_path).save(INTS, b"of ints")
    (code,) = tmp_path.glob("*.nbc")
    before = code.read_bytes()
    (tmp_path / "kernel.nbi").unlink()
    kernel(tmp_path).save(FLOATS, b"of floats")
    code.write_bytes(before)  # as after a kill between the index and the code
    assert kernel(tmp_path).load(FLOATS) is None


def test_what_cannot_be_kept_is_passed_over(tmp_path: Path) -> None:
    (tmp_path / "kernel.nbi").mkdir()
    kernel(tmp_path).save(FLOATS, b"code")
    assert kernel(tmp_path).load(FLOATS) is None
