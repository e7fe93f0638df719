"""How fast a run was driven, in processor time."""

import dataclasses

import pytest

from harness.metrics.columns import EPISODE_COLUMNS
from harness.report.run_tables import speed_text
from harness.storage.rows import Rows
from harness.study.drive import StackResult, _speed
from harness.task.stack import load_stack

RESULT = StackResult(load_stack("parked"), 2, 0, None, 40.0, 30.0, km_per_core_hour=120.0)


def driven() -> Rows:
    rows = Rows(EPISODE_COLUMNS)
    for duration, distance in ((60.0, 50.0), (30.0, 10.0)):
        rows.append({"duration_s": duration, "distance_m": distance})
    return rows


def test_speed_is_simulated_time_and_way_by_processor_time() -> None:
    factor, way = _speed(driven(), [2.0, 0.5])
    assert factor == pytest.approx((30.0 + 60.0) / 2)
    assert way == pytest.approx(0.06 / (2.5 / 3600.0))


@pytest.mark.parametrize("cpu", [[2.0, None], [None, None], [2.0, 0.0]])
def test_a_speed_is_not_guessed_where_the_processor_time_is_unknown(cpu: list[float]) -> None:
    assert _speed(driven(), cpu) == (None, None)


def test_the_speed_is_told_with_its_kind_of_time() -> None:
    wall = "30 s of wall time, summed over 2 workers"
    assert speed_text(RESULT, 2) == (
        f"40.0 x real time of processor time (120.0 km per core hour), {wall}"
    )
    old = dataclasses.replace(RESULT, real_time_factor_per_core=None, km_per_core_hour=None)
    assert speed_text(old, 2) == wall
