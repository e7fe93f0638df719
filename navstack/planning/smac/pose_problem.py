"""What a search over poses is given: where the robot may be, where to go, and what ways cost."""

from typing import NamedTuple

from navstack.types import BoolArray, ByteArray, FloatArray

# of SearchGround.room
ROOMY = 1
NARROW = 2


class SearchGround(NamedTuple):
    """Where the robot may be; lengths in [cells]."""

    costs: ByteArray  # (height, width)
    blocked: BoolArray  # (256,) costs that the centre must not have
    footprint: FloatArray  # (N, 2) convex
    reach: float  # its circumscribed radius
    allow_unknown: bool
    # (height, width) whether a cell's surroundings are free: 0 not yet asked, else ROOMY or NARROW
    room: ByteArray


class Penalties(NamedTuple):
    """What makes one way dearer than another of the same length."""

    reverse: float
    change: float
    non_straight: float
    cost: float
    retrospective: float
    rotation: float


class Expansion(NamedTuple):
    """When a curve is tried that leads straight to the goal; lengths in [cells]."""

    ratio: float
    max_length: float
    max_cost: int
    radius: float  # of the curve
    reverses: bool  # backwards all the way, too


class Goal(NamedTuple):
    """Where to, and when to be content with less; lengths in [cells]."""

    pose: FloatArray  # (3,)
    heading: int  # number of its heading
    tolerance: float
    max_iterations: int
    max_on_approach_iterations: int
    coarse: int  # cells along an edge of one of the heuristic's
    window: float  # about the goal, within which the length of Dubins' curve counts; 0: nowhere
    radius: float  # of that curve
