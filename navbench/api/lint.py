"""What is wrong with a Nav2 parameter file, and what hurts on a real robot."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from harness.storage.shipped import resolve, shipped
from harness.world.physics.robot import RobotParams
from navstack.errors import ParameterError
from navstack.lint import lint as findings_of
from navstack.params.lint.subject import RobotLimits
from navstack.params.nav2_file.file import inspect_nav2
from navstack.params.nav2_file.findings import Notice
from navstack.params.nav2_file.release import looks_like
from navstack.params.strict import load_dataclass


@dataclass(frozen=True)
class Linted:
    """What was found in a file."""

    path: Path
    notices: Sequence[Notice]
    ignored: Sequence[str]  # parameters that are not modelled here
    releases: Sequence[str] = ()  # distributions of Nav2 that the file looks like

    @property
    def errors(self) -> list[Notice]:
        """What makes the file unusable."""
        return [notice for notice in self.notices if notice.is_error]

    @property
    def warnings(self) -> list[Notice]:
        """What will cause trouble."""
        return [notice for notice in self.notices if not notice.is_error]

    def as_json(self) -> dict[str, Any]:
        """As ``navbench lint --json`` prints it."""
        return {
            "errors": [_plain(notice) for notice in self.errors],
            "warnings": [_plain(notice) for notice in self.warnings],
            "ignored": list(self.ignored),
            "releases": list(self.releases),
        }


def _plain(notice: Notice) -> dict[str, Any]:
    return {
        "id": notice.id,
        "path": notice.path,
        "line": notice.line or None,
        "message": notice.message,
        "advice": notice.advice,
    }


def lint(file: str, robot: str | None = None, *, strict: bool = False) -> Linted:
    """Check a Nav2 parameter file.

    Args:
        file: its path, or a name of params/nav2.
        robot: a name of params/robots or a file, to hold the file against; None: none.
        strict: whether names unknown to Nav2 are errors; Nav2 and ``run`` let them pass.

    Raises:
        InputError: there is no such file or robot.
    """
    limits = None if robot is None else robot_limits(robot)
    path = Path(file)
    if not os.path.isfile(path):
        path = resolve(file, shipped("params") / "nav2", "Nav2")
    try:
        nav2 = inspect_nav2(path, allow_unknown=not strict)
    except ParameterError as error:
        message = str(error).removeprefix(f"{path}: ")
        advice = "give a Nav2 parameter file"
        return Linted(path, [Notice("unreadable-file", "", message, advice, is_error=True)], ())
    return Linted(path, findings_of(nav2, limits), nav2.ignored, looks_like(nav2.names))


def robot_limits(name_or_file: str) -> RobotLimits:
    """What a robot's body can do.

    Raises:
        InputError: no such robot, or its file cannot be used.
    """
    path = resolve(name_or_file, shipped("params") / "robots", "robot")
    body = load_dataclass(RobotParams, path)
    return RobotLimits(
        path.stem,
        body.polygon,
        body.max_speed,
        body.max_yaw_rate,
        body.max_acceleration,
        body.max_deceleration,
        body.max_yaw_acceleration,
    )
