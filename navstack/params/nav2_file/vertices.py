"""Polygons as Nav2 writes them in a text (``array_parser.cpp``)."""

import re

_TOKEN = re.compile(
    r"(?P<blank>[, \t])|(?P<bracket>[\[\]])"
    r"|\s*(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)"
)
DEPTH = 2  # of the brackets around numbers


def parse_vertices(text: str) -> list[list[float]] | None:
    """The lists of numbers in a text such as ``[[0.3, 0.2], [0.3, -0.2], [-0.3, 0.0]]``.

    None: Nav2 cannot read it.

    As in Nav2's ``parseVVF`` commas count as blanks: ``[[0.3 0.2] [0.3 -0.2] [-0.3 0.0]]`` is the
    same.
    """
    found: list[list[float]] = []
    depth = place = 0
    while place < len(text):
        token = _TOKEN.match(text, place)
        if token is None or (token["number"] and depth != DEPTH):
            return None
        place = token.end()
        if token["number"]:
            found[-1].append(float(token["number"]))
        elif token["bracket"] == "[":
            depth += 1
            if depth == DEPTH:
                found.append([])
        elif token["bracket"] == "]":
            depth -= 1
        if not 0 <= depth <= DEPTH:
            return None
    if depth:
        return None
    return found
