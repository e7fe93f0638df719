"""A potential that is forgotten leaves nothing behind, on small maps and those processes share."""

import numpy as np
import pytest

from navstack.planning.navfn_kernels import POT_HIGH
from navstack.planning.potential_field import NOWHERE, PotentialField

from .given import free_map


@pytest.mark.parametrize("width", [60, 1200], ids=["small", "shared"])
def test_a_forgotten_field_is_as_new(width: int) -> None:
    costmap = free_map(1000, width, 0.05)
    field = PotentialField(allow_unknown=True)
    field.expand(costmap, 500 * width + 30, 500 * width + 50)
    first = field.potential.copy()
    assert first[500, 30] == 0.0
    assert first[500, 31] == 50.0
    field.forget()
    assert (field.potential == POT_HIGH).all()
    field.expand(costmap, 500 * width + 30, 500 * width + 50)
    assert np.array_equal(field.potential, first)
    field.expand(costmap, 20 * width + 30, NOWHERE)
    field.forget()
    assert (field.potential == POT_HIGH).all()
