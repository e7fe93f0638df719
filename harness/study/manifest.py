"""What a run folder says of its run, written and read back: a run repeats from its folder alone."""

import dataclasses
import hashlib
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from harness.episode.factory import scene_of
from harness.episode.files import nav2_parameters, prices_of, rules_of, with_recording, world_params
from harness.execution.arithmetic import machine, other_arithmetic
from harness.execution.process_cache import kept
from harness.execution.worker_check import project_digest
from harness.storage.manifest_file import (
    COUNTS,
    read_manifest,
    require_stack_name,
    require_unchanged,
)
from harness.storage.new_run import MANIFEST, OF_STACKS
from harness.storage.parameters import parameter_folder
from harness.storage.rows import Row
from harness.storage.shipped import district_files, is_district
from harness.storage.texts import clean_text
from harness.task.stack import Stack, absolute_files, policy_files, policy_module
from harness.task.study import MAX_EPISODES, EpisodeTask, Study, usable_workers
from harness.world.map.scene import Scene
from harness.world.physics.robot import RobotParams
from harness.world.sensors.suite import SensorParams
from navstack.errors import InputError
from navstack.params.nav2_file.file import Nav2File
from navstack.params.strict import dump_dataclass, from_mapping, load_dataclass

PROGRAM = "navbench"
LIBRARIES = (
    "numpy",
    "scipy",
    "numba",
    "pybullet",
    "ompl",
    "casadi",
    "filterpy",
    "shapely",
    "pyarrow",
)
OF_ONE_EPISODE = ("stack", "stack_number", "episode")  # fields of a task that a study has many of


def about(study: Study, command: Sequence[str]) -> Row:
    """Content of ``run.json``: all that running again takes, the files in ``params/`` by name."""
    task = dataclasses.asdict(study.template)
    for key in OF_ONE_EPISODE:
        del task[key]
    if study.template.people is not None:
        # of a recording, a copy of which is in params/
        task["people"] = Path(study.template.people).name
    content: Row = {
        "command": _typed(command),
        "stacks": [dataclasses.asdict(stack) | _files(stack) for stack in study.stacks],
        "episodes": study.episodes,
    }
    if study.only:
        content["only"] = list(study.only)
    if study.counts:
        content[COUNTS] = _by_name(study)
    content |= task
    for key in ("world", "rules", "prices"):
        content[key] = f"params/{key}.yaml"
    content["map_sha256"] = _digest_of(study.template.map_name)
    content["program_sha256"] = project_digest()
    policies = policy_digests(study)
    if policies:
        content["policies_sha256"] = policies
    content["versions"] = {name: version(name) for name in (PROGRAM, *LIBRARIES)}
    content["machine"] = machine()
    return content


def _by_name(study: Study) -> dict[str, int]:
    """How many deliveries each stack has."""
    return dict(zip([stack.name for stack in study.stacks], study.counts, strict=True))


def _typed(command: Sequence[str]) -> list[str]:
    """What was typed, without the folders of this machine before a program or a script.

    ``sys.argv`` has them.
    """
    script = Path(command[0]) if command else Path()
    program = ["python", str(Path(*script.parts[-2:]))] if script.suffix == ".py" else [PROGRAM]
    return [*program, *command[1:]]


def parameters(study: Study) -> dict[str, str]:
    """What the run uses, defaults and overrides filled in, by file name in ``params/``."""
    template = study.template
    world, recording = with_recording(
        world_params(template.world, template.pedestrians, template.people)
    )
    texts = {
        "world.yaml": dump_dataclass(world),
        **recording,
        "rules.yaml": dump_dataclass(rules_of(template.rules)),
        "prices.yaml": dump_dataclass(prices_of(template.prices)),
    }
    for stack in study.stacks:
        files = {key: file.removeprefix("params/") for key, file in _files(stack).items()}
        texts[files["sensors"]] = dump_dataclass(load_dataclass(SensorParams, Path(stack.sensors)))
        texts[files["robot"]] = dump_dataclass(load_dataclass(RobotParams, Path(stack.robot)))
        if stack.nav2_file:
            nav2 = nav2_parameters(stack.nav2_file, template.allow_unknown)
            texts[files["nav2_file"]] = _with_absolute_masks(nav2).dump_merged()
            texts[f"{stack.name}-ignored.txt"] = "\n".join((*nav2.warnings, *nav2.ignored, ""))
    return texts


def load_study(folder: Path, workers: int | None = None) -> Study:
    """The study of a run folder, with its own parameters instead of the files that they came from.

    Args:
        folder: of a run.
        workers: as in :func:`harness.task.study.make_study`.

    Raises:
        InputError: the folder holds no run, one of another version of this program, or one on a
            map that has changed.
    """
    require_unchanged(folder)
    content = _whole_manifest(folder)
    where = str(folder / MANIFEST)
    recorded = content.get("versions", {}).get(PROGRAM)
    if recorded != version(PROGRAM):
        raise InputError(
            f"{where}: made by {PROGRAM} {recorded}, this is {version(PROGRAM)}; resume it with "
            "that one"
        )
    names = [
        field.name for field in dataclasses.fields(EpisodeTask) if field.name not in OF_ONE_EPISODE
    ]
    stacks = tuple(_stored_stack(folder, each, where) for each in _list(content, "stacks", where))
    parameters = parameter_folder(folder.absolute())
    task = {
        **{name: content[name] for name in names if name in content},
        **{"stack": dataclasses.asdict(stacks[0]), "stack_number": 0, "episode": 0},
        **{key: str(parameters / f"{key}.yaml") for key in ("world", "rules", "prices")},
        **{"pedestrians": None, "people": None},  # world.yaml already has those that were asked for
    }
    template = from_mapping(EpisodeTask, task, where)
    episodes = content.get("episodes")
    if not isinstance(episodes, int) or not 1 <= episodes <= MAX_EPISODES:
        raise InputError(
            f"{where}: episodes: {episodes!r} is not a whole number of 1 to {MAX_EPISODES}"
        )
    if _digest_of(template.map_name) != content.get("map_sha256"):
        raise InputError(
            f"{where}: map '{template.map_name}' has changed since; restore it, or start a new run"
        )
    workers = usable_workers(workers, episodes * len(stacks))
    only = _only(content, episodes, where)
    return Study(stacks, episodes, workers, template, only, _counts(content, stacks, where))


def policy_digests(study: Study) -> dict[str, str]:
    """SHA-256 of the files of each stack's policy, by the stack's name.

    Of those only that name some.
    """
    files = {stack.name: policy_files(stack) + policy_module(stack) for stack in study.stacks}
    return {
        name: hashlib.sha256(
            b"".join(file.read_bytes() for file in own if file.is_file())
        ).hexdigest()
        for name, own in files.items()
        if own
    }


def version_notes(folder: Path) -> list[str]:
    """A note for all that is another than when the run began: then rows may differ."""
    return [
        *code_notes(folder),
        *(f"{why}: further rows may differ" for why in differences(folder)),
    ]


def code_notes(folder: Path) -> list[str]:
    """A note where the program's code or a policy's files are others than when the run began."""
    notes = []
    if not is_same_program(folder):
        notes.append(
            f"the run began with other code, parameters or maps of {PROGRAM}: "
            "further rows may differ"
        )
    known = _whole_manifest(folder).get("policies_sha256", {})
    if known and known != policy_digests(load_study(folder)):
        notes.append("the run began with other files of its policy: further rows may differ")
    return notes


def is_same_program(folder: Path) -> bool:
    """Whether a run, and each stack of a packed one, began with this code, parameters and maps."""
    content = _whole_manifest(folder)
    told = (content, *content.get(OF_STACKS, {}).values())
    return all(is_this_program(each) for each in told)


def is_this_program(said: Mapping[str, Any]) -> bool:
    """Whether deliveries of which this is said were driven by the code that is here."""
    here = project_digest()
    return bool(said.get("program_sha256", here) == here)


def differences(folder: Path) -> list[str]:
    """Why rows of a run need not come out here as stored; none: they must, to the last bit.

    Other libraries or another Python than when the run began, or a machine that computes otherwise.
    """
    content = _whole_manifest(folder)
    recorded = content["versions"]
    found = [
        f"the run began with {name} {recorded.get(name)}, this is {version(name)}"
        for name in LIBRARIES
        if recorded.get(name, version(name)) != version(name)
    ]
    if why := other_arithmetic(content.get("machine")):
        found.append(f"the run began elsewhere: {why}")
    return found


def _whole_manifest(folder: Path) -> dict[str, Any]:
    content = read_manifest(folder)
    if not isinstance(content.get("versions"), dict):
        raise InputError(
            f"{folder / MANIFEST}: is damaged; a run can be resumed from a whole one only"
        )
    return content


def _only(content: Mapping[str, Any], episodes: int, where: str) -> tuple[int, ...]:
    """The numbers of a run's deliveries where it has not the first ones."""
    only = content.get("only", [])
    if not isinstance(only, list) or not all(
        type(each) is int and 0 <= each < MAX_EPISODES for each in only
    ):
        raise InputError(f"{where}: only: {only!r} is not a list of numbers of deliveries")
    if only and len(set(only)) != episodes:
        raise InputError(
            f"{where}: only: has {len(set(only))} deliveries, but episodes says {episodes}"
        )
    return tuple(only)


def _counts(content: Mapping[str, Any], stacks: Sequence[Stack], where: str) -> tuple[int, ...]:
    """How many deliveries each stack of a run has, where they differ."""
    counts, most = content.get(COUNTS), content["episodes"]
    if counts is None:
        return ()
    names = [stack.name for stack in stacks]
    if not isinstance(counts, dict) or sorted(counts) != sorted(names):
        raise InputError(f"{where}: {COUNTS}: {counts!r} has not one number for each stack")
    if not all(type(each) is int and 1 <= each <= most for each in counts.values()):
        raise InputError(f"{where}: {COUNTS}: {counts!r} has numbers that are not 1 to {most}")
    return tuple(counts[name] for name in names)


def _list(content: Mapping[str, Any], key: str, where: str) -> list[Any]:
    value = content.get(key)
    if not isinstance(value, list) or not value:
        raise InputError(f"{where}: {key}: {value!r} is not a list of at least one entry")
    return value


def _stored_stack(folder: Path, content: Any, where: str) -> Stack:
    """A stack with its files in ``params/``, wherever the manifest says that they are."""
    stack = from_mapping(Stack, content, f"{where}: stacks")
    require_stack_name(stack.name, where)
    parameters = parameter_folder(folder.absolute())
    files = {key: str(parameters / Path(file).name) for key, file in _files(stack).items()}
    nav2_file = files.get("nav2_file", "")
    return dataclasses.replace(
        stack,
        name=clean_text(stack.name),
        sensors=files["sensors"],
        robot=files["robot"],
        nav2_file=nav2_file,
    )


def _files(stack: Stack) -> dict[str, str]:
    """Where a stack's files are in the run folder, by field of the stack."""
    files = {key: f"params/{stack.name}-{key}.yaml" for key in ("sensors", "robot")}
    return files | ({"nav2_file": f"params/{stack.name}-nav2.yaml"} if stack.nav2_file else {})


def _with_absolute_masks(nav2: Nav2File) -> Nav2File:
    """The same file with paths of maps and masks, relative to where it was, made absolute."""
    moved = {}
    for node, file in absolute_files(nav2).items():
        entries = nav2.parameters[node]
        moved[node] = {
            **entries,
            "yaml_filename": dataclasses.replace(entries["yaml_filename"], value=file),
        }
    return dataclasses.replace(nav2, parameters={**nav2.parameters, **moved})


def map_digest(scene: Scene) -> str:
    """SHA-256 of everything in a scene."""
    digest = hashlib.sha256()
    for grid in (scene.geometry, scene.walkable, scene.navigation_mesh):
        digest.update(repr((grid.resolution, grid.origin, grid.data.shape)).encode())
        digest.update(np.ascontiguousarray(grid.data).data)
    for obstacle in scene.obstacles:
        digest.update(repr((obstacle.kind, obstacle.height)).encode() + obstacle.polygon.tobytes())
    for zone in scene.zones:
        digest.update(repr((zone.kind, zone.elevation)).encode() + zone.polygon.tobytes())
    return digest.hexdigest()


_known_digest = kept(2)(map_digest)  # of the scenes that are kept themselves


def _digest_of(map_name: str) -> str:
    """SHA-256 of a map, or of the files of a district."""
    if not is_district(map_name):
        return _known_digest(scene_of(map_name))
    digest = hashlib.sha256()
    for file in district_files(Path(map_name)):
        digest.update(file.name.encode() + hashlib.sha256(file.read_bytes()).digest())
    return digest.hexdigest()
