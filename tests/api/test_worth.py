"""What a localization error is worth: dollars up to the largest error that was priced."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from harness.recorded.trajectory import Errors
from navbench.api.localize import worth


def found(*errors: float, params: str = "stock") -> Any:
    ape = Errors(np.array(errors), None) if errors else None
    request = SimpleNamespace(params=params, allow_unknown=True, is_held_out=False)
    return SimpleNamespace(ape=ape, request=request, is_reference_input=False, doubt="")


@pytest.mark.parametrize(
    ("errors", "usd", "within", "is_beyond"),
    [
        ((0.0, 0.0), 0.0, 1.0, False),
        ((0.3, 0.3, 0.3), 4.53, 0.0, False),
        ((0.1, 0.7), 7.55, 0.5, False),
        ((4.0, 0.2), 15.1, 0.5, True),
    ],
)
def test_an_error_costs_its_share_and_arrives_within_the_tolerance(
    errors: tuple[float, ...], usd: float, within: float, is_beyond: bool
) -> None:
    value = worth(found(*errors))
    assert value is not None
    assert value.usd_per_run == pytest.approx(usd)
    assert value.low_usd <= value.usd_per_run <= value.high_usd
    assert (value.share_within, value.is_beyond) == (within, is_beyond)
    assert value.goal_tolerance_m == 0.25


def test_of_a_held_out_reference_no_share_is_near_enough() -> None:
    held_out = found(0.1, 0.7)
    held_out.is_reference_input = held_out.request.is_held_out = True
    value = worth(held_out)
    assert value is not None
    assert (value.usd_per_run, value.share_within) == (pytest.approx(7.55), None)


def test_without_a_reference_nothing_is_said() -> None:
    assert worth(found()) is None
