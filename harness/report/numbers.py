"""Numbers as texts."""

from collections.abc import Iterable

from harness.statistics.interval import Interval

UNDEFINED = "--"


def number_text(value: float | None, decimals: int | None = 2, is_signed: bool = False) -> str:
    """A number to so many decimals, or to three significant digits; dashes where there is none."""
    if value is None:
        return UNDEFINED
    digits = ".3g"
    if decimals is not None:
        digits = f".{decimals}f"
    sign = ""
    if is_signed:
        sign = "+"
    return f"{value:{sign}z{digits}}"


def count_text(value: float | None, absent: str = UNDEFINED) -> str:
    """A whole number with separated thousands; a word where there is none."""
    if value is None:
        return absent
    return f"{value:,.0f}"


def bounds_text(
    interval: Interval | None,
    decimals: int | None = 2,
    is_signed: bool = False,
) -> str:
    """The interval alone; empty where there are too few data to say."""
    if interval is None or interval.low is None or interval.high is None:
        return ""
    low, high = (number_text(end, decimals, is_signed) for end in (interval.low, interval.high))
    return f"[{low}, {high}]"


def interval_text(
    interval: Interval | None,
    decimals: int | None = 2,
    is_signed: bool = False,
    absent: str = UNDEFINED,
) -> str:
    """A value with its interval; without bounds where there are too few data to say."""
    if interval is None or interval.value is None:
        return absent
    value = number_text(interval.value, decimals, is_signed)
    return f"{value} {bounds_text(interval, decimals, is_signed)}".rstrip()


def counted(number: int, thing: str) -> str:
    """A number of things, in the plural but for one."""
    if number == 1:
        return f"1 {thing}"
    return f"{number:,d} {plural(thing)}"


def plural(thing: str) -> str:
    """Several of a thing: missions, days, deliveries."""
    if thing.endswith("y") and thing[-2] not in "aeiou":
        return f"{thing[:-1]}ies"
    return f"{thing}s"


def too_few(number: int, thing: str) -> str:
    """That so many of a thing are too few; there may be one only."""
    verb = "are"
    if number == 1:
        verb = "is"
    return f"{counted(number, thing)} {verb} too few"


def all_of(number: int, thing: str) -> str:
    """All of a number of things, of which there may be one only."""
    if number == 1:
        return f"the only {thing}"
    return f"all {counted(number, thing)}"


def range_text(counts: Iterable[int]) -> str:
    """The least to the greatest of some counts; the only one where they are alike."""
    known = sorted(set(counts))
    if len(known) > 1:
        return f"{known[0]} to {known[-1]}"
    return str(known[0])


def p_text(p: float | None) -> str:
    """A p value; resampled ones below 0.001 say no more than that, and those near 0.05 more."""
    if p is None:
        return UNDEFINED
    if p < 0.001:
        return "<.001"
    if f"{p:.3f}" == "0.050":
        return f"{p:.4f}"
    return f"{p:.3f}"
