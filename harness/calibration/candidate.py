"""A candidate for the published world: other values of free parameters, as files that a run can take."""

import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from harness.calibration.declaration import CLASSES, Declaration, leaves, plain, present_leaves, shipped_parameters
from harness.durable_files import write_text
from harness.manifest import load_study, parameters
from harness.runs import JOURNAL
from harness.stored_run import StoredRun, load_run
from harness.study import Study, make_study
from harness.world.replay_file import recording_text
from navstack.errors import InputError
from navstack.params.strict import dump_dataclass, from_mapping, load_dataclass, load_yaml
from navstack.params.yaml_text import load_text

FRICTION, WAKE = "world.cargo.friction", "world.cargo.wake_acceleration"
LATENCY = "robot.compute_latency"
PARKED = "parked"  # the stack that asks no sensor
FILES = ("world", "robot", "sensors")  # kinds that a candidate sets


def parse_settings(texts: Sequence[str], declaration: Declaration) -> dict[str, Any]:
    """Values of free parameters from ``KEY=VALUE`` texts.

    Raises:
        InputError: a text of another form, a key that is not free or comes twice, or a value beyond its range.
    """
    settings: dict[str, Any] = {}
    for text in texts:
        key, equals, value = text.partition("=")
        if not equals:
            raise InputError(f"--set '{text}' is not KEY=VALUE, e.g. world.people.speed=1.2")
        if key in settings:
            raise InputError(f"--set {key} is given twice; give each parameter one value")
        free = declaration.require_free(key)
        settings[key] = plain(load_text(value, f"--set {key}"))
        if not free.allows(settings[key]):
            raise InputError(f"--set {text}: defensible is {free.allowed} {free.unit}".rstrip())
    return settings


def write_candidate(settings: Mapping[str, Any], folder: Path) -> dict[str, str]:
    """Write the files of a candidate; returns their paths by kind.

    Pieces of popcorn are simulated from an acceleration on that friction holds them up to, so that follows friction.

    Args:
        settings: value by key; what is not among them is as shipped.
        folder: where they go.

    Raises:
        InputError: a value that the world does not take.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = {}
    for kind in FILES:
        content = dataclasses.asdict(shipped_parameters(kind))
        for key, value in {**_followers(settings), **settings}.items():
            if key.startswith(f"{kind}."):
                _put(content, key.split(".")[1:], value)
        path = folder / f"{kind}.yaml"
        write_text(path, dump_dataclass(from_mapping(CLASSES[kind], content, f"candidate's {kind}")))
        paths[kind] = str(path)
    return paths


def candidate_study(
    stack: str, files: Mapping[str, str], episodes: int, seed: int, workers: int | None, **conditions: Any
) -> Study:
    """The deliveries of one stack in a candidate's world.

    Args:
        stack: a name of ``params/stacks``.
        files: names or files by kind; what is missing is the stack's own.
        episodes: number of deliveries.
        seed: of the run.
        workers: as in :func:`harness.study.make_study`.
        conditions: further arguments of it, such as ``map_name``.

    Raises:
        InputError: as :func:`harness.study.make_study`.
    """
    used: dict[str, Any] = {kind: file for kind, file in files.items() if not (kind == "sensors" and stack == PARKED)}
    return make_study(stacks=[stack], episodes=episodes, seed=seed, workers=workers, **used, **conditions)


def finished_run(study: Study, folder: Path) -> StoredRun | None:
    """The run of a study that a folder holds; None: it is not finished.

    Raises:
        InputError: the folder holds another study, that is other deliveries or another world, or none at all.
    """
    if is_finished(folder):
        about = load_run(str(folder)).about
        driven = (about["episodes"], about["seed"], about["map_name"])
    else:
        unfinished = load_study(folder)
        driven = (unfinished.episodes, unfinished.template.seed, unfinished.template.map_name)
    asked = (study.episodes, study.template.seed, study.template.map_name)
    for name, old, new in zip(("episodes", "seed", "map"), driven, asked, strict=True):
        if old != new:
            raise InputError(f"'{folder}' was driven with {name} {old}, not {new}; choose another --out")
    stack = study.stacks[0].name
    for name, text in parameters(study).items():
        kind = Path(name).stem.removeprefix(f"{stack}-")
        stored = folder / "params" / name
        if not stored.is_file() or not _alike(kind, stored, text):
            raise InputError(f"'{folder}' was driven with other {kind} parameters; choose another --out, or delete it")
    return load_run(str(folder)) if is_finished(folder) else None


def is_finished(folder: Path) -> bool:
    """Whether a folder holds a whole run."""
    return (folder / "episodes.parquet").is_file() and not (folder / JOURNAL).is_file()


def acts_on(key: str, stack: str) -> bool:
    """Whether a parameter can change what a stack does: who is parked asks no sensor and decides nothing."""
    return stack != PARKED or not (key.startswith("sensors.") or key == LATENCY)


def changes(run: StoredRun) -> dict[str, Any]:
    """In which values a run's world, robot and sensors differ from what is shipped; parked asks no sensor."""
    (stack,) = run.stacks
    kinds = [kind for kind in FILES if not (kind == "sensors" and stack.name == PARKED)]
    stored = {
        key: value
        for kind in kinds
        for key, value in leaves(kind, load_dataclass(CLASSES[kind], _stored(run.folder, kind, stack.name))).items()
    }
    present = present_leaves()
    differing = {key: value for key, value in stored.items() if value != present[key]}
    followers = _followers(differing)
    return {key: value for key, value in differing.items() if followers.get(key) != value}


def _stored(folder: Path, kind: str, stack: str) -> Path:
    return folder / "params" / ("world.yaml" if kind == "world" else f"{stack}-{kind}.yaml")


def _followers(settings: Mapping[str, Any]) -> dict[str, Any]:
    if FRICTION not in settings:
        return {}
    present = present_leaves()
    return {WAKE: present[WAKE] * min(1.0, settings[FRICTION] / present[FRICTION])}


def _put(content: dict[str, Any], path: Sequence[str], value: Any) -> None:
    for name in path[:-1]:
        content = content[name]
    content[path[-1]] = value


def _alike(kind: str, stored: Path, text: str) -> bool:
    """Whether a stored file means the same; a key that came later counts with its default."""
    if stored.suffix != ".yaml":
        return recording_text(stored) == text
    if kind not in CLASSES:
        return bool(load_yaml(stored) == load_text(text, kind))
    cls = CLASSES[kind]
    return bool(load_dataclass(cls, stored) == from_mapping(cls, load_text(text, kind), kind))
