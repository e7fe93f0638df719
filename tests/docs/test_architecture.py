"""The picture of the architecture shows the rooms as the import rules have them."""

from tools.draw_architecture import PICTURE, picture


def test_the_picture_is_as_the_rules_are() -> None:
    assert PICTURE.read_text(encoding="utf-8") == picture(), "python -m tools.draw_architecture"
