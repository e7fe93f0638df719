"""``navbench localize``: a recorded log through a localizer, to a trajectory and its errors."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from harness.recorded.bag import Bag, files_read
from harness.recorded.bag_file import DamageError
from harness.recorded.mountings import Mountings
from harness.recorded.receiver import Receiver
from harness.recorded.replay import Replay
from harness.recorded.ros_messages import FIX, ODOMETRY, TYPES
from harness.recorded.sources import (
    MESSAGES,
    Choice,
    choose,
    note_of_edge,
    odometry_frame,
    read_transforms,
)
from harness.recorded.start import local_frame, off_map, start_belief, static_map
from harness.recorded.topics import Topics
from harness.recorded.trajectory import (
    Errors,
    Trajectory,
    absolute_errors,
    align,
    match,
    read_tum,
    relative_errors,
    write_tum,
)
from harness.storage.files import require_no_input, require_writable
from harness.storage.shipped import resolve, shipped
from navstack.build import build_localizer
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import InputError, UnknownNameError
from navstack.localization.amcl import AmclLocalizer
from navstack.localization.localizer import Localizer
from navstack.params.extensions import localizers, uses_map
from navstack.params.nav2_file.file import Nav2File, load_nav2
from navstack.types import Belief, Health, Pose2D

# of parameters that a file does not set, other than in simulated worlds. Of the accelerometer a log
# seldom tells how it is tilted and shaken: on a slope of 17 degrees, gravity in it is taken for
# slipping wheels at 0.3 m/s2/sqrt(Hz), and 6 m of 140 m are lost. Wheels count as much in Autoware
# (ekf_localizer's proc_stddev_vx_c: 10 m/s2)
DEFAULTS = {"gps_ekf.acceleration_noise": 3.0}

Comparison = tuple[Errors, Errors | None]  # APE and RPE
Show = Callable[[], AbstractContextManager[Callable[[float], None]]]


@dataclass(frozen=True, slots=True)
class Request:
    """What the user asked for; see ``navbench localize --help``."""

    bags: tuple[Path, ...]
    params: str
    localizer: str
    out: Path
    map_name: str | None = None
    static_tf: tuple[str, ...] = ()
    remap: tuple[str, ...] = ()
    reference: str | None = None
    alignment: str = "none"
    interval: float = 1.0  # [s] of the RPE
    initial_pose: str | None = None
    is_global: bool = False
    datum: str | None = None
    base_frame: str | None = None
    seed: int = 0
    allow_unknown: bool = True
    is_held_out: bool = False  # every other message of the reference, from the localizer

    def __post_init__(self) -> None:
        """Check what excludes each other.

        Raises:
            InputError: two starts are given.
        """
        if self.is_global and self.initial_pose is not None:
            raise InputError(
                f"--global starts anywhere, and --initial-pose {self.initial_pose} there; give "
                "one of them"
            )


@dataclass(frozen=True, slots=True)
class Localized:
    """What a localizer made of a log."""

    request: Request
    trajectory: Trajectory  # which is written, unless it is empty
    ape: Errors | None  # None: there is no reference
    rpe: Errors | None
    degraded: float  # [s] for which the localizer was DEGRADED
    lost: float  # [s] for which it was LOST
    trouble: str  # what ended it early, and what is kept; empty: nothing
    is_interrupted: bool
    is_reference_input: bool = False  # whether the reference went to the localizer, too
    doubt: str = ""  # why the figures are of no use; empty: nothing speaks against them

    def as_json(self) -> dict[str, Any]:
        """As ``navbench localize --json`` prints it."""
        ape, rpe = self.ape, self.rpe
        return {
            "poses": len(self.trajectory),
            "final": [float(value) for value in self.trajectory.poses[-1]],
            "degraded_s": self.degraded,
            "lost_s": self.lost,
            "ape": ape and {"alignment": self.request.alignment, **ape.as_json()},
            "rpe": rpe and {"interval_s": self.request.interval, **rpe.as_json()},
            "reference_is_input": self.is_reference_input,
            "held_out": self.request.is_held_out,
            "doubt": self.doubt,
            "out": str(self.request.out),
        }


def localize(request: Request, show: Show) -> Localized:
    """Replay, write the trajectory, compare it with the reference.

    Args:
        request: of the user.
        show: shows progress meanwhile; yields what hears of the share that is done.

    Raises:
        InputError: something given cannot be used.
    """
    require_writable("--out", request.out)
    read = (*files_read(request.bags), request.params, request.map_name, request.reference)
    require_no_input("--out", request.out, read)
    if request.localizer not in localizers():
        raise UnknownNameError("localizer", request.localizer, localizers())
    mountings = Mountings()
    for text in request.static_tf:
        mountings.give(text)
    path = Path(request.params)
    if not path.is_file():
        path = resolve(request.params, shipped("params") / "nav2", "Nav2")
    nav2 = load_nav2(path, request.allow_unknown)
    frame = local_frame(request.datum)
    start = start_belief(request.initial_pose, nav2, request.localizer)
    with Bag(request.bags, TYPES) as bag:
        topics = Topics(bag.topics, bag.counts(), request.remap)
        reference = _reference(request.reference, topics)
        topic = reference if isinstance(reference, str) else None
        choice = choose(
            request.localizer, topics, bag, topic, request.is_held_out, request.base_frame
        )
        read_transforms(bag, topics, mountings)
        _note_odometry(choice)
        receiver = Receiver(
            mountings,
            request.base_frame,
            odometry_frame(bag, choice),
            *frame,
            _note,
            choice.edge,
            choice.has_twist,
        )
        grid = static_map(request.map_name, request.localizer)
        localizer = _localizer(request, _with_defaults(nav2), grid)
        _doubt_start(request, start, FIX in choice.topics and request.datum is None)
        if start is not None and uses_map(request.localizer):
            note = off_map(start, grid)
            if note:
                _note(note)
        replay = Replay(bag, choice, receiver, localizer)
        trouble, is_interrupted = _run(replay, request, localizer, start or Belief(Pose2D()), show)
        trouble = trouble or bag.damage or _unusable(request.localizer, choice, bag, receiver)
    found = _finish(replay, request, reference, trouble, is_interrupted)
    return replace(found, is_reference_input=choice.is_reference_input, doubt=receiver.doubt)


def _note_odometry(choice: Choice) -> None:
    """Say where odometry or its velocities are from, unless a message has both."""
    if choice.edge is not None:
        _note(note_of_edge(choice.topics[ODOMETRY], choice.edge))
    if not choice.has_twist:
        _note(f"{choice.topics[ODOMETRY]} tells no velocities: they are taken from its poses")


def _unusable(localizer: str, choice: Choice, bag: Bag, receiver: Receiver) -> str:
    """Which input that the localizer cannot do without held nothing usable; empty: none."""
    if receiver.fixes_elsewhere:
        return receiver.fixes_elsewhere
    for name in localizers()[localizer].inputs:
        topic = choice.topics[MESSAGES[name]]
        kind = bag.topics[topic]
        if receiver.left_out[kind] and not receiver.taken[kind]:
            return (
                f"none of the {receiver.left_out[kind]} messages of {topic} holds anything usable, "
                f"which localizer {localizer} needs"
            )
    return ""


def _reference(given: str | None, topics: Topics) -> Trajectory | str | None:
    """What to compare with: a trajectory from a file, or the name of a topic."""
    if given is None:
        return None
    if Path(given).is_file():
        return read_tum(Path(given))
    try:
        return topics.require(given)
    except InputError as error:
        raise InputError(f"reference '{given}' is no file, and {error}") from None


def _with_defaults(nav2: Nav2File) -> Nav2File:
    """The file with ``DEFAULTS`` where it says nothing."""
    missing = {}
    for name, value in DEFAULTS.items():
        node, _, dotted = name.partition(".")
        if nav2.value(node, dotted) is None:
            missing[name] = value
    return nav2.with_values(missing, allow_unknown=True)


def _localizer(request: Request, nav2: Nav2File, grid: OccupancyGrid) -> Localizer:
    localizer = build_localizer(request.localizer, nav2, grid)
    if request.is_global and not isinstance(localizer, AmclLocalizer):
        raise InputError(
            f"--global: localizer {request.localizer} cannot localize globally; amcl and amcl-gps "
            "can"
        )
    return localizer


def _doubt_start(request: Request, start: Belief | None, is_anchor: bool) -> None:
    """Refuse or warn of a start that nobody knows; ``is_anchor``: the first fix is placed there."""
    if is_anchor and request.is_global:
        raise InputError(
            f"--global without --datum: localizer {request.localizer} would place the first fix "
            "at a start that "
            "nobody knows; give --datum LAT,LON[,HEADING], or --initial-pose in place of --global"
        )
    if start is None and not request.is_global:
        fixes, instead = "", " or --global"
        if is_anchor:
            fixes, instead = ", and fixes are placed from there", ""
        _note(
            f"nobody says where the robot starts: taken to be at 0,0,0{fixes}; give "
            f"--initial-pose{instead}"
        )


def _run(
    replay: Replay, request: Request, localizer: Localizer, start: Belief, show: Show
) -> tuple[str, bool]:
    """Replay to the end, the first damage or an interrupt.

    Returns what went wrong and whether it was an interrupt.
    """

    def begin(belief: Belief) -> None:
        localizer.reset(belief, np.random.default_rng(request.seed))
        if request.is_global and isinstance(localizer, AmclLocalizer):
            localizer.localize_globally()

    share = 0.0
    try:
        with show() as update:
            for share in replay.run(start, begin, _note):
                update(share)
    except KeyboardInterrupt:
        return f"interrupted after {share:.0%} of the messages", True
    except (DamageError, InputError) as error:
        return str(error), False
    return "", False


def _finish(
    replay: Replay,
    request: Request,
    reference: Trajectory | str | None,
    trouble: str,
    is_interrupted: bool,
) -> Localized:
    """Write what there is, compare it, and say what went wrong."""
    trajectory = replay.trajectory
    kept = "no pose was computed"
    comparison = None
    if len(trajectory):
        write_tum(request.out, trajectory)
        kept = f"the {len(trajectory)} poses until then are kept in {request.out}"
        if isinstance(reference, str):
            reference = replay.reference
        try:
            comparison = _compare(trajectory, reference, request)
        except InputError as error:
            trouble, kept = trouble or str(error), f"the trajectory is kept in {request.out}"
    elif not trouble:
        trouble = f"no message of {', '.join(sorted(replay.topics))} holds anything usable"
    if trouble:
        trouble = f"{trouble}; {kept}"
    ape, rpe = comparison or (None, None)
    degraded, lost = (replay.seconds[each] for each in (Health.DEGRADED, Health.LOST))
    return Localized(request, trajectory, ape, rpe, degraded, lost, trouble, is_interrupted)


def _compare(
    trajectory: Trajectory, reference: Trajectory | None, request: Request
) -> Comparison | None:
    """APE and RPE against a reference; None: there is no reference."""
    if reference is None:
        return None
    if not len(reference):
        raise InputError(f"reference {request.reference} has no usable pose")
    estimate, matched = match(trajectory, reference)
    aligned = align(estimate, matched, request.alignment)
    return absolute_errors(aligned, matched), relative_errors(estimate, matched, request.interval)


def _note(text: str) -> None:
    line = f"note: {text}"
    Console(stderr=True, highlight=False, emoji=False).print(line, markup=False, soft_wrap=True)
