"""Numbers of Markdown tables."""

import pytest

from harness.report.markdown import wrapped
from harness.report.numbers import all_of, counted, interval_text, number_text, range_text
from harness.statistics.interval import Interval


@pytest.mark.parametrize(
    ("value", "expected"), [(None, "--"), (1.256, "1.26"), (-0.5, "-0.50"), (-0.001, "0.00")]
)
def test_numbers_have_their_decimals_and_no_negative_zero(value, expected):
    assert number_text(value, 2) == expected


@pytest.mark.parametrize(
    ("interval", "expected"),
    [
        (Interval(None, None, None, 0), "--"),
        (Interval(0.5, None, None, 1), "+0.50"),
        (Interval(-0.001, -0.25, 0.5, 9), "+0.00 [-0.25, +0.50]"),
    ],
)
def test_intervals_show_what_they_have(interval, expected):
    assert interval_text(interval, 2, is_signed=True) == expected


@pytest.mark.parametrize(
    ("thing", "some"),
    [("mission", "1,200 missions"), ("day", "1,200 days"), ("delivery", "1,200 deliveries")],
)
def test_one_thing_is_no_plural(thing, some):
    assert (counted(1, thing), counted(1200, thing)) == (f"1 {thing}", some)
    assert (all_of(1, thing), all_of(1200, thing)) == (f"the only {thing}", f"all {some}")


def test_a_table_in_a_list_is_not_broken():
    row = "  | " + " | ".join(["a cell of some length"] * 8) + " |"
    text = wrapped(f"- {'word ' * 40}\n\n{row}\n{row}")
    assert (
        text.count(row) == 2
        and max(len(line) for line in text.split("\n") if "word" in line) <= 120
    )


def test_counts_are_told_as_a_range() -> None:
    assert range_text([5, 5]) == "5"
    assert range_text([5, 3, 4]) == "3 to 5"
