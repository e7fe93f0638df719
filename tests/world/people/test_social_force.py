"""The social force model against its equations, and what people do with it."""

import cmath
import dataclasses
import math

import numpy as np
import pytest
from scipy.stats import binomtest

from harness.storage.shipped import shipped
from harness.world.people.edges import Edges, edge_distance, keep_inside
from harness.world.people.params import PedestrianParams, SocialForceParams
from harness.world.people.social_force import SocialForcePedestrians
from harness.world.people.social_force_kernels import (
    BUSY,
    LOST,
    RESTLESS,
    _heading,
    _need,
    walk_among_others,
)
from harness.world.people.social_forces import (
    force_constants,
    from_edge,
    from_person,
    from_robot,
)
from harness.world.people.walk_kernels import Walks
from harness.world.physics.body_state import BodyState
from harness.world.world_params import WorldParams
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.params.strict import load_dataclass
from navstack.types import Pose2D

DT = 1 / 120
AWAY = Pose2D(1000.0, 0.0)
SOCIAL = PedestrianParams(model="social_force", speed=1.34, speed_std=0.26)
FORCES = force_constants(SOCIAL, (0.37, 0.25), 0.5)
FRAME = np.array((-6.0, -6.0, 1.0, 0.0, 0.2))
P = SocialForceParams()


def grid_of(free, resolution=0.1):
    return OccupancyGrid(np.where(free, 0, 100).astype(np.int8), resolution, Pose2D())


def strip(length=30.0, width=4.0):
    return np.ones((round(width / 0.1), round(length / 0.1)), dtype=np.bool_)


def crossing():
    """Two ways of 4 m that cross, 30 m x 30 m."""
    free = np.zeros((300, 300), dtype=np.bool_)
    free[130:170] = True
    free[:, 130:170] = True
    return free


class Walkers:
    """People on routes that a test chooses."""

    def __init__(self, robot, states, goals, free=None, **changes):
        """``states`` (n, 4) and ``goals`` (n, 2) [m]; everybody likes to walk at 1.34 m/s."""
        people = dataclasses.replace(
            SOCIAL,
            count=len(states),
            speed_std=0.0,
            start_clearance=0.0,
            **changes,
        )
        self.model = SocialForcePedestrians(
            people, grid_of(strip() if free is None else free), robot
        )
        self.model.reset(np.random.default_rng(0), AWAY)
        errands = self.model._errands
        for i, ((x, y, vx, vy), goal) in enumerate(zip(states, goals, strict=True)):
            errands._cells[i] = errands.network.nearest_cell(*goal)
            errands.pauses[i] = 1e6
            errands.find_back(i, x, y)
            self.model.displaced(i, x, y, vx, vy)

    def walk(self, seconds, dt=DT, robot=None):
        states = [self.model.states]
        for k in range(round(seconds / dt)):
            if robot:
                self.model.see_robot(robot(k * dt))
            self.model.step(dt)
            states.append(self.model.states)
        return np.array(states)


def ellipse(r, velocity):
    """The semi-minor axis b of equation 4, from the other to the person at ``r``."""
    s = P.look_ahead * np.array(velocity)
    both = np.linalg.norm(r) + np.linalg.norm(r - s)
    return 0.5 * math.sqrt(both**2 - s @ s)


def gradient(potential, r, step=1e-6):
    offsets = step * np.eye(2)
    return np.array([(potential(r + d) - potential(r - d)) / (2 * step) for d in offsets])


@pytest.mark.parametrize("velocity", [(0.0, 0.0), (1.0, 0.0), (-0.6, 1.1)])
@pytest.mark.parametrize("r", [(0.8, 0.3), (1.9, -0.7), (-0.9, 0.2)])
def test_the_force_is_minus_the_gradient_of_the_published_potential(r, velocity):
    """Equations 3, 4 and 8 by finite differences."""
    r = np.array(r)
    force = -gradient(lambda q: 2.1 * math.exp(-ellipse(q, velocity) / 0.3), r)
    for heading in ((1.0, 0.0), (0.0, 1.0), (-0.6, -0.8)):
        seen = np.dot(heading, -force) >= np.linalg.norm(force) * math.cos(math.radians(100.0))
        expected = force if seen else 0.5 * force
        assert from_person(FORCES, *r, *heading, 0.0, 0.0, *velocity) == pytest.approx(
            expected, rel=1e-5
        )


def test_edges_push_as_published():
    """Equation 5: U = 10 exp(-d / 0.2) of the distance to the nearest edge."""
    x = (np.arange(60) + 0.5) * 0.2
    distances = np.tile(x, (60, 1))  # an edge at the left
    edges = Edges(distances, distances > 0.0, np.array((0.0, 0.0, 1.0, 0.0, 0.2)))
    for d in (0.4, 0.73, 1.5):
        force = 10.0 / 0.2 * math.exp(-d / 0.2)
        assert from_edge(FORCES, d, 6.0, edges) == pytest.approx((force, 0.0), abs=1e-9)


def test_bodies_that_overlap_are_pressed_apart():
    far = from_person(FORCES, 0.6, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    near = from_person(FORCES, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    social = 2.1 / 0.3 * (math.exp(-0.5 / 0.3) - math.exp(-0.6 / 0.3))
    assert near[0] - far[0] == pytest.approx(1500.0 * 0.1 + social)
    assert near[1] == far[1] == 0.0


def test_two_who_meet_exactly_head_on_keep_right():
    """There the gradient jumps; one rule for both, so that they do not dodge to the same side."""
    assert from_person(FORCES, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.3, 0.0) == pytest.approx((0.0, 7.0))
    assert from_person(FORCES, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, -1.3, 0.0) == pytest.approx(
        (0.0, -7.0)
    )


def test_the_robot_is_a_person_of_its_size_with_a_rectangular_body():
    robot = np.array((0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    circle = math.hypot(0.37, 0.25)
    force = 7.0 * math.exp(-(1.2 - (circle - 0.3)) / 0.3)
    assert from_robot(FORCES, 1.2, 0.0, 0.0, 0.0, -1.0, 0.0, robot, True) == pytest.approx(
        (force, 0.0)
    )
    for (x, y), direction in (
        ((0.6, 0.1), (1.0, 0.0)),
        ((0.1, -0.5), (0.0, -1.0)),
        ((0.3, 0.0), (1.0, 0.0)),
    ):
        push = from_robot(FORCES, x, y, *np.zeros(4), robot, True)
        soft = from_robot(FORCES._replace(body_stiffness=0.0), x, y, *np.zeros(4), robot, True)
        assert np.subtract(push, soft) / np.linalg.norm(np.subtract(push, soft)) == pytest.approx(
            direction
        )
    assert from_robot(FORCES, 0.6, 0.1, *np.zeros(4), robot, True)[0] > 1500.0 * (0.37 + 0.3 - 0.6)


@pytest.mark.parametrize("yaw", [0.0, 0.4, -2.0])
@pytest.mark.parametrize(
    ("place", "direction", "overlap"),
    [
        ((0.6, 0.1), (1.0, 0.0), 0.07),
        ((-0.1, 0.5), (0.0, 1.0), 0.05),
        ((0.47, -0.35), (math.sqrt(0.5), -math.sqrt(0.5)), 0.3 - 0.1 * math.sqrt(2.0)),
        ((-0.3, 0.1), (-1.0, 0.0), 0.3 + 0.07),  # from here on the centre is inside
        ((0.05, 0.1), (0.0, 1.0), 0.3 + 0.15),
        ((0.3, -0.2), (0.0, -1.0), 0.3 + 0.05),
    ],
)
def test_its_body_presses_out_by_the_nearest_side(place, direction, overlap, yaw):
    cos, sin = math.cos(yaw), math.sin(yaw)
    turn = np.array(((cos, -sin), (sin, cos)))
    robot = np.array((2.0, -1.0, cos, sin, 0.0, 0.0))
    push = from_robot(FORCES, *(turn @ place + (2.0, -1.0)), 0.0, 0.0, 1.0, 0.0, robot, False)
    assert push == pytest.approx(tuple(1500.0 * overlap * turn @ direction), abs=1e-9)


def test_what_counts_of_the_robot_is_its_relative_motion():
    """Walking towards it is as its coming."""
    still, coming = (
        np.array((0.0, 0.0, 1.0, 0.0, 0.0, 0.0)),
        np.array((0.0, 0.0, 1.0, 0.0, 1.2, 0.3)),
    )
    assert from_robot(FORCES, 2.0, 0.4, -1.2, -0.3, -1.0, 0.0, still, True) == pytest.approx(
        from_robot(FORCES, 2.0, 0.4, 0.0, 0.0, -1.0, 0.0, coming, True)
    )


@pytest.mark.parametrize("turn", [0.5, 1.0, 1.5])
def test_from_every_side_it_is_noticed_at_the_same_distance(turn):
    """A robot at 1.5 m/s, turned about the person, pushes with the same force, turned alike."""
    cos, sin = math.cos(turn * math.pi), math.sin(turn * math.pi)
    forces = []
    for c, s in ((1.0, 0.0), (cos, sin)):
        coming = np.array((-4.0 * c, -4.0 * s, c, s, 1.5 * c, 1.5 * s))
        fx, fy = from_robot(
            FORCES._replace(robot_range=0.2),
            0.0,
            0.0,
            0.0,
            0.0,
            -c,
            -s,
            coming,
            True,
        )
        forces.append((c * fx + s * fy, c * fy - s * fx))
    assert math.hypot(*forces[0]) > 0.0
    assert forces[1] == pytest.approx(forces[0], rel=1e-9)


def test_the_robots_middle_and_velocity_are_seen_in_the_map(robot):
    """Complex numbers: turned by the yaw, its middle is 0.1 m behind its base and 0.05 m right."""
    aside = dataclasses.replace(
        robot, footprint=((0.5, 0.2), (0.5, -0.3), (-0.7, -0.3), (-0.7, 0.2))
    )
    model = SocialForcePedestrians(dataclasses.replace(SOCIAL, count=1), grid_of(strip()), aside)
    model.see_robot(BodyState(3.0, 2.0, 0.7, 1.1, -0.4))
    turn = cmath.exp(0.7j)
    seen = 3.0 + 2.0j + turn * (-0.1 - 0.05j), turn, turn * (1.1 - 0.4j)
    assert model._robot == pytest.approx([part for each in seen for part in (each.real, each.imag)])


def measured():
    """Forces of params/worlds/measured.yaml."""
    people = load_dataclass(WorldParams, shipped("params") / "worlds" / "measured.yaml").people
    return people, force_constants(people, (0.37, 0.25), 0.5)


def test_the_measured_forces_are_those_of_the_fit():
    """A exp((d - r) / B) (lambda + (1 - lambda) (1 + cos phi) / 2), Agrawal et al. 2024.

    A, B and lambda are 2, 0.89 and 0.4 of people; A and B of the robot are 7.93 and 0.99.
    """
    people, forces = measured()
    assert people.radius == 0.3
    for r in ((1.1, 0.4), (-0.7, 1.6), (2.0, -2.5)):
        distance = np.linalg.norm(r)
        away = np.divide(r, distance)
        for heading in ((1.0, 0.0), (-0.6, 0.8)):
            weight = 0.4 + 0.6 * (1.0 - np.dot(heading, away)) / 2.0
            expected = 2.0 * math.exp((0.6 - distance) / 0.89) * weight * away
            assert from_person(forces, *r, *heading, 0.0, 0.0, 0.4, -1.1) == pytest.approx(
                expected, rel=1e-3
            )
            robot = np.array((0.0, 0.0, 1.0, 0.0, 1.5, 0.2))
            both = 0.3 + math.hypot(0.37, 0.25)
            expected = 7.93 * math.exp((both - distance) / 0.99) * away
            assert from_robot(forces, *r, -0.8, 0.5, *heading, robot, True) == pytest.approx(
                expected, rel=1e-3
            )


def test_who_does_not_notice_the_robot_is_only_pushed_by_it():
    _, forces = measured()
    robot = np.array((0.0, 0.0, 1.0, 0.0, 0.0, 0.0))
    assert from_robot(forces, 1.2, 0.0, -1.0, 0.0, -1.0, 0.0, robot, False) == (0.0, 0.0)
    assert from_robot(forces, 0.6, 0.0, -1.0, 0.0, -1.0, 0.0, robot, False) == pytest.approx(
        (1500.0 * 0.07, 0.0)
    )


def test_the_share_of_people_who_notice_nothing(robot):
    """Drawn anew for each delivery, from its generator; nobody else is drawn where all notice."""
    people, _ = measured()
    model = SocialForcePedestrians(dataclasses.replace(people, count=200), grid_of(strip()), robot)
    unaware = []
    for seed in range(20):
        model.reset(np.random.default_rng(seed), Pose2D())
        unaware.append(200 - model._aware.sum())
    assert len(set(unaware)) > 5
    assert binomtest(int(sum(unaware)), 4000, 0.073).pvalue > 0.01


def test_where_all_notice_the_robot_nobody_is_drawn_for_it(robot):
    model = SocialForcePedestrians(dataclasses.replace(SOCIAL, count=3), grid_of(strip()), robot)
    drawn, expected = np.random.default_rng(3), np.random.default_rng(3)
    model.reset(drawn, Pose2D())
    model.errands.reset(expected, Pose2D())
    assert drawn.random() == expected.random()


def twin(forces, robot, corners, speeds, states, edges):
    """The kernel in slow numpy: everybody walks, nobody arrives; one step of DT."""
    after = np.empty_like(states)
    for i, (x, y, vx, vy) in enumerate(states):
        e = (corners[i] - (x, y)) / np.linalg.norm(corners[i] - (x, y))
        total = (speeds[i] * e - (vx, vy)) / forces.relaxation_time
        for j, other in enumerate(states):
            if j != i:
                total = total + from_person(forces, x, y, *e, *other)
        total = (
            total
            + from_robot(forces, x, y, vx, vy, *e, robot, True)
            + from_edge(forces, x, y, edges)
        )
        velocity = np.array((vx, vy)) + DT * total
        speed = np.linalg.norm(velocity)
        velocity *= min(1.0, forces.top_speed * speeds[i] / speed)
        after[i] = keep_inside(x, y, *velocity, DT, forces.edge_distance, edges)
    return after


def test_the_kernel_equals_a_slow_twin():
    rng = np.random.default_rng(7)
    n = 12
    states = np.hstack((rng.uniform(-3.0, 3.0, (n, 2)), rng.normal(0.0, 0.8, (n, 2))))
    corners = rng.uniform(-5.0, 5.0, (n, 2)) + (20.0, 0.0)
    speeds = rng.uniform(0.8, 1.6, n)
    robot = np.array((0.3, -0.2, math.cos(0.4), math.sin(0.4), 1.1, 0.3))
    edges = Edges(rng.uniform(0.5, 1.5, (60, 60)), np.ones((60, 60), dtype=np.bool_), FRAME)
    after, needs = np.empty((n, 4)), np.empty(n, dtype=np.int64)
    counts, zeros = np.ones(n, dtype=np.int64), np.zeros(n, dtype=np.int64)
    walks = Walks(corners[:, None].copy(), counts, zeros, np.zeros(n), speeds)
    aware = np.ones(n, dtype=np.bool_)
    walk_among_others(DT, FORCES, robot, aware, walks, np.ones(n), states, edges, after, needs)
    np.testing.assert_allclose(
        after, twin(FORCES, robot, corners, speeds, states, edges), rtol=1e-12
    )
    assert (needs == 0).all()


@pytest.mark.parametrize(
    ("begun", "place", "corner", "heading"),
    [
        (0, (0.0, 0.49), 1, (0.0, 1.0)),  # within half a metre of the corner: on to the next one
        (0, (0.3, 0.4), 1, (-0.3 / math.hypot(0.3, 1.6), 1.6 / math.hypot(0.3, 1.6))),
        (0, (0.0, 0.51), 0, (0.0, -1.0)),
        (1, (0.0, 0.99), 1, (0.0, 1.0)),
        (1, (0.6, 1.2), 2, (0.0, 0.0)),  # within a metre of the end of the path: there
        (1, (0.0, 3.01), 1, (0.0, -1.0)),
    ],
)
def test_corners_and_the_goal_are_reached_from_a_distance(begun, place, corner, heading):
    points = np.array((((9.0, 9.0), (9.0, 9.0)), ((0.0, 0.0), (0.0, 2.0))))
    walks = Walks(points, np.array((2, 2)), np.array((0, begun)), np.zeros(2), np.ones(2))
    states = np.array(((5.0, 5.0, 0.0, 0.0), (*place, 0.0, 0.0)))
    assert _heading.py_func(1, walks, states) == pytest.approx(heading)
    assert walks.next_point.tolist() == [0, corner]


@pytest.mark.parametrize(
    ("next_point", "pause", "look", "is_open", "need", "after"),
    [
        (1, 0.3, 9.0, True, BUSY, (0.2, 9.0)),  # stands
        (1, 0.1, 9.0, True, RESTLESS, (0.0, 9.0)),
        (0, 0.1, 0.2, False, BUSY, (0.1, 0.1)),  # does not look yet
        (0, 0.1, 0.1, False, LOST, (0.1, 0.5)),
        (0, 0.1, 0.05, True, BUSY, (0.1, 0.45)),
    ],
)
def test_what_somebody_needs(next_point, pause, look, is_open, need, after):
    """A wall between the person and the corner, or none.

    Looks are half a second apart, a step takes 0.1 s.
    """
    walkable = np.ones((60, 60), dtype=np.bool_)
    walkable[:, 30] = is_open
    walks = Walks(
        np.array((((2.0, 0.1),),)),
        np.ones(1, int),
        np.array((next_point,)),
        np.array((pause,)),
        np.ones(1),
    )
    looks, edges = np.array((look,)), Edges(np.ones((60, 60)), walkable, FRAME)
    assert _need.py_func(0, 0.1, walks, looks, np.array(((-2.0, 0.1, 0.0, 0.0),)), edges) == need
    assert (walks.pauses[0], looks[0]) == pytest.approx(after, abs=1e-12)


def test_alone_in_the_open_everybody_walks_at_the_own_speed(robot):
    walkers = Walkers(robot, [(2.0, 2.0, 0.0, 0.0)], [(28.0, 2.0)])
    states = walkers.walk(8.0)
    speed = np.hypot(*states[:, 0, 2:].T)
    expected = 1.34 * (1.0 - np.exp(-np.arange(len(speed)) * DT / 0.5))  # equation 2 alone
    assert np.abs(speed - expected).max() < 0.02


def test_two_who_meet_pass_without_touching(robot):
    walkers = Walkers(
        robot, [(5.0, 2.0, 1.34, 0.0), (25.0, 2.0, -1.34, 0.0)], [(28.0, 2.0), (2.0, 2.0)]
    )
    states = walkers.walk(15.0)
    assert np.hypot(*(states[:, 0, :2] - states[:, 1, :2]).T).min() > 0.59
    assert states[-1, 0, 0] > 20.0 and states[-1, 1, 0] < 10.0


def test_people_step_aside_for_the_robot(robot):
    """It drives at 1.5 m/s towards somebody who stands in its way."""
    way = lambda t: BodyState(4.0 + 1.5 * t, 2.0, 0.0, 1.5)  # noqa: E731
    standing = Walkers(robot, [(15.0, 2.05, 0.0, 0.0)], [(15.0, 2.05)])
    states = standing.walk(9.0, robot=way)
    nearest = min(
        math.dist((4.0 + 1.5 * k * DT + robot.center[0], 2.0 + robot.center[1]), state[0, :2])
        for k, state in enumerate(states)
    )
    assert nearest > robot.half_size[1] + 0.3 - 0.02
    assert abs(states[-1, 0, 1] - 2.05) > 0.3


def test_people_walk_around_a_standing_robot(robot):
    walkers = Walkers(robot, [(5.0, 2.0, 1.34, 0.0)], [(28.0, 2.0)])
    states = walkers.walk(20.0, robot=lambda t: BodyState(15.0, 1.95))
    dx = np.abs(states[:, 0, 0] - 15.0 - robot.center[0]) - robot.half_size[0]
    dy = np.abs(states[:, 0, 1] - 1.95 - robot.center[1]) - robot.half_size[1]
    assert np.hypot(np.maximum(dx, 0.0), np.maximum(dy, 0.0)).min() > 0.3 - 0.02
    assert states[-1, 0, 0] > 26.0


@pytest.mark.parametrize("count", [20, 40])
def test_nobody_leaves_the_walkable_ground_or_gets_stuck(robot, count):
    free = crossing()
    model = SocialForcePedestrians(dataclasses.replace(SOCIAL, count=count), grid_of(free), robot)
    model.reset(np.random.default_rng(1), AWAY)
    states = []
    for _ in range(round(60.0 / DT)):
        model.step(DT)
        states.append(model.states)
    states = np.array(states)
    assert np.isfinite(states).all()
    columns, rows = (
        np.floor(states[..., 0] / 0.1).astype(int),
        np.floor(states[..., 1] / 0.1).astype(int),
    )
    assert free[rows, columns].all()
    assert np.hypot(states[..., 2], states[..., 3]).max() <= 1.3 * 1.5 * 1.34 + 1e-9
    moved = np.hypot(*(states[-1, :, :2] - states[:-1, :, :2]).transpose(2, 0, 1)).max(axis=0)
    assert moved.min() > 3.0


def test_crowds_do_not_push_anybody_through_an_edge(robot):
    """Thirty people behind each other in a blind alley, all wanting through its end."""
    free = strip(20.0, 2.0)
    model = SocialForcePedestrians(dataclasses.replace(SOCIAL, count=30), grid_of(free), robot)
    model.reset(np.random.default_rng(3), AWAY)
    errands = model._errands
    errands.points[:, 0] = (60.0, 1.0)
    errands.counts[:], errands.next_point[:] = 1, 0
    errands.find_back = errands.set_out = lambda *_: None
    states = []
    for _ in range(round(30.0 / DT)):
        model.step(DT)
        states.append(model.states[:, :2])
    states = np.array(states)
    assert states[-1, :, 0].max() > 18.0
    assert (states >= 0.2).all() and (states <= (19.8, 1.8)).all()


def test_it_is_stable_at_the_physics_rate(robot):
    """Half the step changes little until people have met; overlapping bodies do not fly apart."""
    meet = [
        (5.0, 2.1, 1.34, 0.0),
        (12.0, 1.9, -1.34, 0.0),
        (8.0, 2.0, 0.0, 0.0),
        (8.3, 2.0, 0.0, 0.0),
    ]
    goals = [(28.0, 2.0), (2.0, 2.0), (8.0, 2.0), (8.3, 2.0)]
    coarse = Walkers(robot, meet, goals).walk(6.0)
    fine = Walkers(robot, meet, goals).walk(6.0, dt=DT / 4)[::4]
    np.testing.assert_allclose(
        coarse[: round(2.0 / DT), :, :2], fine[: round(2.0 / DT), :, :2], atol=0.05
    )
    assert np.hypot(coarse[..., 2], coarse[..., 3]).max() <= 1.3 * 1.34 + 1e-9
    assert np.hypot(*(coarse[-1, 2, :2] - coarse[-1, 3, :2])) > 0.59


def test_long_steps_are_divided(robot):
    meet, goals = [(5.0, 2.1, 1.34, 0.0), (12.0, 1.9, -1.34, 0.0)], [(28.0, 2.0), (2.0, 2.0)]
    one = Walkers(robot, meet, goals).walk(3.0, dt=0.1)
    many = Walkers(robot, meet, goals).walk(3.0, dt=1 / 60)[::6]
    np.testing.assert_allclose(one, many, atol=1e-9)


def test_somebody_pushed_around_a_corner_finds_a_new_way(robot):
    walkers = Walkers(robot, [(15.0, 2.0, 0.0, 0.0)], [(15.0, 28.0)], free=crossing())
    walkers.walk(1.0)
    walkers.model.displaced(0, 28.0, 15.0, 0.0, 0.0)
    states = walkers.walk(25.0)
    assert math.dist(states[-1, 0, :2], (15.0, 28.0)) < 1.5


def test_who_was_pushed_off_the_walkable_ground_comes_back(robot):
    walkers = Walkers(robot, [(5.0, 2.0, 0.0, 0.0)], [(28.0, 2.0)])
    walkers.model.displaced(0, 5.0, -0.15, 0.0, -0.5)
    states = walkers.walk(4.0)
    assert edge_distance(*states[0, 0, :2], walkers.model._edges) < 0.0
    assert edge_distance(*states[-1, 0, :2], walkers.model._edges) > 0.3


def test_goals_and_speeds_do_not_depend_on_the_others(robot):
    """Common random numbers: what somebody wants is the same in a crowd of any size."""
    few, many = (
        SocialForcePedestrians(dataclasses.replace(SOCIAL, count=count), grid_of(crossing()), robot)
        for count in (3, 30)
    )
    for model in (few, many):
        model.reset(np.random.default_rng(5), AWAY)
    assert np.array_equal(few.states, many.states[:3])
    assert np.array_equal(few._errands.speeds, many._errands.speeds[:3])
    assert np.array_equal(few._errands._cells, many._errands._cells[:3])
