"""Where a replay starts: the pose, the local frame of the fixes, the map."""

import math

import numpy as np

from harness.storage.shipped import resolve, shipped
from harness.world.map.scene import Scene
from navstack.costmap.map_io import load_map
from navstack.costmap.occupancy_grid import FARTHEST, UNKNOWN, OccupancyGrid, align
from navstack.errors import InputError, ParameterError
from navstack.localization.geodesy import LocalFrame
from navstack.params.extensions import uses_map
from navstack.params.nav2_file.file import Nav2File
from navstack.types import Belief, Pose2D

_SURE = 1e-6  # [m], [rad] deviation of who says that there is none
ANY_HEADING = np.diag((1.0, 1.0, math.pi**2 / 3.0))  # [m2, m2, rad2] of an unknown start


def start_belief(given: str | None, nav2: Nav2File, localizer: str) -> Belief | None:
    """Where the robot is believed to be before the first message.

    Args:
        given: ``x,y,yaw[,std_xy,std_yaw]`` by the user; None: as the file says for AMCL.
        nav2: the parameter file.
        localizer: its name; only those with a map start where the file says.

    Returns:
        The belief; without deviations its covariance is 0, for which each localizer has a default.
        None: it is unknown.

    Raises:
        InputError: what the user or the file gives is no pose.
    """
    if given is not None:
        values = numbers(
            "--initial-pose", given, (3, 5), "x,y,yaw[,std_xy,std_yaw] in [m] and [rad]"
        )
        xy, yaw = values[3:] or (0.0, 0.0)
        if xy < 0.0 or yaw < 0.0:
            raise InputError(
                f"--initial-pose '{given}' has a negative standard deviation; give 0 or more"
            )
        if len(values) > 3:  # a covariance of 0 stands for none
            xy, yaw = max(xy, _SURE), max(yaw, _SURE)
        return Belief(Pose2D(*values[:3]), np.diag((xy**2, xy**2, yaw**2)))
    if not uses_map(localizer):
        return Belief(Pose2D(), ANY_HEADING)
    if nav2.value("amcl", "set_initial_pose") is not True:
        return None
    pose = [nav2.value("amcl", f"initial_pose.{name}", 0.0) for name in ("x", "y", "yaw")]
    if not all(isinstance(value, int | float) and abs(value) <= FARTHEST for value in pose):
        raise ParameterError(
            f"{nav2.path.name}: amcl: initial_pose {pose} is not x, y, yaw: three numbers"
        )
    return Belief(Pose2D(*map(float, pose)))


def local_frame(datum: str | None) -> tuple[LocalFrame | None, float]:
    """The frame of a datum ``latitude,longitude[,heading]``, and its heading [rad] from east.

    Raises:
        InputError: it is none.
    """
    if datum is None:
        return None, 0.0
    what = "latitude,longitude[,heading] in [deg], [deg], [rad from east], e.g. 42.3758,-71.1474"
    values = numbers("--datum", datum, (2, 3), what)
    if len(values) == 2:
        values.append(0.0)
    latitude, longitude, heading = values
    return LocalFrame(latitude, longitude, heading), heading


def static_map(name_or_file: str | None, localizer: str) -> OccupancyGrid:
    """What scans are matched with; a single unknown cell for localizers that need no map.

    A map of one's own counts as it is, as in Nav2; a built-in world as a robot would have mapped
    it, as in a run.

    Raises:
        InputError: the map is needed and not given, or cannot be used.
    """
    if name_or_file is None:
        if uses_map(localizer):
            raise InputError(
                f"localizer {localizer} needs a map; give --map with a map_server YAML file"
            )
        return OccupancyGrid(np.full((1, 1), UNKNOWN, dtype=np.int8), 1.0, Pose2D())
    path = resolve(name_or_file, shipped("maps"), "map")
    grid = align(load_map(path))
    if path.resolve().is_relative_to(shipped("maps").resolve()):
        return Scene(path.stem, (), (), grid, grid).mapped_geometry
    return grid


def off_map(start: Belief, grid: OccupancyGrid) -> str:
    """Why nobody finds a robot that starts there: it is off the map; empty: it is on it."""
    pose = start.pose
    right = grid.origin.x + grid.width * grid.resolution
    top = grid.origin.y + grid.height * grid.resolution
    if grid.origin.x <= pose.x < right and grid.origin.y <= pose.y < top:
        return ""
    return (
        f"the start ({pose.x:g}, {pose.y:g}) m lies off the map, which has x {grid.origin.x:g} to "
        f"{right:g} m, y {grid.origin.y:g} to {top:g} m; check --initial-pose and --map"
    )


def numbers(option: str, text: str, counts: tuple[int, ...], what: str) -> list[float]:
    """Finite numbers separated by commas.

    Raises:
        InputError: there are not as many as one of ``counts``.
    """
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) not in counts or not all(map(math.isfinite, values)):
        raise InputError(f"{option} '{text}' is not {what}")
    if max(map(abs, values)) > FARTHEST:
        raise InputError(f"{option} '{text}' has a number beyond {FARTHEST:g}; give {what}")
    return values
