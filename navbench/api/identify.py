"""A robot file and a sensors file from a recorded drive."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from harness.identify.identification import PARTS, Identified, amcl_alphas
from harness.identify.identification import identify as identify_log
from harness.identify.robot_file import DEFAULT_ROBOT, Written, sensors_beside, write_files
from harness.identify.urdf import read_urdf
from harness.recorded.bag import files_read
from harness.recorded.drive_log import DriveLog
from harness.recorded.log import LogRequest, read_log
from harness.storage.files import require_no_input, require_writable
from harness.storage.shipped import shipped
from harness.world.physics.robot import RobotParams
from navbench.api.progress import count_shown, say, share_shown
from navstack.params.nav2_file.file import load_nav2
from navstack.params.strict import load_dataclass


@dataclass(frozen=True, slots=True)
class IdentifiedRobot:
    """What a log tells of its robot, and the files that were made of it."""

    found: Identified
    log: DriveLog
    written: Written

    def as_json(self) -> dict[str, Any]:
        """As ``navbench identify --json`` prints it."""
        found, written = self.found, self.written
        return {
            "schema": 1,
            "bag": self.log.files,
            "duration_s": self.log.duration,
            "topics": dict(self.log.topics),
            "values": {key: each.as_json() for key, each in found.estimates.items()},
            "predictions": [each.as_json() for each in found.predictions],
            "predicted": found.predicts,
            "amcl": amcl_alphas(found),
            "robot": str(written.robot),
            "sensors": str(written.sensors),
            "notes": list(written.notes),
        }


def identify(
    request: LogRequest, out: Path, *, urdf: Path | None = None, nav2: Path | None = None
) -> IdentifiedRobot:
    """Identify a robot from a recorded drive.

    Args:
        request: bags, remappings and frames.
        out: robot file to write; the sensors file ``<name>_sensors.yaml`` goes beside it.
        urdf: the robot's description; None: not known.
        nav2: its Nav2 parameter file; None: not known.

    Returns:
        Each value with its interval, or why it cannot be identified.

    Raises:
        InputError: something given cannot be used.
    """
    require_writable("robot file", out, (".yaml", ".yml"))
    for each in (out, sensors_beside(out)):
        require_no_input("robot file", each, (*files_read(request.bags), urdf, nav2))
    body = None
    if nav2 is not None:
        load_nav2(nav2, allow_unknown=True)  # refused before the log is read, which takes longer
    if urdf is not None:
        body = read_urdf(urdf)
        request = replace(request, static_tf=(*body.frames, *request.static_tf))
    with share_shown("messages") as update:
        log = read_log(request, lambda text: say(f"note: {text}"), update)
    default = load_dataclass(RobotParams, shipped("params") / "robots" / f"{DEFAULT_ROBOT}.yaml")
    with count_shown("parts identified", PARTS) as tell:
        found = identify_log(log, default, tell)
    return IdentifiedRobot(found, log, write_files(out, found, log, body, nav2))
