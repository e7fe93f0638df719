"""What all figures have in common: size, type, and the files that they become."""

import contextlib
import math
from collections.abc import Callable, Iterator, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from PIL import Image

from harness.statistics.interval import Interval
from harness.storage.files import replacing, writing
from navstack.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH_INCH, DPI = 5.2, 200  # fit for a paper's column
FONT: Any = {
    "font.size": 8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "pdf.fonttype": 42,
    "svg.hashsalt": "0",
}
SUFFIXES = (".pdf", ".png")
UNDATED: dict[str, Any] = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}, ".png": {}}


@contextlib.contextmanager
def own_settings(**settings: Any) -> Iterator[None]:
    """Draw with matplotlib's defaults and these settings, whatever the user's matplotlibrc says."""
    from matplotlib import rc_context, rcdefaults

    given: Any = settings
    with rc_context():
        rcdefaults()
        with rc_context(given):
            yield


def error_bars(intervals: Sequence[Interval]) -> list[list[float]]:
    """Lengths of error bars below and above values.

    NaN, which is not drawn, where there is no interval.
    """
    known = [(each.value or 0.0, each.low, each.high) for each in intervals]
    below = [math.nan if low is None else max(value - low, 0.0) for value, low, _ in known]
    return [
        below,
        [math.nan if high is None else max(high - value, 0.0) for value, _, high in known],
    ]


def save_picture(figure: "Figure", path: Path) -> None:
    """Write a figure as the picture that its file's ending names, whole or not at all.

    Raises:
        InputError: it cannot be written, or matplotlib knows no such picture.
    """
    content = BytesIO()
    try:
        figure.savefig(content, format=path.suffix[1:] or None, facecolor="white")
        with replacing(path) as stream:
            stream.write(content.getvalue())
    except (OSError, ValueError) as error:  # matplotlib knows not every ending
        reason = getattr(error, "strerror", error)
        raise InputError(
            f"picture {path}: cannot be written ({reason}); give a folder with room, and .png"
        ) from None


def save_figure(stem: Path, height: float, draw: "Callable[[Axes], None]") -> list[Path]:
    """Draw a figure of one column and write it as PDF and PNG; returns their paths.

    Args:
        stem: path without suffix; its folder is made where it is missing.
        height: [inch].
        draw: draws into the figure's only axes.

    Raises:
        InputError: the folder cannot be written.
    """
    return save_panels(stem, (WIDTH_INCH, height), lambda figure: draw(figure.add_subplot()))


def save_panels(
    stem: Path,
    size: tuple[float, float],
    draw: "Callable[[Figure], None]",
) -> list[Path]:
    """As :func:`save_figure`, for a figure of any width and height [inch]."""
    paths = [stem.with_name(stem.name + suffix) for suffix in SUFFIXES]
    with writing(stem.parent):
        stem.parent.mkdir(parents=True, exist_ok=True)
    save_as(paths, size, draw)
    return paths


def save_as(
    paths: Sequence[Path],
    size: tuple[float, float],
    draw: "Callable[[Figure], None]",
    font_size: float = 8.0,
) -> None:
    """Draw a figure once and write it in the formats that its paths' suffixes name.

    Same input, same bytes.

    Raises:
        InputError: a file cannot be written.
    """
    from matplotlib.figure import Figure

    with own_settings(**FONT | {"font.size": font_size}):
        figure = Figure(figsize=size, dpi=DPI, layout="constrained")
        draw(figure)
        contents = rendered(figure, [path.suffix.lower() for path in paths])
    for path, content in zip(paths, contents, strict=True):
        with writing(path), replacing(path) as stream:
            stream.write(content)


def rendered(figure: "Figure", suffixes: Sequence[str]) -> list[bytes]:
    """The content of a figure's file in each format, e.g. ``.png``."""
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
    figure.set_layout_engine(None)  # saving would lay it out again for each file
    contents = []
    for suffix in suffixes:
        stream = BytesIO()
        figure.savefig(
            stream, format=suffix[1:], dpi=DPI, metadata=UNDATED[suffix], facecolor="white"
        )
        is_picture = suffix == ".png"
        contents.append(_fewer_colours(stream) if is_picture else stream.getvalue())
    return contents


def _fewer_colours(picture: BytesIO) -> bytes:
    """A PNG as one of 256 colours, less than half the size; its text's edges need no more."""
    smaller = BytesIO()
    with Image.open(picture) as image:
        few = image.convert("RGB").quantize(256, dither=Image.Dither.NONE)
        few.save(smaller, "PNG", optimize=True, dpi=(DPI, DPI))
    return smaller.getvalue()
