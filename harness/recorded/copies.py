"""Files of one log that hold the same messages, which would count twice."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from harness.recorded.bag_file import COLUMNS, BagError, BagFile
from navstack.types import IntArray

_SHARED = 0.5  # [-] of a file's messages that another one has from which it is a copy


def require_each_once(paths: Sequence[Path]) -> None:
    """Refuse a file that is given twice, by whatever name.

    Raises:
        BagError: it is.
    """
    seen: dict[tuple[int, int], Path] = {}
    for path in paths:
        try:
            about = path.stat()
        except OSError:
            continue  # opening it tells what is wrong
        key = about.st_dev, about.st_ino
        before = seen.get(key)
        if before is None:
            seen[key] = path
            continue
        name = ""
        if before != path:
            name = f", also as '{before}'"
        raise BagError(f"bag '{path}' is given twice{name}; give each once")


def require_no_copies(files: Sequence[BagFile]) -> None:
    """Refuse files most of whose messages another file has, too.

    Raises:
        BagError: there is one.
    """
    if len(files) < 2:
        return
    keys, numbers = _messages_of(files)
    order = np.lexsort((numbers, keys[:, 1], keys[:, 0]))
    keys, numbers = keys[order], numbers[order]
    is_same = (keys[1:] == keys[:-1]).all(axis=1) & (numbers[1:] != numbers[:-1])
    pairs = np.column_stack((numbers[:-1], numbers[1:]))[is_same]
    found, counts = np.unique(pairs, axis=0, return_counts=True)
    sizes = np.bincount(numbers, minlength=len(files))
    for (one, other), count in zip(found.tolist(), counts.tolist(), strict=True):
        if count > _SHARED * min(sizes[one], sizes[other]):
            raise BagError(
                f"bags '{files[one].path}' and '{files[other].path}' hold the same messages "
                f"({count} of topic and time alike); give each message once"
            )


def _messages_of(files: Sequence[BagFile]) -> tuple[IntArray, IntArray]:
    """Topic and time (N, 2) of all messages, and the file (N,) that each stands in.

    Topics have one number in all files; files whose messages all came at once tell no times.
    """
    names: dict[str, int] = {}
    keys, numbers = [np.empty((0, 2), dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    for number, file in enumerate(files):
        rows = np.array(file.index, dtype=np.int64).reshape(-1, COLUMNS)
        if not len(rows) or np.ptp(rows[:, 1]) == 0:
            continue
        shared = [names.setdefault(topic.name, len(names)) for topic in file.topics]
        keys.append(np.column_stack((np.array(shared)[rows[:, 0]], rows[:, 1])))
        numbers.append(np.full(len(rows), number))
    return np.concatenate(keys), np.concatenate(numbers)
