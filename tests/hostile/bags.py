"""Recorded logs: bags of ROS 1, SQLite and MCAP, metadata of ROS 2, and reference trajectories."""

import sqlite3
import struct
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing
from pathlib import Path

import pyarrow as pa

from .case import Case, Make, pipe, put
from .yaml_attacks import ATTACKS

_FIX, _ODOMETRY = b"sensor_msgs/NavSatFix", b"nav_msgs/Odometry"
_SCHEMA = """CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT,
    serialization_format TEXT, offered_qos_profiles TEXT);
INSERT INTO topics VALUES (1, '/fix', 'sensor_msgs/msg/NavSatFix', 'cdr', '');"""
_MESSAGES = (
    "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);"
)
_METADATA = """rosbag2_bagfile_information:
  version: 5
  storage_identifier: sqlite3
  relative_file_paths: [{path}]
  compression_mode: "{mode}"
"""
_MAGIC = b"\x89MCAP0\r\n"


def record(fields: Mapping[str, bytes], data: bytes, size: int | None = None) -> bytes:
    """A record of ROS 1; ``size`` is what it says of its data."""
    header = b"".join(
        struct.pack("<I", len(k) + 1 + len(v)) + k.encode() + b"=" + v for k, v in fields.items()
    )
    return (
        struct.pack("<I", len(header))
        + header
        + struct.pack("<I", len(data) if size is None else size)
        + data
    )


def zeros(compression: str) -> bytes:
    """200 MB of zeros, compressed piece by piece."""
    sink = pa.BufferOutputStream()
    with pa.CompressedOutputStream(sink, compression) as stream:
        for _ in range(200):
            stream.write(bytes(1_000_000))
    return sink.getvalue().to_pybytes()


def head(index: int = 1 << 20, **more: bytes) -> bytes:
    """The beginning of a bag of ROS 1."""
    counts = {"conn_count": struct.pack("<I", 1), "chunk_count": struct.pack("<I", 1)}
    return b"#ROSBAG V2.0\n" + record(
        {"op": b"\x03", "index_pos": struct.pack("<Q", index), **counts, **more}, b""
    )


def connection(number: int, topic: bytes, kind: bytes = _FIX) -> bytes:
    """A record that makes a topic known."""
    fields = {"op": b"\x07", "conn": struct.pack("<I", number), "topic": topic}
    about = b"".join(struct.pack("<I", len(text)) + text for text in (b"type=" + kind, b"md5sum=*"))
    return record(fields, about)


def message(data: bytes, number: int = 0) -> bytes:
    """A record with a message."""
    return record(
        {"op": b"\x02", "conn": struct.pack("<I", number), "time": struct.pack("<II", 1, 0)}, data
    )


def chunk(
    content: bytes,
    compression: bytes = b"none",
    size: int | None = None,
    **says: int,
) -> bytes:
    """A record with records in it; ``size`` is what it says of them."""
    size = len(content) if size is None else size
    return record(
        {"op": b"\x05", "compression": compression, "size": struct.pack("<I", size)},
        content,
        **says,
    )


ROS1: dict[str, tuple[str, Callable[[], bytes]]] = {
    "is empty": ("is empty", lambda: b""),
    "is a text": ("is no bag", lambda: b"all work and no play\n" * 100),
    "is of the format 1.2": ("format 2.0", lambda: b"#ROSBAG V1.2\n" + bytes(100)),
    "has the magic only": ("never closed", lambda: b"#ROSBAG V2.0\n"),
    "has a header of 4 GB": ("impossible size", lambda: b"#ROSBAG V2.0\n" + b"\xff" * 200),
    "has a header field of 4 GB": (
        "header cannot be read",
        lambda: b"#ROSBAG V2.0\n\x08\0\0\0\xff\xff\xff\xffabcd\0\0\0\0",
    ),
    "has a record without op": ("'op'", lambda: b"#ROSBAG V2.0\n" + record({"conn": b"1"}, b"")),
    "is encrypted": ("encrypted", lambda: head(encryptor=b"rosbag/AesCbcEncryptor")),
    "has a block that says 4 GB": (
        "the block",
        lambda: head() + chunk(b"x", b"bz2", (1 << 32) - 1),
    ),
    "has a block of 4 GB that is not there": (
        "the block",
        lambda: head() + chunk(b"", size=(1 << 32) - 1),
    ),
    "has a block that grows a thousandfold": (
        "more bytes than the 1000",
        lambda: head() + chunk(zeros("bz2"), b"bz2", 1000),
    ),
    "has blocks of an unknown compression": ("'rar'", lambda: head() + chunk(b"x", b"rar")),
    "has a block of noise": (
        "cannot be decompressed",
        lambda: head() + chunk(bytes(range(256)), b"lz4", 1000),
    ),
    "has a record beyond its block": (
        "beyond the end",
        lambda: head() + chunk(record({"op": b"\x02"}, b"", 1 << 31)),
    ),
    "has a million topics": (
        "topics",
        lambda: head() + chunk(b"".join(connection(i, b"/t%d" % i) for i in range(20_000))),
    ),
    "has a topic name of escape codes": (
        "no topic",
        lambda: head() + chunk(connection(0, b"/\x1b[2J\x07", _ODOMETRY)),
    ),
    "has no fix": ("no message of /fix", lambda: head() + chunk(connection(0, b"/fix"))),
    "has a message without bytes": (
        "is no sensor_msgs",
        lambda: head(500) + chunk(connection(0, b"/fix") + message(b"")) + bytes(0),
    ),
    "has a message whose text says 4 GB": (
        "is no sensor_msgs",
        lambda: head(500) + chunk(connection(0, b"/fix") + message(bytes(12) + b"\xff" * 100)),
    ),
}


def mcap(*records: tuple[int, bytes]) -> bytes:
    """An MCAP file of opcodes and contents."""
    return _MAGIC + b"".join(
        struct.pack("<BQ", opcode, len(content)) + content for opcode, content in records
    )


def text(content: str) -> bytes:
    """A text with its length."""
    return struct.pack("<I", len(content)) + content.encode()


def mcap_chunk(content: bytes, compression: str, size: int) -> tuple[int, bytes]:
    """A block; ``size`` is what it says of its decompressed bytes."""
    packed = struct.pack("<Q", len(content)) + content
    return 6, struct.pack("<QQQI", 0, 0, size, 0) + text(compression) + packed


def _topic_and(*records: tuple[int, bytes]) -> bytes:
    schema = struct.pack("<H", 1) + text("sensor_msgs/msg/NavSatFix") + text("ros2msg") + text("")
    channel = struct.pack("<HH", 1, 1) + text("/fix") + text("cdr") + text("")
    return mcap((3, schema), (4, channel), *records)


MCAP: dict[str, tuple[str, Callable[[], bytes]]] = {
    "ends after the magic": ("never closed", lambda: _MAGIC),
    "has a record of 2^63 bytes": ("never closed", lambda: _MAGIC + struct.pack("<BQ", 3, 1 << 63)),
    "has a block that says 2^60 bytes": (
        "the block",
        lambda: mcap(mcap_chunk(b"x", "zstd", 1 << 60)),
    ),
    "has a block that grows a thousandfold": (
        "more bytes than the 1000",
        lambda: mcap(mcap_chunk(zeros("zstd"), "zstd", 1000)),
    ),
    "has a channel that is cut off": (
        "description",
        lambda: mcap((4, b"\1\0\1\0\xff\xff\xff\xff/fix")),
    ),
    "has a message that is too short": ("too short", lambda: _topic_and((5, b"\1\0"))),
    "has a message at the end of time": (
        "impossible time",
        lambda: _topic_and((5, struct.pack("<HIQQ", 1, 0, (1 << 64) - 1, 0) + bytes(50))),
    ),
}
SQLITE: dict[str, tuple[str, str]] = {
    "has no tables": ("no table 'topics'", "CREATE TABLE other(id INTEGER);"),
    "has a view without end for messages": (
        "no table 'messages'",
        _SCHEMA
        + "CREATE VIEW messages AS WITH RECURSIVE n(id) AS (SELECT 1 UNION ALL SELECT id + 1 "
        "FROM n) "
        "SELECT id, 1 AS topic_id, id AS timestamp, x'00' AS data FROM n;",
    ),
    "computes the data": (
        "no table 'messages'",
        _SCHEMA
        + "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, "
        "data BLOB GENERATED ALWAYS AS (zeroblob(900000000)));",
    ),
    "has words for times": (
        "without time",
        _SCHEMA + _MESSAGES + "INSERT INTO messages VALUES (1, 1, 'now', x'00');",
    ),
    "has no data": (
        "has no data",
        _SCHEMA + _MESSAGES + "INSERT INTO messages VALUES (1, 1, 5, NULL);",
    ),
    "has a message of garbage": (
        "is no sensor_msgs",
        _SCHEMA + _MESSAGES + "INSERT INTO messages VALUES (1, 1, 5, x'00');",
    ),
}
TRAJECTORIES: dict[str, Callable[[], bytes]] = {
    "is empty": lambda: b"",
    "is binary": lambda: bytes(range(256)) * 10,
    "has words": lambda: b"time x y z a b c d\n",
    "has numbers that are none": lambda: b"1 0 0 0 0 0 0 nan\n",
    "has a line of 2 MB": lambda: b"1 " * 1_000_000,
}


def cases() -> Iterator[Case]:
    """Everything with ``navbench localize``."""
    for what, (says, content) in ROS1.items():
        yield Case(f"bag: ROS 1 file {what}", says, _file("log.bag", content))
    for what, (says, content) in MCAP.items():
        yield Case(f"bag: MCAP file {what}", says, _file("log.mcap", content))
    for what, (says, script) in SQLITE.items():
        yield Case(f"bag: SQLite file {what}", says, _database(script))
    yield Case(
        "bag: SQLite file of noise",
        "SQLite",
        _file("log.db3", lambda: b"SQLite format 3\0" + bytes(5000)),
    )
    yield Case(
        "bag: does not exist", "log.bag", lambda folder: arguments(folder, folder / "log.bag")
    )
    yield Case(
        "bag: is a pipe", "log.bag", lambda folder: arguments(folder, pipe(folder / "log.bag"))
    )
    yield Case("bag: is a device", "/dev/zero", lambda folder: arguments(folder, Path("/dev/zero")))
    yield Case(
        "bag: is a folder without bags", "0 bag files", lambda folder: arguments(folder, folder)
    )
    yield Case(
        "bag: metadata lead out of the folder",
        "passwd",
        _metadata(path="../../../../../../etc/passwd"),
    )
    yield Case("bag: metadata name no text", "not a list of file names", _metadata(path="{a: 1}"))
    yield Case(
        "bag: metadata have no section",
        "rosbag2_bagfile_information",
        _yaml(lambda: "version: 5\n"),
    )
    for what, attack in ATTACKS.items():
        yield Case(f"bag: metadata {what}", "metadata.yaml", _yaml(lambda content=attack: content))
    yield Case("bag: a message grows a thousandfold", "decompresses to more than", _growing_message)
    yield Case("bag: a file grows a thousandfold", "is no bag", _growing_file)
    for what, content in TRAJECTORIES.items():
        yield Case(f"bag: reference {what}", "ref.tum", _reference(content))


def arguments(folder: Path, bag: Path, *more: str) -> list[str]:
    """A replay of a bag with fixes."""
    out = str(folder / "out.tum")
    return [
        "localize",
        "--bag",
        str(bag),
        "--params",
        "stock",
        "--localizer",
        "gps",
        "--out",
        out,
        *more,
    ]


def _file(name: str, content: Callable[[], bytes]) -> Make:
    return lambda folder: arguments(folder, put(folder / name, content()))


def _database(script: str) -> Make:
    return lambda folder: arguments(folder, _write(folder / "log.db3", script))


def _write(path: Path, script: str) -> Path:
    with closing(sqlite3.connect(path)) as database:
        database.executescript(script)
    return path


def _metadata(path: str, mode: str = "") -> Make:
    return _yaml(lambda: _METADATA.replace("{path}", path).replace("{mode}", mode))


def _yaml(content: Callable[[], str | bytes]) -> Make:
    def make(folder: Path) -> list[str]:
        put(folder / "metadata.yaml", content())
        return arguments(folder, folder)

    return make


def _growing_message(folder: Path) -> list[str]:
    path = _write(folder / "log.db3", _SCHEMA + _MESSAGES)
    packed = zeros("zstd")
    with closing(sqlite3.connect(path)) as database, database:
        database.execute("INSERT INTO messages VALUES (1, 1, 5, ?)", (packed,))
    return _metadata("log.db3", "MESSAGE")(folder)


def _growing_file(folder: Path) -> list[str]:
    put(folder / "log.db3.zstd", zeros("zstd"))
    return _metadata("log.db3.zstd", "FILE")(folder)


def _reference(content: Callable[[], bytes]) -> Make:
    def make(folder: Path) -> list[str]:
        bag = put(
            folder / "log.bag", head(500) + chunk(connection(0, b"/fix") + message(bytes(100)))
        )
        return arguments(folder, bag, "--reference", str(put(folder / "ref.tum", content())))

    return make
