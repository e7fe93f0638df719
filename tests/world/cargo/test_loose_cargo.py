"""A bucket that stands loose on the robot: it slides and tips as mechanics says."""

import dataclasses
import math

import numpy as np
import pytest

from harness.world.cargo.bucket import SCALE, _bucket, build, hold
from harness.world.cargo.cargo import Cargo
from harness.world.cargo.loose_cargo import LooseCargo
from harness.world.cargo.params import CargoParams
from harness.world.physics.engine import Server, bullet
from navstack.errors import ParameterError, UnknownNameError

DT, GRAVITY = 1.0 / 120.0, 9.81
LEVEL, STILL = (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
FREE = CargoParams(pieces=1, bucket="free", wake_acceleration=0.1, settle_time=5.0)
FULL = CargoParams(bucket="free")


def make(params, robot, seed=0):
    cargo = LooseCargo(params, GRAVITY, DT, robot)
    cargo.reset(np.random.default_rng(seed))
    return cargo


def place(cargo):
    """Of the bucket on the deck (x, y, z) [m]."""
    return np.array(cargo._pose()[0]) / SCALE


# Bullet multiplies it and the root
@pytest.mark.parametrize(("friction", "factor"), [(0.25, 0.6), (0.0, 0.0)])
def test_the_bucket_and_the_deck_have_their_thicknesses_below_and_outside(
    monkeypatch, robot, friction, factor
):
    """Ten times as large: floor 0.01 m, walls 0.02 m, deck 0.1 m.

    The deck is the robot's body about the bucket.
    """
    params = dataclasses.replace(FREE, bucket_width=0.2, friction=friction, bucket_friction=0.3)
    made, height = [], 10.0 * params.bucket_height
    monkeypatch.setattr(
        "harness.world.cargo.loose_cargo.add_boxes", lambda *given: made.append(given) or 5
    )
    monkeypatch.setattr(
        "harness.world.cargo.loose_cargo.set_dynamics", lambda *given, **more: made.append(more)
    )
    monkeypatch.setattr(
        "harness.world.cargo.loose_cargo.hold", lambda *given: made.append(given) or 6
    )
    moved = dataclasses.replace(robot, bucket=(-0.1335, 0.05, 0.8))
    assert LooseCargo(params, GRAVITY, DT, moved)._make_deck_and_bucket(3, params) == 6
    (client, (floor, *sides), mass), dynamics, (_, (deck,), of_deck, restitution) = made
    assert (client, mass, restitution) == (3, params.bucket_mass, 0.0)
    flat = lambda box: [*box[0], *box[1]]  # noqa: E731
    assert flat(floor) == pytest.approx([1.0, 1.0, 0.05, 0.0, 0.0, -0.05])
    expected = [(0.1, 1.2, 0.5 * height, sign * 1.1, 0.0, 0.5 * height) for sign in (1.0, -1.0)]
    expected += [(1.0, 0.1, 0.5 * height, 0.0, sign * 1.1, 0.5 * height) for sign in (1.0, -1.0)]
    assert np.array(sorted(map(flat, sides))) == pytest.approx(np.array(sorted(expected)))
    assert flat(deck) == pytest.approx([3.735, 2.5, 0.5, -1.0, -0.5, -0.1 - 0.5])
    assert dynamics == {
        "lateralFriction": math.sqrt(friction),
        "restitution": math.sqrt(params.restitution),
    }
    assert of_deck == pytest.approx(factor)


def test_a_fixed_bucket_has_its_floor_below_and_its_walls_outside(monkeypatch):
    """Ten times as large: 0.05 m thick; the floor reaches below the walls."""
    made, params = [], dataclasses.replace(FREE, bucket_width=0.2, friction=0.25, restitution=0.36)
    monkeypatch.setattr("harness.world.cargo.bucket.hold", lambda *given: made.append(given) or 7)
    assert _bucket(3, params) == 7
    ((client, boxes, friction, restitution),) = made
    assert (client, friction, restitution) == (3, 0.5, 0.36)
    half = 5.0 * params.bucket_height
    expected = [(1.5, 1.5, 0.25, 0.0, 0.0, -0.25)]
    expected += [(0.25, 1.5, half, sign * 1.25, 0.0, half) for sign in (1.0, -1.0)]
    expected += [(1.0, 0.25, half, 0.0, sign * 1.25, half) for sign in (1.0, -1.0)]
    assert np.array(sorted((*extents, *centre) for extents, centre in boxes)) == pytest.approx(
        np.array(sorted(expected))
    )


def test_what_is_held_is_heavy_and_fills_its_boxes(monkeypatch):
    server, told = Server(), []
    monkeypatch.setattr(
        "harness.world.cargo.bucket.set_dynamics", lambda *given, **more: told.append((given, more))
    )
    held = hold(
        server.client,
        [((1.0, 2.0, 0.5), (0.0, 1.0, 0.0)), ((0.5, 0.5, 2.0), (3.0, 0.0, 1.0))],
        0.3,
        0.49,
    )
    low, high = bullet.getAABB(held, physicsClientId=server.client)
    server.close()
    ((given, more),) = told
    assert (given, more.pop("restitution")) == ((server.client, held), pytest.approx(0.7))
    assert more == {"mass": 1e6, "localInertiaDiagonal": (1e6, 1e6, 1e6), "lateralFriction": 0.3}
    assert (*low, *high) == pytest.approx((-1.0, -1.0, -1.0, 3.5, 3.0, 3.0), abs=1e-9)


def test_pieces_weigh_rub_and_roll_as_asked():
    """As PyBullet tells of them: mass, friction, rolling friction.

    Their radius is 0.154 in its lengths.
    """
    params, server = CargoParams(pieces=2, friction=0.36, rolling_friction=0.1), Server()
    heap = np.array(((0.0, 0.0, 0.05), (0.01, -0.02, 0.1)))
    _, pieces = build(server.client, params, heap, DT)
    for piece, place in zip(pieces, heap, strict=True):
        told = bullet.getDynamicsInfo(piece, -1, server.client)
        assert [told[k] for k in (0, 1, 6)] == pytest.approx([0.001, 0.6, 0.1 * 0.154])
        assert bullet.getBasePositionAndOrientation(piece, server.client)[0] == pytest.approx(
            tuple(10.0 * place)
        )
    server.close()


def accelerate(cargo, acceleration, seconds):
    for _ in range(round(seconds / DT)):
        cargo.step(acceleration, LEVEL, STILL)


@pytest.mark.parametrize("friction", [0.3, 0.5])
@pytest.mark.parametrize("acceleration", [2.0, 4.0, 7.0, 8.0])
def test_it_slides_by_coulombs_law(robot, friction, acceleration):
    """Way on the deck 1/2 (a - mu g) t^2, none up to mu g; no piece tells on it."""
    cargo = make(dataclasses.replace(FREE, bucket_friction=friction, piece_mass=1e-9), robot)
    accelerate(cargo, (acceleration, 0.0, 0.0), 0.25)
    expected = -0.5 * max(acceleration - friction * GRAVITY, 0.0) * 0.25**2
    x, y, z = place(cargo)
    assert x == pytest.approx(expected, abs=0.003 + 0.06 * abs(expected))
    assert (y, z) == pytest.approx((0.0, 0.0), abs=0.003)
    cargo.close()


def test_with_enough_friction_it_tips_where_gravity_no_longer_holds_it(robot):
    """Over the edge of its floor once a h > g b.

    H: centre of mass above the deck, b: half the floor's width.
    """
    tall = dataclasses.replace(FREE, bucket_friction=20.0, bucket_width=0.04, piece_mass=1e-9)
    limit = GRAVITY * 0.02 / 0.01
    for acceleration, tips in ((0.8 * limit, False), (1.3 * limit, True)):
        cargo = make(tall, robot)
        accelerate(cargo, (acceleration, 0.0, 0.0), 0.5)
        up = 1.0 - 2.0 * sum(component**2 for component in cargo._pose()[1][:2])
        assert (up < math.cos(0.3)) == tips
        cargo.close()


def test_on_a_slope_it_slides_beyond_the_angle_of_friction(robot):
    for angle, slides in ((0.9 * math.atan(0.5), False), (1.1 * math.atan(0.5), True)):
        cargo = make(dataclasses.replace(FREE, piece_mass=1e-9), robot)
        tilted = (0.0, math.sin(0.5 * angle), 0.0, math.cos(0.5 * angle))
        for _ in range(60):
            cargo.step(STILL, tilted, STILL)
        assert (float(np.linalg.norm(place(cargo))) > 0.02) == slides
        cargo.close()


def test_who_falls_off_the_robot_loses_everything(robot):
    cargo = make(dataclasses.replace(FULL, bucket_friction=0.1), robot)
    accelerate(cargo, (0.0, 9.0, 0.0), 1.0)
    assert cargo.state.pieces_outside == cargo.state.pieces_at_start == 50
    cargo.close()


@pytest.mark.parametrize("deceleration", [3.0, 4.4])
def test_usual_braking_spills_nothing(robot, deceleration):
    cargo = make(FULL, robot)
    accelerate(cargo, (-deceleration, 0.0, 0.0), 0.5)
    accelerate(cargo, STILL, 1.0)
    assert cargo.state.pieces_outside == 0
    cargo.close()


def test_it_stays_where_it_slid_when_all_rests(robot):
    cargo = make(FULL, robot)
    accelerate(cargo, (-8.0, 0.0, 0.0), 0.3)
    accelerate(cargo, STILL, 2.0)
    assert not cargo.is_awake
    assert bullet.getBaseVelocity(cargo._bucket, cargo._client) == (STILL, STILL)
    there = place(cargo)
    assert there[0] > 0.05
    accelerate(cargo, (-4.6, 0.0, 0.0), 0.05)  # wakes it, below friction
    accelerate(cargo, STILL, 1.0)
    assert place(cargo) == pytest.approx(there, abs=0.005)
    cargo.close()


def test_the_heap_is_that_of_a_fixed_bucket(robot):
    fixed, loose = Cargo(CargoParams(), GRAVITY, DT), make(FULL, robot, seed=3)
    fixed.reset(np.random.default_rng(3))
    assert np.array_equal(fixed.positions, loose.positions)


def test_impossible_buckets_are_refused():
    with pytest.raises(UnknownNameError, match="cargo: bucket 'glued'"):
        CargoParams(bucket="glued")
    for change in ({"bucket_mass": 0.0}, {"bucket_friction": -0.1}):
        with pytest.raises(ParameterError, match=next(iter(change))):
            CargoParams(**change)
