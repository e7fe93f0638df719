"""The velocity smoother: what it sends while commands come and cease."""

from collections.abc import Iterator

import numpy as np

from harness.parity.comparison import Comparison
from harness.parity.golden import GoldenFile
from harness.parity.part import Case
from navstack.params.safety import VelocitySmootherParams
from navstack.params.strict import from_mapping
from navstack.safety.velocity_smoother import VelocitySmoother
from navstack.types import Twist2D

FACTS = "velocity_smoother"
SUFFIXES = ("out", "t", "cmds_t_x_y_w")
TOLERANCE = 1e-9  # [m/s, rad/s]
MEASURED = (0.8, 0.8, 0.9)  # share of what was sent that the recorded odometry measures in the next cycle
NOT_OURS = ("odom_duration",)  # the odometry given to navstack is smoothed already


def find(file: GoldenFile) -> Iterator[Case]:
    """Sequences ``vs_<case>_cmds_t_x_y_w`` (commands), ``_t`` (cycles) and ``_out`` (NaN: nothing was sent)."""
    for base in file.bases("_cmds_t_x_y_w", prefix="vs_"):
        arrays = frozenset(f"vs_{base}_{suffix}" for suffix in SUFFIXES)
        if arrays <= file.names and "params" in file.facts(FACTS, base):
            yield Case(f"vs_{base}", file, arrays)


def check(case: Case, comparison: Comparison) -> None:
    """Every cycle; where Nav2 sends nothing, navstack sends the standstill that Nav2 sent last."""
    given = dict(case.file.facts(FACTS, case.name.removeprefix("vs_"))["params"])
    for key in NOT_OURS:
        given.pop(key, None)
    smoother = VelocitySmoother(from_mapping(VelocitySmootherParams, given, case.title))
    commands = list(case["cmds_t_x_y_w"])
    measured, ours = Twist2D(), []
    for stamp in case["t"]:
        while commands and commands[0][0] <= stamp:
            t, x, y, w = commands.pop(0)
            smoother.receive(Twist2D(x, y, w), t)
        sent = smoother.smooth(None, measured, stamp)
        ours.append((sent.linear_x, sent.linear_y, sent.angular_z))
        measured = Twist2D(*(share * value for share, value in zip(MEASURED, ours[-1], strict=True)))
    comparison.near("velocities", ours, np.nan_to_num(case["out"]), TOLERANCE)
