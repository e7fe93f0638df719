"""DWB's decisions: sampled velocities, trajectories, scores and the chosen command of single scenes (Nav2 main)."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from harness.parity.comparison import Comparison
from harness.parity.golden import GoldenFile
from harness.parity.part import Case, existing
from navstack.control.controller import Surroundings
from navstack.control.dwb.critics import CRITICS, build_critics
from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.critics.map_grid import MapGridCritic
from navstack.control.dwb.decision import Decision
from navstack.control.dwb.dwb_controller import DwbController
from navstack.control.dwb.rollouts import Rollouts
from navstack.control.dwb.scene import Scene
from navstack.costmap.costmap import Costmap
from navstack.params.dwb import DwbParams
from navstack.params.strict import from_mapping
from navstack.types import FloatArray, Pose2D, RobotState, Twist2D

TOLERANCE = 1e-5  # of trajectories, raw scores and totals, which Nav2 adds up in float32
FREQUENCY = 30.0  # [Hz] of the recorded controller
PLAN_LENGTH_OF_MAIN = 1.0  # [m] within which Nav2 main's RotateToGoal begins to act
NOT_OURS = ("transform_tolerance",)  # recorded parameters that navstack, which has one frame, does not have
SUFFIXES = (
    *("vel", "raw", "total", "illegal_critic", "npose", "last_pose", "poses", "pose_off", "times", "time_off"),
    *(f"grid_{critic}" for critic in CRITICS),
)

OUT_OF_BOUNDS = (
    "RotateToGoal.lookahead_time >= 0: upstream reads its score's time beyond the end of an array; RotateToGoal's "
    "scores, the totals and the command are not compared"
)


def find(file: GoldenFile) -> Iterator[Case]:
    """Scenes of one cycle: ``<case>_costmap``, ``<case>_path`` and ``<case>_vel``, and their facts."""
    for name in file.bases("_costmap"):
        inputs = {f"{name}_costmap", f"{name}_path"}
        if {*inputs, f"{name}_vel"} <= file.names and "pose" in file.facts(name):
            yield Case(name, file, existing(file, (*inputs, *(f"{name}_{suffix}" for suffix in SUFFIXES))))


def check(case: Case, comparison: Comparison) -> None:
    """One cycle on a fresh controller; the cycles that follow it, where they are recorded."""
    facts, costmap = case.facts, costmap_of(case)
    params = replace(make_params(case.file, facts["overrides"]), path_length_tolerance=PLAN_LENGTH_OF_MAIN)
    critics = build_critics(params)
    controller = DwbController(params, footprint_of(case.file), FREQUENCY, critics)
    goal, path = Pose2D(*facts["goal"]), case["path"]
    decision = controller.decide(state_of(facts), path, goal, Surroundings(costmap))
    undefined = params.RotateToGoal.lookahead_time >= 0.0
    if undefined:
        comparison.allow(OUT_OF_BOUNDS)
    check_decision(case, "", comparison, decision, undefined)
    check_grids(case, "", comparison, critics, make_scene(facts, path, goal, costmap, case.file))
    if not undefined:
        check_choice(comparison, facts, decision)
    _check_following(case, comparison, path, Surroundings(costmap), params)


def _check_following(
    case: Case, comparison: Comparison, path: FloatArray, surroundings: Surroundings, params: DwbParams
) -> None:
    """The cycles after the first, on one controller that remembers; the sequence begins with the scene itself."""
    controller = DwbController(params, footprint_of(case.file), FREQUENCY)
    following = case.facts.get("sequence_after", ())
    for k, step in enumerate((case.facts, *following) if following else ()):
        decision = controller.decide(state_of(step), path, Pose2D(*case.facts["goal"]), surroundings)
        check_choice(comparison, step, decision, f"cycle {k}: ")
        if "n_osc" in step:
            comparison.equal(
                f"cycle {k}: oscillating", decision.scores.rejections().get("Oscillation", 0), step["n_osc"]
            )


def make_params(file: GoldenFile, overrides: Mapping[str, Any]) -> DwbParams:
    """The parameters of a scene: the file's, and what the scene changes; critics' own stand as ``<Critic>.<name>``."""
    nested: dict[str, Any] = {}
    for key, value in {**file.meta["base_params"], **overrides}.items():
        head, _, tail = key.partition(".")
        if tail:
            nested.setdefault(head, {})[tail] = value
        elif key not in NOT_OURS:
            nested[key] = value
    return from_mapping(DwbParams, nested, str(file.path))


def footprint_of(file: GoldenFile) -> FloatArray:
    """The padded footprint (V, 2) [m] of a file's scenes."""
    return np.array(file.meta["footprint_padded"])


def costmap_of(case: Case) -> Costmap:
    """The costmap of a scene."""
    return Costmap(case["costmap"], case.facts["resolution"], *case.facts["origin"])


def state_of(step: Mapping[str, Any]) -> RobotState:
    """The robot's state in a recorded cycle."""
    return RobotState(Pose2D(*step["pose"]), Twist2D(*step["vel"]), step.get("t", 0.0))


def make_scene(step: Mapping[str, Any], plan: FloatArray, goal: Pose2D, costmap: Costmap, file: GoldenFile) -> Scene:
    """What the critics saw in a recorded cycle."""
    state = state_of(step)
    return Scene(state.pose, state.twist, state.stamp, goal, plan, costmap, footprint_of(file))


def check_decision(case: Case, prefix: str, comparison: Comparison, decision: Decision, undefined: bool) -> None:
    """Samples, trajectories and scores of a cycle whose arrays are ``<case>_<prefix><suffix>``.

    ``undefined``: RotateToGoal's scores mean nothing.
    """
    at = prefix and f"{prefix.rstrip('_')}: "
    scores = decision.scores
    comparison.equal(f"{at}velocities", scores.rollouts.commands, case[f"{prefix}vel"])
    _check_trajectories(case, prefix, comparison, scores.rollouts)
    illegal = np.isinf(scores.raw)
    rejected_by = np.where(illegal.any(axis=0), illegal.argmax(axis=0), -1)
    legal = (rejected_by < 0) & (case[f"{prefix}illegal_critic"] < 0)
    for i, name in enumerate(decision.scores.critics):
        if name != "RotateToGoal" or not undefined:
            comparison.near(f"{at}raw score {name}", scores.raw[i][legal], case[f"{prefix}raw"][legal, i], TOLERANCE)
    if not undefined:
        comparison.equal(f"{at}rejecting critic", rejected_by, case[f"{prefix}illegal_critic"])
        comparison.near(f"{at}totals", scores.totals[legal], case[f"{prefix}total"][legal], TOLERANCE)


def _check_trajectories(case: Case, prefix: str, comparison: Comparison, rollouts: Rollouts) -> None:
    at = prefix and f"{prefix.rstrip('_')}: "
    if not np.array_equal(rollouts.lengths, case[f"{prefix}npose"]):
        comparison.equal(f"{at}poses per trajectory", rollouts.lengths, case[f"{prefix}npose"])
        return
    ends = np.stack((rollouts.x[:, -1], rollouts.y[:, -1]), axis=1)
    last = case[f"{prefix}last_pose"]
    comparison.near(f"{at}last positions", ends, last[:, :2], TOLERANCE)
    comparison.angles(f"{at}last headings", rollouts.yaw[:, -1], last[:, 2], TOLERANCE)
    if f"{prefix}poses" in case:
        is_pose = np.arange(rollouts.x.shape[1]) < rollouts.lengths[:, None]
        poses = case[f"{prefix}poses"]
        positions = np.stack((rollouts.x[is_pose], rollouts.y[is_pose]), axis=1)
        comparison.near(f"{at}positions", positions, poses[:, :2], TOLERANCE)
        comparison.angles(f"{at}headings", rollouts.yaw[is_pose], poses[:, 2], TOLERANCE)
    if f"{prefix}times" in case:
        counts = case[f"{prefix}npose"] - 1
        times = [rollouts.sim_time / n * np.arange(count) for n, count in zip(rollouts.steps, counts, strict=True)]
        comparison.near(f"{at}times", np.concatenate(times), case[f"{prefix}times"], TOLERANCE)


def check_grids(case: Case, prefix: str, comparison: Comparison, critics: Mapping[str, Critic], scene: Scene) -> None:
    """What a critic shows of itself, cell by cell: distances of the map-grid critics, costs of the others."""
    costs = scene.costmap.data
    every_cell = np.arange(costs.size, dtype=np.int32)
    for name, critic in critics.items():
        if f"{prefix}grid_{name}" in case:
            ours = costs
            if isinstance(critic, MapGridCritic):
                ours = critic.distances(every_cell, scene).reshape(costs.shape)
            comparison.equal(f"{prefix}grid {name}", ours, case[f"{prefix}grid_{name}"])


def check_choice(comparison: Comparison, step: Mapping[str, Any], decision: Decision, at: str = "") -> None:
    """The chosen command, exactly (also the one that Nav2 chose with its short circuit), and what was rejected."""
    command = decision.command if decision.is_legal else None
    chosen = [np.nan] * 3 if command is None else [command.linear_x, command.linear_y, command.angular_z]
    for key in ("cmd", "short_circuit_cmd"):
        if key in step:
            comparison.equal(f"{at}{key}", chosen, [np.nan] * 3 if step[key] is None else step[key])
    if decision.is_legal and "best_index" in step:
        comparison.equal(f"{at}index of the best", decision.choice.index, step["best_index"])
    if "n_illegal" in step:
        comparison.equal(f"{at}rejected trajectories", sum(decision.scores.rejections().values()), step["n_illegal"])
    if "critic_scales" in step:
        comparison.equal(f"{at}critics", decision.scores.critics, step["critic_names"])
        comparison.near(f"{at}critics' scales", decision.scores.scales, step["critic_scales"], TOLERANCE)
