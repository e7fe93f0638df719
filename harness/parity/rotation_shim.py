"""The rotation shim in closed loops: those of Nav2 Jazzy, and those of Nav2 main."""

from collections.abc import Iterator, Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from harness.parity.comparison import Comparison
from harness.parity.golden import GoldenFile
from harness.parity.part import Case, existing
from navstack.control.controller import Controller, Surroundings
from navstack.control.rotation_shim import RotationShimController
from navstack.costmap.costmap import Costmap
from navstack.params.rotation_shim import RotationShimParams
from navstack.types import Path, Pose2D, RobotState, Twist2D

TOLERANCE = 1e-5  # [m/s, rad/s]
PASSED_THROUGH = Twist2D(99.0, 0.0, 0.25)  # the recorded primary controller's command
FOOTPRINT = np.array(((0.19, 0.3), (0.19, -0.3), (-0.657, -0.3), (-0.657, 0.3)))  # [m] padded
FREE_CELLS, RESOLUTION, ORIGIN = 160, 0.05, (-4.0, -4.0)  # of a costmap that was not recorded
GOAL_TOLERANCE = 0.25  # [m] of the recorded goal checker
MAIN = "rotation_shim"  # key of the facts of Nav2 main's cases


class _Primary(Controller):
    """The recorded primary controller: always the same command."""

    def reset(self) -> None:
        """Nothing to forget."""

    def compute_velocity(self, state: RobotState, plan: Path, surroundings: Surroundings) -> Twist2D:
        """The mark that the shim has handed over."""
        return PASSED_THROUGH


def find_jazzy(file: GoldenFile) -> Iterator[Case]:
    """Rollouts ``rsj_<case>``: x, y, yaw, measured v and w, commanded x, y and w, whether there was a new plan."""
    for base in file.bases("_path", prefix="rsj_"):
        name = f"rsj_{base}"
        if name in file and "params" in file.facts(base):
            yield Case(name, file, existing(file, (name, f"{name}_path", f"{name}_costmap")))


def check_jazzy(case: Case, comparison: Comparison) -> None:
    """Every command of a rollout; each new plan is a new object."""
    facts = case.file.facts(case.name.removeprefix("rsj_"))
    shim, surroundings = _make(facts["params"]), _surroundings(case, facts)
    rows, plan = case.file[case.name], Path(case["path"])
    ours = []
    for x, y, yaw, v, w, *_, replanned in rows:
        if replanned:
            plan = Path(case["path"])
        ours.append(shim.compute_velocity(RobotState(Pose2D(x, y, yaw), Twist2D(v, 0.0, w)), plan, surroundings))
    comparison.near("commands", _as_array(ours), rows[:, 5:8], TOLERANCE)


def find_main(file: GoldenFile) -> Iterator[Case]:
    """Rollouts ``rs_<case>_poses``, ``_vels``, ``_path``, ``_cmd``."""
    for base in file.bases("_cmd", prefix="rs_"):
        name = f"rs_{base}"
        inputs = {f"{name}_{suffix}" for suffix in ("poses", "vels", "path")}
        if inputs <= file.names and "params" in file.facts(MAIN, base):
            yield Case(name, file, existing(file, (*inputs, f"{name}_cmd", f"{name}_costmap")))


def check_main(case: Case, comparison: Comparison) -> None:
    """Every command of a rollout. Main decides in every cycle: that is Jazzy's shim with a new plan in every cycle."""
    facts = case.file.facts(MAIN, case.name.removeprefix("rs_"))
    shim, surroundings = _make(facts["params"]), _surroundings(case, facts)
    ours = [
        shim.compute_velocity(RobotState(Pose2D(*pose), Twist2D(*twist)), Path(case["path"]), surroundings)
        for pose, twist in zip(case["poses"], case["vels"], strict=True)
    ]
    comparison.near("commands", _as_array(ours), case["cmd"], TOLERANCE)


def _make(given: Mapping[str, Any]) -> RotationShimController:
    names = {field.name for field in fields(RotationShimParams)} - {"primary_controller"}
    bare = {key.removeprefix("FollowPath."): value for key, value in given.items()}
    params = RotationShimParams(**{key: value for key, value in bare.items() if key in names})
    return RotationShimController(params, _Primary(), FOOTPRINT, bare["controller_frequency"], GOAL_TOLERANCE)


def _surroundings(case: Case, facts: Mapping[str, Any]) -> Surroundings:
    costs = case["costmap"] if "costmap" in case else np.zeros((FREE_CELLS, FREE_CELLS), dtype=np.uint8)
    return Surroundings(Costmap(costs, facts.get("resolution", RESOLUTION), *facts.get("origin", ORIGIN)))


def _as_array(commands: list[Twist2D]) -> np.ndarray:
    return np.array([(command.linear_x, command.linear_y, command.angular_z) for command in commands])
