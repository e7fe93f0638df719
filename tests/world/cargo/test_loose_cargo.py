"""A bucket that stands loose on the robot: it slides and tips as mechanics says."""

import dataclasses
import math

import numpy as np
import pytest

from harness.world.cargo.bucket import SCALE, _bucket, build, hold
from harness.world.cargo.cargo import BucketStep, Cargo
from harness.world.cargo.loose_cargo import (
    LooseCargo,
    about_vertical,
    are_in_box_of,
    bucket_boxes,
    mass_of_open_box,
)
from harness.world.cargo.params import CargoParams
from harness.world.physics.engine import Server, bullet
from harness.world.truth import CargoState
from navstack.errors import ParameterError, UnknownNameError

DT, GRAVITY = 1.0 / 120.0, 9.81
LEVEL, STILL = (0.0, 0.0, 0.0, 1.0), (0.0, 0.0, 0.0)
FREE = CargoParams(pieces=1, fill=0.1, bucket="free", wake_acceleration=0.1, settle_time=5.0)
FULL = CargoParams(bucket="free")


def make(params, robot, seed=0):
    cargo = LooseCargo(params, GRAVITY, DT, robot)
    cargo.reset(np.random.default_rng(seed))
    return cargo


def place(cargo):
    """Of the bucket on the deck (x, y, z) [m]."""
    return np.array(cargo._pose()[0]) / SCALE


def flat(box):
    return [*box[0], *box[1]]


def test_the_bucket_and_the_deck_have_their_thicknesses_below_and_outside(robot):
    """Ten times as large: floor 0.01 m, walls 0.02 m, the deck down to the robot's underside."""
    params = dataclasses.replace(FREE, bucket_width=0.2, place=(-0.1335, 0.05, 0.8))
    height = 10.0 * params.bucket_height
    floor, *sides = bucket_boxes(params)
    assert flat(floor) == pytest.approx([1.0, 1.0, 0.05, 0.0, 0.0, -0.05])
    expected = [(0.1, 1.2, 0.5 * height, sign * 1.1, 0.0, 0.5 * height) for sign in (1.0, -1.0)]
    expected += [(1.0, 0.1, 0.5 * height, 0.0, sign * 1.1, 0.5 * height) for sign in (1.0, -1.0)]
    assert np.array(sorted(map(flat, sides))) == pytest.approx(np.array(sorted(expected)))
    cargo = LooseCargo(params, GRAVITY, DT, robot)
    deck = cargo._deck_box(cargo._thickness)
    half = 0.5 * 10.0 * (0.79 - robot.ground_clearance)
    assert flat(deck) == pytest.approx([3.735, 2.5, half, -1.0, -0.5, -0.1 - half])


@pytest.mark.parametrize(("friction", "factor"), [(0.25, 0.6), (0.0, 0.0)])
def test_the_decks_friction_makes_bullets_product_the_asked_one(robot, friction, factor):
    params = dataclasses.replace(FREE, friction=friction, bucket_friction=0.3)
    assert LooseCargo(params, GRAVITY, DT, robot)._factor == pytest.approx(factor)


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


def accelerate(cargo, acceleration, seconds, velocity=STILL):
    """Accelerate for some seconds; the velocity is that at the beginning."""
    for k in range(round(seconds / DT)):
        now = tuple((np.array(velocity) + np.multiply(acceleration, (k + 1) * DT)).tolist())
        cargo.step(BucketStep(acceleration, now, LEVEL, STILL))


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
    limit = GRAVITY * 0.02 / (mass_of_open_box(tall)[0] + 0.01)
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
            cargo.step(BucketStep(STILL, STILL, tilted, STILL))
        assert (float(np.linalg.norm(place(cargo))) > 0.02) == slides
        cargo.close()


ABOVE_BASE_LINK = dataclasses.replace(FULL, place=(0.0, 0.0, 0.47))


@pytest.mark.parametrize("share", [0.85, 1.2])
def test_it_falls_where_the_way_that_a_shock_gives_it_exceeds_that_to_the_edge(robot, share):
    """A change of speed dv lets it slide dv^2 / (2 mu g); its middle must pass the deck's edge."""
    to_edge = robot.center[0] + robot.half_size[0]
    change = share * math.sqrt(2.0 * 0.5 * GRAVITY * to_edge)
    cargo = make(dataclasses.replace(ABOVE_BASE_LINK, pieces=1, piece_mass=1e-9), robot)
    accelerate(cargo, (-change / (2.0 * DT), 0.0, 0.0), 2.0 * DT, (change, 0.0, 0.0))
    accelerate(cargo, STILL, 3.0)
    fallen = place(cargo)[2] < -0.3
    assert fallen == (share > 1.0)
    assert (cargo._left_deck is not None) == fallen
    cargo.state = CargoState(1, 0)  # it lies in its bucket, wherever that is
    assert cargo.pieces_on_robot == int(not fallen)
    cargo.close()


@pytest.mark.parametrize("height", [0.3, 0.8])
def test_it_falls_freely_to_the_ground_and_stays_behind(robot, height):
    """After sqrt(2 h / g) it is down; a robot that drives on has left it behind."""
    params = dataclasses.replace(
        FREE,
        place=(0.0, 0.0, height),
        bucket_friction=0.0,
        piece_mass=1e-9,
        settle_time=9.0,
    )
    cargo = make(params, robot)
    accelerate(cargo, (0.0, -20.0, 0.0), 0.25)
    heights, speed = [], (0.0, -5.0, 0.0)
    for _ in range(round(0.9 / DT)):
        cargo.step(BucketStep(STILL, speed, LEVEL, STILL))
        heights.append(place(cargo)[2])
    begins = next(k for k, z in enumerate(heights) if z < -0.02)
    lands = next(k for k, z in enumerate(heights) if z < -height + 0.05)
    falling = (lands - begins) * DT
    expected = math.sqrt(2.0 * (height - 0.05) / GRAVITY) - math.sqrt(2.0 * 0.02 / GRAVITY)
    assert falling == pytest.approx(expected, abs=0.04)
    assert min(heights) > -height - 0.1
    assert place(cargo)[1] > 0.5
    cargo.close()


def test_on_the_ground_friction_stops_it(robot):
    """It lands at rest in the map, though the robot drives on at 2 m/s."""
    cargo = make(dataclasses.replace(ABOVE_BASE_LINK, bucket_friction=0.5), robot)
    accelerate(cargo, (0.0, -25.0, 0.0), 0.2)
    speed = (0.0, -5.0, 0.0)
    for _ in range(round(1.5 / DT)):
        cargo.step(BucketStep(STILL, speed, LEVEL, STILL))
    before = place(cargo)
    for _ in range(12):
        cargo.step(BucketStep(STILL, speed, LEVEL, STILL))
    drift = (place(cargo) - before) / (12 * DT) + np.array(speed)  # [m/s] in the map
    assert np.abs(drift).max() < 0.3
    cargo.close()


def test_what_fell_with_its_pieces_has_lost_none_by_that(robot):
    """Published: pieces count that are in the bucket's box, wherever it is."""
    cargo = make(ABOVE_BASE_LINK, robot)
    accelerate(cargo, (8.0, 0.0, 0.0), 0.02)  # wakes it
    shift = SCALE * np.array((0.0, 1.0, -0.47 + 0.01))
    for body in (cargo._bucket, *cargo._pieces):  # carried down beside the robot
        at, how = bullet.getBasePositionAndOrientation(body, cargo._client)
        bullet.resetBasePositionAndOrientation(body, (at + shift).tolist(), how, cargo._client)
    accelerate(cargo, STILL, 1.0)
    assert place(cargo)[2] == pytest.approx(-0.47, abs=0.02)
    assert cargo.state.pieces_outside == 0
    cargo.close()


def test_what_falls_over_the_edge_spills(robot):
    cargo = make(ABOVE_BASE_LINK, robot)
    accelerate(cargo, (0.0, -12.0, 0.0), 0.2)
    for _ in range(round(3.0 / DT)):
        cargo.step(BucketStep(STILL, (0.0, -2.0, 0.0), LEVEL, STILL))
    assert not cargo.is_awake
    assert cargo.state.lost_fraction > 0.1
    lost = cargo.state
    accelerate(cargo, (9.0, 0.0, 0.0), 0.3)  # does not move it any more
    assert cargo.state == lost
    cargo.close()


@pytest.mark.parametrize("seed", range(3))
def test_a_robot_that_drives_over_a_fallen_bucket_scatters_its_pieces(robot, seed):
    cargo = make(ABOVE_BASE_LINK, robot, seed)
    accelerate(cargo, (-12.0, 0.0, 0.0), 0.2, (3.4, 0.0, 0.0))
    for _ in range(round(3.0 / DT)):
        cargo.step(BucketStep(STILL, (1.0, 0.0, 0.0), LEVEL, STILL))
    assert cargo.state.lost_fraction > 0.4
    cargo.close()


@pytest.mark.parametrize(("angle", "counts"), [(0.0, False), (0.25 * math.pi, True)])
def test_a_turned_bucket_has_a_larger_box(angle, counts):
    """Its sides are the map's axes: at 45 degrees it reaches sqrt(2) as far."""
    outside = np.array(((0.07, 0.0, 0.02), (0.0, -0.07, 0.02)))
    assert are_in_box_of(outside, about_vertical(angle), FULL).tolist() == [counts, counts]
    inside, above = np.array(((0.0, 0.0, 0.05),)), np.array(((0.0, 0.0, 1.0),))
    assert are_in_box_of(inside, about_vertical(angle), FULL).all()
    assert not are_in_box_of(above, about_vertical(angle), FULL).any()


@pytest.mark.parametrize("yaw", [0.4, -2.5])
def test_it_is_put_there_without_the_robots_heading(robot, yaw):
    """And the box counts along the map's axes: nothing is lost by the heading alone."""
    cargo = LooseCargo(ABOVE_BASE_LINK, GRAVITY, DT, robot)
    cargo.reset(np.random.default_rng(0), yaw)
    heading = (0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))
    for _ in range(30):
        cargo.step(BucketStep((5.5, 0.0, 0.0), STILL, heading, STILL))
    x, y, z, w = cargo._pose()[1]
    on_robot = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    assert on_robot == pytest.approx(-yaw, abs=0.1)
    assert cargo.state.pieces_outside == 0
    cargo.close()


def test_it_is_dropped_before_the_first_count(robot):
    """From 2 cm nothing jumps out; from a metre some do, and they count as never loaded."""
    for drop, whole in ((0.02, True), (1.0, False)):
        cargo = make(dataclasses.replace(ABOVE_BASE_LINK, drop=drop), robot)
        assert (cargo.state.pieces_at_start == 50) == whole
        assert cargo.state.pieces_outside == 0
        cargo.close()


def test_a_kept_heap_is_right_for_robots_of_other_heights_and_widths(robot, monkeypatch, tmp_path):
    """Whoever comes second finds what he would have made himself."""
    dropped = dataclasses.replace(ABOVE_BASE_LINK, drop=0.02)
    low = dataclasses.replace(robot, ground_clearance=robot.ground_clearance + 0.02)
    wider = tuple((x, 1.2 * y) for x, y in robot.footprint)
    wide = dataclasses.replace(robot, footprint=wider)
    for second in (low, wide):
        heaps = []
        for number, order in enumerate(((robot, second), (second,))):
            monkeypatch.setenv("NAVSTACK_CACHE", str(tmp_path / f"{id(second)}_{number}"))
            for each in order:
                heap = LooseCargo(dropped, GRAVITY, DT, each)._settled(0)
            heaps.append(heap)
        assert np.array_equal(*heaps)


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


def test_the_open_box_weighs_as_its_plates_do():
    """Against a sum over many points of its five plates."""
    params = dataclasses.replace(FULL, bucket_width=0.1, bucket_mass=0.2)
    ticks = (np.arange(60) + 0.5) / 60.0
    along, up = (each.ravel() for each in np.meshgrid(ticks - 0.5, ticks))
    height, wall = params.bucket_height, np.full(along.size, 0.05)
    plates = [np.stack((0.1 * along, 0.1 * (up - 0.5), 0.0 * up), axis=1)]
    for sign in (1.0, -1.0):
        plates.append(np.stack((sign * wall, 0.1 * along, height * up), axis=1))
        plates.append(np.stack((0.1 * along, sign * wall, height * up), axis=1))
    areas = np.repeat((0.01, *(4 * [0.1 * height])), along.size)
    masses = 0.2 * areas / areas.sum()
    points = np.concatenate(plates)
    middle, inertia = mass_of_open_box(params)
    assert middle == pytest.approx(masses @ points[:, 2] / 0.2)
    x, y, z = (points - (0.0, 0.0, middle)).T
    expected = (masses @ (y**2 + z**2), masses @ (x**2 + z**2), masses @ (x**2 + y**2))
    assert inertia == pytest.approx(expected, rel=1e-3)


@pytest.mark.parametrize(
    ("braking", "speed", "lost"),
    [(4.8, 3.0, 0), (5.5, 3.0, 0), (6.0, 2.0, 0), (8.0, 1.0, 0), (6.0, 3.0, 3), (8.0, 3.0, 42)],
)
def test_how_hard_a_robot_may_brake(robot, braking, speed, lost):
    """The table of docs/physics.md: the bucket slides v^2 / 2 (1 / (mu g) - 1 / a) in a stop."""
    cargo = make(dataclasses.replace(ABOVE_BASE_LINK, restitution=0.0, drop=0.02), robot)
    ticks = round(speed / braking / DT)
    accelerate(cargo, (-speed / (ticks * DT), 0.0, 0.0), ticks * DT, (speed, 0.0, 0.0))
    accelerate(cargo, STILL, 1.0)
    slid = max(0.5 * speed**2 * (1.0 / (0.5 * GRAVITY) - 1.0 / braking), 0.0)
    assert cargo.state.pieces_outside == pytest.approx(lost, abs=8)
    assert (slid > 0.14) == (lost > 0)
    if not lost:
        assert place(cargo)[0] == pytest.approx(slid, abs=0.012)
    cargo.close()


@pytest.mark.parametrize("speed", [0.0, 1.5])
def test_a_robot_that_drives_on_pushes_what_lies_before_it(robot, speed):
    cargo = make(ABOVE_BASE_LINK, robot)
    accelerate(cargo, (8.0, 0.0, 0.0), 0.02)
    shift = SCALE * np.array((0.5, 0.0, -0.47 + 0.01))
    for body in (cargo._bucket, *cargo._pieces):
        at, how = bullet.getBasePositionAndOrientation(body, cargo._client)
        bullet.resetBasePositionAndOrientation(body, (at + shift).tolist(), how, cargo._client)
    for _ in range(round(3.0 / DT)):
        cargo.step(BucketStep(STILL, (speed, 0.0, 0.0), LEVEL, STILL))
    x, _, z = place(cargo)
    pushed = x + 3.0 * speed - 0.5  # [m] in the map
    assert x > 0.14
    assert z < -0.3
    assert pushed == pytest.approx(max(3.0 * speed - 0.3, 0.0), abs=0.15)
    cargo.close()


def test_a_robot_that_turns_on_the_spot_pushes_what_lies_beside_it(robot):
    """Its rear, which reaches 0.65 m from the axle, sweeps a bucket away that lies 0.45 m off."""
    cargo = make(ABOVE_BASE_LINK, robot)
    accelerate(cargo, (8.0, 0.0, 0.0), 0.02)
    shift = SCALE * np.array((0.0, 0.45, -0.47 + 0.01))
    for body in (cargo._bucket, *cargo._pieces):
        at, how = bullet.getBasePositionAndOrientation(body, cargo._client)
        bullet.resetBasePositionAndOrientation(body, (at + shift).tolist(), how, cargo._client)
    accelerate(cargo, STILL, 2.5)  # comes to rest beside the standing robot
    before, rate, places = place(cargo), -1.0, []
    for k in range(round(0.5 * math.pi / DT)):
        yaw = rate * (k + 1) * DT
        turned = (0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))
        cargo.step(BucketStep(STILL, STILL, turned, (0.0, 0.0, rate)))
        places.append(place(cargo))
    assert math.hypot(*(places[-1] - before)[:2]) > 0.1
    speeds = np.linalg.norm(np.diff(places, axis=0), axis=1) / DT
    assert speeds.max() < 3.0  # swept, not thrown out of the robot's body
    cargo.close()
