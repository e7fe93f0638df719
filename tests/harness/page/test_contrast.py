"""What a page writes can be read: WCAG 2.1's contrast of 4.5 to 1 and more, in light and dark."""

import re
from importlib.resources import files

import pytest

STYLE = (files("harness.report.page") / "assets" / "page.css").read_text(encoding="utf-8")
LEAST = 4.5  # level AA, for text of any size
TINTS = 12  # colours of stacks, as in core.js
WRITTEN = ("ink", "soft", "accent", "loss", "gain", *(f"s{number}" for number in range(TINTS)))
BEHIND = ("paper", "card")


def colours(theme):
    """The colours of a theme by name."""
    selector = ":root {" if theme == "light" else ':root[data-theme="dark"] {'
    body = STYLE.split(selector, 1)[1].split("}", 1)[0]
    return dict(re.findall(r"--([\w-]+): (#[0-9a-f]{6});", body))


def luminance(colour):
    """Relative luminance (WCAG 2.1)."""
    shares = [int(colour[place : place + 2], 16) / 255.0 for place in (1, 3, 5)]
    linear = [
        each / 12.92 if each <= 0.04045 else ((each + 0.055) / 1.055) ** 2.4 for each in shares
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_every_text_stands_out(theme):
    known = colours(theme)
    for text in WRITTEN:
        for ground in BEHIND:
            low, high = sorted((luminance(known[text]), luminance(known[ground])))
            assert (high + 0.05) / (low + 0.05) >= LEAST, (theme, text, ground)


def test_there_are_as_many_tints_as_the_program_takes():
    program = (files("harness.report.page") / "assets" / "core.js").read_text(encoding="utf-8")
    assert f"const TINTS = {TINTS};" in program
    assert all(
        f"s{number}" in colours(theme) for theme in ("light", "dark") for number in range(TINTS)
    )
