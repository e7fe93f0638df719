"""The arms of an ablation: one stack with another localizer, map or injected error in each."""

import dataclasses
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from harness.episode.files import nav2_parameters
from harness.task.stack import (
    LOCALIZATION_MAPS,
    NO_ERROR,
    PARKED,
    SENSORS,
    TRUTH,
    InjectedError,
    Stack,
    localizer_names,
)
from harness.task.study import Study, usable_workers
from navstack.errors import InputError, UnknownNameError
from navstack.params.costmap import ObstacleLayerParams
from navstack.params.extensions import localizers, uses_map
from navstack.params.nav2_file.file import Nav2File
from navstack.params.nav2_file.views import read_collision_monitor, read_costmap
from navstack.params.spatio_temporal import SpatioTemporalLayerParams

COSTMAPS = ("local_costmap", "global_costmap")


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of error that can be injected."""

    field: str  # of InjectedError
    unit: str
    most: float  # in that unit


KINDS = {"position": Kind("position_rms", "m", 100.0), "heading": Kind("heading_rms", "deg", 180.0)}


def arms_of(
    stack: Stack,
    localizers: Sequence[str],
    errors: Sequence[str],
    correlation_time: float | None = None,
    allow_unknown: bool = True,
) -> tuple[Stack, ...]:
    """The arms of a stack, named by what is different in each.

    Args:
        stack: that drives.
        localizers: ``NAME`` or ``NAME@MAP`` each; none: those that there are, or with errors the
            ground truth alone.
        errors: ``position=0.1,0.3`` [m] or ``heading=2`` [deg] each, several separated by blanks;
            every value is an arm beside the ground truth, which is driven too.
        correlation_time: of these errors [s]; None: the usual one.
        allow_unknown: whether unknown keys in the stack's Nav2 file are warnings.

    Raises:
        InputError: a name, map or error that cannot be had, an arm given twice, or fewer than two
            arms.
    """
    if stack.navigator == PARKED:
        raise InputError(
            f"stack '{stack.name}' does not drive, so that its localizer changes nothing; give "
            "another"
        )
    if correlation_time is not None and not errors:
        raise InputError("--correlation-time is that of --inject's errors; give both, or neither")
    names = list(localizers) or ([TRUTH] if errors else list(localizer_names()))
    if errors and TRUTH not in names:
        names.insert(0, TRUTH)
    nav2 = nav2_parameters(stack.nav2_file, allow_unknown)
    arms = [_with_localizer(stack, name, nav2) for name in names]
    pace = {}
    if correlation_time is not None:
        pace = {"correlation_time": correlation_time}
    arms += [_with_error(stack, *error, pace, nav2) for text in errors for error in _errors(text)]
    _check_different(arms)
    return tuple(arms)


def with_arms(study: Study, arms: tuple[Stack, ...], workers: int | None) -> Study:
    """The same deliveries, driven by the arms.

    Raises:
        InputError: fewer than one worker is asked for.
    """
    template = dataclasses.replace(study.template, stack=arms[0])
    count = usable_workers(workers, study.episodes * len(arms))
    return dataclasses.replace(study, stacks=arms, workers=count, template=template)


def injected_kind(stack: Stack) -> str | None:
    """Which kind of error an arm has; None: it has none."""
    return next((name for name, kind in KINDS.items() if getattr(stack.injected, kind.field)), None)


def injected_level(stack: Stack, kind: str) -> float:
    """How much of a kind of error an arm has, in the kind's unit."""
    return float(getattr(stack.injected, KINDS[kind].field))


def is_buildable(stack: Stack) -> bool:
    """Whether a robot can have this localizer: nothing that money buys knows the true pose."""
    return stack.localizer != TRUTH


def parameter_sources(stack: Stack, arms: Sequence[Stack], allow_unknown: bool) -> tuple[str, ...]:
    """Where the parameters of the arms' localizers are from: a sentence for each kind of source."""
    nav2 = nav2_parameters(stack.nav2_file, allow_unknown)
    return tuple(sources_of(nav2, [arm.localizer for arm in arms]))


def sources_of(nav2: Nav2File, names: Sequence[str]) -> list[str]:
    """The same of localizers by name; those that are none have no parameters."""
    given, known = nav2.parameters, localizers()
    named = sorted({node for name in names if name in known for node in known[name].nodes})
    file, sources = nav2.path.name, []
    if own := [node for node in named if given.get(node)]:
        sources.append(f"parameters from {file}: {', '.join(own)}")
    if missing := [node for node in named if not given.get(node)]:
        nodes = ", ".join(missing)
        sources.append(f"{file} has no parameters for {nodes}: those are the program's defaults")
    return sources


def _with_localizer(stack: Stack, text: str, nav2: Nav2File) -> Stack:
    name, at, map_name = text.partition("@")
    if name not in localizer_names():
        raise UnknownNameError("localizer", name, localizer_names())
    if at and map_name not in LOCALIZATION_MAPS:
        raise UnknownNameError(f"map in '{text}'", map_name, LOCALIZATION_MAPS)
    if at and not uses_map(name):
        on_map = ", ".join(filter(uses_map, localizer_names()))
        raise InputError(f"'{text}': {name} uses no map; a map can be chosen for: {on_map}")
    return dataclasses.replace(
        stack,
        name=text,
        title=f"{stack.name} with localizer {text}",
        localizer=name,
        localization_map=map_name or stack.localization_map or stack.planning_map,
        carries=_sensors(name, nav2),
        injected=NO_ERROR,
    )


def _with_error(
    stack: Stack,
    kind: str,
    size: float,
    pace: dict[str, float],
    nav2: Nav2File,
) -> Stack:
    error = InjectedError(**{KINDS[kind].field: size}, **pace)
    name = f"{kind}={size:g}"
    arm = dataclasses.replace(_with_localizer(stack, TRUTH, nav2), name=name, injected=error)
    return dataclasses.replace(
        arm, title=f"{stack.name} with {TRUTH} and an error of {name} {KINDS[kind].unit}"
    )


def _errors(text: str) -> Iterable[tuple[str, float]]:
    """Every kind and size in a text such as ``position=0.1,0.3 heading=2``."""
    for part in text.split():
        kind, equals, sizes = part.partition("=")
        if not equals or not sizes:
            raise InputError(
                f"--inject '{part}' is not KIND=SIZE[,SIZE], e.g. position=0.1,0.3 (m) or "
                "heading=2 (deg)"
            )
        if kind not in KINDS:
            raise UnknownNameError("kind of error", kind, KINDS)
        for size in sizes.split(","):
            yield kind, _size(kind, size)


def _size(kind: str, text: str) -> float:
    most, unit = KINDS[kind].most, KINDS[kind].unit
    try:
        size = float(text)
    except ValueError:
        size = -1.0
    if not 0.0 < size <= most:
        raise InputError(
            f"--inject {kind}: '{text}' is not a number above 0, up to {most:g} {unit}; without "
            f"error drives {TRUTH}"
        )
    return size


def _check_different(arms: Sequence[Stack]) -> None:
    known: dict[Stack, str] = {}
    for arm in arms:
        if arm.name in known.values():
            raise InputError(f"localizer '{arm.name}' is given more than once; give each once")
        unnamed = dataclasses.replace(arm, name="", title="")
        if unnamed in known:
            raise InputError(
                f"localizers '{known[unnamed]}' and '{arm.name}' are the same thing here; "
                "give one of them"
            )
        known[unnamed] = arm.name
    if len(arms) < 2:
        raise InputError(
            f"'{arms[0].name}' alone can be compared with nothing; give at least two localizers or "
            "errors"
        )


def _sensors(localizer: str, nav2: Nav2File) -> tuple[str, ...]:
    """Those with a price that an arm really needs: for its localizer, and to see obstacles."""
    needed: set[str] = set()
    if localizer != TRUTH:
        needed.update(localizers()[localizer].inputs)
    if drives_by_scan(nav2):
        needed.add("scan")
    return tuple(sensor for name, sensor in SENSORS.items() if name in needed)


def drives_by_scan(nav2: Nav2File) -> bool:
    """Whether a costmap's obstacle layer or the collision monitor reads the scan."""
    costmaps = (read_costmap(nav2, node) for node in COSTMAPS)
    layers = (
        layer for costmap in costmaps for layer in costmap.enabled_layers(costmap.plugins).values()
    )
    seeing = (
        layer
        for layer in layers
        if isinstance(layer, ObstacleLayerParams | SpatioTemporalLayerParams)
    )
    marks = any(layer.active_sources for layer in seeing)
    return marks or bool(read_collision_monitor(nav2).polygons)
