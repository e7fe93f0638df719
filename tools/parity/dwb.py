"""DWB: scenes of Nav2 main, sequences of Jazzy, sampled velocities, densified plans."""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from navstack.control.controller import Surroundings
from navstack.control.dwb.critics import build_critics
from navstack.control.dwb.critics.critic import Critic
from navstack.control.dwb.critics.map_grid import MapGridCritic
from navstack.control.dwb.decision import Decision
from navstack.control.dwb.dwb_controller import DwbController
from navstack.control.dwb.pose_score import add_distances, plan_cells, seeds_of
from navstack.control.dwb.rollouts import RolloutGenerator, Rollouts
from navstack.control.dwb.scene import DwbScene
from navstack.control.plan_handling import PlanWindow, densify
from navstack.costmap.costmap import Costmap
from navstack.errors import NoLegalVelocity
from navstack.params.dwb import DwbParams
from navstack.params.registry.controllers import DWB_CRITICS
from navstack.params.strict import from_mapping
from navstack.types import FloatArray, Path, Pose2D, RobotState, Twist2D
from tools.parity.comparison import Comparison
from tools.parity.golden import GoldenFile
from tools.parity.part import Case, Shape, costmap_of, existing

TOLERANCE = 1e-5  # of trajectories, raw scores and totals, which Nav2 adds up in float32
FREQUENCY = 30.0  # [Hz] of the recorded controller
NO_COMMAND = (np.nan, np.nan, np.nan)
RESOLUTION = 0.05  # [m] of the grid that plans are densified for
POINT_TOLERANCE = 1e-9  # [m] of plans
PLAN_LENGTH_OF_MAIN = 1.0  # [m] within which Nav2 main's RotateToGoal begins to act
# recorded parameters that navstack, which has one frame, does not have
NOT_OURS = ("transform_tolerance",)
SUFFIXES = (
    *(
        "vel",
        "raw",
        "total",
        "illegal_critic",
        "npose",
        "last_pose",
        "poses",
        "pose_off",
        "times",
        "time_off",
    ),
    *(f"grid_{critic}" for critic in DWB_CRITICS),
)

OUT_OF_BOUNDS = (
    "RotateToGoal.lookahead_time >= 0: upstream reads its score's time beyond the end of "
    "an array; RotateToGoal's "
    "scores, the totals and the command are not compared"
)


SCENES = Shape(
    ("{}_costmap", "{}_path", "{}_vel"), tuple(f"{{}}_{suffix}" for suffix in SUFFIXES), fact="pose"
)
VELOCITIES = Shape(("twists_{}",), (), (), None, "twists_{}")
PLANS = Shape(("adjust_{}_in", "adjust_{}_out"), (), ("adjust_{}",), None, "adjust_{}")


def check_scene(case: Case, comparison: Comparison) -> None:
    """One cycle on a fresh controller; the cycles that follow it, where they are recorded."""
    facts, costmap = case.facts, _costmap(case)
    params = replace(
        _params(case.file, facts["overrides"]), path_length_tolerance=PLAN_LENGTH_OF_MAIN
    )
    critics = build_critics(params)
    controller = DwbController(params, _footprint(case.file), FREQUENCY, critics)
    goal, path = Pose2D(*facts["goal"]), case["path"]
    decision = controller.decide(_state(facts), path, goal, Surroundings(costmap))
    undefined = params.RotateToGoal.lookahead_time >= 0.0
    if undefined:
        comparison.allow(OUT_OF_BOUNDS)
    _check_decision(case, "", comparison, decision, undefined)
    _check_grids(case, "", comparison, critics, _scene(facts, path, goal, costmap, case.file))
    if not undefined:
        _check_choice(comparison, facts, decision)
    _check_following(case, comparison, path, Surroundings(costmap), params)


def _check_following(
    case: Case,
    comparison: Comparison,
    path: FloatArray,
    surroundings: Surroundings,
    params: DwbParams,
) -> None:
    """The cycles after the first, on one controller that remembers.

    The sequence begins with the scene itself.
    """
    controller = DwbController(params, _footprint(case.file), FREQUENCY)
    following = case.facts.get("sequence_after", ())
    if not following:
        return
    for k, step in enumerate((case.facts, *following)):
        decision = controller.decide(_state(step), path, Pose2D(*case.facts["goal"]), surroundings)
        _check_choice(comparison, step, decision, f"cycle {k}: ")
        if "n_osc" in step:
            comparison.equal(
                f"cycle {k}: oscillating",
                decision.scores.rejections().get("Oscillation", 0),
                step["n_osc"],
            )


def _params(file: GoldenFile, overrides: Mapping[str, Any]) -> DwbParams:
    """The parameters of a scene: the file's, and what the scene changes.

    Critics' own stand as ``<Critic>.<name>``.
    """
    nested: dict[str, Any] = {}
    for key, value in {**file.meta["base_params"], **overrides}.items():
        head, _, tail = key.partition(".")
        if tail:
            nested.setdefault(head, {})[tail] = value
        elif key not in NOT_OURS:
            nested[key] = value
    return from_mapping(DwbParams, nested, str(file.path))


def _footprint(file: GoldenFile) -> FloatArray:
    """The padded footprint (V, 2) [m] of a file's scenes."""
    return np.array(file.meta["footprint_padded"])


def _costmap(case: Case) -> Costmap:
    """The costmap of a scene."""
    return costmap_of(case["costmap"], case.facts["resolution"], case.facts["origin"])


def _state(step: Mapping[str, Any]) -> RobotState:
    """The robot's state in a recorded cycle."""
    return RobotState(Pose2D(*step["pose"]), Twist2D(*step["vel"]), step.get("t", 0.0))


def _scene(
    step: Mapping[str, Any],
    plan: FloatArray,
    goal: Pose2D,
    costmap: Costmap,
    file: GoldenFile,
) -> DwbScene:
    """What the critics saw in a recorded cycle."""
    state = _state(step)
    return DwbScene(state.pose, state.twist, state.stamp, goal, plan, costmap, _footprint(file))


def _check_decision(
    case: Case,
    prefix: str,
    comparison: Comparison,
    decision: Decision,
    undefined: bool,
) -> None:
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
            comparison.near(
                f"{at}raw score {name}",
                scores.raw[i][legal],
                case[f"{prefix}raw"][legal, i],
                TOLERANCE,
            )
    if undefined:
        case.pass_over(f"{prefix}total")
    else:
        comparison.equal(f"{at}rejecting critic", rejected_by, case[f"{prefix}illegal_critic"])
        comparison.near(
            f"{at}totals", scores.totals[legal], case[f"{prefix}total"][legal], TOLERANCE
        )


def _check_trajectories(
    case: Case,
    prefix: str,
    comparison: Comparison,
    rollouts: Rollouts,
) -> None:
    at = prefix and f"{prefix.rstrip('_')}: "
    if not np.array_equal(rollouts.lengths, case[f"{prefix}npose"]):
        comparison.equal(f"{at}poses per trajectory", rollouts.lengths, case[f"{prefix}npose"])
        return
    ends = np.stack((rollouts.x[:, -1], rollouts.y[:, -1]), axis=1)
    last = case[f"{prefix}last_pose"]
    comparison.near(f"{at}last positions", ends, last[:, :2], TOLERANCE)
    comparison.angles(f"{at}last headings", rollouts.yaw[:, -1], last[:, 2], TOLERANCE)
    for kind, count in (("pose", rollouts.lengths), ("time", rollouts.lengths - 1)):
        if f"{prefix}{kind}_off" in case:
            starts = np.concatenate(([0], np.cumsum(count)))
            comparison.equal(f"{at}{kind}s before each", starts, case[f"{prefix}{kind}_off"])
    if f"{prefix}poses" in case:
        is_pose = np.arange(rollouts.x.shape[1]) < rollouts.lengths[:, None]
        poses = case[f"{prefix}poses"]
        positions = np.stack((rollouts.x[is_pose], rollouts.y[is_pose]), axis=1)
        comparison.near(f"{at}positions", positions, poses[:, :2], TOLERANCE)
        comparison.angles(f"{at}headings", rollouts.yaw[is_pose], poses[:, 2], TOLERANCE)
    if f"{prefix}times" in case:
        counts = case[f"{prefix}npose"] - 1
        times = [
            rollouts.sim_time / n * np.arange(count)
            for n, count in zip(rollouts.steps, counts, strict=True)
        ]
        comparison.near(f"{at}times", np.concatenate(times), case[f"{prefix}times"], TOLERANCE)


def _check_grids(
    case: Case,
    prefix: str,
    comparison: Comparison,
    critics: Mapping[str, Critic],
    scene: DwbScene,
) -> None:
    """What a critic shows of itself, cell by cell.

    Distances of the map-grid critics, costs of the others.
    """
    costs = scene.costmap.data
    rows, columns = np.indices(costs.shape, dtype=np.int32)
    every_cell = np.stack((columns.ravel(), rows.ravel()))
    for name, critic in critics.items():
        if f"{prefix}grid_{name}" in case:
            ours: np.ndarray = costs
            if isinstance(critic, MapGridCritic):
                ours = np.zeros(costs.shape)
                path = plan_cells(scene.plan, scene.situation)
                seeds = seeds_of(critic.kind, critic.measured.nose, path, scene.situation)
                add_distances(every_cell, seeds, ours.ravel())
            comparison.equal(f"{prefix}grid {name}", ours, case[f"{prefix}grid_{name}"])


def _check_choice(
    comparison: Comparison,
    step: Mapping[str, Any],
    decision: Decision,
    at: str = "",
) -> None:
    """The chosen command, exactly, also with Nav2's short circuit, and what was rejected."""
    chosen = NO_COMMAND
    if decision.is_legal:
        command = decision.command
        chosen = (command.linear_x, command.linear_y, command.angular_z)
    for key in ("cmd", "short_circuit_cmd"):
        if key in step:
            recorded = step[key] or NO_COMMAND
            comparison.equal(f"{at}{key}", chosen, recorded)
    if decision.is_legal and "best_index" in step:
        comparison.equal(f"{at}index of the best", decision.choice.index, step["best_index"])
    if "n_illegal" in step:
        comparison.equal(
            f"{at}rejected trajectories",
            sum(decision.scores.rejections().values()),
            step["n_illegal"],
        )
    if "critic_scales" in step:
        comparison.equal(f"{at}critics", decision.scores.critics, step["critic_names"])
        comparison.near(
            f"{at}critics' scales", decision.scores.scales, step["critic_scales"], TOLERANCE
        )


def find_sequences(file: GoldenFile) -> Iterator[Case]:
    """Sequences ``<case>_costmap``, ``_path``, ``_s<k>_vel`` (k from 0), facts ``steps``."""
    for name in file.bases("_s0_vel"):
        inputs = {f"{name}_costmap", f"{name}_path"}
        steps = file.facts(name).get("steps", ())
        if inputs <= file.names and steps:
            outputs = (
                f"{name}_s{k}_{s}"
                for k in range(len(steps))
                for s in ("transformed_plan", *SUFFIXES)
            )
            yield Case(name, file, existing(file, (*inputs, *outputs)))


def check_sequence(case: Case, comparison: Comparison) -> None:
    """Every cycle of a sequence on one controller, which prunes one plan."""
    params = _params(case.file, case.facts["overrides"])
    critics = build_critics(params)
    controller = DwbController(params, _footprint(case.file), FREQUENCY, critics)
    window = PlanWindow(
        params.prune_plan,
        params.prune_distance,
        params.forward_prune_distance,
        params.shorten_transformed_plan,
    )
    costmap, plan = _costmap(case), Path(case["path"])
    goal = Pose2D(*map(float, plan.poses[-1]))
    for k, step in enumerate(case.facts["steps"]):
        near = window.near(plan, Pose2D(*step["pose"]), costmap)
        if f"s{k}_transformed_plan" in case:
            comparison.near(
                f"s{k}: pruned plan", near, case[f"s{k}_transformed_plan"], POINT_TOLERANCE
            )
        try:
            controller.compute_velocity(_state(step), plan, Surroundings(costmap))
        except NoLegalVelocity as error:
            comparison.equal(
                f"s{k}: rejected in the error", sum(error.rejections.values()), step["n_samples"]
            )
        decision = controller.last_decision
        assert decision is not None
        _check_choice(comparison, step, decision, f"s{k}: ")
        if f"s{k}_vel" in case:
            _check_decision(case, f"s{k}_", comparison, decision, undefined=False)
            _check_grids(
                case, f"s{k}_", comparison, critics, _scene(step, near, goal, costmap, case.file)
            )


def check_velocities(case: Case, comparison: Comparison) -> None:
    """All samples in their order, to the last bit.

    The fact is the velocity alone, or with changed parameters.
    """
    facts = case.file.meta[case.name]
    velocity, overrides = facts, {}
    if isinstance(facts, dict):
        velocity, overrides = facts["vel"], facts["over"]
    generator = RolloutGenerator(_params(case.file, overrides), FREQUENCY)
    comparison.equal("velocities", generator.sample(Twist2D(*velocity)), case.file[case.name])


def check_plan(case: Case, comparison: Comparison) -> None:
    """The points, filled up where a gap exceeds two cells."""
    ours = densify(case["in"], case.facts.get("resolution", RESOLUTION))
    comparison.near("points", ours, case["out"][:, :2], POINT_TOLERANCE)
