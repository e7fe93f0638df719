"""Drive deliveries of stacks, or one delivery by hand."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from harness.episode.episode import RunningDelivery
from harness.episode.factory import Parts
from harness.execution.process_cache import forget, forget_changed
from harness.storage.files import nearby
from harness.storage.manifest_file import accept_changes, other_study
from harness.storage.shipped import DEFAULT_WORLD, keep_compiled_code
from harness.storage.texts import quoted
from harness.study.manifest import load_study, version_notes
from harness.study.places import Where
from harness.study.preflight import check
from harness.task.study import make_study
from navbench.api.driving import Driven, begin, drive_folder, extend, say_notes
from navbench.api.large_maps import drivable
from navbench.api.runs import Run, load
from navstack.errors import InputError


def run(
    stack: str | Sequence[str] = "nav2-gps",
    episodes: int = 20,
    *,
    seed: int = 0,
    map: str = "sidewalk",  # noqa: A002 - as the option is called
    world: str = DEFAULT_WORLD,
    out: str | Path | None = None,
    workers: int | None = None,
    **options: Any,
) -> Run:
    """Drive deliveries, as ``navbench run`` does; progress goes to standard error.

    Args:
        stack: a name of params/stacks, a stack file or a Nav2 parameter file; several drive the
            same deliveries.
        episodes: deliveries per stack.
        seed: same seed, same deliveries.
        map: a built-in map or a map_server YAML file.
        world: a name of params/worlds or a YAML file.
        out: run folder; None: ``results/<time>-<stack>``.
        workers: processes; None: one per core.
        options: the other options of the command, such as ``pedestrians``, ``people``,
            ``localizer``, ``sensors``, ``robot``, ``prices``, ``rules``, ``missions``, ``start``
            and ``goal`` (x [m], y [m], yaw [rad]), ``record``, ``substitutes``.

    Raises:
        InputError: something that was given cannot be used.
        KeyboardInterrupt: interrupted; what is finished is kept in the folder.
    """
    keep_compiled_code()
    stacks = [stack] if isinstance(stack, str) else list(stack)
    choices = {"episodes": episodes, "seed": seed, "map": map, "world": world, **options}
    path = None if out is None else Path(out)
    return _finished(drive(stacks, path, Where(workers=workers), **choices))


def resume(
    folder: str | Path,
    *,
    workers: int | None = None,
    force: bool = False,
    retry_errors: bool = False,
    episodes: int | None = None,
) -> Run:
    """Go on with an interrupted run, as ``navbench run --resume`` does.

    Args:
        folder: of the run.
        workers: processes; None: one per core.
        force: also where files of the folder were changed.
        retry_errors: also drive what ended in an error of the machine, as a map that was missing.
        episodes: deliveries per stack from now on, no fewer than it was made for; None: as many.

    Raises:
        InputError: the folder cannot be used.
        KeyboardInterrupt: interrupted; what is finished is kept in the folder.
    """
    keep_compiled_code()
    where = Where(workers=workers)
    return _finished(drive_rest(Path(folder), where, force, retry_errors, episodes))


def drive(
    stacks: Sequence[str],
    out: Path | None,
    where: Where,
    map: str = "sidewalk",  # noqa: A002 - as the option is called
    **options: Any,
) -> Driven:
    """What :func:`run` does; an interrupt ends it early.

    Raises:
        InputError: something that was given cannot be used.
    """
    forget_changed()
    study = make_study(stacks=stacks, map_name=drivable(map), workers=where.workers, **options)
    return begin(study, out, where)


def drive_rest(
    folder: Path,
    where: Where,
    is_forced: bool = False,
    retries_errors: bool = False,
    episodes: int | None = None,
) -> Driven:
    """What :func:`resume` does; an interrupt ends it early.

    Raises:
        InputError: the folder cannot be used.
    """
    path = nearby(folder.resolve())  # a link may point elsewhere before the run ends
    if known := other_study(path):
        kind, command = known
        following = f"navbench {command} --resume {quoted(path)}"
        raise InputError(f"'{path}' is {kind}; go on with {following}")
    if is_forced:
        accept_changes(path)
    study = load_study(path, where.workers)
    check(study)
    say_notes(version_notes(path))
    if episodes is not None:
        extend(path, episodes)
        study = load_study(path, where.workers)
    return drive_folder(study, path, where, retries_errors)


def _finished(driven: Driven) -> Run:
    if driven.is_interrupted:
        raise KeyboardInterrupt
    return load(driven.folder)


def make_world(
    stack: str = "nav2-gps",
    *,
    seed: int = 0,
    episode: int = 0,
    map: str = "sidewalk",  # noqa: A002 - as the option is called
    world: str = DEFAULT_WORLD,
    **options: Any,
) -> RunningDelivery:
    """A delivery that is stepped by hand.

    Look at ``observation`` and ``truth``, call ``drive``, until ``verdict``.

    Args:
        stack: whose robot and sensors drive; its navigator is there as ``brain``, and need not be
            asked.
        seed: of the deliveries.
        episode: the delivery's number, as in a run.
        map: a built-in map or a map_server YAML file.
        world: a name of params/worlds or a YAML file.
        options: as of :func:`run`.

    Raises:
        InputError: something that was given cannot be used.
    """
    forget()  # files may have changed since another delivery
    study = make_study(
        stacks=[stack],
        episodes=1,
        seed=seed,
        map_name=drivable(map),
        world=world,
        workers=1,
        **options,
    )
    task = dataclasses.replace(study.template, episode=episode)
    return RunningDelivery(task, world=Parts(task).new_world())
