"""DWB of Nav2 Jazzy in sequences of cycles, with its pruning of the plan."""

from collections.abc import Iterator

from harness.parity.comparison import Comparison
from harness.parity.dwb import (
    FREQUENCY,
    SUFFIXES,
    check_choice,
    check_decision,
    check_grids,
    costmap_of,
    footprint_of,
    make_params,
    make_scene,
    state_of,
)
from harness.parity.golden import GoldenFile
from harness.parity.part import Case, existing
from navstack.control.controller import Surroundings
from navstack.control.dwb.critics import build_critics
from navstack.control.dwb.dwb_controller import DwbController
from navstack.control.plan_handling import PlanWindow
from navstack.errors import NoLegalVelocity
from navstack.types import Path, Pose2D

PLAN_TOLERANCE = 1e-9  # [m]


def find(file: GoldenFile) -> Iterator[Case]:
    """Sequences ``<case>_costmap``, ``<case>_path``, ``<case>_s<k>_vel`` (k from 0) with ``steps`` in their facts."""
    for name in file.bases("_s0_vel"):
        inputs = {f"{name}_costmap", f"{name}_path"}
        steps = file.facts(name).get("steps", ())
        if inputs <= file.names and steps:
            outputs = (f"{name}_s{k}_{s}" for k in range(len(steps)) for s in ("transformed_plan", *SUFFIXES))
            yield Case(name, file, existing(file, (*inputs, *outputs)))


def check(case: Case, comparison: Comparison) -> None:
    """Every cycle of a sequence on one controller, which prunes one plan."""
    params = make_params(case.file, case.facts["overrides"])
    critics = build_critics(params)
    controller = DwbController(params, footprint_of(case.file), FREQUENCY, critics)
    window = PlanWindow(
        params.prune_plan, params.prune_distance, params.forward_prune_distance, params.shorten_transformed_plan
    )
    costmap, plan = costmap_of(case), Path(case["path"])
    goal = Pose2D(*map(float, plan.poses[-1]))
    for k, step in enumerate(case.facts["steps"]):
        near = window.near(plan, Pose2D(*step["pose"]), costmap)
        if f"s{k}_transformed_plan" in case:
            comparison.near(f"s{k}: pruned plan", near, case[f"s{k}_transformed_plan"], PLAN_TOLERANCE)
        try:
            controller.compute_velocity(state_of(step), plan, Surroundings(costmap))
        except NoLegalVelocity as error:
            comparison.equal(f"s{k}: rejected in the error", sum(error.rejections.values()), step["n_samples"])
        decision = controller.last_decision
        assert decision is not None
        check_choice(comparison, step, decision, f"s{k}: ")
        if f"s{k}_vel" in case:
            check_decision(case, f"s{k}_", comparison, decision, undefined=False)
            check_grids(case, f"s{k}_", comparison, critics, make_scene(step, near, goal, costmap, case.file))
