"""What drives: a Nav2 file, a localizer, sensors and a robot, under one name."""

import dataclasses
import importlib.util
import os
import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

from harness.storage.shipped import is_file, resolve, shipped
from harness.storage.texts import clean_text, name_of
from harness.task.camera_params import CameraParams
from harness.task.lidar_place import fitting_sensors
from harness.task.own_body import own_body
from harness.task.ros2_params import NO_ROS2, Ros2Params
from navstack.errors import InputError, ParameterError, UnknownNameError
from navstack.files import named_by
from navstack.params.extensions import localizers, uses_map
from navstack.params.nav2_file.file import Nav2File, inspect_nav2
from navstack.params.nav2_file.ros_yaml import PARAMETERS
from navstack.params.strict import from_mapping, load_dataclass, load_yaml, read_text
from navstack.ranges import KEPT_OUT, NotNegative, Parameters, Positive, up_to

PEER = "peer"  # the localizer of whoever drives over ROS 2
TRUTH = "ground_truth"  # the localizer and the tracker that no robot can have
# none: all is free until it is seen
GEOMETRY, MESH, NO_MAP = PLANNING_MAPS = ("geometry", "navigation_mesh", "none")
LOCALIZATION_MAPS = (GEOMETRY, MESH, "outlined_mesh")
# or a policy, as MODULE:CLASS or FILE.py:CLASS; ros2: nodes of another program
NAV2, PARKED, ROS2 = NAVIGATORS = ("nav2", "parked", "ros2")
_COMMENT = re.compile(r"(?:^|\s)#")  # where one begins in a line of YAML
WHEN_LOST = ("drive", "stop")  # what a robot does whose localizer is lost
SENSORS = {"scan": "lidar", "fix": "gps"}  # those that have a price, by the input that they give
# [s] of an injected error: the least of GNSS multipath (Joerger and Pervan 2020: 10 to 900 s)
CORRELATION_TIME = 10.0


@dataclass(frozen=True, slots=True)
class InjectedError(Parameters, whose="injected error", finite=True):
    """A set error on top of the true pose: one first-order Gauss-Markov process per coordinate."""

    position_rms: NotNegative = 0.0  # [m] root mean square of the distance from the true position
    heading_rms: NotNegative = 0.0  # [deg] root mean square of the angle from the true yaw
    correlation_time: Positive = CORRELATION_TIME  # [s] over which the correlation falls to 1/e

    @property
    def is_zero(self) -> bool:
        """Whether there is none."""
        return self.position_rms == 0.0 and self.heading_rms == 0.0


NO_ERROR = InjectedError()


@dataclass(frozen=True, slots=True)
class PolicyParams(Parameters, whose="policy"):
    """How a policy of the user's drives; see :mod:`harness.policy`."""

    rate: Annotated[float, up_to(1000)] = 10.0  # [Hz] at which it is asked
    time_limit: Annotated[float, up_to(1800)] = 10.0  # [s] of wall time for an answer
    # [s] of wall time until it is there: it may have to load a network
    start_limit: Annotated[float, up_to(1800)] = 120.0
    file: str = ""  # handed to it when it is made, e.g. its weights; empty: it is made without
    # [m/s] at which the waypoints of one that answers with waypoints are followed
    speed: Annotated[float, up_to(100)] = 1.0
    sees_people: bool = False  # whether it receives the true positions of people
    # whether it was trained on collected data, which is part of the CAPEX
    data_collection: bool = False
    camera: CameraParams = CameraParams()  # whose pictures it is shown; none unless it has pixels


NO_POLICY = PolicyParams()


@dataclass(frozen=True, slots=True)
class Stack:
    """One way to drive. Files stand as absolute paths once the stack is loaded."""

    title: str
    navigator: str
    localizer: str
    planning_map: str  # of PLANNING_MAPS, or a map_server YAML file
    sensors: str
    carries: tuple[str, ...]
    robot: str
    nav2_file: str = ""  # empty for 'parked'; of 'ros2' it gives the ticks' rate only
    localization_map: str = ""  # of LOCALIZATION_MAPS, or such a file; empty: the planning map
    when_lost: str = "drive"  # of WHEN_LOST; Nav2 drives on
    injected: InjectedError = NO_ERROR  # on top of ground_truth
    # ground_truth: people as they are; empty: as the Nav2 file's tracker sees them
    tracker: str = ""
    name: str = ""
    policy: PolicyParams = NO_POLICY  # of a navigator that is a policy
    ros2: Ros2Params = NO_ROS2  # of a navigator that is elsewhere
    body: str = field(default="", metadata=KEPT_OUT)  # note on a robot that the Nav2 file describes

    @property
    def is_nav2(self) -> bool:
        """Whether the Nav2 file decides how it drives."""
        return self.navigator == NAV2

    @property
    def is_policy(self) -> bool:
        """Whether a policy of the user's drives."""
        return ":" in self.navigator

    @property
    def data_collection(self) -> bool:
        """Whether data collection is part of its CAPEX."""
        return self.policy.data_collection


def load_stack(
    name_or_file: str,
    localizer: str | None = None,
    robot: str | None = None,
    sensors: str | None = None,
) -> Stack:
    """A stack by name, by its file, or made from a Nav2 parameter file.

    That is like ``nav2-gps``, with the robot that the file describes where it is another one.

    Args:
        name_or_file: a name of ``params/stacks``, a stack file, or a Nav2 parameter file.
        localizer: replaces the stack's own.
        robot: replaces the stack's own.
        sensors: preset that replaces the stack's own.

    Raises:
        InputError: an unknown name, or a file that is neither a stack nor a Nav2 file.
    """
    stacks = shipped("params") / "stacks"
    path = resolve(name_or_file, stacks, "stack")
    is_nav2_file = _has_nodes(read_text(path))
    if is_nav2_file:
        stack = load_dataclass(Stack, stacks / "nav2-gps.yaml")
        stack = dataclasses.replace(
            stack, nav2_file=str(path.absolute()), title=f"Nav2 file {clean_text(path.name)}"
        )
    else:
        stack = _stack_of(path)
    changes: dict[str, Any] = {
        name: _beside(path, getattr(stack, name))
        for name in ("nav2_file", "planning_map", "localization_map", "robot", "sensors")
    }
    given = {"localizer": localizer, "robot": robot, "sensors": sensors}
    changes |= {name: value for name, value in given.items() if value is not None}
    stack = dataclasses.replace(
        stack,
        name=name_of(path),
        navigator=_policy_beside(path, stack.navigator),
        policy=dataclasses.replace(stack.policy, file=_weights_beside(path, stack.policy.file)),
        **changes,
    )
    stack = _with_paths(stack, path)
    if is_nav2_file and robot is None:
        stack = _with_own_body(stack)
    sensors_file = fitting_sensors(Path(stack.sensors), Path(stack.robot))
    return dataclasses.replace(stack, sensors=str(sensors_file))


def _has_nodes(text: str) -> bool:
    """Whether a file has parameters of nodes outside its comments, as every Nav2 file has."""
    return any(PARAMETERS in _COMMENT.split(line)[0] for line in text.splitlines())


def _stack_of(path: Path) -> Stack:
    """The stack of a file of its own.

    Raises:
        InputError: it is another file, or has an unknown key or a value that is none.
    """
    mapping = load_yaml(path)
    names = {each.name for each in dataclasses.fields(Stack)}
    if not isinstance(mapping, Mapping) or names.isdisjoint(mapping):
        raise InputError(
            f"{path}: neither a Nav2 parameter file, which has <node>: {PARAMETERS}: <parameters>, "
            "nor a stack file; give one of the two, or a name of navbench list stacks"
        )
    return from_mapping(Stack, mapping, str(path))


def _with_own_body(stack: Stack) -> Stack:
    """A stack made from a Nav2 file with the robot of that file, if it is another one."""
    nav2 = inspect_nav2(Path(stack.nav2_file), allow_unknown=True)
    body = own_body(nav2, Path(stack.robot), Path(stack.sensors), stack.name)
    if body is None:
        return stack
    return dataclasses.replace(stack, robot=body.robot, body=body.note, sensors=body.sensors)


def absolute_files(nav2: Nav2File) -> dict[str, str]:
    """Of each node that names a map or a mask the absolute path of that file.

    Relative ones begin at the Nav2 file.
    """
    named = {node: entries.get("yaml_filename") for node, entries in nav2.parameters.items()}
    folder = nav2.path.parent
    return {
        node: str(named_by(folder, str(file.value)).resolve())
        for node, file in named.items()
        if file and file.value
    }


def policy_files(stack: Stack) -> list[Path]:
    """The files that a stack's policy is made of, as far as the stack names them."""
    code = Path(stack.navigator.rpartition(":")[0])
    files = []
    if code.suffix == ".py":
        files.append(code)
    if stack.policy.file:
        files.append(Path(stack.policy.file))
    return files


def policy_module(stack: Stack) -> list[Path]:
    """The file of a policy that is given as MODULE:CLASS; none: it is another one."""
    module, colon, _ = stack.navigator.rpartition(":")
    if not colon or module.endswith(".py"):
        return []
    package, *names = module.split(".")
    found = importlib.util.find_spec(package) if package else None  # nothing of it is run
    if found is None or not found.has_location or found.origin is None:
        return []
    place = Path(found.origin)
    if names:
        place = place.parent.joinpath(*names).with_suffix(".py")
    if not place.is_file():
        place = place.with_suffix("") / "__init__.py"
    return [place] if place.is_file() else []


def localizer_names() -> tuple[str, ...]:
    """The localizers that a stack may name, those of other packages among them."""
    return (TRUTH, *localizers())


def _beside(path: Path, name_or_file: str) -> str:
    """What a stack's file names: a file, relative to that one, as an absolute path.

    A name of ``params`` as it is.
    """
    if is_file(name_or_file):
        return str((path.parent / name_or_file).absolute())
    return name_or_file


def _policy_beside(path: Path, navigator: str) -> str:
    """A policy in a file, relative to the stack's, with its absolute path.

    Another navigator as it is.

    Raises:
        ParameterError: the file is not there.
    """
    file, colon, name = navigator.rpartition(":")
    if not colon or not file.endswith(".py"):
        return navigator
    return f"{_weights_beside(path, file)}:{name}"


def _weights_beside(path: Path, file: str) -> str:
    if not file:
        return ""
    found = (path.parent / file).absolute()
    if not os.path.isfile(found):
        raise ParameterError(
            f"{path}: {found} is not there; files of a policy are looked for beside the stack's "
            "file"
        )
    return str(found)


def _check_map(kind: str, given: str, known: Collection[str]) -> None:
    """Refuse a map that is neither a name nor a file that there is."""
    if not is_file(given):
        _check(kind, given, known)
    elif not os.path.isfile(given):
        raise ParameterError(
            f"{kind} {given} is not there; give a map_server YAML file, or one of "
            f"{', '.join(known)}"
        )


def _with_paths(stack: Stack, path: Path) -> Stack:
    """Check the names and turn those of files into absolute paths."""
    if not stack.is_policy:
        _check("navigator", stack.navigator, (*NAVIGATORS, "MODULE:POLICY"))
    known = localizer_names()
    if stack.navigator == ROS2:
        known = (PEER,)
    _check("localizer", stack.localizer, known)
    _check_map("planning map", stack.planning_map, PLANNING_MAPS)
    if stack.localization_map or stack.planning_map != NO_MAP or uses_map(stack.localizer):
        _check_map(
            "localization map", stack.localization_map or stack.planning_map, LOCALIZATION_MAPS
        )
    _check("when_lost", stack.when_lost, WHEN_LOST)
    _check("tracker", stack.tracker or TRUTH, (TRUTH,))
    for sensor in stack.carries:
        _check("sensor", sensor, SENSORS.values())
    if not stack.injected.is_zero and stack.localizer != TRUTH:
        raise ParameterError(
            f"{path}: injected: an error is added to ground_truth only, not to '{stack.localizer}'"
        )
    params = shipped("params")
    nav2_file = ""
    if stack.navigator != PARKED and (stack.nav2_file or stack.navigator != ROS2):
        if not stack.nav2_file:
            needs = "a nav2 stack needs one"
            if stack.is_policy:
                needs = "it has the localizer's and the planner's parameters"
            raise ParameterError(f"{path}: key 'nav2_file' is missing; {needs}")
        nav2_file = str(resolve(stack.nav2_file, params / "nav2", "Nav2").resolve())
    return dataclasses.replace(
        stack,
        nav2_file=nav2_file,
        sensors=str(resolve(stack.sensors, params / "sensors", "sensor preset").resolve()),
        robot=str(resolve(stack.robot, params / "robots", "robot").resolve()),
    )


def _check(kind: str, given: str, known: Collection[str]) -> None:
    if given not in known:
        raise UnknownNameError(kind, given, known)
