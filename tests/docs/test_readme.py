"""README is short, and its figures are those of the stored deliveries."""

import re

import pytest

from tools.readme_figures import BEGIN, END, README, STREETS, figures, filled, street_figures

from .blocks import ROOT

TEXT = README.read_text(encoding="utf-8")
MOST_WORDS = 700
MOST_WORDS_OF_DOCS = 30_000
# numbers that are no measurements: versions of Python, the paper's number
NO_FIGURES = {"3.11", "3.12", "2511.20216", "2.0"}


def test_the_figures_are_those_of_the_stored_deliveries() -> None:
    assert TEXT == filled(TEXT, figures()), "python -m tools.readme_figures"
    streets = (STREETS / "index.md").read_text(encoding="utf-8")
    assert streets == filled(streets, street_figures()), "python -m tools.readme_figures"


def test_no_figure_stands_outside_what_the_script_writes() -> None:
    outside = TEXT.partition(BEGIN)[0] + TEXT.partition(END)[2]
    measured = re.findall(r"\d+\.\d+|\d[\d ,]*(?= ?(?:%|USD|deliveries|missions|m/s))", outside)
    assert set(measured) <= NO_FIGURES


def test_readme_and_docs_are_short() -> None:
    assert len(TEXT.split()) <= MOST_WORDS
    words = sum(
        len(page.read_text(encoding="utf-8").split()) for page in (ROOT / "docs").glob("*.md")
    )
    assert words <= MOST_WORDS_OF_DOCS


def test_a_text_without_marks_is_refused() -> None:
    with pytest.raises(ValueError, match="has no '<!-- tools/readme"):
        filled("no marks", "x")
