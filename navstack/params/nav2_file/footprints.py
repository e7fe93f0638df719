"""Footprints that Nav2 cannot read, or reads although they enclose no body."""

from navstack.geometry import crosses_itself
from navstack.params.costmap import CostmapParams, is_unreadable, robot_footprint
from navstack.params.nav2_file.findings import Notice, Parameters, value_of
from navstack.params.nav2_file.nodes import COSTMAPS

_ADVICE = 'footprint: "[[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2]]" in metres, in quotes'
_IN_ORDER = "give the corners in order around the robot"


def footprint_notices(parameters: Parameters) -> list[Notice]:
    """Unreadable footprints: Nav2 logs them and takes robot_radius (``costmap_2d_ros.cpp``).

    It reads those that cross themselves (``footprint.cpp``) and tests the edges as they are.
    """
    notices = []
    for node in COSTMAPS:
        entries = parameters.get(node, {})
        text = value_of(entries, "footprint", "")
        if not isinstance(text, str) or not text:
            continue
        path, line = f"{node}: footprint", entries["footprint"].line
        if is_unreadable(text):
            radius = value_of(entries, "robot_radius", CostmapParams().robot_radius)
            message = (
                f"{text!r} is not a list of at least three [x, y] pairs; Nav2 warns and takes "
                f"robot_radius, {radius} m"
            )
            notices.append(Notice("unreadable-footprint", path, message, _ADVICE, line))
        elif crosses_itself(robot_footprint(CostmapParams(footprint=text))):
            message = f"{text!r} crosses itself; Nav2 takes it, and tests edges inside the robot"
            notices.append(Notice("crossed-footprint", path, message, _IN_ORDER, line))
    return notices
