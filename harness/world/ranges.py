"""Checks of parameters that types cannot make: a value out of range is refused by its name."""

import math
import sys

from navstack.errors import ParameterError

MAX_RATE = 10_000.0  # [Hz] of a sensor
MAX_LATENCY = 60.0  # [s] of a sensor


def check_ranges(where: str, params: object, positive: str = "", not_negative: str = "", shares: str = "") -> None:
    """Refuse values out of range.

    Args:
        where: part of the file, for the message.
        params: a dataclass.
        positive: names of its fields, with blanks between, that must be more than 0.
        not_negative: those that must be 0 or more.
        shares: those that must be 0 to 1.

    Raises:
        ParameterError: one is out of range; the message names it.
    """
    for names, allowed, least, most in (
        (positive, "more than 0", sys.float_info.min, math.inf),
        (not_negative, "0 or more", 0.0, math.inf),
        (shares, "0 to 1", 0.0, 1.0),
    ):
        for name in names.split():
            value = getattr(params, name)
            if not least <= value <= most:
                raise ParameterError(f"{where}: {name} {value}; allowed is {allowed}")


def check_timing(sensor: str, rate: float, latency: float) -> None:
    """Refuse a rate that is not positive, or beyond every sensor, and a latency that is negative or endless.

    Raises:
        ParameterError: so it is.
    """
    if not 0.0 < rate <= MAX_RATE:
        raise ParameterError(f"{sensor}: rate {rate} Hz; allowed is more than 0 to {MAX_RATE:g}")
    if not 0.0 <= latency <= MAX_LATENCY:
        raise ParameterError(f"{sensor}: latency {latency} s; allowed is 0 to {MAX_LATENCY:g}")
