"""Files that are whole or not there, and folders with one writer, whatever ends the program."""

import contextlib
import errno
import fcntl
import glob
import os
import re
import shutil
import tempfile
import threading
import zipfile
import zlib
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import IO, Any

from harness.storage.texts import utf_8
from navstack.errors import InputError

# in a suite's folder: its declaration, and a folder that it writes
SUITE, FIGURES = "suite.yaml", "figures"
CELL = re.compile(r"-seed\d+-")  # in the name of the run folder of a suite's cell
# what reading a damaged archive of arrays or table raises
BROKEN = (
    OSError,
    ValueError,
    EOFError,
    LookupError,
    ArithmeticError,
    MemoryError,  # an array that says it is larger than any memory
    NotImplementedError,
    zipfile.BadZipFile,
    zlib.error,
)
# what fsync of a folder raises on file systems that do not know it, as of some shared folders
_NOT_OF_FOLDERS = (errno.EINVAL, errno.ENOTSUP, errno.EBADF)
LOCK = "run.lock"  # in a folder as long as a program writes it


def write_text(path: Path, text: str) -> None:
    """Write a text file, whole or not at all; see :func:`utf_8`."""
    with replacing(path) as stream:
        stream.write(utf_8(text))


def nearby(path: Path) -> Path:
    """An absolute path as seen from the current folder, where it is inside of it."""
    with contextlib.suppress(FileNotFoundError, ValueError):  # it is gone, or elsewhere
        return path.relative_to(Path.cwd())
    return path


def require_writable(what: str, file: Path, suffixes: Sequence[str] = ()) -> None:
    """Check, before the work, that its result can be written to the file that a user names.

    Raises:
        InputError: it has none of the suffixes, is a folder, its folder does not exist, or
            permission is missing.
    """
    if suffixes and file.suffix.lower() not in suffixes:
        raise InputError(
            f"{what} '{file}' cannot be written; give a name that ends with {', '.join(suffixes)}"
        )
    if file.is_dir():
        raise InputError(f"{what} '{file}' cannot be written: it is a folder; give a file")
    if not file.absolute().parent.is_dir():
        raise InputError(
            f"{what} '{file}' cannot be written: its folder does not exist; make it, or choose "
            "another"
        )
    to_write = file
    if not file.exists():
        to_write = file.absolute().parent
    if not os.access(to_write, os.W_OK):
        raise InputError(f"{what} '{file}' cannot be written: permission denied; choose another")


def require_no_input(what: str, out: Path, given: Iterable[str | Path | None]) -> None:
    """Check that a result does not take the place of a file that it is made from.

    Raises:
        InputError: it would.
    """
    files = [Path(each) for each in given if each is not None]
    if out.exists() and any(each.exists() and out.samefile(each) for each in files):
        raise InputError(f"{what} '{out}' is a file that is read; give another name")


def require_folder(path: Path) -> None:
    """Check, before the work, that files can be put into a folder, which may still have to be made.

    Raises:
        InputError: it is no folder, or permission is missing.
    """
    existing = next(folder for folder in (path, *path.absolute().parents) if folder.exists())
    if not existing.is_dir() or not os.access(existing, os.W_OK):
        raise InputError(f"output folder '{path}' cannot be written; choose another")


def require_real_folders(path: Path) -> None:
    """Check that no folder in a run folder is a link.

    Nor, in a suite, the run folder itself or that of the figures.

    Any other run folder may be a link: it stands where the user said.

    Args:
        path: of the run folder; it need not exist.

    Raises:
        InputError: there is such a link; it could lead anywhere.
    """
    folders: list[Path] = []
    if path.is_dir():
        folders += path.iterdir()
    suite = path.absolute().parent
    if CELL.search(path.name) and (suite / SUITE).is_file():
        folders += [path, suite / FIGURES]
    for folder in folders:
        if folder.is_symlink() and not folder.is_file():
            raise InputError(
                f"'{folder}' is a symbolic link, and a run is written to folders of its own only; "
                "put a real folder "
                "in its place, or remove it"
            )


@contextlib.contextmanager
def writing(what: Path) -> Iterator[None]:
    """Say in one line that a file or folder cannot be written.

    Raises:
        InputError: it cannot.
    """
    try:
        yield
    except OSError as error:
        raise InputError(
            f"'{what}' cannot be written ({error.strerror}); make room or choose another place"
        ) from None


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[IO[bytes]]:
    """A stream that takes a file's place once it is complete and on disk.

    A power cut leaves the old or the new one.
    """
    # of its own: another program, or thread, may write the same file
    owner = f"{os.getpid()}-{threading.get_ident()}"
    partial = path.with_name(f"{path.name}.{owner}.partial")
    try:
        with open(partial, "wb", opener=no_links) as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        partial.replace(path)
    except BaseException as error:
        partial.unlink(missing_ok=True)
        # a full disk does not say which file it lacks room for
        if isinstance(error, OSError) and error.filename in (None, str(partial)):
            error.filename = str(path)
        raise
    sync_folder(path.parent)


@contextlib.contextmanager
def arriving_together(folder: Path, name: str) -> Iterator[Path]:
    """A folder whose files are put into another one once they are all complete.

    What an interrupt, a full disk or a killed program leaves is never half of a map.

    Args:
        folder: where they are put; it is made if need be.
        name: of what they make up; what a killed program left of it is removed.

    Raises:
        InputError: the folder cannot be written.
    """
    with writing(folder):
        folder.mkdir(parents=True, exist_ok=True)
        for left in folder.glob(f".{glob.escape(name)}.*.partial"):
            with contextlib.suppress(InputError), locked(left):  # nobody writes it any more
                shutil.rmtree(left)
        partial = Path(tempfile.mkdtemp(prefix=f".{name}.", suffix=".partial", dir=folder))
    try:
        with locked(partial):
            yield partial
            with writing(folder):
                for file in sorted(partial.iterdir()):
                    if file.name != LOCK:
                        file.replace(folder / file.name)
    finally:
        shutil.rmtree(partial, ignore_errors=True)


def no_links(path: str, flags: int) -> int:
    """An opener for what is written in a folder that may come from others.

    A link there could lead to any file.

    Raises:
        OSError: the path is a symbolic link.
    """
    return os.open(path, flags | os.O_NOFOLLOW, 0o666)


def sync_folder(path: Path) -> None:
    """Put the names in a folder on disk, where its file system does that."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in _NOT_OF_FOLDERS:
            raise
    finally:
        os.close(descriptor)


@contextlib.contextmanager
def locked(path: Path) -> Iterator[IO[str]]:
    """Hold a run folder for oneself; the lock, which is yielded, dies with the process.

    Raises:
        InputError: another process holds it.
        OSError: it cannot be written.
    """
    while True:
        with open(path / LOCK, "w", opener=no_links) as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise InputError(
                    f"run folder '{path}' is being written by another run; wait for its end"
                ) from None
            if not is_same_file(lock, path / LOCK):
                continue  # its last holder was just removing it
            try:
                yield lock
            finally:
                if is_same_file(lock, path / LOCK):
                    (path / LOCK).unlink(missing_ok=True)
            return


def is_same_file(stream: IO[Any], path: Path) -> bool:
    """Whether an open file is the one that lies at a path."""
    with contextlib.suppress(FileNotFoundError, NotADirectoryError):
        return os.path.samestat(os.fstat(stream.fileno()), path.stat())
    return False
