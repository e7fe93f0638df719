"""Drive, price and compare deliveries from Python.

``python -m navbench`` is the program of the same name.

    import navbench

    run = navbench.run("nav2-gps", episodes=8)
    print(run.margins)

Other modules: :mod:`navbench.gym`, an environment for reinforcement learning.
"""

import importlib
from typing import TYPE_CHECKING, Any

from navstack.dispatch import pin

if TYPE_CHECKING:
    from harness.episode.episode import Delivery, RunningDelivery
    from harness.policy.interface import Policy, PolicyObservation
    from harness.statistics.interval import Interval
    from harness.task.camera_params import CameraParams
    from navbench.api import Run, compare, load, make_world, plan, price, run
    from navstack.errors import InputError, NavstackError
    from navstack.types import Pose2D, Twist2D

pin()  # before anything loads numpy

# fmt: off
__all__ = [
    "CameraParams", "Delivery", "InputError", "Interval", "NavstackError", "Policy", "PolicyObservation", "Pose2D",
    "Run", "RunningDelivery", "Twist2D", "compare", "load", "make_world", "plan", "price", "run",
]
# fmt: on
_WHERE = {
    "CameraParams": "harness.task.camera_params",
    "Delivery": "harness.episode.episode",
    "InputError": "navstack.errors",
    "Interval": "harness.statistics.interval",
    "NavstackError": "navstack.errors",
    "Policy": "harness.policy.interface",
    "PolicyObservation": "harness.policy.interface",
    "Pose2D": "navstack.types",
    "RunningDelivery": "harness.episode.episode",
    "Twist2D": "navstack.types",
}


def __getattr__(name: str) -> Any:
    """What is asked for, imported then: the program itself needs little of it."""
    if name not in __all__:
        raise AttributeError(
            f"module 'navbench' has no attribute '{name}'; it has {', '.join(sorted(__all__))}"
        )
    return getattr(importlib.import_module(_WHERE.get(name, "navbench.api")), name)


def __dir__() -> list[str]:
    return sorted(__all__)
