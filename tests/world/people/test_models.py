"""What holds for every model of people, and how a user chooses one."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from harness.episode.files import with_recording, world_params
from harness.storage.shipped import shipped
from harness.task.study import make_study
from harness.world.people.models import PEDESTRIAN_MODELS, make_pedestrians
from harness.world.people.params import (
    MODEL_NAMES,
    PedestrianParams,
    ReplayParams,
    SocialForceParams,
)
from harness.world.physics.body_state import BodyState
from harness.world.world_params import WorldParams
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import InputError, ParameterError, UnknownNameError
from navstack.params.strict import dump_dataclass, load_dataclass
from navstack.types import Pose2D

DT = 1 / 120
AWAY = Pose2D(1000.0, 0.0)
PARALLEL = "id,t,x,y\n" + "".join(
    f"{person},{time},{2.0 + time},{1.0 + person}\n" for person in range(3) for time in range(6)
)


@pytest.fixture(scope="module", params=MODEL_NAMES)
def model(request, robot, tmp_path_factory):
    file = tmp_path_factory.mktemp("people") / "parallel.csv"
    file.write_text(PARALLEL)
    people = PedestrianParams(model=request.param, count=12, replay=ReplayParams(str(file)))
    square = OccupancyGrid(np.zeros((400, 400), dtype=np.int8), 0.05, Pose2D())
    return make_pedestrians(people, square, robot)


def record(model, seed, seconds=4.0, robot=AWAY):
    model.reset(np.random.default_rng(seed), robot)
    states = [model.states]
    for _ in range(round(seconds / DT)):
        model.see_robot(BodyState(robot.x, robot.y))
        model.step(DT)
        states.append(model.states)
    return np.array(states)


def test_the_table_and_the_names_in_files_agree():
    assert tuple(PEDESTRIAN_MODELS) == MODEL_NAMES


def test_the_same_seed_gives_the_same_people_bit_for_bit(model):
    first = record(model, 1)
    other = record(model, 2)
    assert np.array_equal(first, record(model, 1))
    assert not np.array_equal(first, other)


def test_states_given_away_do_not_change(model):
    model.reset(np.random.default_rng(0), AWAY)
    before = model.states
    copy = before.copy()
    for _ in range(30):
        model.step(DT)
    assert np.array_equal(before, copy)
    assert not np.array_equal(model.states, copy)


def test_velocities_are_those_of_the_motion(model):
    """Where nobody turns at once, arrives or appears, a step is the velocity times its time."""
    change = 0.05  # [m/s] at most in a step
    states = record(model, 3)
    there = np.isfinite(states).all(axis=2)
    states[~there] = np.nan
    moved = np.diff(states[..., :2], axis=0)
    steady = (
        (np.abs(np.diff(states[..., 2:], axis=0)) < change).all(axis=2) & there[1:] & there[:-1]
    )
    assert steady.sum() > 100
    np.testing.assert_allclose(moved[steady], states[1:][steady][:, 2:] * DT, atol=change * DT)


def test_nobody_is_near_the_robot_at_the_start(model):
    for seed in range(20):
        model.reset(np.random.default_rng(seed), Pose2D(4.0, 2.0))
        assert np.hypot(*(model.states[:, :2] - (4.0, 2.0)).T).min() >= 2.0


def test_who_is_absent_is_infinitely_far_and_still(model):
    states = record(model, 5, seconds=8.0).reshape(-1, 4)
    absent = ~np.isfinite(states).all(axis=1)
    assert (states[absent] == (np.inf, np.inf, 0.0, 0.0)).all()


def test_the_published_world_is_what_parameters_default_to():
    """So that other world files need to hold only what differs."""
    assert load_dataclass(WorldParams, shipped("params") / "worlds" / "easy.yaml") == WorldParams()


def test_the_social_world_makes_way_and_can_be_pushed():
    social = load_dataclass(WorldParams, shipped("params") / "worlds" / "social.yaml")
    assert social.people.model == "social_force"
    assert social.pedestrian_bodies.kind == "dynamic"
    assert social.contacts == WorldParams().contacts


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: PedestrianParams(model="walk"), "did you mean 'random_walk'"),
        (
            lambda: SocialForceParams(relaxation_time=0.0),
            "relaxation_time 0.0 must be more than 0",
        ),
        (lambda: SocialForceParams(body_stiffness=1e6), "must be 0 to 10000"),
        (lambda: SocialForceParams(wall_strength=-1.0), "wall_strength -1.0 must be 0 or more"),
        (lambda: ReplayParams(frame_rate=0.0), "frame_rate 0.0 must be more than 0"),
    ],
)
def test_impossible_parameters_are_refused(make, message):
    with pytest.raises((ParameterError, UnknownNameError), match=message):
        make()


def study(**choices):
    return make_study(stacks=["parked"], episodes=1, workers=1, **choices)


def chosen(**choices):
    task = study(**choices).template
    return world_params(task.world, task.pedestrians, task.people).people


def test_people_are_chosen_on_the_command_line(tmp_path):
    assert chosen().model == "random_walk"
    assert chosen(people="social_force").speed == 1.0
    assert chosen(world="social_force").speed == 1.34
    assert chosen(world="social_force", pedestrians=3).count == 3
    file = tmp_path / "people.csv"
    file.write_text(PARALLEL)
    replayed = chosen(people=str(file))
    assert (replayed.model, replayed.replay.file) == ("replay", str(file))


def test_a_recording_is_found_beside_its_world_file(tmp_path):
    (tmp_path / "people.csv").write_text(PARALLEL)
    world = tmp_path / "mine.yaml"
    world.write_text(
        "people: {model: replay, replay: {file: people.csv, placement: {x: 1.0, y: 2.0, "
        "yaw: 0.0}}}\n"
    )
    replayed = chosen(world=str(world))
    assert Path(replayed.replay.file) == tmp_path / "people.csv"
    assert replayed.replay.placement == Pose2D(1.0, 2.0)


def test_a_run_folder_holds_the_recording(tmp_path):
    (tmp_path / "source.csv").write_text(PARALLEL)
    task = study(people=str(tmp_path / "source.csv")).template
    world, texts = with_recording(world_params(task.world, None, task.people))
    folder = tmp_path / "params"
    folder.mkdir()
    for name, text in {"world.yaml": dump_dataclass(world), **texts}.items():
        (folder / name).write_text(text)
    again = world_params(str(folder / "world.yaml"), None).people
    assert Path(again.replay.file).read_text() == PARALLEL
    assert dataclasses.replace(again.replay, file="") == dataclasses.replace(
        world.people.replay, file=""
    )


@pytest.mark.parametrize(
    ("choices", "message"),
    [
        (
            {"people": "socialforce"},
            "unknown model of people 'socialforce'; did you mean 'social_force'",
        ),
        ({"world": "socal"}, "unknown world 'socal'; did you mean 'social_force'"),
        (
            {"people": "some.csv", "pedestrians": 3},
            "--pedestrians 3 cannot be had from a recording",
        ),
    ],
)
def test_bad_choices_are_refused_in_one_line(choices, message):
    with pytest.raises(InputError, match=message) as caught:
        chosen(**choices)
    assert "\n" not in str(caught.value)
