"""The command ``navbench localize``."""

import sys
from pathlib import Path
from typing import Any

import click

from navbench.cli.options import JSON, STRICT, Finite


# fmt: off
@click.command()
@click.option("--bag", "bags", multiple=True, required=True, type=click.Path(path_type=Path),
              help="A .bag, .mcap or .db3 file or a folder of ROS 2; repeatable for a log in several files.")
@click.option("--map", "map_name", help="A map_server YAML file or a built-in map; for amcl and amcl-gps.")
@click.option("--params", required=True, help="A Nav2 parameter file, or a name of params/nav2.")
@click.option("--localizer", required=True, help="Such as gps-ekf or amcl; docs/localization.md lists them.")
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Trajectory to write, in TUM's format.")
@click.option("--static-tf", multiple=True, metavar="TEXT",
              help="Where a sensor is: 'PARENT CHILD x y yaw' or 'PARENT CHILD x y z roll pitch yaw', [m] and [rad]; "
              "repeatable.")
@click.option("--remap", multiple=True, metavar="USUAL:=ACTUAL", help="Another topic, e.g. /scan:=/front/scan.")
@click.option("--reference", metavar="TOPIC|FILE", help="Poses to compare with: of a topic, or of a TUM file.")
@click.option("--align", "alignment", type=click.Choice(("none", "start", "se2")), default="none", show_default=True,
              help="How the trajectory is laid on the reference before the APE is taken.")
@click.option("--interval", type=Finite(min=0.0, max=1e6, min_open=True), default=1.0, show_default=True,
              help="Of the RPE, in [s].")
@click.option("--initial-pose", metavar="x,y,yaw[,std_xy,std_yaw]",
              help="Where the robot starts; default: the file's, for amcl, else 0,0,0.")
@click.option("--global", "is_global", is_flag=True, help="Start anywhere on the map; for amcl and amcl-gps.")
@click.option("--datum", metavar="LAT,LON[,HEADING]", help="Origin of the local frame, [rad] of its x axis from east; "
              "default: such that the first fix is where the robot starts.")
@click.option("--base-frame", help="Frame of the robot; default: the odometry's child frame.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the particles.")
@STRICT
@JSON
# fmt: on
def localize(**choices: Any) -> None:
    """Run one of the robot's localizers over a recorded ROS 1 or ROS 2 bag, without ROS.

    Reads LaserScan, Imu, NavSatFix, Odometry and the frames of tf_static; writes the believed poses; prints the errors
    (APE, RPE) against a reference. docs/recorded_logs.md describes it.

    \b
    Examples:
      navbench localize --bag drive.bag --params stock --localizer gps-ekf --out drive.tum \
          --reference /fix --align start
      navbench localize --bag rosbag2_drive --map office.yaml --params my_nav2.yaml --localizer amcl --out drive.tum
      navbench localize --bag drive.mcap --params stock --localizer odom_imu --out drive.tum \\
          --static-tf "base_link imu_link 0 0 0.5 1.5708 0 -1.5708" --remap /imu/data:=/xsens/imu

    Exit status: 0 done; 1 bad input, or a log that breaks off (what was computed is kept); 130 interrupted (likewise).
    """
    from harness.recorded.command import Request, localize
    from navbench.cli.progress import share_shown

    sys.exit(localize(Request(**choices), lambda: share_shown("messages")))
