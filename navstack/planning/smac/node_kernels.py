"""The poses that a search has come to, and the table in which it finds them again."""

from typing import NamedTuple

import numpy as np

from navstack.jit import njit
from navstack.planning.smac.pose_problem import SearchGround
from navstack.types import BoolArray, FloatArray, IntArray

_EMPTY = -1
_MIX = np.uint64(0x9E3779B97F4A7C15)  # Knuth's multiplicative hash, 2^64 / golden ratio


@njit()
def slot(keys: IntArray, key: int) -> int:
    """Where a key stands in an open-addressing table, or would."""
    mask = np.uint64(len(keys) - 1)
    at = (np.uint64(key) * _MIX) >> np.uint64(20)
    while True:
        at &= mask
        if keys[np.int64(at)] == key or keys[np.int64(at)] == _EMPTY:
            return int(at)
        at += np.uint64(1)


class Nodes(NamedTuple):
    """Poses that a search has come to; room for more than there are."""

    places: FloatArray  # (room, 2) [cells]
    headings: IntArray  # (room,) their numbers
    parents: IntArray  # (room,) -1: none
    by: IntArray  # (room,) the parent's motion
    travelled: FloatArray  # (room,) cost of the way to it
    ahead: FloatArray  # (room,) at least that of the way on
    is_done: BoolArray  # (room,)
    keys: IntArray  # (4 * room,) open-addressing table: cell and heading ..
    numbers: IntArray  # (4 * room,) .. -> node


@njit()
def make_nodes(room: int) -> Nodes:
    """Room for nodes, of which there are none."""
    return Nodes(
        np.empty((room, 2)),
        np.empty(room, dtype=np.int64),
        np.empty(room, dtype=np.int64),
        np.empty(room, dtype=np.int64),
        np.empty(room),
        np.empty(room),
        np.zeros(room, dtype=np.bool_),
        np.full(4 * room, _EMPTY, dtype=np.int64),
        np.empty(4 * room, dtype=np.int64),
    )


@njit()
def more_nodes(nodes: Nodes, count: int) -> Nodes:
    """The same nodes with twice the room."""
    larger = make_nodes(2 * len(nodes.headings))
    larger.places[:count] = nodes.places[:count]
    larger.headings[:count] = nodes.headings[:count]
    larger.parents[:count] = nodes.parents[:count]
    larger.by[:count] = nodes.by[:count]
    larger.travelled[:count] = nodes.travelled[:count]
    larger.ahead[:count] = nodes.ahead[:count]
    larger.is_done[:count] = nodes.is_done[:count]
    for i in range(len(nodes.keys)):
        if nodes.keys[i] != _EMPTY:
            at = slot(larger.keys, nodes.keys[i])
            larger.keys[at] = nodes.keys[i]
            larger.numbers[at] = nodes.numbers[i]
    return larger


@njit(inline="always")
def key_of(
    ground: SearchGround,
    x: float,
    y: float,
    heading: int,
    bins: int,
) -> int:
    """The number of a cell and a heading."""
    return int((int(y) * ground.costs.shape[1] + int(x)) * bins + heading)
