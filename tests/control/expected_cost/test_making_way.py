"""Who makes way: made-up people, tracked with noise, and what the controller makes of it."""

import dataclasses
import math

import numpy as np
import pytest
from numpy.random import default_rng
from pytest import approx

from navstack.control.contact_risk import body_of
from navstack.control.controller import Surroundings
from navstack.control.expected_cost.making_way import (
    MakingWay,
    distances_apart,
    force_on,
    log_likelihood_ratio,
    of_the_place,
)
from navstack.types import Path, Pose2D, RobotState, Track, Twist2D

from .expected_cost_twin import FOOTPRINT, PARAMS, prediction, street
from .test_expected_cost import make

PRIOR = 0.5  # that most people make way
UNKNOWN = 0.46  # how likely a stranger makes way then: half of 2 %, and half of 90 %
DT = 1.0 / 15.0  # [s]
NOISE = 0.05  # [m/s] of a track's velocity
ROBOT_SPEED = 1.0  # [m/s] along x
LASTS = 6.0  # [s] of an encounter
RELAXATION = 0.6  # [s] of the social force model
RADII = 0.3 + math.hypot(0.3735, 0.25)  # [m] of a person and of the robot


def straight(t, place, velocity, away):
    """A velocity (2,) that does not change."""
    return velocity


def swerving(t, place, velocity, away):
    """The social force model: back to 1.3 m/s along -x, and away from the robot."""
    return velocity + DT * ((np.array((-1.3, 0.0)) - velocity) / RELAXATION + away)


def circling(t, place, velocity, away):
    turn = 0.5 * DT
    rotation = ((math.cos(turn), -math.sin(turn)), (math.sin(turn), math.cos(turn)))
    return np.array(rotation) @ velocity


def stopping(t, place, velocity, away):
    if t > 2.0:
        return np.zeros(2)
    return velocity


def meet(
    estimator,
    rng,
    walk,
    number=0,
    place=(8.0, 0.1),
    velocity=(-1.3, 0.0),
    begins=0.0,
    beside=None,
):
    """An encounter; how likely the person makes way (n,) after each cycle.

    ``beside`` (2,) [m] is where somebody else walks, from this person.
    """
    place = np.array(place)
    velocity = np.array(velocity)
    found = []
    for n in range(round(LASTS / DT)):
        stamp = begins + n * DT
        pose = Pose2D(ROBOT_SPEED * n * DT, 0.0, 0.0)
        centre = np.array((pose.x - 0.2335, 0.0))
        away = np.array(force_on(*(place - centre), RADII))
        velocity = walk(n * DT, place, velocity, away)
        place = place + DT * velocity
        seen = velocity + rng.normal(0.0, NOISE, 2)
        track = Track(number, stamp, *place, *seen, 0.3, np.eye(4))
        tracks = [track]
        if beside is not None:
            tracks.append(
                dataclasses.replace(track, id=98, x=track.x + beside[0], y=track.y + beside[1])
            )
        estimator.observe(tracks, pose, stamp)
        found.append(estimator.chances(tracks)[0])
    return np.array(found)


def estimator():
    return MakingWay(body_of(FOOTPRINT), PRIOR)


@pytest.mark.parametrize("seed", range(10))
def test_who_swerves_is_recognised_before_the_robot_passes(seed):
    """They would meet after 3.1 s."""
    found = meet(estimator(), default_rng(seed), swerving)
    assert found[: round(1.0 / DT)].max() < 0.55, "far away hardly anything is seen"
    assert found[round(3.1 / DT) :].min() > 0.8


@pytest.mark.parametrize("seed", range(20))
def test_who_walks_straight_at_the_robot_is_never_recognised(seed):
    found = meet(estimator(), default_rng(seed), straight)
    assert found.max() < 0.7
    assert found[-1] < 0.25


@pytest.mark.parametrize(("walk", "most"), [(straight, 2), (stopping, 2), (circling, 20)])
def test_who_does_not_see_the_robot_is_hardly_ever_taken_for_one_who_does(walk, most):
    """At most so many of 100, at any time of any encounter; circles are those of a hasty turn."""
    rng = default_rng(3)
    fooled = 0
    for _ in range(100):
        heading = rng.uniform(-math.pi, math.pi)
        velocity = rng.uniform(0.0, 1.5) * np.array((math.cos(heading), math.sin(heading)))
        place = rng.uniform((0.5, -4.0), (6.0, 4.0))
        found = meet(estimator(), rng, walk, place=place, velocity=velocity)
        fooled += found.max() > 0.8
    assert fooled <= most


def test_who_stands_by_shows_nothing():
    found = meet(estimator(), default_rng(2), straight, place=(3.0, 1.5), velocity=(0.0, 0.0))
    assert found.max() < 0.7


def test_those_who_were_met_tell_what_to_expect_of_the_others():
    """Two who swerve show a place where people do; four who walk straight on take it back."""
    rng = default_rng(5)
    found = estimator()
    stranger = Track(99, 0.0, 50.0, 0.0, 0.0, 0.0, 0.3, np.eye(4))
    assert found.chances((stranger,))[0] == approx(UNKNOWN)
    for number in range(2):
        meet(found, rng, swerving, number, begins=10.0 * number)
    assert found.chances((stranger,))[0] > 0.8
    for number in range(2, 6):
        meet(found, rng, straight, number, begins=10.0 * number)
    assert found.chances((stranger,))[0] < 0.1
    found.reset()
    assert found.chances((stranger,))[0] == approx(UNKNOWN)


def test_the_evidence_is_bayes_rule():
    """The ratio of two mixtures of normal distributions, and of two shares of people."""

    def density(x, y, usual):
        def normal(std):
            return math.exp(-0.5 * (x * x + y * y) / std**2) / (2.0 * math.pi * std**2)

        return 0.7 * normal(usual) + 0.3 * normal(0.3)

    felt = math.hypot(0.15, 0.05) / 0.4  # [m/s] of which people make 0.4, give or take 0.25
    aware = density(0.2 - 0.15, -0.1 - 0.05, math.hypot(0.1, 0.25 * felt))
    ratio = aware / density(0.2, -0.1, 0.1)
    assert log_likelihood_ratio((0.2, -0.1), (0.15, 0.05)) == approx(math.log(ratio))
    assert of_the_place(0.0) == approx(0.0)
    assert of_the_place(math.log(4.0)) == approx(math.log((0.9 * 4.0 + 0.1) / (0.02 * 4.0 + 0.98)))


def test_no_change_and_no_number_of_people_is_too_much():
    """A track that jumps, and 2000 people who walk straight on."""
    found = estimator()
    assert log_likelihood_ratio((80.0, 0.0), (0.1, 0.0)) == approx(0.0)
    for number in range(2000):
        for stamp, x in ((0.5 * number, 1.6), (0.5 * number + 0.45, 1.0)):
            track = Track(number, stamp, x, 0.0, -1.3, 0.0, 0.3, np.eye(4))
            found.observe((track,), Pose2D(), stamp)
    assert found.chances((track,))[0] < 0.02


def test_who_is_in_a_crowd_shows_nothing():
    """Somebody swerves, with somebody else 1 m away."""
    alone = estimator()
    meet(alone, default_rng(0), swerving)
    crowded = estimator()
    found = meet(crowded, default_rng(0), swerving, beside=(0.0, 1.0))
    stranger = Track(99, 0.0, 50.0, 0.0, 0.0, 0.0, 0.3, np.eye(4))
    assert alone.chances((stranger,))[0] > 0.7
    assert found == approx(UNKNOWN)
    assert crowded.chances((stranger,))[0] == approx(UNKNOWN)


def test_distances_apart():
    places = ((0.0, 0.0), (3.0, 4.0), (3.0, 5.0))
    tracks = [Track(0, 0.0, x, y, 0.0, 0.0, 0.3, np.eye(4)) for x, y in places]
    assert distances_apart(tracks) == approx((5.0, 1.0, 1.0))
    assert distances_apart(tracks[:1]) == approx((math.inf,))
    assert distances_apart(()).shape == (0,)


def test_a_pause_begins_all_looks_anew():
    found = estimator()
    for stamp, vx in ((0.0, -1.0), (0.3, -1.0), (1.0, 1.0), (1.3, 1.0)):
        track = Track(0, stamp, 1.5, 0.0, vx, 0.0, 0.3, np.eye(4))
        found.observe((track,), Pose2D(), stamp)
    assert found.chances((track,))[0] == approx(UNKNOWN)


def test_who_makes_way_weighs_less_the_later_it_counts():
    one = (15.0, 12.0, 0.3, 1.0, 0.3, 0.01, 0.04)
    blind = prediction(one).weight
    aware = prediction(one, yielding=0.8).weight
    gone = np.minimum(PARAMS.step * np.arange(1, PARAMS.steps + 1) / PARAMS.yielding_time, 1.0)
    assert aware == approx(blind * (1.0 - 0.8 * gone))


def test_the_same_tracks_lead_to_the_same_commands():
    params = dataclasses.replace(PARAMS, yielding_prior=PRIOR, detour_patience=1.0)
    drives = []
    for _ in range(2):
        controller = make(params)
        rng = default_rng(8)
        commands = []
        for n in range(20):
            stamp = n * DT
            velocity = rng.normal((0.0, -1.0), 0.05)
            track = Track(0, stamp, 15.0, 16.0 - stamp, *velocity, 0.3, 0.01 * np.eye(4))
            command = controller.compute_velocity(
                standing(stamp), plan_of(18.0), Surroundings(street(), (track,))
            )
            commands.append((command.linear_x, command.angular_z))
        drives.append(commands)
    assert drives[0] == drives[1]


def test_the_field_follows_a_detour_that_lasts_and_comes_back():
    """It waits for a fifth of the 21 s that the detour takes longer.

    People block the street for 3 s, then for 5 s, then they are gone.
    """
    remade = fields_made(
        (6.0, 60.0),
        (9.0, 60.0),
        (9.5, 18.0),
        (11.0, 60.0),
        (14.0, 60.0),
        (16.0, 60.0),
        (18.0, 18.0),
        (22.0, 18.0),
    )
    assert remade == [16.0, 22.0]


def test_it_waits_anew_before_a_second_detour():
    """The detour is blocked, too: the next way takes more than 30 s longer."""
    remade = fields_made((6.0, 60.0), (11.0, 60.0), (17.0, 120.0), (23.0, 120.0), (27.0, 120.0))
    assert remade == [11.0, 27.0]


def fields_made(*plans):
    """When [s] the field was made anew, of plans that are (stamp [s], length [m]).

    The straight way has 18 m. Longer plans lead round people who block it.
    """
    world = street()
    controller = make(dataclasses.replace(PARAMS, detour_patience=0.2), world=world)
    controller.compute_velocity(standing(0.0), plan_of(18.0), Surroundings(world))
    remade = []
    for stamp, length in plans:
        world.data[:] = world.floor
        if length > 18.0:
            world.data[360:380, 150:440] = 254
            world.data[420:440, 160:450] = 254
        before = controller._goal_field.followed
        controller.compute_velocity(standing(stamp), plan_of(length), Surroundings(world))
        if controller._goal_field.followed is not before:
            remade.append(stamp)
    return remade


def standing(stamp):
    pose = Pose2D(15.0, 10.0, math.pi / 2)
    return RobotState(pose, Twist2D(), stamp, pose)


def plan_of(length):
    """A plan of this length [m] to the goal at (15, 28) m, to the side and back."""
    aside = math.sqrt(max(0.25 * length**2 - 81.0, 0.0))
    return Path(np.array(((15.0, 10.0, 0.0), (15.0 + aside, 19.0, 0.0), (15.0, 28.0, 0.0))))
