"""Drive, price and compare deliveries from Python: everything that the commands do.

``python -m navbench`` is the program of the same name.

    import navbench

    run = navbench.run("nav2-gps", episodes=8)
    print(run.margins)

Other modules: :mod:`navbench.gym`, an environment for reinforcement learning.
"""

import importlib
from types import FunctionType
from typing import TYPE_CHECKING, Any

from navbench.arguments import checked
from navstack.dispatch import pin

if TYPE_CHECKING:
    from harness.episode.episode import Delivery, RunningDelivery
    from harness.policy.interface import Policy, PolicyObservation
    from harness.recorded.command import Request
    from harness.recorded.log import LogRequest
    from harness.statistics.interval import Interval
    from harness.study.places import Where
    from harness.study.suite import Portion
    from harness.task.camera_params import CameraParams
    from navbench.api.ablate import ablate, resume_ablation
    from navbench.api.check import check, resume_check
    from navbench.api.cost_log import cost_log
    from navbench.api.day import day
    from navbench.api.explain import explain
    from navbench.api.identify import identify
    from navbench.api.lint import lint
    from navbench.api.listing import listing
    from navbench.api.localize import localize
    from navbench.api.maps import import_map, make_map, measure_map
    from navbench.api.money import compare, price, price_sets, sensitivity
    from navbench.api.paper import paper
    from navbench.api.plan import plan
    from navbench.api.report import replay, report
    from navbench.api.ros2 import drive_robot, serve
    from navbench.api.run import make_world, resume, run
    from navbench.api.runs import Run, load
    from navbench.api.street import cut_map, import_osm, route_missions, street_losses
    from navbench.api.suite import resume_suite, suite
    from navbench.api.tuning.tune import resume_tuning, tune
    from navbench.api.verify import scenario, verify
    from navstack.errors import InputError, NavstackError
    from navstack.types import Pose2D, Twist2D

pin()  # before anything loads numpy

_NAMES = {  # by module
    "harness.episode.episode": ("Delivery", "RunningDelivery"),
    "harness.policy.interface": ("Policy", "PolicyObservation"),
    "harness.recorded.command": ("Request",),
    "harness.recorded.log": ("LogRequest",),
    "harness.statistics.interval": ("Interval",),
    "harness.study.places": ("Where",),
    "harness.study.suite": ("Portion",),
    "harness.task.camera_params": ("CameraParams",),
    "navbench.api.ablate": ("ablate", "resume_ablation"),
    "navbench.api.check": ("check", "resume_check"),
    "navbench.api.cost_log": ("cost_log",),
    "navbench.api.day": ("day",),
    "navbench.api.explain": ("explain",),
    "navbench.api.identify": ("identify",),
    "navbench.api.lint": ("lint",),
    "navbench.api.listing": ("listing",),
    "navbench.api.localize": ("localize",),
    "navbench.api.maps": ("import_map", "make_map", "measure_map"),
    "navbench.api.money": ("compare", "price", "price_sets", "sensitivity"),
    "navbench.api.paper": ("paper",),
    "navbench.api.plan": ("plan",),
    "navbench.api.report": ("replay", "report"),
    "navbench.api.ros2": ("drive_robot", "serve"),
    "navbench.api.run": ("make_world", "resume", "run"),
    "navbench.api.runs": ("Run", "load"),
    "navbench.api.street": ("cut_map", "import_osm", "route_missions", "street_losses"),
    "navbench.api.suite": ("resume_suite", "suite"),
    "navbench.api.tuning.tune": ("resume_tuning", "tune"),
    "navbench.api.verify": ("scenario", "verify"),
    "navstack.errors": ("InputError", "NavstackError"),
    "navstack.types": ("Pose2D", "Twist2D"),
}
_WHERE = {name: module for module, names in _NAMES.items() for name in names}
__all__ = [
    "CameraParams",
    "Delivery",
    "InputError",
    "Interval",
    "LogRequest",
    "NavstackError",
    "Policy",
    "PolicyObservation",
    "Portion",
    "Pose2D",
    "Request",
    "Run",
    "RunningDelivery",
    "Twist2D",
    "Where",
    "ablate",
    "check",
    "compare",
    "cost_log",
    "cut_map",
    "day",
    "drive_robot",
    "explain",
    "identify",
    "import_map",
    "import_osm",
    "lint",
    "listing",
    "load",
    "localize",
    "make_map",
    "make_world",
    "measure_map",
    "paper",
    "plan",
    "price",
    "price_sets",
    "replay",
    "report",
    "resume",
    "resume_ablation",
    "resume_check",
    "resume_suite",
    "resume_tuning",
    "route_missions",
    "run",
    "scenario",
    "sensitivity",
    "serve",
    "street_losses",
    "suite",
    "tune",
    "verify",
]


def __getattr__(name: str) -> Any:
    """What is asked for, imported then: the program itself needs little of it."""
    if name not in _WHERE:
        raise AttributeError(
            f"module 'navbench' has no attribute '{name}'; it has {', '.join(__all__)}"
        )
    found = getattr(importlib.import_module(_WHERE[name]), name)
    if _WHERE[name].startswith("navbench.api"):
        importlib.import_module("harness.execution.arithmetic").warn_of_other_arithmetic()
    if isinstance(found, FunctionType):
        found = globals()[name] = checked(found)  # once, so that pickle finds the same
    return found


def __dir__() -> list[str]:
    return sorted(__all__)
