"""The auditor's look at what a tuned file computes: latency costs nothing in simulation."""

import math

from harness.tuning.audit_findings import Check, Evidence
from harness.tuning.result import StudyResult

MOST = 2.0  # times the original's computing
MULTIPLIES = frozenset(  # parameters that the controller's work per second is proportional to
    (
        *("controller_frequency", "vx_samples", "vy_samples", "vtheta_samples", "sim_time"),
        *("batch_size", "time_steps", "iteration_count"),
    )
)


def computing(study: StudyResult) -> Check:
    """How much more the tuned file computes per second than the original, by its parameters."""
    tuned, original = study.incumbent.values, study.original.values
    factors = {}
    for parameter in study.space.parameters:
        for path in parameter.paths:
            before, after = original.get(path, parameter.original), tuned.get(path)
            if path.rpartition(".")[2] in MULTIPLIES and _is_amount(before) and _is_amount(after):
                factors[path] = float(after) / float(before)  # type: ignore[arg-type]
    times = math.prod(factors.values())
    return Check(
        "compute",
        times > MOST,
        f"the controller computes {times:.2g} times as much per second by its parameters",
        (Evidence.unsampled("computing per second", "times", 1.0, times, 1),),
        is_examined=bool(factors),
    )


def _is_amount(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and value > 0
