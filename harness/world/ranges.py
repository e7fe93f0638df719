"""Checks of parameters that types cannot make: a value out of range is refused by its name."""

import math
import sys
from collections.abc import Mapping

from navstack.errors import ParameterError

POSITIVE = sys.float_info.min  # least value of what must be more than 0
TIMING = {"rate": (POSITIVE, 10_000.0), "latency": (0.0, 60.0)}  # [Hz], [s] of a sensor

Limits = Mapping[str, tuple[float, float]]  # least and most value by name


def check_ranges(
    where: str,
    params: object,
    positive: str = "",
    not_negative: str = "",
    shares: str = "",
    within: Limits | None = None,
) -> None:
    """Refuse values out of range.

    Args:
        where: part of the file, for the message.
        params: a dataclass.
        positive: names of its fields, with blanks between, that must be more than 0.
        not_negative: those that must be 0 or more.
        shares: those that must be 0 to 1.
        within: those with limits of their own.

    Raises:
        ParameterError: one is out of range; the message names it.
    """
    limits = {
        **dict.fromkeys(positive.split(), (POSITIVE, math.inf)),
        **dict.fromkeys(not_negative.split(), (0.0, math.inf)),
        **dict.fromkeys(shares.split(), (0.0, 1.0)),
        **(within or {}),
    }
    for name, (least, most) in limits.items():
        value = getattr(params, name)
        if not least <= value <= most:
            raise ParameterError(f"{where}: {name} {value}; allowed is {_in_words(least, most)}")


def _in_words(least: float, most: float) -> str:
    if least == 0.0 and most == math.inf:
        return "0 or more"
    low = f"{least:g}"
    if least == POSITIVE:
        low = "more than 0"
    if most == math.inf:
        return low
    return f"{low} to {most:g}"
