"""What tells whether a run folder was changed.

Checksums of its files, and one in each line of a journal.
"""

import hashlib
import json
import re
import zlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from harness.storage.files import write_text
from harness.storage.texts import utf_8

CHECKSUMS = "checksums.json"  # SHA-256 of each file below, by name
OF_ALL = ("run.json", "params/*", "parameters.json.gz")
OF_FINISHED = ("*.parquet", "summary.json")  # as long as there is a journal, these follow from it
RECORDINGS = "recordings/*"
_SEAL = re.compile(rb', "crc": "([0-9a-f]{8})"\}\n')
_SEALED = len(b', "crc": "01234567"}\n')


def sealed(text: str) -> bytes:
    """An object in JSON, of at least one key, as a line with its checksum."""
    return f'{text[:-1]}, "crc": "{zlib.crc32(text.encode()):08x}"}}\n'.encode()


def unsealed(line: bytes) -> bytes:
    """The JSON text of a line; one without checksum, as older versions wrote it, is taken as it is.

    Raises:
        ValueError: it is not what was written.
    """
    seal = _SEAL.fullmatch(line[-_SEALED:])
    if seal is None:
        return line
    text = line[:-_SEALED] + b"}"
    if zlib.crc32(text) != int(seal[1], 16):
        raise ValueError("its checksum is another one")
    return text


def write_checksums(folder: Path, coming: Mapping[str, str] | None = None) -> None:
    """Note the files of a run folder as they are.

    Of those that are to be written next, the texts are given.
    """
    known = {name: _digest(utf_8(text)) for name, text in (coming or {}).items()}
    _write(folder, _digests(folder, (*OF_ALL, *OF_FINISHED, RECORDINGS)) | known)


def note_tables(folder: Path) -> None:
    """Note the tables, the summary and the recordings of a run as they are now.

    The other files stay as they were noted.
    """
    if (folder / CHECKSUMS).exists() and (known := _known(folder)) is not None:
        _write(folder, known | _digests(folder, (*OF_FINISHED, RECORDINGS)))


def is_noted(folder: Path, name: str, content: bytes) -> bool:
    """Whether a file with this content is what was noted for a name."""
    return (_known(folder) or {}).get(name) == _digest(content)


def root_digest(folder: Path) -> str | None:
    """SHA-256 of the file of checksums, which stands for the whole run; None: there is none."""
    if not (folder / CHECKSUMS).is_file():
        return None
    return _digest((folder / CHECKSUMS).read_bytes())


def _write(folder: Path, digests: Mapping[str, str]) -> None:
    write_text(folder / CHECKSUMS, json.dumps(digests, indent=1, sort_keys=True) + "\n")


def _known(folder: Path) -> dict[str, str] | None:
    """The noted checksums; None: their file is damaged."""
    try:
        content = json.loads((folder / CHECKSUMS).read_text(encoding="utf-8"))
        return {str(name): str(digest) for name, digest in content.items()}
    except (OSError, ValueError, AttributeError, RecursionError):
        return None


def changed_files(folder: Path, is_finished: bool, with_recordings: bool = False) -> list[str]:
    """Files of a run folder that are not as they were written, or that are missing.

    None in one without checksums.

    Args:
        folder: of a run.
        is_finished: whether its tables count, too; else they follow from the journal.
        with_recordings: whether the recordings of a finished run count, which may be many.
    """
    if not (folder / CHECKSUMS).is_file():
        return []
    known = _known(folder)
    if known is None:
        return [CHECKSUMS]
    patterns: tuple[str, ...] = OF_ALL
    whole: tuple[str, ...] = OF_ALL  # of which none may be added; a study may add tables
    if is_finished:
        patterns += OF_FINISHED
    if is_finished and with_recordings and _fitting(known, (RECORDINGS,)):
        patterns += (RECORDINGS,)
        whole += (RECORDINGS,)
    there = _digests(folder, patterns)
    wanted = _fitting(known, patterns)
    added = _digests(folder, whole).keys()
    return sorted(
        name
        for name in wanted | (there.keys() & (known.keys() | added))
        if there.get(name) != known.get(name)
    )


def _fitting(names: Iterable[str], patterns: Sequence[str]) -> set[str]:
    """The names that fit a pattern, none of which is for a folder and what is below it."""
    return {
        name
        for name in names
        for pattern in patterns
        if name.count("/") == pattern.count("/") and Path(name).match(pattern)
    }


def _digests(folder: Path, patterns: tuple[str, ...]) -> dict[str, str]:
    """SHA-256 of the files of a folder that fit the patterns, by name."""
    files = sorted(path for pattern in patterns for path in folder.glob(pattern) if path.is_file())
    return {str(path.relative_to(folder)): _digest(path.read_bytes()) for path in files}


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()
