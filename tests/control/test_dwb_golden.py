"""DWB against Nav2's own C++; every scene whose arrays are in the folder of golden vectors is checked."""

import json
import os
from dataclasses import replace
from pathlib import Path as FilePath
from types import SimpleNamespace

import numpy as np
import pytest

from navstack.control.controller import Surroundings
from navstack.control.dwb.critics.map_grid import MapGridCritic
from navstack.control.dwb.dwb_controller import DwbController
from navstack.control.dwb.velocity_samples import VelocitySampler
from navstack.control.plan_handling import PlanWindow, densify
from navstack.costmap.costmap import Costmap
from navstack.errors import NoLegalVelocity
from navstack.params.dwb import DwbParams
from navstack.params.strict import from_mapping
from navstack.types import Path, Pose2D, RobotState, Twist2D

GOLDEN = FilePath(os.environ.get("NAVSTACK_GOLDEN", FilePath(__file__).parents[1] / "golden"))
READS_OUT_OF_BOUNDS = "goal_slowing_lookahead"  # upstream's own undefined behaviour
TOLERANCE = 1e-5
JAZZY = {stem: stem.startswith("dwb_jazzy") for stem in (f.stem for f in GOLDEN.glob("dwb_*.npz"))}
FILES = {stem: np.load(GOLDEN / f"{stem}.npz") for stem in JAZZY}
META = {stem: json.loads(str(arrays["meta_json"])) for stem, arrays in FILES.items()}


def make_params(stem: str, overrides: dict, **more: object) -> DwbParams:
    nested: dict = {}
    flat = {**META[stem]["base_params"], **overrides, **more}
    flat.pop("transform_tolerance", None)
    for key, value in flat.items():
        head, _, tail = key.partition(".")
        if tail:
            nested.setdefault(head, {})[tail] = value
        else:
            nested[key] = value
    params = from_mapping(DwbParams, nested, stem)
    return params if JAZZY[stem] else replace(params, path_length_tolerance=1.0)


def scenes(jazzy: bool) -> list[tuple[str, str]]:
    found = []
    for stem, meta in META.items():
        for name, entry in meta.items():
            is_scene = isinstance(entry, dict) and f"{name}_costmap" in FILES[stem] and f"{name}_path" in FILES[stem]
            if JAZZY[stem] == jazzy and is_scene and name != READS_OUT_OF_BOUNDS:
                found.append((stem, name))
    return found


def make_controller(stem: str, overrides: dict) -> DwbController:
    return DwbController(make_params(stem, overrides), np.array(META["dwb_a"]["footprint_padded"]), 30.0)


def make_costmap(stem: str, name: str) -> Costmap:
    meta = META[stem][name]
    return Costmap(FILES[stem][f"{name}_costmap"], meta["resolution"], *meta["origin"])


def make_state(step: dict) -> RobotState:
    return RobotState(Pose2D(*step["pose"]), Twist2D(*step["vel"]), step.get("t", 0.0))


def as_list(command: Twist2D | None) -> list[float] | None:
    return None if command is None else [command.linear_x, command.linear_y, command.angular_z]


def check_trajectories(arrays: np.lib.npyio.NpzFile, prefix: str, rollouts: object) -> None:
    r = rollouts
    np.testing.assert_array_equal(r.lengths, arrays[f"{prefix}_npose"])
    last = arrays[f"{prefix}_last_pose"]
    np.testing.assert_allclose(r.x[:, -1], last[:, 0], atol=TOLERANCE)
    np.testing.assert_allclose(r.y[:, -1], last[:, 1], atol=TOLERANCE)
    assert np.abs((r.yaw[:, -1] - last[:, 2] + np.pi) % (2 * np.pi) - np.pi).max() < TOLERANCE
    if f"{prefix}_poses" in arrays:
        poses = arrays[f"{prefix}_poses"]
        is_pose = np.arange(r.x.shape[1]) < r.lengths[:, None]
        np.testing.assert_allclose(r.x[is_pose], poses[:, 0], atol=TOLERANCE)
        np.testing.assert_allclose(r.y[is_pose], poses[:, 1], atol=TOLERANCE)
    if f"{prefix}_times" in arrays:
        times = [r.sim_time / n * np.arange(length - 1) for n, length in zip(r.steps, r.lengths, strict=True)]
        np.testing.assert_allclose(np.concatenate(times), arrays[f"{prefix}_times"], atol=TOLERANCE)


def check_decision(arrays: np.lib.npyio.NpzFile, prefix: str, controller: DwbController, costmap: Costmap) -> None:
    decision = controller.last_decision
    np.testing.assert_array_equal(decision.rollouts.commands, arrays[f"{prefix}_vel"])
    check_trajectories(arrays, prefix, decision.rollouts)
    illegal = np.isinf(decision.raw)
    rejected_by = np.where(illegal.any(axis=0), illegal.argmax(axis=0), -1)
    np.testing.assert_array_equal(rejected_by, arrays[f"{prefix}_illegal_critic"])
    legal = rejected_by < 0
    np.testing.assert_allclose(decision.raw.T[legal], arrays[f"{prefix}_raw"][legal], atol=TOLERANCE)
    np.testing.assert_allclose(decision.totals[legal], arrays[f"{prefix}_total"][legal], atol=TOLERANCE)
    for name, critic in controller._critics.items():
        if isinstance(critic, MapGridCritic) and f"{prefix}_grid_{name}" in arrays:
            grid = arrays[f"{prefix}_grid_{name}"]
            every_cell = np.arange(grid.size, dtype=np.int32)
            ours = critic.distances(every_cell, SimpleNamespace(costmap=costmap))
            np.testing.assert_array_equal(ours.reshape(grid.shape), grid)


@pytest.mark.parametrize(("stem", "name"), scenes(jazzy=False))
def test_scene(stem: str, name: str) -> None:
    meta, arrays, costmap = META[stem][name], FILES[stem], make_costmap(stem, name)
    controller = make_controller(stem, meta["overrides"])
    decision = controller.decide(make_state(meta), arrays[f"{name}_path"], Pose2D(*meta["goal"]), Surroundings(costmap))
    check_decision(arrays, name, controller, costmap)
    assert as_list(decision.command if decision.is_legal else None) == meta["cmd"]
    if decision.is_legal:
        assert decision.best == meta["best_index"]


@pytest.mark.parametrize(
    ("stem", "name"), [(stem, name) for stem, name in scenes(jazzy=False) if "sequence_after" in META[stem][name]]
)
def test_oscillation_over_several_cycles(stem: str, name: str) -> None:
    meta, costmap = META[stem][name], make_costmap(stem, name)
    controller = make_controller(stem, meta["overrides"])
    for step in [meta, *meta["sequence_after"]]:
        goal, path = Pose2D(*meta["goal"]), FILES[stem][f"{name}_path"]
        decision = controller.decide(make_state(step), path, goal, Surroundings(costmap))
        assert as_list(decision.command) == step["cmd"]
        assert sum(decision.rejections.values()) == step["n_illegal"]
        assert decision.rejections.get("Oscillation", 0) == step.get("n_osc", 0)


@pytest.mark.parametrize(("stem", "name"), scenes(jazzy=True))
def test_jazzy_sequence(stem: str, name: str) -> None:
    meta, arrays, costmap = META[stem][name], FILES[stem], make_costmap(stem, name)
    params = make_params(stem, meta["overrides"])
    controller = make_controller(stem, meta["overrides"])
    window = PlanWindow(
        params.prune_plan, params.prune_distance, params.forward_prune_distance, params.shorten_transformed_plan
    )
    plan = Path(arrays[f"{name}_path"])
    for i, step in enumerate(meta["steps"]):
        near = window.near(plan, Pose2D(*step["pose"]), costmap)
        np.testing.assert_allclose(near, arrays[f"{name}_s{i}_transformed_plan"], atol=1e-12)
        command = None
        try:
            command = controller.compute_velocity(make_state(step), plan, Surroundings(costmap))
        except NoLegalVelocity as error:
            assert sum(error.rejections.values()) == step["n_illegal"] == step["n_samples"]
        check_decision(arrays, f"{name}_s{i}", controller, costmap)
        assert as_list(command) == step["cmd"]


def twists() -> list[tuple[str, str]]:
    return [(stem, name) for stem in FILES for name in FILES[stem].files if name.startswith("twists_")]


@pytest.mark.parametrize(("stem", "name"), twists())
def test_sampled_velocities(stem: str, name: str) -> None:
    meta = META[stem][name]
    velocity, overrides = (meta["vel"], meta["over"]) if isinstance(meta, dict) else (meta, {})
    params = make_params(stem, overrides)
    limited = params.trajectory_generator_name.endswith("LimitedAccelGenerator")
    sampler = VelocitySampler(params, params.sim_period if limited else params.sim_time)
    np.testing.assert_array_equal(sampler.sample(Twist2D(*velocity)), FILES[stem][name])


@pytest.mark.parametrize(
    ("stem", "name"),
    [
        (s, n.removesuffix("_in"))
        for s in FILES
        for n in FILES[s].files
        if n.startswith("adjust_") and n.endswith("_in")
    ],
)
def test_densified_plan(stem: str, name: str) -> None:
    ours = densify(FILES[stem][f"{name}_in"], 0.05)
    np.testing.assert_allclose(ours, FILES[stem][f"{name}_out"][:, :2], atol=1e-12)


def test_golden_scenes_were_found() -> None:
    assert len(scenes(jazzy=False)) >= 15
    assert len(scenes(jazzy=True)) >= 7
    assert len(twists()) >= 20
