"""A fixed law, for a node and for a policy in the harness's own process."""

import math
from typing import Any

import numpy as np

STEADY = 0.6  # [m/s]


def command(stamp: float, ranges: Any, range_max: float) -> tuple[float, float]:
    """Speed and yaw rate at a time [s] of the delivery, with a scan in which inf is no return."""
    seen = np.minimum(ranges, range_max)
    openness = float((seen == range_max).mean())
    nearest = float(seen.min())
    return min(STEADY, 0.2 * nearest), 0.3 * math.sin(round(stamp, 6)) + 0.1 * openness


class Law:
    """What the node does, as a policy."""

    def reset(self, seed: int) -> None:
        """Nothing is remembered."""

    def act(self, seen: Any) -> Any:
        """The law, by a lidar that reaches 30 m."""
        return np.array(command(seen.stamp, seen.ranges, 30.0))
