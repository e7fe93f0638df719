"""Where each number stands in what the solver is given of a step of the horizon."""

from typing import NamedTuple

from navstack.types import FloatMatrix, FloatVector

# Of every step: the point of the path that the step's end is held against, and what is wanted
# there.
# [m] map frame
FOOT_X = 0
FOOT_Y = 1
# unit vector along the path
TANGENT_X = 2
TANGENT_Y = 3
HEADING = 4  # [rad] wanted yaw, on the turn nearest to the predicted one
LEAD = 5  # [m] wanted progress beyond the foot point
SPEED = 6  # [m/s] wanted
JERK = 7  # [m/s3] of the wanted progress
CONTOUR = 8  # [-] factor of the contour weight
# then 3 numbers per circle of the footprint: gradient x, y and offset [m] of its half-plane
BASE = 9
# [m2] added to squared distances to people, so that their roots have gradients at 0
SOFTENED = 1e-6
# and then 3 per person: x, y [m] and the distance [m] below which a circle's centre costs

# Of the whole horizon.
(
    W_CONTOUR,
    W_LAG,
    W_HEADING,
    W_SPEED,
    W_YAW_ACCELERATION,
    W_LATERAL,
    W_OBSTACLE,
    W_PERSON,
    W_JERK,
    W_YAW_JERK,
) = range(10)
LATERAL_LIMIT = 10  # [m/s2]
CIRCLES = 11  # then the circles' centres [m] along the base frame's x axis

TERMS = (
    "contour",
    "lag",
    "heading",
    "speed",
    "yaw acceleration",
    "lateral acceleration",
    "obstacles",
    "people",
    "jerk",
    "yaw jerk",
)


class Sizes(NamedTuple):
    """How large the problem is."""

    steps: int  # N
    circles: int
    people: int

    @property
    def stage(self) -> int:
        """Numbers per step."""
        return BASE + 3 * self.circles + 3 * self.people

    @property
    def shared(self) -> int:
        """Numbers of the whole horizon."""
        return CIRCLES + self.circles


class Horizon(NamedTuple):
    """What the solver is given of all steps, by the places above."""

    stages: FloatMatrix  # (N, Sizes.stage)
    times: FloatVector  # (N,) [s] of the steps
    shared: FloatVector  # (Sizes.shared,)


# The limits, in the order in which kernels take them.
(
    MAX_SPEED,  # [m/s]
    MAX_ACCELERATION,  # [m/s2]
    MAX_DECELERATION,  # [m/s2]
    MAX_JERK,  # [m/s3]
    MAX_YAW_RATE,  # [rad/s]
    MAX_YAW_ACCELERATION,  # [rad/s2]
    MAX_YAW_JERK,  # [rad/s3]
    MAX_LATERAL,  # [m/s2]
) = range(8)
