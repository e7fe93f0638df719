"""People of the models as bodies: pushed, absent, and seen by the world."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from harness.task.mission import Mission
from harness.world.map.scene import Scene
from harness.world.people.body_params import PedestrianBodyParams
from harness.world.people.crowd import Crowd, friction_factor
from harness.world.people.models import make_pedestrians
from harness.world.people.params import ReplayParams
from harness.world.people.pedestrians import PedestrianModel
from harness.world.pybullet_world import PyBulletWorld
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.types import Pose2D, Twist2D

from ..laboratory import NoSensors, bullet

WALKABLE = OccupancyGrid(np.zeros((80, 300), dtype=np.int8), 0.1, Pose2D())
START = Pose2D(5.0, 4.0)


@pytest.fixture
def world_of(robot, params):
    """Makes worlds of given people; closes them afterwards."""
    made = []

    def make(bodies="dynamic", **people):
        who = dataclasses.replace(params.people, **people)
        kind = dataclasses.replace(params.pedestrian_bodies, kind=bodies)
        settings = dataclasses.replace(params, people=who, pedestrian_bodies=kind)
        scene = Scene("test", (), (), WALKABLE, WALKABLE)
        world = PyBulletWorld(
            scene,
            robot,
            settings,
            make_pedestrians(who, WALKABLE, robot),
            NoSensors(),
            2,
        )
        made.append(world)
        restart(world)
        return world

    yield make
    for world in made:
        world.close()


def restart(world, seed=0, start=START):
    generators = {name: np.random.default_rng(seed) for name in ("pedestrians", "cargo")}
    world.reset(Mission(start, start, 0.0), generators)


def stand(world, x, y):
    """Make the only person stand at (x, y) for good."""
    model = world._pedestrians
    model._errands.next_point[0] = model._errands.counts[0]
    model._errands.pauses[0] = 1e6
    model.displaced(0, x, y, 0.0, 0.0)


def drive(world, seconds, speed=0.0):
    truths = []
    for _ in range(round(seconds * 60)):
        world.step(Twist2D(speed))
        truths.append(world.truth)
    return truths


def test_a_model_that_takes_pushes_goes_on_from_where_its_body_is(world_of):
    """The social forces are off here, so that nobody makes way and only the body yields."""
    world = world_of(model="social_force", count=1)
    model = world._pedestrians
    model._forces = model._forces._replace(
        person_strength=0.0,
        body_stiffness=0.0,
        wall_strength=0.0,
    )
    stand(world, 6.0, 4.0)
    truths = drive(world, 3.0, speed=1.0)
    body, modelled = truths[-1].pedestrians[0], model.states[0]
    assert body[0] > 6.3
    assert np.hypot(*(body[:2] - modelled[:2])) < 0.03
    assert len(world.close_episode().contacts) >= 1
    let_go = drive(world, 2.0, speed=-1.0)[-1].pedestrians[0, 0]
    # it stays there
    assert drive(world, 2.0, speed=-1.0)[-1].pedestrians[0, 0] == pytest.approx(let_go, abs=0.01)


def test_a_body_follows_its_model_as_long_as_nobody_pushes(world_of):
    """The same walk with and without bodies: a robot that nobody touches makes no difference."""
    with_bodies, without = (
        world_of(model="social_force", count=12),
        world_of(model="social_force", count=12),
    )
    for world in (with_bodies, without):
        restart(world, seed=4)
    without._crowd.ACTIVE_RADIUS = 0.0
    ours, theirs = (
        np.array([t.pedestrians for t in drive(world, 8.0)]) for world in (with_bodies, without)
    )
    near = np.hypot(*(theirs[..., :2] - (5.0, 4.0)).transpose(2, 0, 1)) < Crowd.ACTIVE_RADIUS
    assert near.any()
    assert not with_bodies.close_episode().contacts
    assert np.median(np.abs(ours - theirs)[near]) < 0.03


def test_a_body_that_nothing_can_push_does_not_hurry_its_model(world_of):
    with_bodies, without = (world_of("kinematic", model="social_force", count=12) for _ in range(2))
    for world in (with_bodies, without):
        restart(world, seed=4)
    without._crowd.ACTIVE_RADIUS = 0.0
    ours, theirs = (
        np.array([t.pedestrians for t in drive(world, 2.0)]) for world in (with_bodies, without)
    )
    assert (
        np.hypot(*(theirs[..., :2] - (5.0, 4.0)).transpose(2, 0, 1)) < Crowd.ACTIVE_RADIUS
    ).any()
    np.testing.assert_allclose(ours, theirs, atol=1e-9)


@pytest.mark.parametrize(
    ("behind", "push_force", "force"),
    [
        # makes it up in 0.5 s
        ((0.1, -0.05, 0.0), 1e6, (900.0 * (0.6 + 0.2), 900.0 * (0.8 - 0.1), 0.0)),
        # at most at twice the walking speed
        ((1.2, 1.6, 0.1), 1e6, (900.0 * 1.2, 900.0 * 1.6, 900.0 * 0.2)),
        ((1.2, 1.6, 0.1), 300.0, (180.0, 240.0, 180.0)),  # and with the force allowed
    ],
)
def test_a_body_off_its_way_is_pushed_back(world_of, monkeypatch, behind, push_force, force):
    """A tenth of the momentum [N s] in a step of 1/120 s; 75 kg."""
    world = world_of(model="random_walk", count=1, speed=1.0)
    crowd, (x, y, *_) = world._crowd, world._pedestrians.states[0].tolist()
    crowd._push_force = push_force
    assert crowd.follow(x, y)
    (body,) = crowd.touchable
    place = x - behind[0], y - behind[1], -behind[2]
    bullet.resetBasePositionAndOrientation(body, place, (0.0, 0.0, 0.0, 1.0), world._client)
    bullet.resetBaseVelocity(body, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), world._client)
    pushes = []
    monkeypatch.setattr(bullet, "applyExternalForce", lambda *given, **more: pushes.append(given))
    assert crowd._steer(body, x, y, 0.6, 0.8) == pytest.approx((*place[:2], 0.0, 0.0))
    ((pushed, _, given, at, frame, _),) = pushes
    assert (pushed, frame) == (body, bullet.WORLD_FRAME)
    assert given == pytest.approx(force, abs=1e-6) and at == pytest.approx(place)


@pytest.mark.parametrize(
    ("ahead", "is_tilted", "is_waiting", "can_touch", "expected"),
    [
        (0.5, False, False, True, False),
        (-0.1, False, False, True, True),
        (-0.1, False, False, False, False),
        # leaning or in contact it may touch what its outline does not
        (-0.1, True, False, False, True),
        (-0.1, False, True, False, True),
    ],
)
def test_obstacles_in_reach_of_a_level_robot_are_near_where_its_outline_can_touch_them(
    world_of,
    monkeypatch,
    ahead,
    is_tilted,
    is_waiting,
    can_touch,
    expected,
):
    world = world_of(count=0)
    monkeypatch.setattr(world._obstacles, "follow", lambda *given: ahead)
    monkeypatch.setattr(world._obstacles, "can_touch", lambda *given: can_touch)
    world._is_tilted, world._book._open = is_tilted, {None: None} if is_waiting else {}
    assert world._look_around(5.0, 4.0) == (False, expected)


def test_a_body_is_given_up_far_from_the_robot_once_it_is_back_on_its_way(world_of):
    world = world_of(model="random_walk", count=1)
    crowd, (x, y, vx, vy) = world._crowd, world._pedestrians.states[0].tolist()
    assert crowd.follow(x, y)
    (body,) = crowd.touchable
    assert bullet.getBasePositionAndOrientation(body, world._client)[0] == pytest.approx(
        (x, y, 0.0)
    )
    assert bullet.getBaseVelocity(body, world._client) == (
        pytest.approx((vx, vy, 0.0)),
        (0.0, 0.0, 0.0),
    )
    bullet.resetBasePositionAndOrientation(
        body, (x + 0.04, y - 0.04, 0.0), (0.0, 0.0, 0.0, 1.0), world._client
    )
    assert crowd.follow(x + 10.0, y)
    bullet.resetBasePositionAndOrientation(
        body, (x + 0.03, y - 0.03, 0.0), (0.0, 0.0, 0.0, 1.0), world._client
    )
    assert not crowd.follow(x + 10.0, y)


@pytest.mark.parametrize(("off", "may_go"), [(0.05, False), (0.0499, True)])
def test_a_body_five_centimetres_off_its_way_is_not_yet_back(world_of, off, may_go):
    world = world_of(model="random_walk", count=1)
    crowd, (x, y) = world._crowd, world._pedestrians.states[0, :2].tolist()
    crowd.follow(x, y)
    (body,) = crowd.touchable
    crowd._model = SimpleNamespace(states=np.array([(0.0, 4.0, 0.0, 0.0)]))
    bullet.resetBasePositionAndOrientation(
        body, (off, 4.0, 0.0), (0.0, 0.0, 0.0, 1.0), world._client
    )
    assert crowd._may_go(0) is may_go


@pytest.mark.parametrize(("frame_steps", "more"), [(1, 0.0), (4, 1.0)])  # [m] of the way in a frame
@pytest.mark.parametrize(("excess", "is_near"), [(-1e-6, True), (1e-6, False)])
def test_somebody_is_near_within_what_is_closed_in_a_step(
    lab,
    robot,
    params,
    frame_steps,
    more,
    excess,
    is_near,
):
    bodies = dataclasses.replace(params.pedestrian_bodies, frame_steps=frame_steps)
    distance = robot.reach + params.people.radius + 0.1 + more + excess
    settings = dataclasses.replace(params, pedestrian_bodies=bodies)
    with lab.world(robot, settings, people=[(2.0, 0.5, 0.0, 0.0)]) as world:
        assert world._crowd.follow(0.0, 0.0)
        x, y = 2.0 - 0.6 * distance, 0.5 - 0.8 * distance
        assert world._crowd.before_step(world._body, x, y, 0) is is_near
        (motion,) = world._crowd.motions.values()
        assert (motion.position, motion.velocity) == ((2.0, 0.5, 0.0), (0.0, 0.0, 0.0))


def test_a_robot_whose_middle_lies_aside_begins_where_its_mission_does(lab, robot, params):
    """Its centre of mass is 0.2 m behind the axle's middle, its box 0.05 m to the right."""
    aside = dataclasses.replace(
        robot, footprint=((0.2, 0.2), (0.2, -0.3), (-0.6, -0.3), (-0.6, 0.2)), center_of_mass_x=-0.2
    )
    with lab.world(aside, params, start=Pose2D(1.0, 2.0, 0.7)) as world:
        pose, (x, y, z) = world.truth.pose, world._position
        cos, sin = np.cos(0.7), np.sin(0.7)
    assert (pose.x, pose.y, pose.yaw) == pytest.approx((1.0, 2.0, 0.7))
    assert (x, y, z) == pytest.approx((1.0 - 0.2 * cos, 2.0 - 0.2 * sin, 0.45))


@pytest.mark.parametrize(
    ("bodies", "model"), [("dynamic", "social_force"), ("kinematic", "random_walk")]
)
def test_a_body_that_its_model_follows_or_moves_is_given_up_at_once(world_of, bodies, model):
    world = world_of(bodies, model=model, count=1)
    crowd, (x, y) = world._crowd, world._pedestrians.states[0, :2].tolist()
    assert crowd.follow(x, y)
    (body,) = crowd.touchable
    bullet.resetBasePositionAndOrientation(
        body, (x + 0.3, y, 0.0), (0.0, 0.0, 0.0, 1.0), world._client
    )
    assert not crowd.follow(x + 10.0, y)


@pytest.mark.slow
def test_people_with_social_forces_touch_a_standing_robot_less(world_of):
    """Than people who walk on whatever they hit, in the same narrow and crowded place.

    And none of them hard.
    """
    counts = {}
    middle = Pose2D(15.0, 4.0, 0.3)
    for model in ("random_walk", "social_force"):
        world = world_of("kinematic", model=model, count=12)
        counts[model] = 0
        for seed in range(3):
            restart(world, seed, middle)
            drive(world, 30.0)
            counts[model] += len(world.close_episode().contacts)
            assert model == "random_walk" or not world.truth.counted_contacts
    assert counts["social_force"] < 0.6 * counts["random_walk"]


@pytest.mark.parametrize("bodies", ["kinematic", "dynamic"])
def test_who_goes_absent_leaves_no_body_behind(world_of, tmp_path, bodies):
    file = tmp_path / "short.csv"
    file.write_text("id,t,x,y\n1,0,7.5,4\n1,0.5,7,4\n2,1,7.5,4\n2,2,6.5,4\n")
    world = world_of(bodies, model="replay", replay=ReplayParams(str(file), loop=False))
    present = [[bool(np.isfinite(t.pedestrians[i, 0])) for i in (0, 1)] for t in drive(world, 3.0)]
    at = lambda seconds: present[round(seconds * 60)]  # noqa: E731
    assert at(0.25) == [True, False] and at(0.75) == [False, False]
    assert at(1.5) == [False, True] and at(2.5) == [False, False]
    assert not world._crowd.touchable
    assert np.isfinite(world.truth.pose.x)


def test_absent_people_can_be_driven_through(world_of, tmp_path):
    file = tmp_path / "later.csv"
    file.write_text("id,t,x,y\n1,0,6.5,4\n1,0.1,6.5,4\n2,50,6,4\n2,60,6,4\n")
    world = world_of(model="replay", replay=ReplayParams(str(file), loop=False))
    drive(world, 4.0, speed=1.5)
    assert world.truth.pose.x > 8.0 and not world.close_episode().contacts


def test_pushes_are_news_to_models_that_take_them_only():
    class Blind(PedestrianModel):
        states = np.zeros((1, 4))

        def reset(self, rng, robot):
            pass

        def step(self, dt):
            pass

    blind = Blind()
    blind.displaced(0, 1.0, 2.0, 3.0, 4.0)
    assert not blind.takes_pushes and (blind.states == 0.0).all()


@pytest.mark.parametrize(
    ("people", "robot", "together"), [(0.5, 0.4, 0.45), (0.2, 0.8, 0.5), (0.0, 0.4, 0.2)]
)
def test_frictions_are_averaged_as_physx_does(people: float, robot: float, together: float) -> None:
    bodies = PedestrianBodyParams(friction=people, friction_combine="average")
    # Bullet multiplies the two
    assert friction_factor(bodies, robot) * robot == pytest.approx(together)
    assert friction_factor(PedestrianBodyParams(friction=people), robot) == people


def test_a_robot_without_friction_has_none_with_people_either() -> None:
    assert friction_factor(PedestrianBodyParams(friction_combine="average"), 0.0) == 0.5
