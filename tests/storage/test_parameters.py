"""Parameter files of a stored run, kept as one."""

import gzip
from pathlib import Path

import pytest

from harness.storage.parameters import MOST_BYTES, PACKED, parameter_folder, write_packed
from navstack.errors import InputError


def test_packed_files_come_back_as_they_were(tmp_path: Path) -> None:
    texts = {"prices.yaml": "value: 8000\r\n", "rules.yaml": "note: 5 € a fee\n"}
    write_packed(tmp_path, texts)
    folder = parameter_folder(tmp_path)
    for name, text in texts.items():
        assert (folder / name).read_bytes().decode() == text


def test_the_same_files_are_the_same_bytes(tmp_path: Path) -> None:
    contents = []
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        write_packed(tmp_path / name, {"rules.yaml": "way_back: true\n"})
        contents.append((tmp_path / name / PACKED).read_bytes())
    assert contents[0] == contents[1]


WHOLE = gzip.compress(b'{"rules.yaml": "way_back: true"}' * 100)
DAMAGED = {
    "an empty file": b"",
    "not packed": b'{"rules.yaml": "way_back: true"}',
    "cut off": WHOLE[: len(WHOLE) // 2],
    "a changed byte": WHOLE[:-6] + b"\0" + WHOLE[-5:],
    "a list": gzip.compress(b"[1, 2]"),
    "a number for a text": gzip.compress(b'{"rules.yaml": 3}'),
    "a name outside": gzip.compress(b'{"../a": "a"}'),
    "the folder above": gzip.compress(b'{"..": "a"}'),
    "no name": gzip.compress(b'{"": "a"}'),
    "a zero in a name": gzip.compress(b'{"a\\u0000b": "a"}'),
    "half a character": gzip.compress(b'{"rules.yaml": "\\ud800"}'),
    "too large": gzip.compress(b" " * (MOST_BYTES + 1)),
}


# The packed bytes hold the time, so they cannot name a case: two workers would not agree on it.
@pytest.mark.parametrize("case", DAMAGED)
def test_a_damaged_file_is_told_in_one_line(tmp_path: Path, case: str) -> None:
    (tmp_path / PACKED).write_bytes(DAMAGED[case])
    with pytest.raises(InputError, match=r"parameters\.json\.gz: is damaged \(.*take a whole copy"):
        parameter_folder(tmp_path)
