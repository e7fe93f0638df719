"""Polygons in a text, read as Nav2's parser reads them."""

import numpy as np
import pytest

from navstack.errors import ParameterError
from navstack.params.collision_monitor import parse_polygon
from navstack.params.nav2_file.vertices import parse_vertices

CORNERS = [[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2]]


@pytest.mark.parametrize(
    "text",
    [
        "[[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2]]",
        "[[0.3 0.2] [0.3 -0.2] [-0.3 -0.2] [-0.3 0.2]]",
        " [[.3,+0.2][3e-1,-0.2],,[-0.3\t-2E-1] [-0.3 0.2]] ",
    ],
)
def test_commas_and_blanks_are_the_same(text):
    assert parse_vertices(text) == CORNERS
    assert np.allclose(parse_polygon(text), CORNERS)


@pytest.mark.parametrize(
    ("text", "lists"), [("", []), ("[]", []), ("[[]]", [[]]), ("[[1 2 3]]", [[1.0, 2.0, 3.0]])]
)
def test_lists_of_any_length_are_read(text, lists):
    assert parse_vertices(text) == lists


@pytest.mark.parametrize(
    "text",
    [
        "0.3",
        "[0.3, 0.2]",
        "[[[1, 2]]]",
        "[[1, 2]",
        "[[1, 2]]]",
        "[[1, x]]",
        "[(1, 2), (3, 4)]",
        "[[1, nan]]",
    ],
)
def test_what_nav2_cannot_read_is_not_read(text):
    assert parse_vertices(text) is None
    with pytest.raises(ParameterError, match="not a list of at least 4 pairs"):
        parse_polygon(text)
