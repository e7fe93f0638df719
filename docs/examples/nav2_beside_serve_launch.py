"""Nav2 beside ``navbench serve``, which is its robot, map server and localizer.

ros2 launch docs/examples/nav2_beside_serve_launch.py params_file:=my_nav2.yaml episodes:=20

Written from Nav2's launch files and documentation (Jazzy); not run by the tests. Nav2's own topics
are those of serve, so that nothing is remapped.
"""

from pathlib import Path

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    IncludeLaunchDescription,
    SetEnvironmentVariable,
    Shutdown,
)
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration

# what may be given, and otherwise is
ARGUMENTS = {"name": "my-nav2", "controller_frequency": "20", "map": "sidewalk", "episodes": "20"}


def generate_launch_description() -> LaunchDescription:
    """Nav2's navigation, and the world; all ends once the deliveries are driven."""
    given = {name: LaunchConfiguration(name) for name in ("params_file", *ARGUMENTS)}
    nav2 = Path(get_package_share_directory("nav2_bringup")) / "launch" / "navigation_launch.py"
    navigation = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(str(nav2)),
        launch_arguments={"use_sim_time": "True", "params_file": given["params_file"]}.items(),
    )
    options = [("--localization", "truth")]
    options += [(f"--{name.replace('_', '-')}", given[name]) for name in ARGUMENTS]
    serve = ExecuteProcess(
        cmd=["navbench", "serve", *(part for option in options for part in option)],
        output="screen",
        on_exit=Shutdown(),
    )
    return LaunchDescription(
        [
            SetEnvironmentVariable("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST"),
            DeclareLaunchArgument("params_file"),
            *(DeclareLaunchArgument(name, default_value=ARGUMENTS[name]) for name in ARGUMENTS),
            navigation,
            serve,
        ]
    )
