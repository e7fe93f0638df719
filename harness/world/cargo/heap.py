"""Heaps of popcorn: poured into a bucket, settled there, kept on disk between runs."""

from functools import lru_cache

import numpy as np

from harness.world.cargo.bucket import SCALE, build, step_with
from harness.world.cargo.params import CargoParams
from harness.world.physics.engine import Server, bullet
from navstack.costmap.field_cache import cached_array, content_key
from navstack.types import FloatArray

_SETTLING = 3.0  # [s] in which the poured pieces come to rest
POURS = 16  # differently poured heaps, each of which can be turned and mirrored in eight ways
_LEVEL = (0.0, 0.0, 0.0, 1.0)


@lru_cache(maxsize=4 * POURS)
def settled_heap(params: CargoParams, gravity: float, dt: float, pour: int = 0) -> FloatArray:
    """Centres (n, 3) in [m] of pieces that were poured into the bucket and came to rest.

    Kept on disk between runs.
    """
    key = content_key("settled heap 1", repr(params), gravity, dt, pour, bullet.getAPIVersion())
    heap = cached_array(key, lambda: _settle(params, gravity, dt, pour), is_of_map=False)
    heap.setflags(write=False)
    return heap


def _settle(params: CargoParams, gravity: float, dt: float, pour: int) -> FloatArray:
    """Pour pieces into a bucket and wait until they rest."""
    server = Server()
    client = server.client
    try:
        bucket, pieces = build(client, params, _poured(params, pour), dt)
        for _ in range(round(_SETTLING / dt)):
            step_with(client, bucket, (0.0, 0.0, -gravity), _LEVEL, (0.0, 0.0, 0.0), dt)
        places = [
            bullet.getBasePositionAndOrientation(piece, physicsClientId=client)[0]
            for piece in pieces
        ]
    finally:
        server.close()
    return np.array(places) / SCALE


def _poured(params: CargoParams, pour: int) -> FloatArray:
    """A loose lattice (n, 3) of pieces above the floor, shifted by layers.

    It collapses into a heap.
    """
    radius = params.piece_radius
    pitch = 2.1 * radius
    per_row = max(1, int((params.bucket_width - 2.0 * radius) / pitch) + 1)
    number = np.arange(params.pieces)
    layer, in_layer = np.divmod(number, per_row * per_row)
    row, column = np.divmod(in_layer, per_row)
    slack = 0.5 * (params.bucket_width - 2.0 * radius - (per_row - 1) * pitch)
    rng = np.random.default_rng(pour)
    # a layer moves as a whole
    shift = slack * rng.uniform(-0.9, 0.9, (int(layer.max()) + 1, 2))[layer]
    flat = (np.stack((column, row), axis=1) - 0.5 * (per_row - 1)) * pitch + shift
    return np.column_stack((flat, radius + layer * pitch))


def turned(heap: FloatArray, which: int) -> FloatArray:
    """One of the eight symmetric images of a heap (n, 3) in a square bucket."""
    x, y, z = heap.T
    if which >= 4:
        y = -y
    for _ in range(which % 4):
        x, y = -y, x
    return np.column_stack((x, y, z))
