"""Texts from elsewhere that every table and terminal takes."""

import os

import pytest

from harness.storage.texts import LONGEST_TEXT, clean_text, clean_texts, name_of


@pytest.mark.parametrize(
    ("text", "clean"),
    [
        ("", ""),
        ("plain", "plain"),
        ("Straße 東京 🤖", "Straße 東京 🤖"),
        (os.fsdecode(b"weights-\xff.bin"), r"weights-\udcff.bin"),
        ("\ud800\udc00", r"\ud800\udc00"),
        ("x" * 1001, "x" * 1000),
        ("\udcff" * 1000, (r"\udcff" * 167)[:1000]),
    ],
)
def test_a_text_becomes_one_that_utf_8_holds(text: str, clean: str) -> None:
    assert clean_text(text) == clean
    assert len(clean_text(text).encode()) <= 4 * LONGEST_TEXT
    assert clean_text(clean) == clean, "cleaned once is clean"


def test_every_text_of_a_record_is_cleaned_and_nothing_else() -> None:
    record = {"row": {"error": "\udcff", "n": 1, "x": 0.5, "is": True, "none": None}}
    record["events"] = [{"kind": "\udc80"}, {"kind": "car"}]  # type: ignore[assignment]
    assert clean_texts(record) == {
        "row": {"error": r"\udcff", "n": 1, "x": 0.5, "is": True, "none": None},
        "events": [{"kind": r"\udc80"}, {"kind": "car"}],
    }


def test_a_file_that_is_not_utf_8_has_a_name_that_is() -> None:
    assert name_of(os.fsdecode(b"/some/my-\xe9.yaml")) == r"my-\udce9"
    assert name_of("nav2-gps") == "nav2-gps"
