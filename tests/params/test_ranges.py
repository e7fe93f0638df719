"""Rules beside fields: what they admit, and what their messages say."""

import math
import pickle
import re
from dataclasses import dataclass, replace
from typing import Annotated

import pytest

from harness.world.world_params import WorldParams
from navstack.errors import InputError, ParameterError
from navstack.params.strict import load_dataclass
from navstack.ranges import (
    POSITIVE,
    Allowed,
    Capped,
    Known,
    Needed,
    NotNegative,
    Parameters,
    Positive,
    Replaced,
    Share,
    at_most,
    less_than,
    one_of,
    up_to,
    within,
)


@dataclass(frozen=True, slots=True)
class WheelParams(Parameters, whose="wheels"):
    radius: Positive = 0.1
    side: Annotated[str, one_of(("left", "right"))] = "left"
    teeth: Annotated[int, Replaced((4, 8), 8)] = 8
    lambda_: NotNegative | None = None
    wear: Annotated[float, POSITIVE, at_most(1)] = 0.5

    def _check_together(self) -> None:
        self._require("wear", self.wear < self.radius * 100.0, "less than radius * 100")


@dataclass(frozen=True, slots=True)
class FiniteWheelParams(WheelParams, finite=True):
    speed: float = 0.0


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"radius": 0.0}, "wheels: radius 0.0 must be more than 0"),
        ({"radius": math.nan}, "wheels: radius nan must be more than 0"),
        ({"side": "top"}, "wheels: side top must be one of left, right"),
        ({"wear": 0.0}, "wheels: wear 0.0 must be more than 0"),
        ({"wear": 1.5}, "wheels: wear 1.5 must be at most 1"),
        ({"radius": 0.001}, "wheels: wear 0.5 must be less than radius * 100"),
    ],
)
def test_a_value_that_is_not_allowed_is_named(given, message):
    with pytest.raises(ParameterError, match=f"^{re.escape(message)}$"):
        WheelParams(**given)


def test_values_that_are_allowed_stay_as_they_are():
    params = WheelParams(radius=2, side="right", lambda_=0.0, wear=1.0)
    assert (params.radius, params.side, params.lambda_, params.wear) == (2, "right", 0.0, 1.0)
    assert pickle.loads(pickle.dumps(params)) == params


def test_none_is_not_checked():
    assert WheelParams().lambda_ is None


def test_an_unknown_number_is_replaced_by_the_usual_one():
    assert WheelParams(teeth=5).teeth == 8
    assert WheelParams(teeth=4).teeth == 4


def test_a_number_beyond_what_matters_is_cut():
    assert [Capped(9.0).taken("reach", value, "") for value in (1, 9.5, math.inf)] == [1, 9.0, 9.0]


def test_a_changed_copy_is_checked_too():
    with pytest.raises(ParameterError, match="radius -1.0"):
        replace(WheelParams(), radius=-1.0)


def test_a_subclass_keeps_rules_and_name_and_may_ask_for_finite_numbers():
    with pytest.raises(ParameterError, match="^wheels: radius -1.0 must be more than 0$"):
        FiniteWheelParams(radius=-1.0)
    with pytest.raises(ParameterError, match="^wheels: speed inf must be a finite number$"):
        FiniteWheelParams(speed=math.inf)
    assert WheelParams(radius=math.inf).radius == math.inf


@pytest.mark.parametrize(
    ("rule", "right", "wrong", "message"),
    [
        (within(1, 2), (1, 2), (0.9, 2.1), "must be 1 to 2"),
        (up_to(2), (0.1, 2), (0.0, 2.1), "must be more than 0 to 2"),
        (less_than(1), (0.0, -5), (1,), "must be less than 1"),
        (Allowed("even", lambda value: value % 2 == 0), (2,), (3,), "must be even"),
        (Needed("; give one"), ("a",), ("",), "name is missing; give one"),
        (Known("wheel", ("left",)), ("left",), ("lift",), "unknown wheel 'lift'; did you mean"),
    ],
)
def test_rules(rule, right, wrong, message):
    assert [rule.taken("name", value, "") for value in right] == list(right)
    for value in wrong:
        with pytest.raises(InputError, match=re.escape(message)):
            rule.taken("name", value, "")


def test_a_share_is_between_0_and_1():
    assert Share.__metadata__[0].text == "0 to 1"


@pytest.mark.parametrize(
    ("text", "told"),
    [("", "is empty; expected the keys"), ("- 1\n", r"\[1\] is not a mapping; expected the keys")],
)
def test_a_file_without_keys_is_told_which_it_takes(tmp_path, text, told):
    (tmp_path / "world.yaml").write_text(text)
    with pytest.raises(ParameterError, match=told):
        load_dataclass(WorldParams, tmp_path / "world.yaml")
