"""The door to ROS 2: deliveries driven by another program's nodes, and our brain as a node."""

import dataclasses
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from harness.ros2.install import require_ros2
from harness.storage.shipped import resolve, shipped
from harness.study.compile_ahead import compile_ahead
from harness.study.places import Where
from harness.task.ros2_params import Ros2Params
from harness.task.stack import ROS2, load_stack
from navbench.api.driving import Driven
from navbench.api.run import drive as drive_stacks
from navstack.build import build_localizer, build_navigator, read_frequencies
from navstack.costmap.map_io import load_map
from navstack.costmap.occupancy_grid import align
from navstack.errors import InputError
from navstack.params.nav2_file.file import load_nav2
from navstack.params.strict import dump_dataclass
from navstack.types import Pose2D

MAP_LIMIT = 60.0  # [s] of wall time for a map to come
SERVED = "ros2"  # of params/stacks
BRAIN = "nav2-gps-ekf"  # of params/stacks: any one that has a Nav2 file


def serve(
    name: str = "ros2",
    *,
    stack: str = SERVED,
    settings: dict[str, Any] | None = None,
    out: Path | None = None,
    where: Where | None = None,
    **options: Any,
) -> Driven:
    """Drive deliveries by the commands of ROS 2 nodes, one after the other.

    Args:
        name: of who drives, as rows and pages call it.
        stack: a stack file whose navigator is ros2.
        settings: of :class:`harness.task.ros2_params.Ros2Params` that differ from the stack's.
        out: run folder; None: ``results/<time>-<name>``.
        where: on this machine by one worker, as there is one robot; None: so.
        options: as of :func:`navbench.run`.

    Raises:
        InputError: ROS 2 is not here, or a value that ``navbench run`` would refuse too.
    """
    require_ros2()
    where = where or Where()
    if not where.is_local:
        raise InputError("serve has one robot, on this machine; leave out --executor")
    if where.workers not in (None, 1):
        raise InputError(
            f"serve has one robot; --workers {where.workers} is given, give --workers 1"
        )
    where = dataclasses.replace(where, workers=1)
    loaded = load_stack(stack, robot=options.pop("robot", None))
    if loaded.navigator != ROS2:
        raise InputError(f"stack '{stack}' has navigator '{loaded.navigator}'; serve needs ros2")
    known = {field.name for field in dataclasses.fields(Ros2Params)}
    given = {key: value for key, value in (settings or {}).items() if value is not None}
    if unknown := set(given) - known:
        raise InputError(f"ros2 has no {', '.join(sorted(unknown))}; it has {', '.join(known)}")
    loaded = dataclasses.replace(loaded, name="", ros2=dataclasses.replace(loaded.ros2, **given))
    with tempfile.TemporaryDirectory(prefix="navbench-serve-") as folder:
        file = Path(folder) / f"{name}.yaml"
        file.write_text(dump_dataclass(loaded), encoding="utf-8")
        return drive_stacks([str(file)], out=out, where=where, **options)


def drive_robot(
    params: str,
    map_file: str | None = None,
    *,
    localizer: str = "gps-ekf",
    laser: Pose2D | None = None,
    datum: tuple[float, float] | None = None,
    seed: int = 0,
    is_simulated: bool = True,
    is_stamped: bool = True,
    seconds: float | None = None,
    say: Callable[[str], None] = print,
) -> None:
    """Drive a robot by our brain over ROS 2 until it is interrupted.

    Args:
        params: a Nav2 parameter file, or a name of params/nav2.
        map_file: a map_server YAML file; None: what comes on /map.
        localizer: of ours.
        laser: pose of the lidar in the base frame; None: at its origin.
        datum: latitude and longitude [deg] of the map's origin; None: the simulator's.
        seed: of the brain's chance.
        is_simulated: whether time comes on /clock.
        is_stamped: whether commands are TwistStamped.
        seconds: after which it ends; None: never.
        say: tells the user a line.

    Raises:
        InputError: ROS 2 is not here, or a file cannot be used.
    """
    require_ros2()
    from harness.ros2.drive import DriveNode
    from harness.ros2.map import receive_map

    file = str(resolve(params, shipped("params") / "nav2", "Nav2"))
    nav2 = load_nav2(Path(file), allow_unknown=True)
    deadline = float("inf")
    if seconds is not None:
        deadline = time.monotonic() + seconds
    if map_file is None:
        say("waiting for /map")
        grid = align(receive_map(min(MAP_LIMIT, deadline - time.monotonic())))
    else:
        grid = align(load_map(map_file))
    compile_ahead([dataclasses.replace(load_stack(BRAIN), nav2_file=file, localizer=localizer)])
    navigator = build_navigator(nav2, build_localizer(localizer, nav2, grid), grid, None)
    settings = Ros2Params()
    if datum is not None:
        settings = dataclasses.replace(settings, latitude=datum[0], longitude=datum[1])
    rate = read_frequencies(nav2).controller
    node = DriveNode(
        navigator,
        settings,
        laser or Pose2D(),
        rate,
        seed,
        say,
        is_simulated=is_simulated,
        is_stamped=is_stamped,
    )
    say(f"waiting for /initialpose and /goal_pose; ticks at {rate:g} Hz")
    node.spin(deadline)
