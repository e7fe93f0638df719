"""A drive along a corridor, as the robot's sensors tell of it."""

import math

import numpy as np

from navstack.costmap.distances import squared_distances
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from navstack.geometry import compose
from navstack.localization.amcl_kernels import cast_rays
from navstack.types import GpsFix, Imu, LaserScan, Observation, Odometry, Pose2D, Twist2D

RESOLUTION = 0.05  # [m]
BEAMS, RANGE = 180, 12.0  # of the scanner, [m]
RATE = 30  # [Hz] of the odometry; scans and fixes come with every third
SPEED = 1.0  # [m/s]
START = Pose2D(5.0, 5.0, 0.0)


def make_grid(pillars):
    """A corridor of 40 m x 10 m, with pillars at some of its cells."""
    cells = np.full((200, 800), FREE, dtype=np.int8)
    cells[:4] = cells[-4:] = OCCUPIED
    for row, column in pillars:
        cells[row : row + 8, column : column + 8] = OCCUPIED
    return OccupancyGrid(cells, RESOLUTION, Pose2D())


def with_landmarks():
    """With pillars of which no stretch has the same."""
    rng = np.random.default_rng(4)
    rows = (12, 40, 150, 175)
    return make_grid([(int(rng.choice(rows)), column) for column in range(20, 780, 45)])


def scanner(grid):
    """Makes what a scanner at the base sees from a pose."""
    occupied = np.pad(grid.data != FREE, 1, constant_values=True)
    clear = np.ceil(np.sqrt(squared_distances(occupied, 100_000) / 2.0)).astype(np.uint8)
    bearings = np.linspace(-math.pi, math.pi, BEAMS, endpoint=False)

    def see(pose, stamp):
        sensor = np.array([[pose.x / RESOLUTION + 1.5, pose.y / RESOLUTION + 1.5, pose.yaw]])
        ranges = cast_rays(clear, sensor, bearings, RANGE / RESOLUTION)[0] * RESOLUTION
        ranges[ranges >= RANGE] = math.inf
        return LaserScan(stamp, ranges, -math.pi, 2.0 * math.pi / BEAMS, 0.05, RANGE)

    return see


def journey(grid, seconds, fix_of=None, scale=1.0, late=0, heading=True, pushed=(math.inf, 0.0)):
    """The observations of all ticks of a drive along the corridor, each with the true pose.

    Args:
        fix_of: makes the fix from stamp and true pose; None: there is none.
        scale: of the odometry's lengths.
        late: ticks by which fixes come after their time.
        heading: whether the inertial unit has an absolute one.
        pushed: [s] when the robot is carried along x while its wheels stand, and [m] how far.
    """
    see, truth, odom, fixes = scanner(grid), START, Pose2D(2.0, 1.0, 0.7), []
    for tick in range(round(seconds * RATE)):
        stamp, is_due = tick / RATE, tick % 3 == 0
        if tick == round(min(pushed[0], 1e6) * RATE):
            truth = Pose2D(truth.x + pushed[1], truth.y, truth.yaw)
        if fix_of is not None and is_due:
            fixes.append(fix_of(stamp, truth))
        fix = scan = None
        if fixes and fixes[0].stamp <= stamp - late / RATE:
            fix = fixes.pop(0)
        if is_due:
            scan = see(truth, stamp)
        imu = Imu(stamp, truth.yaw, 0.0, 0.0, 0.0)
        if not heading:
            imu = Imu(stamp, math.nan, 0.0, 0.0, 0.0)
        yield Observation(stamp, Odometry(stamp, odom, Twist2D(SPEED)), imu, fix, scan), truth
        step = SPEED / RATE
        if stamp >= pushed[0]:
            step = 0.0
        truth, odom = compose(truth, Pose2D(step)), compose(odom, Pose2D(scale * step))


def drive(localizer, *of_journey, **more):
    """The beliefs and truths of all ticks of a :func:`journey`."""
    ticks = journey(*of_journey, **more)
    return [(localizer.update(observation), truth) for observation, truth in ticks]


def errors(rows):
    """[m] of the beliefs (n,)."""
    return np.array([math.hypot(each.pose.x - at.x, each.pose.y - at.y) for each, at in rows])


def exact(std):
    """Fixes without error that claim a standard deviation [m]."""
    return lambda stamp, truth: GpsFix(stamp, truth.x, truth.y, std)
