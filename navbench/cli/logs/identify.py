"""The command ``navbench identify``."""

from pathlib import Path

import click

from navbench.cli.logs.bag_options import bag_options
from navbench.cli.options import FULL, JSON, path_option
from navbench.cli.streams import print_json


@click.command()
@bag_options
@path_option("--urdf", "FILE", "The robot's description: outline, mass, wheels, frames.")
@path_option("--nav2", "FILE", "Its Nav2 parameter file: outline and limits.")
@path_option(
    "--out", "FILE.yaml", "Robot file to write; <name>_sensors.yaml goes beside it.", required=True
)
@FULL
@JSON
def identify(
    bags: tuple[Path, ...],
    static_tf: tuple[str, ...],
    remap: tuple[str, ...],
    base_frame: str | None,
    urdf: Path | None,
    nav2: Path | None,
    out: Path,
    is_full: bool,
    as_json: bool,
) -> None:
    """Make a robot file and a sensors file from a recorded drive.

    BAG is a .bag, .mcap or .db3 file or a folder of ROS 2. From commands, odometry, inertial unit,
    scans and fixes it finds dead time, lag and limits of the drive, scales and noise of the
    sensors, and where the lidar is: each with an interval, or what to drive so that it can be
    found. docs/your_robot.md describes it.

    \b
    Examples:
      navbench identify drive.mcap --out my_robot.yaml
      navbench identify drive.mcap --urdf my_robot.urdf --nav2 my_robot_nav2.yaml \\
          --out my_robot.yaml --full
      navbench identify test1.bag --out husky.yaml --json \\
          --static-tf "base_link imu_link 0 -0.3 0.52 1.5707963 0 -1.5707963"

    Exit status: 0 done; 1 bad input.
    """
    from harness.recorded.log import LogRequest
    from harness.report.identified import identified_blocks
    from harness.report.tables import print_blocks, report_console
    from navbench.api.identify import identify

    request = LogRequest(bags, static_tf, remap, base_frame)
    robot = identify(request, out, urdf=urdf, nav2=nav2)
    if as_json:
        print_json(robot.as_json())
        return
    blocks = identified_blocks(robot.found, robot.log, robot.written, is_full)
    print_blocks(blocks, report_console())
