"""Footprints that Nav2 cannot read."""

from navstack.params.costmap import CostmapParams, is_unreadable
from navstack.params.nav2_file.findings import Notice, Parameters, value_of
from navstack.params.nav2_file.nodes import COSTMAPS

_ADVICE = 'footprint: "[[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2], [-0.3, 0.2]]" in metres, in quotes'


def footprint_notices(parameters: Parameters) -> list[Notice]:
    """Unreadable footprints: Nav2 logs them and takes robot_radius (``costmap_2d_ros.cpp``)."""
    notices = []
    for node in COSTMAPS:
        entries = parameters.get(node, {})
        text = value_of(entries, "footprint", "")
        if isinstance(text, str) and is_unreadable(text):
            radius = value_of(entries, "robot_radius", CostmapParams().robot_radius)
            message = (
                f"'{text}' is not a list of at least three [x, y] pairs; Nav2 warns and takes "
                f"robot_radius, {radius} m"
            )
            line = entries["footprint"].line
            notices.append(
                Notice("unreadable-footprint", f"{node}: footprint", message, _ADVICE, line)
            )
    return notices
