"""Regulated pure pursuit along a path, and the rotation shim in closed loops."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from navstack.control.controller import Controller, Surroundings
from navstack.control.rotation_shim import RotationShimController
from navstack.control.rpp.rpp_controller import RegulatedPurePursuitController
from navstack.errors import NoLegalVelocity
from navstack.params.rotation_shim import RotationShimParams
from navstack.params.rpp import RppParams
from navstack.params.strict import from_mapping
from navstack.types import Path, Pose2D, RobotState, Twist2D
from tools.parity.comparison import Comparison
from tools.parity.part import Case, Shape, costmap_of

TOLERANCE = 1e-5  # [m/s, rad/s]
RPP_FREQUENCY = 20.0  # [Hz] of the recorded controller
GOAL_TOLERANCE = 0.25  # [m] of the recorded goal checker
FOOTPRINT = np.array(((0.19, 0.3), (0.19, -0.3), (-0.657, -0.3), (-0.657, 0.3)))  # [m] padded
RESOLUTION, ORIGIN = 0.05, (-4.0, -4.0)  # [m] of the recorded costmaps
FREE_CELLS = 160  # of a costmap that was not recorded
PASSED_THROUGH = Twist2D(99.0, 0.0, 0.25)  # the command of the shim's recorded primary controller
REFUSED = [np.nan] * 3  # recorded in place of a command


# either name holds the costs; with none of them all cells are free
GRIDS = ("{}_costmap", "{}_grid")
RPP = Shape(
    ("{}_path_start_idx", "{}_path", "{}_poses", "{}_vels", "{}_cmd"), GRIDS, fact="overrides"
)
# x, y, yaw, measured v and w, commanded x, y and w, whether there was a new plan
SHIM = Shape(
    ("rsj_{}_path", "rsj_{}"), tuple(f"rsj_{grid}" for grid in GRIDS), ("{}",), "params", "rsj_{}"
)
SHIM_OF_MAIN = Shape(
    ("rs_{}_cmd", "rs_{}_poses", "rs_{}_vels", "rs_{}_path"),
    tuple(f"rs_{grid}" for grid in GRIDS),
    ("rotation_shim", "{}"),
    "params",
    "rs_{}",
)


def check_rpp(case: Case, comparison: Comparison) -> None:
    """Every command in order on one controller.

    The path begins at the robot, as recorded, or is cut there.
    """
    recorded = ["collision" in error for error in case.facts["errors"]]
    for what, begins in (
        ("recorded path", case["path_start_idx"]),
        ("whole path", np.zeros(len(recorded), dtype=int)),
    ):
        ours = _commands(case, begins)
        comparison.equal(f"{what}: refused for a collision", np.isnan(ours).any(axis=1), recorded)
        comparison.near(
            f"{what}: commands", np.nan_to_num(ours), np.nan_to_num(case["cmd"]), TOLERANCE
        )


def _commands(case: Case, begins: np.ndarray) -> np.ndarray:
    """The command (N, 3) of each row, NaN where it was refused.

    The path begins at these indices (N,).
    """
    facts, path = case.facts, case["path"]
    given = {"lookahead_along_path": True, **facts["overrides"]}  # it was recorded with main
    params = from_mapping(RppParams, given, case.title)
    controller = RegulatedPurePursuitController(params, FOOTPRINT, RPP_FREQUENCY, GOAL_TOLERANCE)
    surroundings = _surroundings(case)
    commands = []
    for pose, velocity, begin in zip(case["poses"], case["vels"], begins, strict=True):
        state = RobotState(Pose2D(*pose), Twist2D(*velocity))
        try:
            command = controller.compute_velocity(state, Path(path[begin:]), surroundings)
        except NoLegalVelocity:
            commands.append(REFUSED)
        else:
            commands.append([command.linear_x, command.linear_y, command.angular_z])
    return np.array(commands)


class _Primary(Controller):
    """The recorded primary controller: always the same command."""

    def reset(self) -> None:
        """Nothing to forget."""

    def compute_velocity(
        self,
        state: RobotState,
        plan: Path,
        surroundings: Surroundings,
    ) -> Twist2D:
        """The mark that the shim has handed over."""
        return PASSED_THROUGH


def check_shim(case: Case, comparison: Comparison) -> None:
    """Every command of a rollout; each new plan is a new object."""
    rows = case.file[case.name]
    ours = _rollout(case, rows[:, :3], np.insert(rows[:, 3:5], 1, 0.0, axis=1), rows[:, -1])
    comparison.near("commands", ours, rows[:, 5:8], TOLERANCE)


def check_shim_of_main(case: Case, comparison: Comparison) -> None:
    """Every command of a rollout.

    Main decides in every cycle: that is Jazzy's shim with a new plan in every cycle.
    """
    poses = case["poses"]
    comparison.near(
        "commands", _rollout(case, poses, case["vels"], np.ones(len(poses))), case["cmd"], TOLERANCE
    )


def _rollout(
    case: Case,
    poses: np.ndarray,
    twists: np.ndarray,
    is_replanned: np.ndarray,
) -> np.ndarray:
    """The shim's command (N, 3) for each pose and twist (N, 3), maybe with a new plan (N,)."""
    shim, surroundings, plan = _shim(case.facts["params"]), _surroundings(case), Path(case["path"])
    commands = []
    for pose, twist, is_new in zip(poses, twists, is_replanned, strict=True):
        plan = Path(case["path"]) if is_new else plan
        command = shim.compute_velocity(
            RobotState(Pose2D(*pose), Twist2D(*twist)), plan, surroundings
        )
        commands.append((command.linear_x, command.linear_y, command.angular_z))
    return np.array(commands)


def _shim(given: Mapping[str, Any]) -> RotationShimController:
    names = {field.name for field in fields(RotationShimParams)} - {"primary_controller"}
    bare = {key.removeprefix("FollowPath."): value for key, value in given.items()}
    params = RotationShimParams(**{key: value for key, value in bare.items() if key in names})
    return RotationShimController(
        params, _Primary(), FOOTPRINT, bare["controller_frequency"], GOAL_TOLERANCE
    )


def _surroundings(case: Case) -> Surroundings:
    facts = case.facts
    free = np.zeros((FREE_CELLS, FREE_CELLS), dtype=np.uint8)
    costs = next((case[name] for name in ("costmap", "grid") if name in case), free)
    return Surroundings(
        costmap_of(costs, facts.get("resolution", RESOLUTION), facts.get("origin", ORIGIN))
    )
