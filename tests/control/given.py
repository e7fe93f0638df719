"""Robots, ground and plans that the tests of controllers share."""

import math

import numpy as np

from navstack.control.controller import Surroundings
from navstack.control.controller_server import ControllerServer
from navstack.control.dwb.critics.critic import Critic
from navstack.control.goal_checker import SimpleGoalChecker
from navstack.control.progress_checker import SimpleProgressChecker
from navstack.costmap.costmap import LETHAL_OBSTACLE, Costmap
from navstack.costmap.inflation import Inflation
from navstack.params.checkers import SimpleGoalCheckerParams, SimpleProgressCheckerParams
from navstack.params.costmap import InflationLayerParams
from navstack.params.dwb import (
    AlignParams,
    DistParams,
    DwbParams,
    ObstacleParams,
    RotateToGoalParams,
)
from navstack.params.servers import ControllerServerParams
from navstack.types import Path, Pose2D, RobotState, Twist2D

RESOLUTION = 0.05  # [m]
INSCRIBED = 0.19  # [m] of the delivery robot
LAYER = InflationLayerParams(inflation_radius=1.5, cost_scaling_factor=3.0)


def box(front, rear, side):
    """A rectangular footprint (4, 2) [m], clockwise from the front left."""
    return np.array(((front, side), (front, -side), (rear, -side), (rear, side)))


DELIVERY_ROBOT = box(0.19, -0.657, 0.3)
SMALL_ROBOT = box(0.2, -0.4, 0.2)
STANDARD_CRITICS = (
    "RotateToGoal",
    "Oscillation",
    "BaseObstacle",
    "GoalAlign",
    "PathAlign",
    "PathDist",
    "GoalDist",
)
DWB = DwbParams(
    critics=STANDARD_CRITICS,
    max_vel_x=1.0,
    max_speed_xy=1.0,
    max_vel_theta=1.2,
    acc_lim_x=2.5,
    decel_lim_x=-2.5,
    acc_lim_theta=3.5,
    decel_lim_theta=-3.5,
    linear_granularity=0.05,
    RotateToGoal=RotateToGoalParams(scale=32.0),
    BaseObstacle=ObstacleParams(scale=0.02),
    GoalAlign=AlignParams(scale=24.0, forward_point_distance=0.1),
    PathAlign=AlignParams(scale=32.0, forward_point_distance=0.1),
    PathDist=DistParams(scale=32.0),
    GoalDist=DistParams(scale=24.0),
)


def robot(x=0.0, y=0.0, yaw=0.0, v=0.0, w=0.0, stamp=0.0):
    """A robot whose odometry is its belief."""
    pose = Pose2D(x, y, yaw)
    return RobotState(pose, Twist2D(v, 0.0, w), stamp, pose)


def straight(length=3.0, yaw=0.0, count=61):
    """A plan from the origin on."""
    along = np.linspace(0.0, length, count)
    x = along * math.cos(yaw)
    y = along * math.sin(yaw)
    return Path(np.column_stack((x, y, np.full(count, yaw))))


def plan_of(*poses):
    """A plan of poses (x, y, yaw)."""
    return Path(np.array(poses))


def ground_with(*points, cost=LETHAL_OBSTACLE, cells=160, middle=(0.0, 0.0)):
    """A free square about a place, with a cell of a cost at each point."""
    corner = np.array(middle) - 0.5 * cells * RESOLUTION
    costmap = Costmap(np.zeros((cells, cells), dtype=np.uint8), RESOLUTION, *corner.tolist())
    for x, y in points:
        column, row = costmap.world_to_map(x, y)
        costmap.data[row, column] = cost
    return Surroundings(costmap)


def inflated(width, height, origin, *boxes):
    """A costmap of so many cells with lethal boxes (x0, x1, y0, y1), inflated by LAYER."""
    costs = np.zeros((height, width), dtype=np.uint8)
    costmap = Costmap(costs, RESOLUTION, *origin)
    for x0, x1, y0, y1 in boxes:
        left, low = costmap.world_to_map(x0, y0)
        right, high = costmap.world_to_map(x1, y1)
        costs[low : high + 1, left : right + 1] = LETHAL_OBSTACLE
    Inflation(LAYER, RESOLUTION, INSCRIBED).apply(costs, 0, width, 0, height)
    return costmap


def moved(pose, twist, dt):
    """Where a robot is that turns, then drives on along its new heading."""
    yaw = pose.yaw + dt * twist.angular_z
    step = dt * twist.linear_x
    return Pose2D(pose.x + step * math.cos(yaw), pose.y + step * math.sin(yaw), yaw)


def filled(cost, x=0.0, y=0.0):
    """Ground about a place whose every cell has a cost."""
    around = ground_with(middle=(x, y))
    around.costmap.data[:] = cost
    return around


def server_of(controller, goal_checker=None, **params):
    """A controller's server with Nav2's checkers."""
    return ControllerServer(
        ControllerServerParams(**params),
        controller,
        goal_checker or SimpleGoalChecker(SimpleGoalCheckerParams()),
        SimpleProgressChecker(SimpleProgressCheckerParams()),
    )


class FixedCosts(Critic):
    """A critic of DWB: one cost for all trajectories, others for some by their numbers."""

    def __init__(self, scale, costs=None, otherwise=5.0):
        super().__init__(scale)
        self._costs = costs or {}
        self._otherwise = otherwise
        self.resets = 0
        self.commands = []

    def reset(self):
        self.resets += 1

    def raw_costs(self, rollouts, scene):
        costs = np.full(len(rollouts.commands), self._otherwise)
        for index, cost in self._costs.items():
            costs[index] = cost
        return costs

    def debrief(self, scene, command):
        self.commands.append(command)


OPEN = ground_with()


def command_of(controller, at=None, plan=None, around=OPEN):
    """What a controller commands in one cycle, at rest at the origin of a straight plan."""
    if plan is None:
        plan = straight()
    return controller.compute_velocity(at or robot(), plan, around)
