"""The critics that price contacts with people, and the closed forms behind them."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.random import default_rng
from pytest import approx

from navstack.control.contact_risk import (
    ContactPricing,
    body_of,
    expected_contacts,
    gap_to,
    nearest,
)
from navstack.control.controller import Surroundings
from navstack.control.dwb.critics.expected_contact import ExpectedContactCritic
from navstack.control.dwb.dwb_controller import DwbController
from navstack.control.dwb.rollouts import RolloutGenerator
from navstack.control.mppi.mppi_controller import MppiController
from navstack.costmap.costmap import Costmap
from navstack.errors import ParameterError
from navstack.params.dwb import DistParams, DwbParams
from navstack.params.expected_contact import ContactPrices, DwbContactParams, MppiContactParams
from navstack.params.mppi import MppiParams
from navstack.params.mppi_critics import PathAlignParams, PathFollowParams
from navstack.types import Path, Pose2D, RobotState, Track, Twist2D

from .given import DWB, box

FOOTPRINT = box(0.14, -0.607, 0.25)
PRICES = ContactPrices()
PLAN = Path(np.array([(0.1 * k, 0.0, 0.0) for k in range(80)]))
OPEN = Costmap(np.zeros((400, 400), dtype=np.uint8), 0.05, -10.0, -10.0)


def person(x, y, vx, vy):
    return Track(0, 0.0, x, y, vx, vy, 0.3, np.diag((0.0025, 0.0025, 0.01, 0.01)))


def chance(z):
    return 1.0 / (1.0 + math.exp(1.702 * z))


def slow(x, y, yaw, dt, v, w, tracks):
    """The expected cost of one trajectory, in plain Python."""
    total = 0.0
    for one in tracks:
        worst = 0.0
        for k in range(len(x)):
            t = k * dt
            cos = math.cos(yaw[k])
            sin = math.sin(yaw[k])
            dx = one.x + t * one.vx - x[k]
            dy = one.y + t * one.vy - y[k]
            place = np.array((cos * dx + sin * dy, cos * dy - sin * dx))
            near = np.clip(place, (-0.607, -0.25), (0.14, 0.25))
            gap = math.hypot(*(place - near))
            if gap > 1e-6:
                normal = (place - near) / gap
            else:  # inside the robot: out by the nearest side
                out = np.array(
                    (place[0] - 0.14, place[1] - 0.25, -0.607 - place[0], -0.25 - place[1])
                )
                gap = out.max()
                normal = np.array(((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[out.argmax()])
            velocity = np.array((cos * one.vx + sin * one.vy, cos * one.vy - sin * one.vx))
            closing = float((np.array((v - w * near[1], w * near[0])) - velocity) @ normal)
            std = math.sqrt(0.0036 + 0.0025 + 0.01 * min(t, 2.0) ** 2) + 0.04 + 0.1 * t
            gap -= one.radius
            if gap > 4.0 * std:
                continue
            injury = np.interp(max(closing, 1.0), range(6), PRICES.contact_usd)
            price = 15.0 + chance((1.0 - closing) / 0.2) * injury
            worst = max(worst, chance(gap / std) * price)
        total += worst
    return total


def test_expected_contacts_equal_a_slow_twin():
    rng = default_rng(4)
    pricing = ContactPricing(PRICES)
    tracks = [person(*rng.uniform(1.5, 4.0, 2), *rng.uniform(-1.5, 0.5, 2)) for _ in range(3)]
    people = pricing.people(tracks, Pose2D(), 0.0)
    k = np.arange(15)
    dt = 0.12
    costs = []
    for _ in range(20):
        v = rng.uniform(0.0, 2.0)
        w = rng.uniform(-1.0, 1.0)
        yaw = w * dt * k
        x = np.cumsum(v * dt * np.cos(yaw))
        y = np.cumsum(v * dt * np.sin(yaw))
        found = expected_contacts(
            x[None],
            y[None],
            yaw[None],
            np.array((15,)),
            np.array((dt,)),
            np.array(((v,),)),
            np.array(((w,),)),
            people,
            body_of(FOOTPRINT),
            pricing.rates,
            pricing.contact_usd,
        )
        assert found[0] == approx(slow(x, y, yaw, dt, v, w, tracks))
        costs.append(found[0])
    assert np.count_nonzero(np.array(costs) > 0.1) >= 8


@pytest.mark.parametrize(
    ("point", "expected"),
    [
        ((3.0, 0.5), (1.0, 1.0, 0.0)),
        ((-5.0, -5.0), (5.0, -0.6, -0.8)),  # 3 m behind and 4 m beside
        ((1.9, 0.2), (-0.1, 1.0, 0.0)),
        ((-1.9, 0.2), (-0.1, -1.0, 0.0)),
        ((0.5, 0.9), (-0.1, 0.0, 1.0)),
        ((0.5, -0.9), (-0.1, 0.0, -1.0)),
        ((2.0, -0.5), (0.0, 1.0, 0.0)),  # on the front edge
        ((-1.5, 0.5), (-0.5, -1.0, 0.0)),  # as deep from both sides
    ],
)
def test_a_point_is_beyond_the_nearest_side_of_a_box(point, expected):
    assert gap_to.py_func(*point, 2.0, 1.0) == approx(expected)


def test_people_are_seen_where_they_are_by_now_the_nearest_first():
    """Two seconds later each is (1, -2) m farther: 5, 3, 5.1 and again 3 m away."""
    covariance = np.diag((1.0, 4.0, 3.0, 2.0)) + 0.1
    places = ((3.0, 8.0), (0.0, 1.0), (0.0, 9.1), (3.0, 4.0))
    tracks = [
        Track(i, 1.0, x, y, 0.5, -1.0, 0.2 + i, covariance) for i, (x, y) in enumerate(places)
    ]
    for most, reach, expected in (
        (9, 5.0, [1, 3, 0]),
        (9, 9.0, [1, 3, 0, 2]),
        (2, 9.0, [1, 3]),
        (9, 2.9, []),
    ):
        rows = nearest(tracks, Pose2D(1.0, 2.0), 3.0, most, reach)
        seen = [
            (places[i][0] + 1.0, places[i][1] - 2.0, 0.5, -1.0, 0.2 + i, 2.6, 2.6) for i in expected
        ]
        assert rows == approx(np.array(seen).reshape(-1, 7))


def dwb(*critics, **more):
    params = DwbParams(
        critics=("PathDist", "GoalDist", *critics),
        max_vel_x=2.0,
        max_speed_xy=2.0,
        max_vel_theta=1.2,
        acc_lim_x=4.0,
        decel_lim_x=-4.0,
        acc_lim_theta=3.5,
        decel_lim_theta=-3.5,
        PathDist=DistParams(4.0),
        GoalDist=DistParams(6.0),
        linear_granularity=0.05,
        **more,
    )
    return DwbController(params, FOOTPRINT, 20.0)


def mppi(*critics, **more):
    params = MppiParams(
        critics=("PathAlignCritic", "PathFollowCritic", *critics),
        vx_max=2.0,
        wz_max=1.2,
        PathAlignCritic=PathAlignParams(),
        PathFollowCritic=PathFollowParams(),
        prune_distance=4.0,
        **more,
    )
    controller = MppiController(params, FOOTPRINT, 20.0)
    controller.seed(default_rng(0))
    return controller


@pytest.mark.parametrize(
    ("with_critic", "without"),
    [
        (lambda: dwb("ExpectedContact", ExpectedContact=DwbContactParams(scale=50.0)), dwb),
        (
            lambda: mppi(
                "ExpectedContactCritic", ExpectedContactCritic=MppiContactParams(cost_weight=50.0)
            ),
            mppi,
        ),
    ],
)
def test_a_controller_with_the_critic_keeps_more_distance(with_critic, without):
    """Somebody comes head-on, a little to the left; distances between bodies over three seconds."""
    gaps = {}
    for make in (with_critic, without):
        controller = make()
        pose = Pose2D()
        twist = Twist2D(1.0)
        least = math.inf
        for k in range(60):
            t = 0.05 * k
            x = 5.0 - 1.2 * t
            y = 0.15
            seen = (dataclasses.replace(person(x, y, -1.2, 0.0), stamp=t),)
            twist = controller.compute_velocity(
                RobotState(pose, twist, t), PLAN, Surroundings(OPEN, seen)
            )
            yaw = pose.yaw + 0.05 * twist.angular_z
            pose = Pose2D(
                pose.x + 0.05 * twist.linear_x * math.cos(yaw),
                pose.y + 0.05 * twist.linear_x * math.sin(yaw),
                yaw,
            )
            place = np.array((x - pose.x, y - pose.y)) @ np.array(
                ((math.cos(yaw), -math.sin(yaw)), (math.sin(yaw), math.cos(yaw)))
            )
            least = min(
                least, math.hypot(*(place - np.clip(place, (-0.607, -0.25), (0.14, 0.25)))) - 0.3
            )
        gaps[make] = least
        assert controller.wants_tracks is (make is with_critic)
    assert gaps[without] < 0.0
    assert gaps[with_critic] > gaps[without] + 0.1


def test_the_decision_tells_the_critics_dollars():
    controller = dwb("ExpectedContact")
    people = (person(2.2, 0.0, -1.2, 0.0),)
    controller.compute_velocity(
        RobotState(Pose2D(), Twist2D(1.5)), PLAN, Surroundings(OPEN, people)
    )
    told = controller.decision
    assert told is not None
    (score,) = [each for each in told.scores if each.critic == "ExpectedContact"]
    assert score.raw is not None
    assert score.raw > 0.1


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ContactPrices(touch_usd=-1.0), "touch_usd -1.0 must be 0 or more"),
        (lambda: ContactPrices(speed_std=0.0), "speed_std 0.0 must be more than 0"),
        (lambda: ContactPrices(contact_usd=(1.0,)), "two prices or more"),
        (
            lambda: MppiContactParams(trajectory_point_step=0),
            "trajectory_point_step 0 must be more than 0",
        ),
    ],
)
def test_prices_that_cannot_be_are_refused(make, message):
    with pytest.raises(ParameterError, match=message):
        make()


@pytest.mark.parametrize("samples", [20, 21])
def test_dwb_sees_who_walks_into_a_robot_that_stands(samples):
    """A trajectory that stands has a pose or two: between them somebody passes through it."""
    params = dataclasses.replace(DWB, sim_time=1.0, vtheta_samples=samples)
    rollouts = RolloutGenerator(params, 20.0).generate(Pose2D(), Twist2D())
    scene = SimpleNamespace(
        tracks=[person(1.04, 0.0, -1.8, 0.0)], pose=Pose2D(), stamp=0.0, footprint=FOOTPRINT
    )
    costs = ExpectedContactCritic(DwbContactParams(), params).raw_costs(rollouts, scene)
    slowest = np.abs(rollouts.commands).sum(axis=1).argmin()
    assert (np.abs(rollouts.commands[slowest]).max() < 1e-6) == (samples == 21)
    assert costs[slowest] > 20.0
