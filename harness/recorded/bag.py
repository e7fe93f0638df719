"""A recorded log: all its files together, their messages in the order of arrival."""

import contextlib
import shutil
import tempfile
from array import array
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np
import pyarrow as pa

from harness.recorded import mcap_file, ros1_file, sqlite_file
from harness.recorded.bag_file import COLUMNS, MOST_TOPICS, BagError, BagFile, DamageError, Topic
from harness.recorded.blocks import decompress_message
from harness.recorded.copies import require_each_once, require_no_copies
from harness.recorded.mcap_file import McapFile
from harness.recorded.ros1_file import Ros1File
from harness.recorded.sqlite_file import SqliteFile
from navstack.errors import ParameterError
from navstack.files import check_regular
from navstack.params.nav2_file.yaml_text import MAX_CHARACTERS, load_text

KINDS: dict[bytes, type[BagFile]] = {
    ros1_file.MAGIC: Ros1File,
    mcap_file.MAGIC: McapFile,
    sqlite_file.MAGIC: SqliteFile,
}
METADATA = "metadata.yaml"
SUFFIXES = (".bag", ".mcap", ".db3")
SET_BACK = 1_000_000_000  # [ns] by which messages of a topic are not written out of order
MOST_BACK, MOST_STEPS = 0.01, 100  # [-] of the messages, where a clock was set; how often
MOST_FILES = 1000
LARGEST_FILE = 1 << 40  # [bytes]
LARGEST_UNPACKED = 16 << 30  # [bytes] of a file that was compressed as a whole
_ZSTD = b"\x28\xb5\x2f\xfd"
_PACKED = (".zst", ".zstd", ".gz", ".bz2")  # suffixes of files compressed as a whole
# what such files begin with
_PACKERS = {_ZSTD: "zstd", b"\x1f\x8b": "gzip", b"BZh": "bz2"}
_PIECE = 1 << 20  # [bytes]


@dataclass(frozen=True, slots=True)
class Message:
    """A message as it stands in a bag."""

    topic: Topic
    arrival: float  # [s] when it was recorded
    content: bytes


class Bag:
    """Files of one log; to be used as a context."""

    def __init__(self, paths: Sequence[Path], types: frozenset[str]) -> None:
        """Scan the files of a log: one or more files, or a folder of ROS 2.

        Raises:
            BagError: there is none, or it is no bag.
        """
        self._stack = contextlib.ExitStack()
        try:
            found = [path for given in paths for path in self._files_of(given)]
            require_each_once(found)
            self._files = [self._open(path, types) for path in found]
        except BaseException:
            self._stack.close()
            raise
        require_no_copies(self._files)
        self._index = _joined(self._files)

    def __enter__(self) -> "Bag":
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    @property
    def damage(self) -> str | None:
        """Where the first damaged file breaks off; None: all are whole."""
        return next((file.damage for file in self._files if file.damage), None)

    @property
    def topics(self) -> dict[str, str]:
        """The type of every topic by name; the first one where a name has several."""
        types: dict[str, str] = {}
        for file in self._files:
            for topic in file.topics:
                types.setdefault(topic.name, topic.type)
        return types

    def counts(self) -> dict[str, int]:
        """How many messages each topic has, of those whose type is read."""
        counts = dict.fromkeys(self.topics, 0)
        for key, count in zip(*np.unique(self._index[:, 0], return_counts=True), strict=True):
            counts[self._topic(int(key)).name] += int(count)
        return counts

    def _topic(self, key: int) -> Topic:
        """The topic that the first column of the index stands for."""
        return self._files[key // MOST_TOPICS].topics[key % MOST_TOPICS]

    def places(self, names: Collection[str]) -> np.ndarray:
        """Rows of the index, one for each message of the topics, in the order of arrival.

        See :meth:`read`.
        """
        types = self.topics
        keys = [
            number * MOST_TOPICS + topic
            for number, file in enumerate(self._files)
            for topic, about in enumerate(file.topics)
            if about.name in names and about.type == types[about.name]
        ]
        return self._index[np.isin(self._index[:, 0], keys)]

    def read(self, place: np.ndarray) -> Message:
        """The message at a row of :meth:`places`.

        Raises:
            DamageError: it cannot be read.
        """
        key, time, *where = place.tolist()
        content = self._files[key // MOST_TOPICS].read(*where)
        topic = self._topic(key)
        if topic.encoding == "cdr" and content.startswith(_ZSTD):  # which begins with a 0 else
            content = decompress_message(content)
        return Message(topic, time * 1e-9, content)

    def _open(self, path: Path, types: frozenset[str]) -> BagFile:
        """A scanned file."""
        with _clear_errors(path):
            check_regular(path, LARGEST_FILE)
            with path.open("rb") as stream:
                start = stream.read(16)
            given = path
            packer = next((name for magic, name in _PACKERS.items() if start.startswith(magic)), "")
            if packer:
                path = self._unpack(given, packer)
                with path.open("rb") as stream:
                    start = stream.read(16)
            kind = next((kind for magic, kind in KINDS.items() if start.startswith(magic)), None)
            if kind is None:
                what = "is no bag"
                if not start:
                    what = "holds nothing that can be unpacked" if packer else "is empty"
                raise BagError(
                    f"bag '{given}' {what}; give a .bag, .mcap or .db3 file or a folder of ROS 2"
                )
            file = kind(path, types)
        self._stack.callback(file.close)
        file.scan()
        return file

    def _unpack(self, path: Path, packer: str) -> Path:
        """A file that was compressed as a whole, decompressed into a folder of this bag."""
        folder = self._stack.enter_context(tempfile.TemporaryDirectory(prefix="navbench-"))
        unpacked, done = Path(folder) / path.name, 0
        with (
            _as_far_as_whole(),
            pa.input_stream(str(path), compression=packer) as stream,
            unpacked.open("wb") as out,
        ):
            free = shutil.disk_usage(folder).free // 2
            while piece := stream.read(_PIECE):
                done += len(piece)
                if done > min(LARGEST_UNPACKED, free):
                    raise BagError(
                        f"bag '{path}' decompresses to more than {min(LARGEST_UNPACKED, free)} "
                        "bytes"
                    )
                out.write(piece)
        return unpacked

    def _files_of(self, path: Path) -> list[Path]:
        """The files of a log: as ``metadata.yaml`` lists them, or without it by their names."""
        if path.name == METADATA:
            path = path.parent
        if not path.is_dir():
            return [path]
        about: dict[str, Any] = {}
        if (path / METADATA).exists():
            about = _metadata(path / METADATA)
        listed = about.get("relative_file_paths")
        if listed is None:
            found = sorted(
                file for file in path.iterdir() if _unpacked_name(file).endswith(SUFFIXES)
            )
        elif isinstance(listed, list) and all(isinstance(name, str) for name in listed):
            # never a file outside the folder
            found = [path / PurePosixPath(name).name for name in listed]
        else:
            raise BagError(
                f"bag '{path / METADATA}': relative_file_paths is not a list of file names"
            )
        if not 0 < len(found) <= MOST_FILES:
            raise BagError(f"bag '{path}' has {len(found)} bag files; 1 to {MOST_FILES} are read")
        return found


def files_read(paths: Sequence[Path]) -> list[Path]:
    """The paths of a log, and what is read of folders among them."""
    found = list(paths)
    for folder in (path for path in paths if path.is_dir()):
        found += [
            file
            for file in folder.iterdir()
            if file.name == METADATA or _unpacked_name(file).endswith(SUFFIXES)
        ]
    return found


@contextlib.contextmanager
def _as_far_as_whole() -> Iterator[None]:
    """Within it reading ends where a compressed file is damaged; errors of the disk are passed on.

    Raises:
        OSError: of the disk, which has a number.
    """
    try:
        yield
    except pa.ArrowException:
        return
    except OSError as error:
        if error.errno is not None:
            raise


def _unpacked_name(file: Path) -> str:
    """The name of a file without the suffix of compression as a whole."""
    return file.stem if file.suffix in _PACKED else file.name


def _metadata(path: Path) -> dict[str, Any]:
    """What ``metadata.yaml`` says of a bag of ROS 2."""
    with _clear_errors(path):
        check_regular(path, 4 * MAX_CHARACTERS)
        text = path.read_text(errors="replace")
    try:
        content = load_text(text, f"bag '{path}'")
    except ParameterError as error:
        raise BagError(str(error)) from None
    about = None
    if isinstance(content, dict):
        about = content.get("rosbag2_bagfile_information")
    if not isinstance(about, dict):
        raise BagError(
            f"bag '{path}' has no section rosbag2_bagfile_information; without this file the "
            "folder is read by its files' names"
        )
    return about


@contextlib.contextmanager
def _clear_errors(path: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise BagError(f"bag '{path}' cannot be read: {error.strerror or error}") from None
    except DamageError as error:
        raise BagError(f"bag '{path}' cannot be read: it {error}") from None


def _joined(files: Sequence[BagFile]) -> np.ndarray:
    """The indices of files as one, in the order of arrival.

    The topics' numbers count on from file to file.
    """
    parts = []
    for number, file in enumerate(files):
        rows = np.array(file.index, dtype=np.int64).reshape(-1, COLUMNS)
        file.index = array("q")  # it may be large
        _run_on(rows)
        rows[:, 0] += number * MOST_TOPICS
        parts.append(rows)
    index = np.concatenate(parts)
    if (np.diff(index[:, 1]) < 0).any():
        index = index[np.argsort(index[:, 1], kind="stable")]
    return index


def _run_on(rows: np.ndarray) -> None:
    """Let times run on where the recorder's clock was set back: rows (N, COLUMNS) as in the file.

    It was where two times of a topic are more than ``SET_BACK`` before the two before them. Unless
    that is so everywhere, or topics end there: then the file is not in the order of arrival.
    """
    by_topic = np.argsort(rows[:, 0], kind="stable")
    same = rows[by_topic[3:], 0] == rows[by_topic[:-3], 0]
    for _ in range(MOST_STEPS):
        times = rows[by_topic, 1]
        before = np.minimum(times[:-3], times[1:-2])
        after = np.maximum(times[2:-1], times[3:])
        back = by_topic[2:-1][same & (before - after > SET_BACK)]
        if not 0 < len(back) <= MOST_BACK * len(rows):
            return
        first = back.min()
        lately = rows[:first, 1] > rows[first - 1, 1] - SET_BACK
        if not np.isin(rows[:first, 0][lately], rows[first:, 0]).all():
            return
        rows[first:, 1] += rows[first - 1, 1] - rows[first, 1]
