"""A file of OpenStreetMap as reading in one go asks for it: in order, of today, uploaded."""

import bz2
import contextlib
import gzip
import re
import tempfile
import zlib
from collections.abc import Iterator
from io import BufferedIOBase
from pathlib import Path
from typing import Any

_DRAFTS = 10**15  # above the number of all that is uploaded
_CHUNK = 1 << 20  # [byte] of XML
_START = re.compile(rb"<(node|way|relation)\s([^<]*)")
_NUMBER = re.compile(rb"\bid=[\"'](-?\d+)[\"']")
_DELETED = re.compile(rb"\baction=[\"']delete[\"']")
Key = tuple[str, int]  # kind and number of an object


@contextlib.contextmanager
def in_order(osmium: Any, path: Path) -> Iterator[Path]:
    """The same file with nodes before ways, by number, and the last version of each object alone.

    Extracts in PBF are so, but for history files; XML of query services often has ways before
    their nodes. What an editor has drawn and not uploaded has negative numbers, which osmium finds
    no places for: it gets others. What an editor has deleted and not uploaded is left out.

    The last version of an object that is deleted for all stays, and is marked as such.
    """
    is_pbf = path.name.endswith(".pbf")
    if is_pbf and not _has_history(osmium, path) and _first(osmium, path)[0]:
        yield path
        return
    with tempfile.TemporaryDirectory() as folder:
        ordered = Path(folder) / "ordered.osh.pbf"  # .osm.pbf would not say what is deleted
        merger = osmium.MergeInputReader()
        merger.add_file(str(path))
        with osmium.SimpleWriter(str(ordered)) as writer:
            merger.apply(writer)
        gone = set() if is_pbf else deleted_by_editor(path)
        if gone or _first(osmium, ordered)[1] < 0:
            ordered = _rewritten(osmium, ordered, gone)
        yield ordered


def _has_history(osmium: Any, path: Path) -> bool:
    with osmium.io.Reader(str(path)) as reader:
        return bool(reader.header().has_multiple_object_versions)


def _first(osmium: Any, path: Path) -> tuple[bool, int]:
    """Whether the first object of a file is a node, and its number; an empty file is in order."""
    for one in osmium.FileProcessor(str(path)):
        return one.is_node(), one.id
    return True, 0


def deleted_by_editor(path: Path) -> set[Key]:
    """What an editor has marked to be deleted in a file of XML; osmium passes over the mark."""
    found = set()
    # osmium has read all of it: what cannot be unpacked is behind the end
    with contextlib.suppress(OSError, EOFError, zlib.error), _opened(path) as file:
        for kind, attributes in _starts(file):
            number = _NUMBER.search(attributes)
            if number is not None and _DELETED.search(attributes):
                found.add((kind, int(number[1])))
    return found


def _opened(path: Path) -> BufferedIOBase:
    """A file of XML, packed or not, whatever its name says."""
    with path.open("rb") as file:
        begin = file.read(3)
    if begin.startswith(b"\x1f\x8b"):
        return gzip.open(path, "rb")
    if begin == b"BZh":
        return bz2.open(path, "rb")
    return path.open("rb")


def _starts(file: BufferedIOBase) -> Iterator[tuple[str, bytes]]:
    """Kind and attributes of each object, as they stand in a file."""
    rest = b""
    while chunk := file.read(_CHUNK):
        whole, mark, begun = (rest + chunk).rpartition(b"<")
        rest = mark + begun
        for start in _START.finditer(whole):
            yield start[1].decode(), start[2]
    for start in _START.finditer(rest):
        yield start[1].decode(), start[2]


def _rewritten(osmium: Any, path: Path, gone: set[Key]) -> Path:
    """The same file with positive numbers, without some objects."""
    rewritten = path.with_name("rewritten.osh.pbf")
    with osmium.SimpleWriter(str(rewritten)) as writer:
        for one in osmium.FileProcessor(str(path)):
            number = _positive(one.id)
            if (_kind(one), one.id) in gone:
                continue
            if one.is_node():
                writer.add_node(one.replace(id=number))
            elif one.is_way():
                nodes = [_positive(node.ref) for node in one.nodes]
                writer.add_way(one.replace(id=number, nodes=nodes))
            else:
                members = [(each.type, _positive(each.ref), each.role) for each in one.members]
                writer.add_relation(one.replace(id=number, members=members))
    return rewritten


def _kind(one: Any) -> str:
    if one.is_node():
        return "node"
    return "way" if one.is_way() else "relation"


def _positive(number: int) -> int:
    if number < 0:
        return _DRAFTS - number
    return number
