"""A policy of 15 numbers: speed and yaw rate are weighted sums of what it sees.

They are squeezed into the robot's limits. What is mirrored is answered mirrored: the speed is a
sum of what left and right have in common, the yaw rate of what they differ in.

Made for docs/python.md: it shows how a policy is trained in ``navbench.gym`` (train_policy.py) and
driven by ``navbench run`` (tiny_policy.yaml).
"""

import json
from pathlib import Path

import numpy as np
import numpy.typing as npt

from navbench import PolicyObservation

FASTEST = np.array((1.8, 1.5))  # [m/s], [rad/s] that it uses
SECTORS, SIDE, SEEN = 9, 1.2, 6.0  # of the scan, [rad] to each side, [m] within which it looks
PAIRS = SECTORS // 2
# where training begins: along the route, slower in bends
FIRST = np.zeros(4 + PAIRS + 1 + 2 + PAIRS)
FIRST[:2], FIRST[4 + PAIRS + 1] = (1.0, -1.0), 2.0

FloatArray = npt.NDArray[np.float64]


def features(seen: PolicyObservation) -> tuple[FloatArray, FloatArray]:
    """What the sums are over: route, own speed and how near things are.

    First as both sides have them in common, then as they differ.
    """
    near, far = (np.arctan2(y, x) for x, y in (seen.route[1], seen.route[4]))
    nearness = np.zeros(SECTORS)
    sector = np.floor((seen.angles + SIDE) / (2.0 * SIDE) * SECTORS)
    for k in range(SECTORS):
        if (inside := sector == k).any():
            nearness[k] = 1.0 - min(float(seen.ranges[inside].min()), SEEN) / SEEN
    speed = seen.velocity[0] / FASTEST[0]
    left, right = nearness[: -PAIRS - 1 : -1], nearness[:PAIRS]  # from the side to the front
    common = np.concatenate(([1.0, abs(near), abs(far), speed], left + right, [nearness[PAIRS]]))
    return common, np.concatenate(([near, far], left - right))


class TinyPolicy:
    """Weights like FIRST, from a JSON file."""

    def __init__(self, file: str) -> None:
        self.weights = np.array(json.loads(Path(file).read_text(encoding="utf-8")))

    def reset(self, seed: int) -> None:
        """Nothing is left to chance, and nothing is remembered."""

    def act(self, observation: PolicyObservation) -> FloatArray:
        """Forward velocity, never backwards, and yaw rate."""
        return command(self.weights, observation)


def command(weights: FloatArray, seen: PolicyObservation) -> FloatArray:
    """Forward velocity [m/s] and yaw rate [rad/s]."""
    common, differing = features(seen)
    speed, turn = weights[: common.size] @ common, weights[common.size :] @ differing
    return FASTEST * np.array((np.clip(speed, 0.0, 1.0), np.tanh(turn)))
