"""Every number of a file has a range, and no extreme makes ``lint`` and ``run`` differ."""

import dataclasses
import json
import os
import subprocess
import sys
import typing
from pathlib import Path

import pytest

from navstack.params.registry.bindings import NAMED_SECTIONS
from navstack.ranges import Parameters, rules_of

from .extremes import number_kind
from .test_defaults import classes

ROOT = Path(__file__).parents[2]
NAV2 = ROOT / "params" / "nav2"
PLANNERS = (
    "nav2_smac_planner::SmacPlannerHybrid",
    "nav2_smac_planner::SmacPlanner2D",
    "nav2_theta_star_planner::ThetaStarPlanner",
)
CONTROLLERS = ("starter", "jackal_mppi", "rpp", "graceful_gps_ekf")
ALL = "NAVBENCH_ALL_EXTREMES"  # set: every value of every file, which takes an hour
MOST_SECONDS, MOST_GIGABYTES = 10.0, 1.5  # of setting up a drive


KINDS = [
    *classes().values(),
    *(each for kinds in NAMED_SECTIONS.values() for each in kinds.values()),
]


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.__name__)
def test_every_number_has_a_range(kind):
    hints = typing.get_type_hints(kind, include_extras=True)
    numbers = [each.name for each in dataclasses.fields(kind) if number_kind(hints[each.name])]
    assert not numbers or issubclass(kind, Parameters)
    assert [name for name in numbers if not rules_of(hints[name])] == []


@pytest.mark.slow
def test_extreme_values_are_refused_by_lint_and_run_alike_or_set_up_quickly(tmp_path):
    files = [NAV2 / f"{name}.yaml" for name in CONTROLLERS]
    for planner in PLANNERS:
        files.append(tmp_path / f"{planner.partition('::')[2]}.yaml")
        text = files[0].read_text()
        files[-1].write_text(text.replace("nav2_navfn_planner::NavfnPlanner", planner))
    count, seconds = (0, 4 * 3600) if ALL in os.environ else (40, 600)
    program = [sys.executable, Path(__file__).with_name("extremes.py"), "8", str(count), *files]
    try:
        done = subprocess.run(
            program,
            capture_output=True,
            text=True,
            timeout=seconds,
            check=False,
            cwd=ROOT,
        )
    except subprocess.TimeoutExpired as stopped:
        pytest.fail(f"does not end: {stopped.stdout.splitlines()[-1]!r}")
    lines = [json.loads(line) for line in done.stdout.splitlines()]
    assert done.returncode == 0, (lines[-1:], done.stderr[-2000:])
    for case, (refused, errors, took, grown) in zip(lines[::2], lines[1::2], strict=True):
        assert bool(refused) == bool(errors), (case, refused, errors)
        assert took < MOST_SECONDS, case
        assert grown < MOST_GIGABYTES, case
        assert "\n" not in refused
