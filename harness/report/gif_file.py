"""Animated GIFs from figures: a file is whole, or it is not written."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from harness.storage.files import replacing
from navstack.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def drawn(figure: "Figure") -> Image.Image:
    """What a figure on an Agg canvas shows now."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    assert isinstance(figure.canvas, FigureCanvasAgg)
    canvas: Any = figure.canvas  # matplotlib does not type what Agg adds
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3].copy())


def write_frames(path: Path, frames: Sequence[Image.Image], frames_per_second: float) -> None:
    """Write pictures as a GIF that repeats.

    Args:
        path: of the file; an existing one is replaced once the new one is complete.
        frames: the pictures, at least one, all of one size.
        frames_per_second: how fast they follow each other.

    Raises:
        InputError: the file cannot be written.
    """
    first, *others = frames
    try:
        with replacing(path) as stream:
            first.save(
                stream, "GIF", save_all=True, append_images=others, duration=round(1000.0 / frames_per_second), loop=0
            )
    except OSError as error:
        raise InputError(f"animation '{path}' cannot be written ({error.strerror}); choose another") from None
