"""The command ``navbench drive``: our brain as a ROS 2 node."""

import click

from navbench.cli.values import Finite
from navstack.types import Pose2D


@click.command()
@click.option("--params", required=True, help="A Nav2 parameter file, or a name of params/nav2.")
@click.option("--map", "map_file", help="A map_server YAML file; default: what comes on /map.")
@click.option("--localizer", default="gps-ekf", show_default=True, help="As of navbench run.")
@click.option(
    "--laser",
    type=(Finite(),) * 3,
    default=(0.0, 0.0, 0.0),
    show_default=True,
    help="x, y [m] and yaw [rad] of the lidar on the base.",
)
@click.option(
    "--datum",
    type=(Finite(-90.0, 90.0), Finite(-180.0, 180.0)),
    help="Latitude and longitude [deg] of the map's origin.",
)
@click.option("--wall-time", is_flag=True, help="A real robot: time is the wall's, not /clock's.")
@click.option("--twist", is_flag=True, help="Command by Twist, as before Kilted.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True)
@click.option("--seconds", type=Finite(0.0), help="[s] after which it ends.")
def drive(
    params: str,
    map_file: str | None,
    localizer: str,
    laser: tuple[float, float, float],
    datum: tuple[float, float] | None,
    wall_time: bool,
    twist: bool,
    seed: int,
    seconds: float | None,
) -> None:
    """Drive a robot over ROS 2 by this program's brain and a Nav2 file.

    It takes /scan, /odom, /imu, /gps/fix, /initialpose and /goal_pose, and commands /cmd_vel. It
    stands while scans or odometry are old or gone, and after a jump of the clock.

    \b
    Examples:
      navbench drive --params my_nav2.yaml --map depot.yaml --localizer amcl --wall-time
      navbench drive --params gps_ekf   # beside navbench serve
    """
    from navbench.api.ros2 import drive_robot

    drive_robot(
        params,
        map_file,
        localizer=localizer,
        laser=Pose2D(*laser),
        datum=datum,
        seed=seed,
        is_simulated=not wall_time,
        is_stamped=not twist,
        seconds=seconds,
        say=lambda line: click.echo(line, err=True),
    )
