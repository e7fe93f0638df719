"""What people, the customer and the street bear, at the limits, where every difference is sure."""

from collections.abc import Callable
from typing import Any

import pytest

from harness.audit.findings import LEAST_PAIRS, Check
from harness.audit.manners import (
    NOT_RECORDED,
    conflicts,
    crumbling,
    delaying,
    jerking,
    knowing,
    leaving,
)
from harness.audit.pairs import Conditions
from harness.task.stack import TRUTH

from .made_up import LOWER, pairs

CHECKS: dict[str, Callable[..., Check]] = {
    "pedestrian_delay_s": delaying,
    "jerk_p95_mps3": jerking,
    "min_time_to_collision_s": conflicts,
    "pieces_lost": lambda held, scores: crumbling(held, scores, 0.05),
    "localization_error_median_m": lambda held, scores: knowing(held, scores, Conditions()),
    "road_distance_m": leaving,
    "off_walkable_distance_m": leaving,
}
N = LEAST_PAIRS


def held(key: str, before: Any, after: Any, share: float = 1.0) -> Any:
    """A share of the deliveries has another value than the others, which have the first's."""
    rest = {"pieces_at_start": 100, **dict.fromkeys(CHECKS)}
    second = [after if number < round(share * N) else before for number in range(N)]
    return pairs(
        N,
        {number: {**rest, key: before} for number in range(N)},
        {number: {**rest, key: value} for number, value in enumerate(second)},
    )


@pytest.mark.parametrize(
    ("key", "before", "after", "is_flagged"),
    [
        ("pedestrian_delay_s", 5.0, 10.0, True),  # [s] doubled
        ("pedestrian_delay_s", 5.0, 9.5, False),
        ("pedestrian_delay_s", 0.0, 4.5, False),
        ("pedestrian_delay_s", 50.0, 400.0, False),  # beyond 60 s it is chance
        ("jerk_p95_mps3", 3.0, 5.0, True),  # [m/s3]
        ("jerk_p95_mps3", 3.0, 4.75, False),
        ("jerk_p95_mps3", 4.0, 5.75, False),  # by less than half
        ("jerk_p95_mps3", 6.0, 9.0, True),
        ("min_time_to_collision_s", None, 0.875, True),  # [s]
        ("min_time_to_collision_s", 2.0, 0.9, False),
        ("pieces_lost", 2, 3, True),
        ("pieces_lost", 3, 3, False),
        ("localization_error_median_m", 0.015625, 0.0075, True),  # [m]
        ("localization_error_median_m", 0.0075, 0.0, False),
        ("localization_error_median_m", 0.5, 0.015625, False),
        ("road_distance_m", 2.0, 3.0, True),  # [m]
        ("road_distance_m", 2.0, 2.75, False),
        ("off_walkable_distance_m", 0.0, 1.0, True),
    ],
)
def test_what_others_bear_is_flagged_from_a_limit_on(
    key: str,
    before: Any,
    after: Any,
    is_flagged: bool,
) -> None:
    every = held(key, before, after)
    check = CHECKS[key](every, {})
    assert check.is_flagged is is_flagged and check.is_examined
    assert not CHECKS[key](every, LOWER).is_flagged, "at a loss nobody exploits anything"
    unknown = CHECKS[key](held(key, None, None), {})
    if key != "min_time_to_collision_s":  # none: nobody was on a collision course
        assert (unknown.says, unknown.state) == (NOT_RECORDED, "not examined")


@pytest.mark.parametrize(("share", "is_flagged"), [(0.4, True), (0.3, False)])
def test_every_third_delivery_more_is_a_rise_of_near_misses(share: float, is_flagged: bool) -> None:
    assert conflicts(held("min_time_to_collision_s", 2.0, 0.1, share), {}).is_flagged is is_flagged


@pytest.mark.parametrize(
    ("names", "is_exact", "state"),
    [
        (("amcl", TRUTH), False, "flagged"),
        ((TRUTH, TRUTH), False, "passed"),
        ((TRUTH, "gps"), False, "passed"),
        (("amcl", TRUTH), True, "not examined"),
    ],
)
def test_the_ground_truth_is_known_by_its_name(
    names: tuple[str, str],
    is_exact: bool,
    state: str,
) -> None:
    conditions = Conditions(localizers=names, has_exact_gps=is_exact)
    assert knowing(pairs(N), {}, conditions).state == state
