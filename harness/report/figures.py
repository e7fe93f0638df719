"""What all figures have in common: size, type, and the files that they become."""

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.storage.files import replacing
from navstack.errors import InputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH_INCH, DPI = 5.2, 200  # fit for a paper's column
FONT: Any = {"font.size": 8, "axes.spines.top": False, "axes.spines.right": False, "pdf.fonttype": 42}
SUFFIXES = (".pdf", ".png")
UNDATED = {".pdf": {"CreationDate": None}, ".png": {}}


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
        raise InputError(f"picture {path}: cannot be written ({error}); give an existing folder and .png") from None


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


def save_panels(stem: Path, size: tuple[float, float], draw: "Callable[[Figure], None]") -> list[Path]:
    """As :func:`save_figure`, for a figure of any width and height [inch]; same input, same bytes."""
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    with rc_context(FONT):
        figure = Figure(figsize=size, dpi=DPI, layout="constrained")
        FigureCanvasAgg(figure)
        draw(figure)
        figure.draw_without_rendering()
        figure.set_layout_engine("none")  # it is laid out now; saving would do it again for each file
        paths = [stem.with_name(stem.name + suffix) for suffix in SUFFIXES]
        try:
            stem.parent.mkdir(parents=True, exist_ok=True)
            for path in paths:
                content = BytesIO()  # what draws makes no sense of a full disk
                figure.savefig(content, format=path.suffix[1:], dpi=DPI, metadata=UNDATED[path.suffix])
                with replacing(path) as stream:
                    stream.write(content.getvalue())
        except OSError as error:
            raise InputError(
                f"'{stem.parent}' cannot be written ({error.strerror}); make room or give --out another"
            ) from None
    return paths
