"""The files that a task names, each read once per process."""

import dataclasses
from pathlib import Path

from harness.economics.prices import Prices, load_prices
from harness.execution.process_cache import kept
from harness.task.study import is_recording
from harness.world.outcome import Rules
from harness.world.people.replay_file import recording_text
from harness.world.physics.robot import RobotParams
from harness.world.world_params import WorldParams
from navstack.errors import InputError
from navstack.params.nav2_file.file import Nav2File, load_nav2
from navstack.params.strict import load_dataclass


@kept(8)
def nav2_parameters(path: str, allow_unknown: bool) -> Nav2File:
    """A Nav2 parameter file, read and checked."""
    return load_nav2(Path(path), allow_unknown)


@kept(2)
def prices_of(path: str) -> Prices:
    """The prices of a study."""
    return load_prices(path)


@kept(2)
def rules_of(path: str) -> Rules:
    """The rules by which deliveries end."""
    return load_dataclass(Rules, Path(path))


@kept(2)
def world_params(path: str, pedestrians: int | None, people: str | None = None) -> WorldParams:
    """A world's parameters, with the people that the user asked for.

    Args:
        path: file of ``params/worlds``.
        pedestrians: how many people; None: the world's own number.
        people: their model, or a recording of them; None: the world's own.

    Raises:
        InputError: an unknown model, or a number for a recording.
    """
    params = load_dataclass(WorldParams, Path(path))
    who = params.people
    if who.replay.file:
        recording = str((Path(path).parent / who.replay.file).resolve())
        who = dataclasses.replace(who, replay=dataclasses.replace(who.replay, file=recording))
    if people is not None and is_recording(people):
        who = dataclasses.replace(
            who, model="replay", replay=dataclasses.replace(who.replay, file=people)
        )
    elif people is not None:
        # goals in turn are for people who do not avoid each other
        choice = "random" if people == "social_force" else who.goal_choice
        who = dataclasses.replace(who, model=people, goal_choice=choice)
    if pedestrians is not None and who.model == "replay":
        raise InputError(
            f"--pedestrians {pedestrians} cannot be had from a recording, which has people of its "
            "own; leave it out, "
            "or choose --people random_walk or social_force"
        )
    if pedestrians is not None:
        who = dataclasses.replace(who, count=pedestrians)
    return dataclasses.replace(params, people=who)


def with_recording(params: WorldParams) -> tuple[WorldParams, dict[str, str]]:
    """The same world with its recording of people, if it replays one, beside its file.

    And that recording by name.
    """
    if params.people.model != "replay":
        return params, {}
    source = Path(params.people.replay.file)
    replay = dataclasses.replace(params.people.replay, file=f"people{source.suffix}")
    beside = dataclasses.replace(params, people=dataclasses.replace(params.people, replay=replay))
    return beside, {replay.file: recording_text(source)}


@kept(2)
def robot_of(path: str) -> RobotParams:
    """The robot of a stack."""
    return load_dataclass(RobotParams, Path(path))
