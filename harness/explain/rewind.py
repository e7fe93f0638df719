"""The same delivery with other parameters from some moment on.

The delivery is driven from its start with the parameters that it had, so that world and brain are
in their true state at the moment. From the start on, a second brain, built with the changed
parameters, is shown the same observations: it localizes, maps, plans and decides, but nobody drives
what it says. At the moment it takes over. No state is copied from one brain to the other, and both
draw their chance from generators that began alike: with nothing changed they say the same in every
tick, and the row comes out as it was.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import cast

import numpy as np

from harness.episode.brains import steps_per_tick
from harness.episode.episode import Delivery, run_episode
from harness.episode.factory import Parts
from harness.explain.brains import HandOver, TakeOver
from harness.explain.evidence import Evidence, task_of
from harness.study.stored_run import StoredRun
from harness.task.brain import Brain
from harness.task.study import EpisodeTask
from harness.tuning.evaluation import Value
from harness.tuning.space.paths import ParameterPlace, locate, with_values
from harness.world.world import World
from navstack.errors import InputError
from navstack.params.nav2_file.file import Nav2File

SWITCHES = {"true": True, "false": False}
KINDS = {bool: "true or false", int: "a whole number", float: "a finite number", str: "a text"}
EXAMPLE = "controller_server.FollowPath.BaseObstacle.scale=0.1"


@dataclass(frozen=True, slots=True)
class Change:
    """One parameter with another value."""

    place: ParameterPlace  # with the value that it had
    value: Value


@dataclass(frozen=True, slots=True)
class Rewound:
    """A delivery with other parameters from some moment on."""

    changes: tuple[Change, ...]
    take_over: TakeOver
    delivery: Delivery


def rewind(run: StoredRun, evidence: Evidence, settings: Sequence[str], moment: float) -> Rewound:
    """Drive a delivery with other parameters from a ``moment`` [s] on.

    Args:
        run: with one stack.
        evidence: of the delivery.
        settings: ``PATH=VALUE`` each, paths as in :mod:`harness.tuning.space.paths`.
        moment: [s] less than the delivery took.

    Raises:
        InputError: a setting cannot be used, or the delivery does not drive here as it did until
            the moment.
    """
    rewound = drive_changed(task_of(run, evidence.row["episode"]), settings, moment)
    assert rewound.delivery.recording is not None
    trace = rewound.delivery.recording["trace"]
    before = evidence.trace[evidence.stamps < rewound.take_over.stamp - 1e-6]
    if not np.array_equal(trace[: len(before)], before, equal_nan=True):
        raise InputError(
            f"{run.folder}: episode {evidence.row['episode']} does not drive here as it did before "
            "the moment: other "
            "libraries, or another kind of machine; rewind it where it was driven"
        )
    return rewound


def drive_changed(task: EpisodeTask, settings: Sequence[str], moment: float) -> Rewound:
    """Drive a task with other parameters from a ``moment`` [s] on; see :func:`rewind`.

    Raises:
        InputError: a setting cannot be used, or the delivery ends before the next decision.
    """
    if not task.stack.is_nav2:
        raise InputError(
            f"--rewind: no Nav2 file decides how {task.stack.name} drives, so there is nothing to "
            "change"
        )
    parts = Parts(task)
    nav2 = parts.nav2
    changes = changes_of(nav2, settings)
    changed = with_values(
        nav2, {change.place.path: change.value for change in changes}, task.allow_unknown
    )
    rate = parts.params.physics.rate
    if steps_per_tick(changed, rate) != steps_per_tick(nav2, rate):
        raise InputError(
            "--rewind: with these frequencies time would pass in ticks of another length, which is "
            "another delivery "
            "from its start on; choose frequencies with the same ticks"
        )
    made: list[HandOver] = []

    def make(parts: Parts, world: World) -> Brain:
        first, second = (parts.navigator_by(file, world) for file in (nav2, changed))
        made.append(HandOver(first, second, moment))
        return cast(Brain, made[0])

    delivery = run_episode(task, make)
    take_over = made[0].take_over
    if take_over is None:
        raise InputError(
            f"--rewind: nothing is decided from {moment:.2f} s on; give a larger --before"
        )
    return Rewound(changes, take_over, delivery)


def changes_of(nav2: Nav2File, settings: Sequence[str]) -> tuple[Change, ...]:
    """What a user wants changed in a file; see :func:`rewind`.

    Raises:
        InputError: no such parameter, a value of the wrong kind, or a parameter given twice.
    """
    changes: dict[str, Change] = {}
    for setting in settings:
        path, _, text = (part.strip() for part in setting.partition("="))
        if not (path and text):
            raise InputError(f"--rewind '{setting}' is not PATH=VALUE, e.g. {EXAMPLE}")
        place = locate(nav2, path)
        if place.path in changes:
            raise InputError(f"--rewind: {place.path} is given twice; give it once")
        changes[place.path] = Change(place, _value(place, text))
    return tuple(changes.values())


def _value(place: ParameterPlace, text: str) -> Value:
    """A text as a value of the parameter's kind."""
    try:
        if place.kind is bool:
            value: Value = SWITCHES[text.lower()]
        else:
            value = place.kind(text)
    except (KeyError, ValueError):
        value = math.nan
    if isinstance(value, float) and not math.isfinite(value):
        raise InputError(
            f"--rewind: {place.path} is {place.value!r}; '{text}' is not {KINDS[place.kind]}"
        )
    return value
