"""The pixels of a map image as nav2_map_server gets them: GraphicsMagick, 8 bits of grey."""

import contextlib
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from PIL import Image, UnidentifiedImageError

from navstack.errors import MapError
from navstack.files import check_regular
from navstack.types import BoolArray

GreyArray = npt.NDArray[np.uint8]

MAX_PIXELS = 20_000_000  # 223 m x 223 m at 0.05 m; a delivery on it takes less than 1 GiB of memory
MAX_WHOLE = 20 * MAX_PIXELS  # of an image of which parts are read: 1 km x 1 km at 0.05 m
MAX_BYTES = 6 * MAX_PIXELS  # of a file: what an ASCII PGM spends on pixels of 16 bits
_MAX_BYTES_OF_PGM = 2 * MAX_WHOLE + 1000  # of a binary one
_FORMATS = ("PNG", "BMP", "PPM", "GIF", "JPEG", "TIFF", "WEBP")  # of Pillow's; others run programs
_DIGITS_AND_GAPS = b"0123456789 \t\r\n\v\f"
_QUANTUM = 65535  # GraphicsMagick's largest channel value while it reads
_PHOTOMETRIC, _WHITE_IS_ZERO = 262, 0  # tag of a TIFF
OPAQUE = 255  # alpha of a pixel through which nothing shines
_GAP = rb"(?:\s|#[^\n\r]*[\n\r])+"  # white space and comments
_PGM_HEADER = re.compile(rb"P([25])" + (_GAP + rb"(\d+)") * 3)


class Crop(NamedTuple):
    """The part of an image that is read, in pixels from its lower left corner."""

    left: int
    bottom: int
    width: int
    height: int

    def box(self, image_height: int) -> tuple[int, int, int, int]:
        """Left, top, right and bottom from the upper left corner, as Pillow counts."""
        bottom = image_height - self.bottom
        return self.left, bottom - self.height, self.left + self.width, bottom


@dataclass(frozen=True, slots=True, eq=False)
class MapImage:
    """An image as brightness."""

    grey: GreyArray  # (height, width) 0 black to 255 white, row 0 = top
    transparent: BoolArray | None  # (height, width) not fully opaque; None: no alpha channel


def read_image(path: Path, crop: Crop | None = None) -> MapImage:
    """Read PGM (ASCII or binary, up to 16 bits), PNG, BMP or another format of ``_FORMATS``.

    A colour's grey is its luma (ITU-R BT.601).

    Args:
        path: of the file.
        crop: the part that is read; None: all of it.

    Raises:
        MapError: the file is missing, no image, corrupt, truncated or too large.
    """
    (image,) = read_parts(path, [crop])
    return image


def read_parts(path: Path, crops: Sequence[Crop | None]) -> Iterator[MapImage]:
    """The same of several parts of an image, which is unpacked once.

    Raises:
        MapError: as of :func:`read_image`.
    """
    try:
        check_regular(path, _MAX_BYTES_OF_PGM)
        with path.open("rb") as file:
            magic = file.read(2)
        if magic != b"P5":
            check_regular(path, MAX_BYTES)
        if magic in (b"P2", b"P5"):
            yield from _read_pgm(path, crops)
            return
        with _no_bound_of_pillows():
            yield from _read_other(path, crops)
    except OSError as error:
        raise _unreadable(path, error) from None


def image_size(path: Path) -> tuple[int, int]:
    """Width and height of an image in pixels, by its header.

    Raises:
        MapError: the file is missing or no image.
    """
    try:
        check_regular(path, _MAX_BYTES_OF_PGM)
        with _no_bound_of_pillows(), Image.open(path, formats=_FORMATS) as image:
            return image.size
    except (UnidentifiedImageError, ValueError, SyntaxError):
        raise MapError(f"map image {path}: is not an image; expected PGM, PNG or BMP") from None
    except OSError as error:
        raise _unreadable(path, error) from None


@contextlib.contextmanager
def _no_bound_of_pillows() -> Iterator[None]:
    """Within it images of any size are opened; ours is looked at before pixels are read."""
    before, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
    try:
        yield
    finally:
        Image.MAX_IMAGE_PIXELS = before


def _unreadable(path: Path, error: OSError) -> MapError:
    reason = error.strerror or str(error).splitlines()[0]
    return MapError(f"map image {path}: cannot be read ({reason}); check 'image' in the map's YAML")


def _check_size(path: Path, width: int, height: int, crop: Crop | None) -> None:
    most = MAX_PIXELS if crop is None else MAX_WHOLE
    if width < 1 or height < 1 or width * height > most:
        side = math.isqrt(MAX_PIXELS)
        raise MapError(
            f"map image {path}: {width} x {height} pixels; allowed: 1 to {most} pixels; "
            f"navbench run drives on one of up to {MAX_WHOLE}; to read a part, write "
            f"crop: [left, bottom, width, height] in pixels beside 'image', e.g. "
            f"crop: [0, 0, {min(side, width)}, {min(side, height)}]"
        )
    if crop is None:
        return
    if crop.left + crop.width > width or crop.bottom + crop.height > height:
        raise MapError(
            f"map image {path}: crop {list(crop)} reaches beyond its {width} x {height} pixels"
        )
    if crop.width * crop.height > MAX_PIXELS:
        raise MapError(f"map image {path}: crop {list(crop)}; allowed: {MAX_PIXELS} pixels")


def _read_pgm(path: Path, crops: Sequence[Crop | None]) -> Iterator[MapImage]:
    content = path.read_bytes()
    header = _PGM_HEADER.match(content)
    if header is None:
        raise MapError(
            f"map image {path}: corrupt PGM header; expected width, height and largest value"
        )
    width, height, largest = (int(field[:9]) for field in header.groups()[1:])
    for crop in crops:
        _check_size(path, width, height, crop)
    if not 1 <= largest <= _QUANTUM:
        raise MapError(f"map image {path}: largest value {largest}; a PGM allows 1 to {_QUANTUM}")
    body = memoryview(content)[header.end() :]
    if header[1] == b"2":
        values = _ascii_values(path, bytes(body))
    else:
        values = _binary_values(body[1:], largest)
    count = width * height
    if len(values) < count:
        raise MapError(
            f"map image {path}: truncated, {len(values)} of {width} x {height} = {count} pixels"
        )
    whole = values[:count].reshape(height, width)
    read = np.floor(np.arange(largest + 1) * _QUANTUM / largest + 0.5)
    grey_of = _in_8_bits(read.astype(np.int64))
    for crop in crops:
        part = whole
        if crop is not None:
            left, top, right, bottom = crop.box(height)
            part = whole[top:bottom, left:right]
        yield MapImage(grey_of[np.minimum(part, largest)], None)


def _in_8_bits(quanta: npt.NDArray[np.integer]) -> GreyArray:
    """GraphicsMagick's channel values as bytes (``ScaleQuantumToChar``)."""
    return ((quanta + 128) // 257).astype(np.uint8)


def _binary_values(body: memoryview, largest: int) -> npt.NDArray[np.integer]:
    kind = np.dtype(np.uint8 if largest < 256 else ">u2")
    return np.frombuffer(body, dtype=kind, count=len(body) // kind.itemsize)


def _ascii_values(path: Path, body: bytes) -> npt.NDArray[np.integer]:
    text = re.sub(rb"#[^\n\r]*", b"", body)
    if b"-" in text:
        raise MapError(f"map image {path}: corrupt ASCII PGM, a pixel is negative")
    if text.translate(None, _DIGITS_AND_GAPS) or re.search(rb"\d{10}", text):
        raise MapError(f"map image {path}: corrupt ASCII PGM, a pixel is not a whole number")
    return np.fromstring(text.decode("ascii"), dtype=np.int64, sep=" ")


def _read_other(path: Path, crops: Sequence[Crop | None]) -> Iterator[MapImage]:
    try:
        with Image.open(path, formats=_FORMATS) as image:
            for crop in crops:
                _check_size(path, *image.size, crop)
            for crop in crops:
                part: Image.Image = image
                if crop is not None:
                    part = image.crop(crop.box(image.height))
                    part.info = image.info  # has what is transparent
                yield _convert(part)
    except UnidentifiedImageError:
        raise MapError(f"map image {path}: is not an image; expected PGM, PNG or BMP") from None
    except (ValueError, SyntaxError, EOFError, IndexError) as error:
        raise MapError(
            f"map image {path}: corrupt or truncated ({str(error).splitlines()[0]})"
        ) from None


def _convert_16_bits(image: Image.Image) -> MapImage:
    values = np.asarray(image).astype(np.int64)
    transparent = None
    if isinstance(image.info.get("transparency"), int):
        transparent = values == image.info["transparency"]
    if getattr(image, "tag_v2", {}).get(_PHOTOMETRIC) == _WHITE_IS_ZERO:  # Pillow leaves it so
        values = 2**16 - 1 - values
    return MapImage(_in_8_bits(values), transparent)


def _convert(image: Image.Image) -> MapImage:
    if image.mode in ("F", "I"):
        raise ValueError(f"pixels of mode {image.mode}, where 8 or 16 bits are needed")
    has_alpha = image.mode in ("LA", "PA", "RGBA", "La", "RGBa") or "transparency" in image.info
    if image.mode.startswith("I;16"):
        return _convert_16_bits(image)
    if not has_alpha:
        return MapImage(np.asarray(image.convert("L")), None)
    with_alpha = image.convert("RGBA")
    transparent = np.asarray(with_alpha.getchannel("A")) < OPAQUE
    return MapImage(np.asarray(with_alpha.convert("L")), transparent)
