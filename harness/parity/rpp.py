"""Regulated pure pursuit: commands of one controller along a path."""

from collections.abc import Iterator

import numpy as np

from harness.parity.comparison import Comparison
from harness.parity.golden import GoldenFile
from harness.parity.part import Case, existing
from navstack.control.controller import Surroundings
from navstack.control.rpp.rpp_controller import RegulatedPurePursuitController
from navstack.costmap.costmap import Costmap
from navstack.errors import NoLegalVelocity
from navstack.params.rpp import RppParams
from navstack.params.strict import from_mapping
from navstack.types import Path, Pose2D, RobotState, Twist2D

SUFFIXES = ("costmap", "path", "poses", "path_start_idx", "vels", "cmd")
TOLERANCE = 1e-5  # [m/s, rad/s]
FREQUENCY = 20.0  # [Hz] of the recorded controller
GOAL_TOLERANCE = 0.25  # [m] of the recorded goal checker
FOOTPRINT = np.array(((0.19, 0.3), (0.19, -0.3), (-0.657, -0.3), (-0.657, 0.3)))  # [m] padded
RESOLUTION, ORIGIN = 0.05, (-4.0, -4.0)  # [m] of the recorded costmaps
REFUSED = [np.nan] * 3  # recorded in place of a command


def find(file: GoldenFile) -> Iterator[Case]:
    """Sequences ``<case>_poses``, ``_vels``, ``_path``, ``_path_start_idx`` and ``_cmd`` on ``_costmap``."""
    for name in file.bases("_path_start_idx"):
        arrays = existing(file, (f"{name}_{suffix}" for suffix in SUFFIXES))
        if len(arrays) == len(SUFFIXES) and "overrides" in file.facts(name):
            yield Case(name, file, arrays)


def check(case: Case, comparison: Comparison) -> None:
    """Every command in order on one controller, whether the path begins at the robot (as recorded) or is cut there."""
    recorded = ["collision" in error for error in case.facts["errors"]]
    for what, begins in (("recorded path", case["path_start_idx"]), ("whole path", np.zeros(len(recorded), dtype=int))):
        ours = _commands(case, begins)
        comparison.equal(f"{what}: refused for a collision", np.isnan(ours).any(axis=1), recorded)
        comparison.near(f"{what}: commands", np.nan_to_num(ours), np.nan_to_num(case["cmd"]), TOLERANCE)


def _commands(case: Case, begins: np.ndarray) -> np.ndarray:
    """The command (N, 3) of each row, NaN where it was refused; the path begins at these indices (N,)."""
    facts, path = case.facts, case["path"]
    params = from_mapping(RppParams, facts["overrides"], case.title)
    controller = RegulatedPurePursuitController(params, FOOTPRINT, FREQUENCY, GOAL_TOLERANCE)
    resolution, origin = facts.get("resolution", RESOLUTION), facts.get("origin", ORIGIN)
    surroundings = Surroundings(Costmap(case["costmap"], resolution, *origin))
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
