"""Where a page counts from: in UTM coordinates a browser's numbers would lose the centimetres."""

from typing import Any

import numpy as np

from navstack.types import FloatArray

Place = tuple[float, float]  # x, y [m] in the map frame

STEP = 10_000.0  # [m]; a map about 0 is drawn as it is
ZERO: Place = (0.0, 0.0)


def page_origin(x: float, y: float) -> Place:
    """The multiple of ``STEP`` that is nearest to a place of a map."""
    return round(x / STEP) * STEP, round(y / STEP) * STEP


def shifted(arrays: dict[str, Any], origin: Place) -> dict[str, Any]:
    """A recording whose places are counted from an origin."""
    if origin == ZERO:
        return arrays
    trace = arrays["trace"].astype(np.float64)
    trace[:, 1:3] -= origin
    trace[:, 6:8] -= origin
    tracks = arrays["tracks"].astype(np.float64)
    tracks[:, 1:3] -= origin
    places: dict[str, FloatArray] = {
        name: arrays[name] - np.array(origin) for name in ("crowd", "plan_xy", "option_xy")
    }
    return {**arrays, **places, "trace": trace, "tracks": tracks}
