"""The pixels of a map image as nav2_map_server gets them: GraphicsMagick, 16 bits a channel."""

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

FloatTable = npt.NDArray[np.float64]
LevelArray = npt.NDArray[np.uint8] | npt.NDArray[np.uint16]

MAX_PIXELS = 20_000_000  # 223 m x 223 m at 0.05 m; a delivery on it takes less than 1 GiB of memory
MAX_WHOLE = 20 * MAX_PIXELS  # of an image of which parts are read: 1 km x 1 km at 0.05 m
MAX_BYTES = 6 * MAX_PIXELS  # of a file: what an ASCII PGM spends on pixels of 16 bits
_MAX_BYTES_OF_PGM = 2 * MAX_WHOLE + 1000  # of a binary one
_FORMATS = ("PNG", "BMP", "PPM", "GIF", "JPEG", "TIFF", "WEBP")  # of Pillow's; others run programs
_DIGITS_AND_GAPS = b"0123456789 \t\r\n\v\f"
_QUANTUM = 65535  # GraphicsMagick's largest channel value
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
    """An image as brightness: pixel (row, column) has the shade ``shades[levels[row, column]]``."""

    levels: LevelArray  # (height, width), row 0 = top
    shades: FloatTable  # (n,) brightness 0..1 of each level
    transparent: BoolArray | None  # (height, width) not fully opaque; None: no alpha channel


def read_image(path: Path, average_alpha: bool, crop: Crop | None = None) -> MapImage:
    """Read PGM (ASCII or binary, up to 16 bits), PNG, BMP or another format of ``_FORMATS``.

    A pixel's shade is the mean of its colour channels, with ``average_alpha`` of its alpha channel
    too (what nav2_map_server does in trinary mode). Colours of 16 bits per channel are read with 8.

    Args:
        path: of the file.
        average_alpha: whether an alpha channel counts as a colour.
        crop: the part that is read; None: all of it.

    Raises:
        MapError: the file is missing, no image, corrupt, truncated or too large.
    """
    (image,) = read_parts(path, average_alpha, [crop])
    return image


def read_parts(path: Path, average_alpha: bool, crops: Sequence[Crop | None]) -> Iterator[MapImage]:
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
            yield from _read_other(path, average_alpha, crops)
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
    shades = np.floor(np.arange(largest + 1) * _QUANTUM / largest + 0.5) / _QUANTUM
    for crop in crops:
        levels = whole
        if crop is not None:
            left, top, right, bottom = crop.box(height)
            levels = whole[top:bottom, left:right]
        levels = np.minimum(levels, largest).astype(np.min_scalar_type(largest))
        yield MapImage(levels, shades, None)


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


def _read_other(
    path: Path, average_alpha: bool, crops: Sequence[Crop | None]
) -> Iterator[MapImage]:
    try:
        with Image.open(path, formats=_FORMATS) as image:
            for crop in crops:
                _check_size(path, *image.size, crop)
            for crop in crops:
                part: Image.Image = image
                if crop is not None:
                    part = image.crop(crop.box(image.height))
                    part.info = image.info  # has what is transparent
                yield _convert(part, average_alpha)
    except UnidentifiedImageError:
        raise MapError(f"map image {path}: is not an image; expected PGM, PNG or BMP") from None
    except (ValueError, SyntaxError, EOFError, IndexError) as error:
        raise MapError(
            f"map image {path}: corrupt or truncated ({str(error).splitlines()[0]})"
        ) from None


def _convert(image: Image.Image, average_alpha: bool) -> MapImage:
    if image.mode in ("F", "I"):
        raise ValueError(f"pixels of mode {image.mode}, where 8 or 16 bits are needed")
    has_alpha = image.mode in ("LA", "PA", "RGBA", "La", "RGBa") or "transparency" in image.info
    if image.mode.startswith("I;16"):
        return MapImage(
            np.asarray(image).astype(np.uint16), np.arange(_QUANTUM + 1) / _QUANTUM, None
        )
    if image.mode in ("1", "L") and not has_alpha:
        return MapImage(np.asarray(image.convert("L")), np.arange(256) * 257 / _QUANTUM, None)
    transparent = None
    averaged = np.asarray(image.convert("RGBA" if has_alpha else "RGB"))
    if has_alpha:
        transparent = averaged[..., 3] < 255
    if not average_alpha:
        averaged = averaged[..., :3]
    levels = averaged.sum(axis=-1, dtype=np.uint16)
    count = averaged.shape[-1]
    shades = np.arange(255 * count + 1) * 257 / count / _QUANTUM
    return MapImage(levels, shades, transparent)
