"""A recorded log through one of the robot's localizers, and what its errors are worth."""

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.ablation.arms import sources_of
from harness.recorded.command import DEFAULTS, Localized, Request
from harness.recorded.command import localize as replay
from harness.storage.shipped import resolve, shipped
from navbench.api.progress import share_shown
from navstack.errors import NavstackError
from navstack.params.extensions import localizers
from navstack.params.nav2_file.file import Nav2File, load_nav2
from navstack.params.nav2_file.views import read_goal_checker
from navstack.params.strict import load_dataclass


@dataclass(frozen=True, slots=True)
class LocalizationPrice:
    """What an error of the believed position costs; see params/calibration."""

    usd_per_m: float  # [USD/run/m]
    low: float  # [USD/run/m] of its 95 % interval
    high: float  # [USD/run/m]
    largest: float  # [m] error up to which it was measured
    study: str  # that measured it


@dataclass(frozen=True, slots=True)
class Worth:
    """What the errors of a trajectory come to."""

    rmse_m: float  # [m] of the positions
    usd_per_run: float  # [USD] by the price of localization error, at most that of its largest
    low_usd: float  # [USD]
    high_usd: float  # [USD]
    is_beyond: bool  # whether the error is larger than any whose price was measured
    largest_m: float  # [m] of those
    study: str
    goal_tolerance_m: float | None  # [m] of the file's goal checker; None: it has none
    # of the poses whose error is within this tolerance; None: there is none, or no sound reference
    share_within: float | None

    def as_json(self) -> dict[str, Any]:
        """As ``navbench localize --json`` has it."""
        return asdict(self)


def localize(request: Request) -> Localized:
    """Run a localizer over a recorded ROS 1 or ROS 2 bag, and write the trajectory.

    Args:
        request: bags, parameters, localizer, file to write and more.

    Returns:
        The trajectory, its errors, and why it ends early where the log breaks off.

    Raises:
        InputError: something given cannot be used.
    """
    return replay(request, lambda: share_shown("messages"))


def worth(found: Localized) -> Worth | None:
    """What the errors of a trajectory cost, and whether they let the robot arrive.

    None where there is no reference to compare with, or one that the localizer has followed, and
    where a sensor's mounting is wrong.
    """
    if found.ape is None or not len(found.ape.positions) or found.doubt:
        return None
    if found.is_reference_input and not found.request.is_held_out:
        return None
    file = shipped("params") / "calibration" / "localization_price.yaml"
    price = load_dataclass(LocalizationPrice, file)
    errors = found.ape.positions
    rmse = float(np.sqrt(np.mean(errors**2)))
    priced = min(rmse, price.largest)
    tolerance = _goal_tolerance(found.request)
    within = None
    if tolerance is not None and not found.request.is_held_out:  # its noise is the reference's
        within = float(np.mean(errors <= tolerance))
    return Worth(
        rmse,
        priced * price.usd_per_m,
        priced * price.low,
        priced * price.high,
        rmse > price.largest,
        price.largest,
        price.study,
        tolerance,
        within,
    )


def sources(request: Request) -> list[str]:
    """Where the localizer's parameters are from: a text for each kind of source."""
    nav2 = _nav2(request)
    found = sources_of(nav2, [request.localizer])
    nodes = localizers()[request.localizer].nodes
    if not nodes:
        return ["it has no parameters"]
    for name, value in DEFAULTS.items():
        node, _, dotted = name.partition(".")
        if node in nodes and nav2.value(node, dotted) is None:
            found.append(f"{name} {value:g}, as for every log")
    return found


def _nav2(request: Request) -> Nav2File:
    path = Path(request.params)
    if not path.is_file():
        path = resolve(request.params, shipped("params") / "nav2", "Nav2")
    return load_nav2(path, request.allow_unknown)


def _goal_tolerance(request: Request) -> float | None:
    """Of the request's Nav2 file [m]; None: its goal checker has none."""
    try:
        checker = read_goal_checker(_nav2(request))
    except NavstackError:
        return None
    tolerance: float | None = getattr(checker.params, "xy_goal_tolerance", None)
    return tolerance
