"""Popcorn in its bucket: conserved, at rest when calm, lost the more, the harder it is shaken."""

import dataclasses
import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from harness.statistics.interval import wilson_interval
from harness.world.cargo.cargo import BucketStep, Cargo, harmless_jolt, in_frame, is_inside
from harness.world.cargo.heap import _poured, _settle, settled_heap, turned
from harness.world.cargo.params import CargoParams
from harness.world.physics.engine import bullet

DT, GRAVITY = 1.0 / 120.0, 9.81
LEVEL = (0.0, 0.0, 0.0, 1.0)
STILL = (0.0, 0.0, 0.0)
PARAMS = CargoParams()


@pytest.fixture(scope="module")
def cargo():
    made = Cargo(PARAMS, GRAVITY, DT)
    yield made
    made.close()


def shake(cargo, accelerations, seed=0, calm=1.2):
    """Final state after accelerations (n, 3) [m/s2], one per physics step, and a calm time [s]."""
    cargo.reset(np.random.default_rng(seed))
    return shake_on(cargo, accelerations, calm)


def shake_on(cargo, accelerations, calm=1.2):
    for acceleration in accelerations:
        cargo.step(BucketStep(tuple(acceleration), STILL, LEVEL, STILL))
    for _ in range(round(calm / DT)):
        cargo.step(BucketStep(STILL, STILL, LEVEL, STILL))
    return cargo.state


def braking(deceleration, duration=0.5):
    return np.tile((-deceleration, 0.0, 0.0), (round(duration / DT), 1))


def shock(speed, direction=0.0):
    return [(-speed * math.cos(direction) / DT, -speed * math.sin(direction) / DT, 0.0)]


@pytest.mark.parametrize("changes", [{"pieces": 5}, {"bucket_width": 0.4}, {"pieces": 1}])
def test_a_bucket_is_never_lower_than_a_piece(changes):
    """Else nothing would be inside, and nothing could spill."""
    made = Cargo(dataclasses.replace(PARAMS, **changes), GRAVITY, DT)
    made.reset(np.random.default_rng(0))
    assert made.state.pieces_at_start > 0
    made.close()


def test_slippery_pieces_are_simulated_where_they_begin_to_slide():
    assert PARAMS.wakes_at(GRAVITY) == PARAMS.wake_acceleration
    assert PARAMS.wakes_at(1.6) == pytest.approx(0.8)
    loose = dataclasses.replace(PARAMS, bucket="free", bucket_friction=0.1)
    assert loose.wakes_at(GRAVITY) == pytest.approx(0.1 * GRAVITY)
    assert dataclasses.replace(loose, bucket="fixed").wakes_at(GRAVITY) == PARAMS.wake_acceleration


def surface_height(heap, radius):
    """Mean height [m] of the heap's surface, sampled from above."""
    axis = (np.arange(40) + 0.5) / 40 * PARAMS.bucket_width - 0.5 * PARAMS.bucket_width
    x, y = np.meshgrid(axis, axis)
    squared = (x[..., None] - heap[:, 0]) ** 2 + (y[..., None] - heap[:, 1]) ** 2
    tops = np.where(
        squared < radius**2, heap[:, 2] + np.sqrt(np.maximum(radius**2 - squared, 0.0)), 0.0
    )
    return tops.max(axis=-1).mean()


def test_the_bucket_is_filled_as_asked():
    heap, radius = _settle(PARAMS, GRAVITY, DT, 0), PARAMS.piece_radius
    assert heap.shape == (PARAMS.pieces, 3)
    assert is_inside(heap, PARAMS).all()
    assert surface_height(heap, radius) / PARAMS.bucket_height == pytest.approx(
        PARAMS.fill, abs=0.06
    )
    distances = np.linalg.norm(heap[:, None] - heap[None], axis=-1)[np.triu_indices(len(heap), 1)]
    assert distances.min() > 1.9 * radius  # pieces hardly overlap
    assert heap[:, 2].min() > 0.9 * radius


def test_a_heap_settles_under_its_weight_in_a_bucket_that_stands(monkeypatch):
    steps = []
    monkeypatch.setattr(
        "harness.world.cargo.heap.step_with", lambda client, bucket, *given: steps.append(given)
    )
    _settle(dataclasses.replace(PARAMS, pieces=1, fill=0.1), GRAVITY, DT, 0)
    assert steps == [((0.0, 0.0, -GRAVITY), LEVEL, STILL, DT)] * 360


def test_all_pieces_are_in_the_bucket_at_the_start_and_stay_while_calm(cargo):
    state = shake(cargo, np.tile((1.0, 0.5, 0.0), (240, 1)))
    assert (state.pieces_at_start, state.pieces_outside) == (50, 0)
    assert not cargo.is_awake


def test_it_wakes_when_shaken_and_rests_again(cargo):
    cargo.reset(np.random.default_rng(0))
    cargo.step(BucketStep((-5.0, 0.0, 0.0), STILL, LEVEL, STILL))
    assert cargo.is_awake
    for _ in range(round(PARAMS.settle_time / DT) + 2):
        cargo.step(BucketStep(STILL, STILL, LEVEL, STILL))
    assert not cargo.is_awake


@pytest.mark.parametrize(("width", "per_row"), [(0.12, 3), (0.0309, 1), (0.2, 6)])
def test_layers_of_a_square_lattice_are_poured_about_the_middle(width, per_row):
    """Seen from its corner, each layer is the same lattice.

    Its corner lies where the walls leave room.
    """
    radius, pitch = PARAMS.piece_radius, 2.1 * PARAMS.piece_radius
    poured = _poured(dataclasses.replace(PARAMS, bucket_width=width), 5)
    slack = 0.5 * width - radius - 0.5 * (per_row - 1) * pitch
    shifts = slack * np.random.default_rng(5).uniform(
        -0.9, 0.9, (-(-PARAMS.pieces // per_row**2), 2)
    )
    half = 0.5 * (per_row - 1)
    lattice = [
        (pitch * (column - half) + x, pitch * (row - half) + y, radius + layer * pitch)
        for layer, (x, y) in enumerate(shifts)
        for row in range(per_row)
        for column in range(per_row)
    ]
    np.testing.assert_allclose(poured, lattice[: PARAMS.pieces], atol=1e-12)


def test_normal_and_emergency_braking_spill_nothing_at_this_fill(cargo):
    for deceleration in (4.0, 6.0):
        assert shake(cargo, braking(deceleration)).pieces_outside == 0


@pytest.mark.parametrize("yaw", [0.0, 0.7, -2.0])
def test_pieces_are_pulled_by_their_weight_and_against_the_buckets_acceleration(
    cargo,
    monkeypatch,
    yaw,
):
    """In the frame that turns with the bucket's heading where it woke: R(-yaw) (g - a).

    And so its lean and spin.
    """
    steps = []
    monkeypatch.setattr(
        "harness.world.cargo.cargo.step_with", lambda client, bucket, *given: steps.append(given)
    )
    acceleration, spin = np.array((2.0, -5.0, 3.5)), (0.3, -0.2, 0.7)
    lean, turned = Rotation.from_euler("yx", (0.1, -0.2)), Rotation.from_euler("z", yaw)
    cargo.reset(np.random.default_rng(0))
    leaning = tuple((turned * lean).as_quat().tolist())
    cargo.step(BucketStep(tuple(acceleration.tolist()), STILL, leaning, spin))
    assert len(cargo.positions) == PARAMS.pieces  # which asks for the motion
    ((pull, orientation, own_spin, dt),) = steps
    # what leans has a heading of its own, too
    woken = turned * Rotation.from_euler("z", lean.as_euler("ZYX")[0])
    np.testing.assert_allclose(
        pull, woken.inv().apply((0.0, 0.0, -GRAVITY) - acceleration), atol=1e-12
    )
    np.testing.assert_allclose(own_spin, woken.inv().apply(spin), atol=1e-12)
    assert Rotation.from_quat(orientation).as_matrix() == pytest.approx(
        (woken.inv() * turned * lean).as_matrix()
    )
    assert dt == DT


@pytest.fixture(scope="module")
def fuller():
    made = Cargo(dataclasses.replace(PARAMS, fill=0.8), GRAVITY, DT)
    yield made
    made.close()


def losses(cargo, dose, seeds=20):
    """Share of the pieces that is lost (seeds,); every seed has a heap and direction of its own."""
    lost = []
    for seed in range(seeds):
        direction = np.random.default_rng((7, seed)).uniform(-math.pi, math.pi)
        turn = np.array(((math.cos(direction), math.sin(direction), 0.0),))
        state = shake(cargo, np.asarray(dose)[:, :1] * turn, seed=seed, calm=0.8)
        inside = int(is_inside(cargo.positions, cargo.params).sum())
        assert inside + state.pieces_outside == state.pieces_at_start
        lost.append(state.lost_fraction)
    return np.array(lost)


@pytest.mark.slow
def test_the_harder_the_brake_the_more_is_lost(fuller):
    means = [losses(fuller, braking(deceleration)).mean() for deceleration in (4.0, 8.0, 16.0)]
    assert means[0] == 0.0
    assert means == sorted(means) and means[-1] > 0.02


@pytest.mark.slow
def test_the_harder_the_shock_the_more_is_lost(fuller):
    shares = [losses(fuller, shock(speed)) for speed in (0.5, 1.0, 2.0)]
    means = [share.mean() for share in shares]
    assert means == sorted(means) and means[0] < 0.02 < means[-1]
    spoiled = [wilson_interval(int((share > 0.05).sum()), len(share)) for share in shares]
    assert spoiled[0].high < 0.2 < spoiled[-1].low


@pytest.mark.slow
def test_a_fuller_bucket_loses_more():
    means = []
    for fill in (0.6, 0.8, 1.0):
        bucket = Cargo(dataclasses.replace(PARAMS, fill=fill), GRAVITY, DT)
        try:
            means.append(losses(bucket, shock(2.5), seeds=12).mean())
        finally:
            bucket.close()
    assert means == sorted(means) and means[0] < means[-1]


def test_pieces_are_conserved(cargo):
    state = shake(cargo, shock(5.0))
    inside = int(is_inside(cargo.positions, PARAMS).sum())
    assert inside + state.pieces_outside == state.pieces_at_start == 50
    assert state.lost_fraction == state.pieces_outside / 50


def test_turning_over_empties_the_bucket(cargo):
    cargo.reset(np.random.default_rng(0))
    rate = math.pi  # [rad/s]
    for step in range(240):
        angle = min(step * DT * rate, math.pi)
        spin = (rate, 0.0, 0.0) if angle < math.pi else STILL
        leaning = (math.sin(0.5 * angle), 0.0, 0.0, math.cos(0.5 * angle))
        cargo.step(BucketStep(STILL, STILL, leaning, spin))
    assert cargo.state.pieces_outside == 50


def test_the_heading_of_the_robot_is_of_no_account(cargo):
    """The same shake seen from another heading moves the pieces the same way in the bucket."""
    places = []
    for heading in (0.0, 2.1):
        cargo.reset(np.random.default_rng(3))
        q = (0.0, 0.0, math.sin(0.5 * heading), math.cos(0.5 * heading))
        for _ in range(30):
            braked = (-8.0 * math.cos(heading), -8.0 * math.sin(heading), 0.0)
            cargo.step(BucketStep(braked, STILL, q, STILL))
        places.append(cargo.positions)
    assert places[0] == pytest.approx(places[1], abs=2e-3)


def test_the_same_shake_gives_the_same_pieces_bit_for_bit(cargo):
    shake(cargo, shock(3.0), seed=4)
    places = cargo.positions
    other = Cargo(PARAMS, GRAVITY, DT)
    try:
        shake(other, shock(3.0), seed=4)
        assert np.array_equal(places, other.positions)
    finally:
        other.close()


def test_the_eight_images_of_a_heap_are_different_and_inside():
    heap = settled_heap(PARAMS, GRAVITY, DT)
    images = [turned(heap, which) for which in range(8)]
    assert all(is_inside(image, PARAMS).all() for image in images)
    assert len({image.round(9).tobytes() for image in images}) == 8
    # in complex numbers: mirrored for the latter four, then turned
    for which, image in enumerate(images):
        flat = heap[:, 0] + 1j * heap[:, 1] * (-1.0 if which > 3 else 1.0)
        assert (
            np.array_equal(image[:, 0] + 1j * image[:, 1], flat * 1j**which)
            and (image[:, 2] == heap[:, 2]).all()
        )


class Places(SimpleNamespace):
    """Cargo whose pieces are where a test says."""

    _are_inside = Cargo._are_inside

    @property
    def positions(self):
        return np.array([self.places[piece] for piece in self._pieces])


def test_pieces_beyond_the_buckets_surroundings_are_lost_for_good(monkeypatch):
    """A bucket of 0.2 m by 0.25 m: what is farther off than 1 m, or 0.125 m below its floor.

    Two were lost before.
    """
    params = SimpleNamespace(bucket_width=0.2, bucket_height=0.25)
    kept = [
        (0.0, 0.0, 0.1),
        (0.1, -0.1, 0.25),
        (0.11, 0.0, 0.1),
        (1.0, -1.0, 1.0),
        (0.0, 0.0, -0.125),
    ]
    gone = [(1.01, 0.0, 0.0), (0.0, -1.01, 0.0), (0.0, 0.0, 1.01), (0.0, 0.0, -0.13)]
    removed, pieces = [], list(range(9))
    monkeypatch.setattr(bullet, "removeBody", lambda piece, physicsClientId: removed.append(piece))
    own = Places(
        places=[*gone[:2], *kept, *gone[2:]],
        params=params,
        _pieces=pieces,
        _client=0,
        _lost=2,
        _at_start=11,
    )
    Cargo._look(own)
    assert (sorted(removed), pieces, own._lost) == ([0, 1, 7, 8], [2, 3, 4, 5, 6], 6)
    assert (own.state.pieces_at_start, own.state.pieces_outside) == (11, 9)


def test_in_frame_takes_the_heading_off():
    heading, tilt = 0.9, 0.2
    tilted = (0.0, math.sin(0.5 * tilt), 0.0, math.cos(0.5 * tilt))  # pitched in the frame
    ch, sh = math.cos(0.5 * heading), math.sin(0.5 * heading)
    x, y, z, w = tilted
    turned_too = (ch * x - sh * y, ch * y + sh * x, ch * z + sh * w, ch * w - sh * z)
    assert in_frame(heading, turned_too) == pytest.approx(tilted)


ALWAYS = -1.0  # [m/s2] of mean shaking that is harmless: none, so every step is simulated at once
SMOOTH = dataclasses.replace(  # as in the world "paper_fitted"
    PARAMS,
    piece_radius=0.014,
    bucket_width=0.16,
    friction=0.2,
    restitution=0.5,
    rolling_friction=0.0,
)


def harmless(params, kind, seed):
    """Accelerations (n, 3) [m/s2], just harmless.

    One shock, a long pull, or one that turns over and over.
    """
    heap = settled_heap(params, GRAVITY, DT, int(np.random.default_rng(seed).integers(16)))
    most = 0.999 * harmless_jolt(heap, params, GRAVITY)
    direction = np.random.default_rng((7, seed)).uniform(-math.pi, math.pi)
    sizes = {
        "shock": [0.2 / DT],
        "pull": np.ones(120),
        "shaking": np.where(np.arange(240) % 60 < 30, 1.0, -1.0),
    }[kind]
    return most * np.outer(sizes, (math.cos(direction), math.sin(direction), 0.0))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["shock", "pull", "shaking"])
@pytest.mark.parametrize(
    "params", [PARAMS, dataclasses.replace(PARAMS, fill=0.7), SMOOTH], ids=["0.6", "0.7", "smooth"]
)
def test_what_counts_as_harmless_spills_nothing(monkeypatch, params, kind):
    accelerations = [harmless(params, kind, seed) for seed in range(6)]
    monkeypatch.setattr("harness.world.cargo.cargo.harmless_jolt", lambda *given: ALWAYS)
    bucket = Cargo(dataclasses.replace(params, wake_acceleration=0.01), GRAVITY, DT)
    try:
        lost = [
            shake(bucket, each, seed, calm=0.3).pieces_outside
            for seed, each in enumerate(accelerations)
        ]
    finally:
        bucket.close()
    assert lost == [0] * 6


@pytest.mark.parametrize(
    ("height", "changes", "most"),
    [
        (0.0, {}, math.sqrt(2.0 * GRAVITY * 0.1) / 0.2),  # a shock
        (0.05, {}, 0.5 * GRAVITY),  # the surface inclined
        (0.1, {}, 0.0),  # a piece at the rim
        (0.11, {}, 0.0),
        (0.0, {"bucket": "free"}, 0.0),
    ],
)
def test_the_harmless_shaking_is_that_of_a_liquid(height, changes, most):
    params = SimpleNamespace(
        **{"bucket": "fixed", "bucket_height": 0.1, "bucket_width": 0.2} | changes
    )
    heap = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, height]])
    assert harmless_jolt(heap, params, GRAVITY) == pytest.approx(most)


def test_pieces_simulated_late_are_where_they_would_be(cargo, monkeypatch):
    """Harmless shakes, rests between them, then a shock that spills.

    Nothing, then everything is simulated.
    """
    motion = np.concatenate(
        (braking(4.9, 0.3), np.zeros((90, 3)), braking(5.5, 0.1), shock(4.0), braking(5.0, 0.2))
    )
    late = [shake(cargo, motion[:n], seed=2) for n in (36, 138, 139, len(motion))]
    places = cargo.positions
    monkeypatch.setattr("harness.world.cargo.cargo.harmless_jolt", lambda *given: ALWAYS)
    assert late == [shake(cargo, motion[:n], seed=2) for n in (36, 138, 139, len(motion))]
    assert np.array_equal(places, cargo.positions)
    assert late[1].pieces_outside == 0 < late[2].pieces_outside


def test_nothing_is_simulated_while_nothing_can_be_spilled(monkeypatch):
    steps = []
    monkeypatch.setattr("harness.world.cargo.cargo.step_with", lambda *given: steps.append(given))
    bucket = Cargo(PARAMS, GRAVITY, DT)
    shake(bucket, braking(5.0, 0.2))
    assert not steps
    shake(bucket, np.concatenate((braking(5.0, 0.2), shock(3.0))), calm=0.0)
    assert len(steps) == 25
    bucket.close()


def test_what_is_left_in_the_bucket_is_what_the_next_episode_begins_with(fuller):
    left = shake(fuller, shock(2.0))
    pieces = fuller.pieces_on_robot
    assert pieces == left.pieces_at_start - left.pieces_outside < left.pieces_at_start
    fuller.reset(np.random.default_rng(1))
    whole = fuller.positions
    fuller.reset(np.random.default_rng(1), 0.0, 30)
    assert fuller.state.pieces_at_start == len(fuller.positions) == 30
    assert fuller.positions[:, 2].max() <= np.sort(whole[:, 2])[29]
    fuller.reset(np.random.default_rng(1), 0.0, 0)
    assert shake_on(fuller, shock(2.0)).lost_fraction == 0.0
