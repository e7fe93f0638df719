"""What may be opened of the files that a user received, and what may be loaded and run."""

import errno
import os
import stat
import zlib
from pathlib import Path

CHECK_BYTES = 4  # of a CRC-32, little endian


def named_by(folder: Path, name: str) -> Path:
    """The file that another file in ``folder`` names.

    ``~/`` begins at the user's own folder, as nav2_map_server has it, where HOME names one.
    """
    home = os.environ.get("HOME", "")
    if home and name.startswith("~/"):
        return Path(home, name[2:])
    return folder / name


def check_regular(path: Path, most: int) -> None:
    """Check a file before it is opened; a pipe would be waited for and a device read without end.

    Args:
        path: of the file.
        most: [bytes] that it may have.

    Raises:
        OSError: the file is absent, no regular file, or too large; ``strerror`` says which.
    """
    try:
        status = path.stat()
    except ValueError as error:
        raise OSError(errno.EINVAL, f"no file here has such a name: {error}") from None
    if stat.S_ISDIR(status.st_mode):
        raise OSError(errno.EISDIR, os.strerror(errno.EISDIR))
    if not stat.S_ISREG(status.st_mode):
        raise OSError(errno.EINVAL, "a pipe or a device, not a file")
    if status.st_size > most:
        raise OSError(errno.EFBIG, f"{status.st_size} bytes, at most {most} are read")


def check_of(content: bytes) -> bytes:
    """What stands at the end of a file that :func:`is_whole` may be asked about."""
    return zlib.crc32(content).to_bytes(CHECK_BYTES, "little")


def is_whole(path: Path) -> bool:
    """Whether a file is as it was written: it ends with the CRC-32 of all before it."""
    try:
        content = path.read_bytes()
    except OSError:
        return False
    before, check = content[:-CHECK_BYTES], content[-CHECK_BYTES:]
    return bool(before) and check == check_of(before)


def is_private(path: Path) -> bool:
    """Whether a file or folder is this user's own and nobody else can write it.

    Code that lies there may be run.
    """
    try:
        status = path.stat()
    except OSError:
        return False
    return status.st_uid == os.getuid() and not status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
