"""A test of the tests: with any documented constant halved or doubled, the parity check fails.

The sources are copied, one constant is changed in the text, and the case that depends on it is run
on the copy.
"""

import compileall
import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from py_compile import PycInvalidationMode
from typing import Any

import numba
import pytest

ROOT = Path(__file__).parents[2]
GOLDEN = ROOT / "tests" / "golden"
PACKAGES = ("navstack", "harness", "tools")
BOTH = (0.5, 2.0)
UNCHANGED = "unchanged"
# by other processes, into the folders of compiled code
HALF_WRITTEN = shutil.ignore_patterns("*.tmp.*", "*.pyc.*")

pytestmark = pytest.mark.slow


@dataclass(frozen=True)
class Constant:
    """A constant in the sources, and a recorded case that depends on it."""

    file: str
    old: str  # text that occurs once in the file, with {} where the value stands
    value: float | str  # a number, or an expression that is multiplied
    part: str
    case: str
    factors: tuple[float, ...] = BOTH  # only one where the recordings do not depend on the other
    # False: run the kernels as plain Python, for files whose kernels hold the constant
    jit: bool = True

    def changed(self, factor: float) -> str:
        """The text with the value multiplied."""
        if isinstance(self.value, str):
            return self.old.format(f"{factor} * {self.value}")
        product = self.value * factor
        return self.old.format(int(product) if isinstance(self.value, int) else product)

    @property
    def text(self) -> str:
        """The text as it stands in the file."""
        return self.old.format(self.value)


NAVFN = "navstack/planning/navfn_kernels.py"
DWB_PARAMS = "navstack/params/dwb.py"
TURN = "navstack/control/turn_in_place.py"
RPP_PARAMS = "navstack/params/rpp.py"
NEAR = ("navfn", "near_goal_dijkstra")
EMPTY = ("navfn", "empty60_dijkstra")
STRAIGHT = ("rpp", "default_straight")
FIELD_MODEL = "navstack/localization/amcl_sensor_models.py"
MOTION = "navstack/localization/motion_model.py"
KLD = "navstack/localization/kld.py"
WEIGHTS = ("amcl_weights", "n360_b60")
MOVED = ("amcl_motion", "motion_seq_end_seed5_alphas_costnav_pose1.2_2.15_1.0_delta.2_.15_.3")

CONSTANTS = (
    Constant(NAVFN, "COST_NEUTRAL = np.float32({})", 50.0, *NEAR, jit=False),
    Constant(NAVFN, "COST_FACTOR = {} ", 0.8, *NEAR, jit=False),
    Constant(NAVFN, "COST_HIGHEST = {} ", 253.0, "navfn", "unknown_allowed_dijkstra", jit=False),
    Constant(NAVFN, "LEAST_OBSTACLE = {} ", 253, *NEAR, jit=False),
    Constant(NAVFN, "WAVE_2 = {}\n", -0.2301, *EMPTY, jit=False),
    Constant(NAVFN, "WAVE_1 = {}\n", 0.5307, *EMPTY, jit=False),
    Constant(NAVFN, "WAVE_0 = {}\n", "0.7040", *EMPTY, jit=False),
    Constant("navstack/planning/navfn_descent.py", "STEP = np.float32({})", 0.5, *EMPTY, jit=False),
    Constant(
        "navstack/costmap/inflation.py",
        "return int({} * factor)",
        "HIGHEST_FALLING_COST",
        "inflation_curves",
        "curve_local",
    ),
    Constant(
        "navstack/control/dwb/critics/map_grid.py",
        "SCALE_PER_METRE = {} ",
        0.5,
        "dwb",
        "rest_straight",
    ),
    Constant(
        "navstack/control/dwb/critics/map_grid.py",
        "super().__init__(params.scale, params.aggregation_type, {})",
        "nose",
        "dwb",
        "rest_straight",
    ),
    Constant(
        "navstack/control/plan_handling.py",
        "LONGEST_GAP = {} ",
        2.0,
        "dwb_plan",
        "adjust_gap3",
        jit=False,
    ),
    Constant(DWB_PARAMS, "    forward_prune_distance: Quantity = {}\n", 2.0, "dwb_jazzy", "curve"),
    # Nothing of the recorded plans lies farther behind than the default, nor does any command lie
    # just beyond 0.05.
    Constant(
        DWB_PARAMS,
        "    prune_distance: Quantity = {} ",
        2.0,
        "dwb_jazzy",
        "corridor",
        factors=(0.5,),
    ),
    Constant(
        DWB_PARAMS,
        "    x_only_threshold: Quantity = {}\n",
        0.05,
        "dwb",
        "oscillation",
        factors=(0.5,),
    ),
    Constant(
        TURN,
        "math.sqrt({} * limits.max_angular_accel * abs(error))",
        2.0,
        "rotation_shim",
        "rsj_rotate_once",
    ),
    Constant(
        TURN,
        "change = {} * period",
        "limits.max_angular_accel",
        "rotation_shim",
        "rsj_rotate_once",
    ),
    Constant(
        "navstack/params/safety.py",
        "max_accel: UpTriple = ({}, 0.0, 3.2)",
        2.5,
        "velocity_smoother",
        "vs_costnav_default_accel",
    ),
    Constant(
        "navstack/params/safety.py",
        "max_decel: DownTriple = (-2.5, 0.0, {})",
        -3.2,
        "velocity_smoother",
        "vs_costnav_default_accel",
    ),
    Constant(
        "navstack/params/planners.py",
        "w_data: NotNegative = {} ",
        0.2,
        "simple_smoother",
        "sm_empty60",
    ),
    Constant(
        "navstack/params/planners.py",
        "w_smooth: NotNegative = {} ",
        0.3,
        "simple_smoother",
        "sm_empty60",
    ),
    Constant(
        "navstack/params/planners.py",
        "neighbours\n    do_refinement: bool = True  # smooth the smoothed path again\n"
        "    refinement_num: Refinements = {} ",
        2,
        "simple_smoother",
        "sm_empty60",
    ),
    Constant(RPP_PARAMS, "    desired_linear_vel: Positive = {} ", 0.5, *STRAIGHT),
    Constant(RPP_PARAMS, "    lookahead_dist: Positive = {} ", 0.6, *STRAIGHT),
    Constant(RPP_PARAMS, "    approach_velocity_scaling_dist: NotNegative = {}\n", 0.6, *STRAIGHT),
    Constant(RPP_PARAMS, "    max_angular_accel: Positive = {} ", 3.2, *STRAIGHT),
    Constant(
        RPP_PARAMS, "    regulated_linear_scaling_min_radius: Positive = {} ", 0.9, "rpp", "arc"
    ),
    Constant(FIELD_MODEL, "self._of_returns(range_max) ** {}\n", 3, *WEIGHTS),
    Constant(FIELD_MODEL, "ends, beams.range_max, {})\n        return Match", 1.0, *WEIGHTS),
    Constant(FIELD_MODEL, "self._field.distances / given.sigma_hit) ** 2) / {})", 2.0, *WEIGHTS),
    Constant(FIELD_MODEL, "+ {} / range_max", "given.z_rand", *WEIGHTS),
    Constant(
        "navstack/localization/likelihood_field.py",
        "cells_of(poses, self.origin.x, self.origin.y, self.resolution, {})",
        1.5,
        *WEIGHTS,
    ),
    Constant(MOTION, "first_std = math.sqrt({} * off_first", "alphas[0]", *MOVED, jit=False),
    Constant(MOTION, "off_first + {} * squared)", "alphas[1]", *MOVED, jit=False),
    Constant(MOTION, "distance_std = math.sqrt({} * squared", "alphas[2]", *MOVED, jit=False),
    Constant(KLD, "BIN_LENGTH = {} ", 0.5, "amcl_clusters", "cluster", jit=False),
    Constant(KLD, "math.radians({})", 10.0, "amcl_clusters", "cluster", jit=False),
    Constant(
        KLD,
        "b = {} / (9.0 * (bins - 1))",
        2.0,
        "amcl_limits",
        "kld_limit_raw_err01_z3",
        jit=False,
    ),
    Constant(
        KLD,
        "(bins - 1) / ({} * error)",
        2.0,
        "amcl_limits",
        "kld_limit_raw_err01_z3",
        jit=False,
    ),
)
CHANGES = [(constant, factor) for constant in CONSTANTS for factor in constant.factors]


def label(constant: Constant, factor: float) -> str:
    return f"{constant.text.strip()} x {factor:g}"


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The sources with what is compiled of them, still valid because files keep their times."""
    folder = tmp_path_factory.mktemp("sources")
    for package in PACKAGES:
        shutil.copytree(ROOT / package, folder / package, ignore=HALF_WRITTEN)
    # once for all changes
    compileall.compile_dir(folder, quiet=1, invalidation_mode=PycInvalidationMode.CHECKED_HASH)
    return folder


@pytest.fixture(scope="module")
def wrong(copy: Path) -> dict[str, list[str]]:
    """What is wrong with each change, and with none (before and after all changes)."""
    every = sorted({(constant.part, constant.case, constant.jit) for constant in CONSTANTS})
    unchanged = [
        {
            "file": "",
            "old": "",
            "new": "",
            "cases": [[*case] for *case, jit in every if jit is which],
            "jit": which,
        }
        for which in (False, True)
    ]
    changed = [
        {
            "file": constant.file,
            "old": constant.text,
            "new": constant.changed(factor),
            "cases": [[constant.part, constant.case]],
            "jit": constant.jit,
        }
        for constant, factor in CHANGES
    ]
    jobs = [
        job | {"copy": str(copy), "sources": str(ROOT), "golden": str(GOLDEN)}
        for job in (*unchanged, *changed, *unchanged)
    ]
    environment = {
        key: value
        for key, value in os.environ.items()
        if key not in ("NUMBA_CACHE_DIR", "PYTHONPATH")
    }
    config: Any = numba.config
    # as navstack has set it, before numba makes itself ready: compiled code is known by it, too
    if config.CPU_NAME:
        environment |= {
            "NUMBA_CPU_NAME": config.CPU_NAME,
            "NUMBA_CPU_FEATURES": config.CPU_FEATURES or "",
        }
    program = subprocess.run(
        [sys.executable, str(Path(__file__).with_name("changed_sources.py"))],
        input=json.dumps(jobs),
        capture_output=True,
        text=True,
        cwd=copy,
        env=environment,
        check=False,
    )
    assert program.returncode == 0, program.stderr
    answers = json.loads(program.stdout)
    assert len(answers) == len(jobs)
    pair = len(unchanged)
    before, middle, after = answers[:pair], answers[pair:-pair], answers[-pair:]
    found = {label(*change): answer for change, answer in zip(CHANGES, middle, strict=True)}
    return found | {UNCHANGED: sum((*before, *after), [])}


def test_the_unchanged_copy_passes(wrong: dict[str, list[str]]) -> None:
    assert wrong[UNCHANGED] == []


@pytest.mark.parametrize("constant", CONSTANTS, ids=lambda constant: constant.text.strip())
def test_every_constant_stands_once_in_the_sources(constant: Constant) -> None:
    assert (ROOT / constant.file).read_text(encoding="utf-8").count(constant.text) == 1


@pytest.mark.parametrize(
    ("constant", "factor"), CHANGES, ids=[label(*change) for change in CHANGES]
)
def test_a_changed_constant_is_noticed(
    constant: Constant,
    factor: float,
    wrong: dict[str, list[str]],
) -> None:
    found = wrong[label(constant, factor)]
    assert found != []
    # it computes something else, it does not break down
    assert not any("cannot be run" in each for each in found)
