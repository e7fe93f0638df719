"""What is kept of a run whose folder is removed, moved or replaced while a program drives it."""

import contextlib
import itertools
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import IO, Any

from harness.storage.files import is_same_file, replacing
from harness.storage.texts import quoted
from navstack.errors import InputError


def is_in_place(*streams: IO[Any]) -> bool:
    """Whether open files are still those at their paths."""
    return all(is_same_file(stream, Path(stream.name)) for stream in streams)


@contextlib.contextmanager
def opened_folder(path: Path) -> Iterator[Path]:
    """A path into a folder, whatever it is called later, where the system has such paths."""
    descriptor = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    inside = Path(f"/proc/self/fd/{descriptor}")
    if not inside.exists():
        inside = path
    try:
        yield inside
    finally:
        os.close(descriptor)


def contents(folder: Path, patterns: tuple[str, ...]) -> dict[str, bytes]:
    """The files of a folder that fit patterns, by name."""
    files = [file for pattern in patterns for file in folder.glob(pattern) if file.is_file()]
    return {str(file.relative_to(folder)): file.read_bytes() for file in files}


def rescued(path: Path, texts: Mapping[str, bytes], journal: IO[bytes]) -> Path:
    """A new run folder beside the place of the old one, or where that cannot be, a temporary one.

    Args:
        path: where the old one was.
        texts: contents of the files that it began with.
        journal: its journal, which may have no name any more.

    Raises:
        OSError: it cannot be written.
    """
    folder = _new_folder(path)
    for name, content in texts.items():
        file = folder / name
        file.parent.mkdir(exist_ok=True)
        file.write_bytes(content)
    journal.seek(0)
    with (folder / Path(journal.name).name).open("wb") as copy:
        shutil.copyfileobj(journal, copy)
    return folder


def copy_files(old: Path, new: Path, names: Iterable[str]) -> None:
    """Copy those files of a folder that are still there into another one, as far as it can be."""
    with contextlib.suppress(OSError):
        new.mkdir(exist_ok=True)
    for name in names:
        if (old / name).is_file() and not (old / name).is_symlink():
            with contextlib.suppress(OSError), replacing(new / name) as copy:
                copy.write((old / name).read_bytes())


def lost_folder(path: Path, folder: Path, count: int, gone: int = 0) -> InputError:
    """What stops a program whose run folder went.

    Its ``count`` deliveries are in ``folder``, but for ``gone`` files of what was recorded of them.
    """
    without = ""
    if gone:
        without = f", but {gone} files of their recordings went with it"
    return InputError(
        f"run folder '{path}' was removed, moved or replaced while this program drove: it stops; "
        f"its {count} finished deliveries are kept{without}; go on with --resume {quoted(folder)}"
    )


def _new_folder(path: Path) -> Path:
    for number in itertools.count(1):
        folder = path.with_name(f"{path.name}-rescued-{number}")
        try:
            folder.mkdir(parents=True)
        except FileExistsError:
            continue
        except OSError:
            break
        return folder
    return Path(tempfile.mkdtemp(prefix=f"{path.name}-rescued-"))
