"""Maps: values of the YAML file, images, objects and companions that cannot be used."""

import json
import os
import struct
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from .case import MAP_TEXT, Case, Make, changed, good_pgm, pipe, put, run_arguments, write_map

_HUGE = "9" * 400
# what is wrong: changes to the valid text, what must be said
VALUES: dict[str, tuple[dict[str, str], str]] = {
    "resolution is not a number": ({"resolution: 0.1": "resolution: .nan"}, "resolution"),
    "resolution is infinite": ({"resolution: 0.1": "resolution: .inf"}, "resolution"),
    "resolution is zero": ({"resolution: 0.1": "resolution: 0"}, "resolution"),
    "resolution is negative": ({"resolution: 0.1": "resolution: -0.05"}, "resolution"),
    "resolution is a hair's breadth": ({"resolution: 0.1": "resolution: 1.0e-300"}, "resolution"),
    "resolution is astronomic": ({"resolution: 0.1": "resolution: 1.0e+300"}, "resolution"),
    "resolution has 400 digits": ({"resolution: 0.1": f"resolution: {_HUGE}"}, "resolution"),
    "resolution is a text": ({"resolution: 0.1": "resolution: fine"}, "resolution"),
    "resolution is a list": ({"resolution: 0.1": "resolution: [0.1]"}, "resolution"),
    "resolution is a date": ({"resolution: 0.1": "resolution: 2024-01-01"}, "resolution"),
    "resolution is missing": ({"resolution: 0.1\n": ""}, "resolution"),
    "origin has two numbers": ({"[0.0, 0.0, 0.0]": "[0.0, 0.0]"}, "origin"),
    "origin has four numbers": ({"[0.0, 0.0, 0.0]": "[0.0, 0.0, 0.0, 0.0]"}, "origin"),
    "origin is not a number": ({"[0.0, 0.0, 0.0]": "[0.0, .nan, 0.0]"}, "origin"),
    "origin is infinitely far": ({"[0.0, 0.0, 0.0]": "[-.inf, 0.0, 0.0]"}, "origin"),
    "origin is astronomically far": ({"[0.0, 0.0, 0.0]": "[1.0e+300, 0.0, 0.0]"}, "origin"),
    "origin has 400 digits": ({"[0.0, 0.0, 0.0]": f"[{_HUGE}, 0.0, 0.0]"}, "origin"),
    "origin is a mapping": ({"[0.0, 0.0, 0.0]": "{x: 0.0}"}, "origin"),
    "thresholds are exchanged": ({"0.65": "0.1"}, "thresh"),
    "a threshold is not a number": ({"0.65": ".nan"}, "occupied_thresh"),
    "a threshold is above one": ({"0.65": "65"}, "thresh"),
    "mode is unknown": ({"negate: 0": "negate: 0\nmode: ternary"}, "ternary"),
    "mode is a list of a thousand": ({"negate: 0": f"negate: 0\nmode: [{'x, ' * 1000}x]"}, "mode"),
    "negate is neither": ({"negate: 0": "negate: maybe"}, "negate"),
    "image is a list": ({"map.pgm": "[map.pgm]"}, "image"),
    "image is empty": ({"map.pgm": "''"}, "image"),
    "image is missing": ({"map.pgm": "nowhere.png"}, "nowhere.png"),
    "image is a folder": ({"map.pgm": "."}, "image"),
    "image climbs to a text": ({"map.pgm": "../" * 12 + "etc/passwd"}, "passwd"),
    "image is a text elsewhere": ({"map.pgm": "/etc/passwd"}, "passwd"),
    "image is an endless device": ({"map.pgm": "/dev/zero"}, "/dev/zero"),
    "image is a random device": ({"map.pgm": "/dev/urandom"}, "/dev/urandom"),
    "image is the memory of this process": ({"map.pgm": "/proc/self/mem"}, "/proc/self/mem"),
    "image is an address": ({"map.pgm": "https://example.com/map.png"}, "image"),
    "image has a NUL in its name": ({"map.pgm": '"map\\0.pgm"'}, "image"),
    "image has a name of 5000 characters": ({"map.pgm": "x" * 5000}, "image"),
    "image has a line break in its name": ({"map.pgm": '"map\\nimage.pgm"'}, "image"),
}


def _chunk(kind: bytes, content: bytes) -> bytes:
    return (
        struct.pack(">I", len(content))
        + kind
        + content
        + struct.pack(">I", zlib.crc32(kind + content))
    )


def png(
    width: int,
    height: int,
    pixels: bytes,
    depth: int = 8,
    colour: int = 0,
    more: bytes = b"",
) -> bytes:
    """A PNG of its own making: ``pixels`` are the unpacked rows with their filter bytes."""
    header = struct.pack(">IIBBBBB", width, height, depth, colour, 0, 0, 0)
    body = _chunk(b"IDAT", zlib.compress(pixels, 9))
    return b"\x89PNG\r\n\x1a\n" + _chunk(b"IHDR", header) + more + body + _chunk(b"IEND", b"")


def good_png(side: int = 100) -> bytes:
    """A free image."""
    return png(side, side, (b"\x00" + b"\xfe" * side) * side)


def _zeros(count: int) -> bytes:
    """``count`` bytes of zeros, packed (RFC 1950).

    One block of them, as often as it takes, and the rest.
    """
    packer = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    block = packer.compress(bytes(1 << 20)) + packer.flush(zlib.Z_FULL_FLUSH)
    rest = packer.compress(bytes(count & ((1 << 20) - 1))) + packer.flush()
    return b"\x78\xda" + block * (count >> 20) + rest + struct.pack(">I", (count % 65521) << 16 | 1)


def bomb(side: int) -> bytes:
    """A PNG of ``side`` x ``side`` black pixels."""
    header = struct.pack(">IIBBBBB", side, side, 8, 0, 0, 0, 0)
    parts = (
        _chunk(b"IHDR", header),
        _chunk(b"IDAT", _zeros(side * (side + 1))),
        _chunk(b"IEND", b""),
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def _text_bomb() -> bytes:
    return png(
        100,
        100,
        (b"\x00" + b"\xfe" * 100) * 100,
        more=_chunk(b"zTXt", b"a\x00\x00" + _zeros(1 << 28)),
    )


IMAGES: dict[str, tuple[Callable[[], bytes], str]] = {
    "is empty": (lambda: b"", "map.pgm"),
    "is a text": (lambda: b"no image at all", "map.pgm"),
    "is random": (lambda: bytes((i * 197 + i * i) % 251 for i in range(5000)), "map.pgm"),
    "is an archive": (lambda: b"PK\x03\x04" + bytes(200), "map.pgm"),
    "is PostScript, a program": (
        lambda: b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 99 99\n(x) run\n",
        "map.pgm",
    ),
    "is a drawing": (
        lambda: b"<svg xmlns='http://www.w3.org/2000/svg' width='9' height='9'/>",
        "map.pgm",
    ),
    "is a PNG cut off in its header": (lambda: good_png()[:20], "map.pgm"),
    "is a PNG cut off in its pixels": (lambda: good_png(300)[:120], "map.pgm"),
    "is a PNG with half of its rows": (
        lambda: png(100, 100, (b"\x00" + b"\xfe" * 100) * 50),
        "occupied",
    ),
    "is a PNG with a wrong checksum": (
        lambda: good_png()[:-20] + b"\x00" * 8 + good_png()[-12:],
        "map.pgm",
    ),
    "is a PNG of no width": (lambda: png(0, 100, b""), "map.pgm"),
    "is a PNG of 2147483647 rows": (lambda: png(1, 2**31 - 1, b""), "pixels"),
    "is a PNG of 65535 x 65535 pixels": (lambda: png(65535, 65535, b""), "map.pgm"),
    "is a PNG that unpacks to 900 MB": (lambda: bomb(30_000), "map.pgm"),
    "is a PNG that unpacks to 100 MB": (lambda: bomb(10_000), "map.pgm"),
    "is a PNG whose text unpacks to 256 MB": (_text_bomb, "map.pgm"),
    "is a PNG of impossible depth": (lambda: png(100, 100, b"", depth=3), "map.pgm"),
    "is a PNG with a palette that is not there": (
        lambda: png(100, 100, bytes(101 * 100), colour=3),
        "in no free cell",
    ),
    "is a GIF cut off": (lambda: b"GIF89a\xff\xff\xff\xff\x00\x00\x00", "map.pgm"),
    "is a BMP of negative size": (
        lambda: b"BM" + struct.pack("<IIIIiiHHIIIIII", 99, 0, 54, 40, -9, 9, 1, 8, *[0] * 6),
        "map.pgm",
    ),
    "is a TIFF with a circle of pages": (
        lambda: b"II*\x00\x08\x00\x00\x00\x00\x00\x08\x00\x00\x00",
        "map.pgm",
    ),
    "is a JPEG cut off": (lambda: b"\xff\xd8\xff\xe0\x00\x10JFIF\x00\x01", "map.pgm"),
    "is a PGM without a size": (lambda: b"P5\n", "map.pgm"),
    "is a PGM of negative size": (lambda: b"P5\n-5 5\n255\n" + bytes(25), "map.pgm"),
    "is a PGM of 999999999 columns": (lambda: b"P5\n999999999 999999999\n255\n", "pixels"),
    "is a PGM whose size has 4000 digits": (
        lambda: b"P5\n" + b"9" * 4000 + b" 1\n255\n",
        "map.pgm",
    ),
    "is a PGM of no largest value": (lambda: b"P5\n5 5\n0\n" + bytes(25), "map.pgm"),
    "is a PGM of too large a value": (lambda: b"P5\n5 5\n70000\n" + bytes(50), "map.pgm"),
    "is a PGM cut off": (lambda: good_pgm()[:-1000], "truncated"),
    "is an ASCII PGM with words": (lambda: b"P2\n2 2\n255\n0 1 two 3\n", "map.pgm"),
    "is an ASCII PGM below zero": (lambda: b"P2\n2 2\n255\n0 1 -2 3\n", "map.pgm"),
    "is an ASCII PGM with a pixel of 400 digits": (
        lambda: b"P2\n2 2\n255\n0 1 2 " + b"9" * 400,
        "map.pgm",
    ),
    "is an ASCII PGM of 16 million pixels and a word": (
        lambda: b"P2\n4000 4000\n255\n" + b"0 " * 15_999_999 + b"x",
        "map.pgm",
    ),
    "is an ASCII PGM of comments": (lambda: b"P2\n#" + b"x" * 100_000 + b"\n", "map.pgm"),
    "is a PFM, of real numbers": (
        lambda: b"Pf\n2 2\n-1.0\n" + struct.pack("<4f", *[float("nan")] * 4),
        "map.pgm",
    ),
    "is all wall": (lambda: b"P5\n100 100\n255\n" + bytes(10_000), "in no free cell"),
    "is a single pixel": (lambda: b"P5\n1 1\n255\n\xfe", "outside"),
}

_RING = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]


def _feature(ring: Any = None, kind: str = "Polygon", **properties: Any) -> dict[str, Any]:
    given = {"role": "obstacle", "kind": "fence", "height": 1.0, **properties}
    shape = {"type": kind, "coordinates": [_RING if ring is None else ring]}
    return {"type": "Feature", "properties": given, "geometry": shape}


def _collection(*features: Any) -> str:
    return json.dumps({"type": "FeatureCollection", "features": list(features)})


OBJECTS: dict[str, Callable[[], str | bytes]] = {
    "is empty": lambda: "",
    "is binary": lambda: bytes(range(256)),
    "is cut off": lambda: _collection(_feature())[:-20],
    "is a list": lambda: "[1, 2]",
    "is a number": lambda: "1",
    "has no features": lambda: '{"type": "FeatureCollection"}',
    "has a text for features": lambda: '{"features": "many"}',
    "has features of numbers": lambda: '{"features": [1]}',
    "is nested 100 000 deep": lambda: "[" * 100_000,
    "is nested 100 000 deep in a feature": lambda: (
        '{"features": ' + "[" * 100_000 + "]" * 100_000 + "}"
    ),
    "has coordinates that are no numbers": lambda: _collection(
        _feature([[0, 0], [float("nan"), 0], [1, 1], [0, 0]])
    ),
    "has infinite coordinates": lambda: _collection(
        _feature([[0, 0], [float("inf"), 0], [1, 1], [0, 0]])
    ),
    "has coordinates of 400 digits": lambda: _collection(
        _feature([[0, 0], [int(_HUGE), 0], [1, 1], [0, 0]])
    ),
    "has coordinates that are astronomic": lambda: _collection(
        _feature([[0, 0], [1e300, 0], [1e300, 1e300], [0, 0]])
    ),
    "has texts for coordinates": lambda: _collection(_feature([["a", "b"]] * 4)),
    "has coordinates of one number": lambda: _collection(_feature([[0], [1], [2], [0]])),
    "has two corners": lambda: _collection(_feature([[0, 0], [1, 1]])),
    "has no corners": lambda: _collection(_feature([])),
    "has a polygon that crosses itself": lambda: _collection(
        _feature([[0, 0], [1, 1], [1, 0], [0, 1], [0, 0]])
    ),
    "has a polygon without area": lambda: _collection(_feature([[0, 0], [1, 0], [2, 0], [0, 0]])),
    "has a point": lambda: _collection(_feature(kind="Point")),
    "has no geometry": lambda: _collection({"properties": {"role": "zone", "kind": "road"}}),
    "has a height that is no number": lambda: _collection(_feature(height="tall")),
    "has a height below ground": lambda: _collection(_feature(height=-1.0)),
    "has an infinite height": lambda: _collection(_feature(height=float("inf"))),
    "has an elevation that is no number": lambda: _collection(
        _feature(role="zone", elevation=float("nan"))
    ),
    "has an elevation beyond the sky": lambda: _collection(_feature(role="zone", elevation=1e300)),
    "has an unknown role": lambda: _collection(_feature(role="ghost")),
    "has a million obstacles": lambda: (
        '{"features": [' + (json.dumps(_feature()) + ",") * 300_000 + "{}]}"
    ),
    "has an obstacle of 200 000 corners": lambda: _collection(
        _feature([[i * 1e-5, (i % 2) * 1e-3] for i in range(200_000)])
    ),
}


def cases() -> Iterator[Case]:
    """Values, images, objects, companions."""
    for what, (changes, says) in VALUES.items():
        yield Case(f"map values: {what}", says, _map_of(changed(MAP_TEXT, changes)))
    for what, (content, says) in IMAGES.items():
        yield Case(f"map image: {what}", says, _image_of(content))
    for what, text in OBJECTS.items():
        yield Case(f"map objects: {what}", "map.geojson", _objects_of(text))
    yield Case("map image: is a pipe", "map.pgm", _pipe_for_image)
    yield Case("map image: is a link to itself", "map.pgm", _link_for_image)
    yield Case("map objects: are a pipe", "map.geojson", _pipe_for_objects)
    for part in ("walkable", "navmesh"):
        yield Case(
            f"map companion: {part} is of another size",
            f"map_{part}",
            _companion(part, good_pgm(90)),
        )
        yield Case(
            f"map companion: {part} is cut off", f"map_{part}", _companion(part, good_pgm()[:500])
        )
        yield Case(
            f"map companion: {part} is a device", "/dev/zero", _companion(part, b"", "/dev/zero")
        )


def _map_of(text: str) -> Make:
    return lambda folder: run_arguments(folder, map_name=write_map(folder, text))


def _image_of(content: Callable[[], bytes]) -> Make:
    return lambda folder: run_arguments(folder, map_name=write_map(folder, map__pgm=content()))


def _objects_of(text: Callable[[], str | bytes]) -> Make:
    def make(folder: Path) -> list[str]:
        put(folder / "map.geojson", text())
        return run_arguments(folder)

    return make


def _pipe_for_image(folder: Path) -> list[str]:
    path = write_map(folder)
    (folder / "map.pgm").unlink()
    pipe(folder / "map.pgm")
    return run_arguments(folder, map_name=path)


def _link_for_image(folder: Path) -> list[str]:
    path = write_map(folder)
    (folder / "map.pgm").unlink()
    os.symlink("map.pgm", folder / "map.pgm")
    return run_arguments(folder, map_name=path)


def _pipe_for_objects(folder: Path) -> list[str]:
    pipe(folder / "map.geojson")
    return run_arguments(folder)


def _companion(part: str, image: bytes, name: str = "") -> Make:
    def make(folder: Path) -> list[str]:
        put(folder / f"map_{part}.pgm", image)
        put(folder / f"map_{part}.yaml", MAP_TEXT.replace("map.pgm", name or f"map_{part}.pgm"))
        return run_arguments(folder)

    return make
