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


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b'{"rules.yaml": "way_back: true"}',
        WHOLE[: len(WHOLE) // 2],
        WHOLE[:-6] + b"\0" + WHOLE[-5:],
        gzip.compress(b"[1, 2]"),
        gzip.compress(b'{"rules.yaml": 3}'),
        *(gzip.compress(b'{"%s": "a"}' % name) for name in (b"../a", b"..", b"", b"a\\u0000b")),
        gzip.compress(b'{"rules.yaml": "\\ud800"}'),
        gzip.compress(b" " * (MOST_BYTES + 1)),
    ],
)
def test_a_damaged_file_is_told_in_one_line(tmp_path: Path, content: bytes) -> None:
    (tmp_path / PACKED).write_bytes(content)
    with pytest.raises(InputError, match=r"parameters\.json\.gz: is damaged \(.*take a whole copy"):
        parameter_folder(tmp_path)
