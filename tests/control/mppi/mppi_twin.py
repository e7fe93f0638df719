"""A slow twin of MPPI in NumPy and double precision, a row per trajectory.

What the kernels are held to.
"""

import math

import numpy as np

from navstack.control.footprint_cost import footprint_cost
from navstack.costmap.inflation import inflation_cost
from navstack.geometry import footprint_radii
from navstack.types import Pose2D


def wrapped(angle):
    return (np.asarray(angle) + math.pi) % (2.0 * math.pi) - math.pi


class Twin:
    """One update of the control sequence; positions in the map frame."""

    def __init__(self, params, footprint, xy_goal_tolerance):
        self.params = params
        self.footprint = footprint
        self.tolerance = xy_goal_tolerance
        self.inscribed, self.circumscribed = footprint_radii(footprint)

    @property
    def limits(self):
        """Of v, w and vy: least, most, most negative and most positive change per step."""
        p = self.params
        dt = self.params.model_dt
        return (
            (p.vx_min, p.vx_max, p.ax_min * dt, p.ax_max * dt),
            (-p.wz_max, p.wz_max, -p.az_max * dt, p.az_max * dt),
            (-p.vy_max, p.vy_max, p.ay_min * dt, p.ay_max * dt),
        )

    def roll_out(self, noise, sequences, pose, twist):
        """Noise (A, B, T) and sequences (A, T) to controls and trajectories (B, T).

        They are of v, w and perhaps vy.
        """
        dt = self.params.model_dt
        # in the precision of the kernels: the limits turn about where a velocity is exactly zero
        self.controls = sequences[:, None, :].astype(np.float32) + noise
        driven = np.zeros((3, *noise.shape[1:]), dtype=np.float32)
        measured = (twist.linear_x, twist.angular_z, twist.linear_y)
        for control, speed, start, (_, _, fall, rise) in zip(
            self.controls, driven, measured, self.limits, strict=False
        ):
            speed[:, 0] = start
            for t in range(1, speed.shape[1]):
                last = speed[:, t - 1]
                forward = last > 0.0
                low = last + np.where(forward, fall, -rise).astype(np.float32)
                high = last + np.where(forward, rise, -fall).astype(np.float32)
                speed[:, t] = control[:, t - 1] = control[:, t - 1].clip(low, high)
        driven = driven.astype(float)
        self.v, self.w, self.vy = driven
        self.yaw = pose.yaw + np.cumsum(self.w * dt, axis=1)
        before = np.hstack((np.full((len(self.v), 1), pose.yaw), self.yaw[:, :-1]))
        cosine = np.cos(before)
        sine = np.sin(before)
        self.x = pose.x + np.cumsum((self.v * cosine - self.vy * sine) * dt, axis=1)
        self.y = pose.y + np.cumsum((self.v * sine + self.vy * cosine) * dt, axis=1)

    def look(self, path, goal, pose, costmap):
        """Take in the path near the robot (N, 3), the goal and the costmap."""
        self.path = path
        self.goal = goal
        self.pose = pose
        self.costmap = costmap
        self.to_goal = math.hypot(goal.x - pose.x, goal.y - pose.y)
        ends = np.hypot(self.x[:, -1:] - path[:, 0], self.y[:, -1:] - path[:, 1])
        self.furthest = 0
        for row in ends:
            self.furthest += int(row[self.furthest :].argmin())
        costs = self.costs_at(path[:-1, 0], path[:-1, 1])
        unknown_is_free = self.params.local_costs.tracks_unknown
        self.free = (costs < 253) | ((costs == 255) & unknown_is_free)
        self.free &= ~self.off_map(path[:-1, 0], path[:-1, 1])

    def off_map(self, x, y):
        c = self.costmap
        mx = np.floor((x - c.origin_x) / c.resolution)
        my = np.floor((y - c.origin_y) / c.resolution)
        return (mx < 0) | (my < 0) | (mx >= c.size_x) | (my >= c.size_y)

    def costs_at(self, x, y):
        c = self.costmap
        mx = np.floor((x - c.origin_x) / c.resolution).astype(int).clip(0, c.size_x - 1)
        my = np.floor((y - c.origin_y) / c.resolution).astype(int).clip(0, c.size_y - 1)
        return np.where(self.off_map(x, y), 255, c.data[my, mx]).astype(int)

    def under_robot(self, costs, step, critic, in_free_cells=False):
        """Greatest cost under the outline (B, S) where the critic looks at it.

        Else it is that of the centre.
        """
        layer = self.params.local_costs.inflation(critic.inflation_layer_name)
        if not critic.consider_footprint:
            return costs, np.zeros(costs.shape, dtype=bool)
        least = 0
        if layer is not None and layer.inflation_radius < self.circumscribed:
            least = 1
        elif layer is not None:
            least = inflation_cost(self.circumscribed, self.inscribed, layer.cost_scaling_factor)
        looked = (costs >= least) & (in_free_cells | (costs > 0))
        worst = costs.copy()
        for b, s in zip(*np.nonzero(looked), strict=True):
            at = Pose2D(self.x[b, s * step], self.y[b, s * step], self.yaw[b, s * step])
            worst[b, s] = footprint_cost(self.costmap, self.footprint, at)
        return worst, looked

    def collisions(self, worst, critic):
        hit = (worst == 254) | ((worst == 253) & (not critic.consider_footprint))
        return hit | ((worst == 255) & (not self.params.local_costs.tracks_unknown))

    def cost_of(self, name):
        """What a critic adds (B,); None: it does not count."""
        own = getattr(self.params, name)
        result = getattr(self, f"_{name}")(own)
        if result is None:
            return None
        weight = getattr(own, "cost_weight", 1.0) / (254.0 if name == "CostCritic" else 1.0)
        return (result * weight) ** max(own.cost_power, 1)

    def _ConstraintCritic(self, own):  # noqa: N802 - as the critic is called
        p = self.params
        most = math.hypot(p.vx_max, p.vy_max)
        least = math.hypot(p.vx_min, p.vy_max) * (1.0 if p.vx_min > 0.0 else -1.0)
        speed = np.copysign(np.sqrt(self.v**2 + self.vy**2), self.v)
        beyond = np.maximum(speed - most, 0.0) + np.maximum(least - speed, 0.0)
        if p.motion_model == "Ackermann":
            with np.errstate(divide="ignore"):
                beyond += np.maximum(
                    p.AckermannConstraints.min_turning_r - abs(self.v) / abs(self.w), 0.0
                )
        return (beyond * p.model_dt).sum(axis=1)

    def _CostCritic(self, own):  # noqa: N802
        step = own.trajectory_point_step
        poses = self.x.shape[1] // step
        costs = self.costs_at(self.x[:, ::step][:, :poses], self.y[:, ::step][:, :poses])
        worst, _ = self.under_robot(costs, step, own)
        hit = self.collisions(worst, own) & (costs > 0)
        each = np.where(costs >= own.near_collision_cost, own.critical_cost, costs)
        if self.to_goal < own.near_goal_distance:
            each = np.where(costs >= own.near_collision_cost, each, 0.0)
        self.hits = hit.any(axis=1)
        return np.where(self.hits, own.collision_cost, each.sum(axis=1)) / costs.shape[1]

    def _ObstaclesCritic(self, own):  # noqa: N802
        layer = self.params.local_costs.inflation(own.inflation_layer_name)
        costs = self.costs_at(self.x, self.y)
        beyond = self.off_map(self.x, self.y)  # where the outline is not looked at
        worst, looked = self.under_robot(np.where(beyond, -1, costs), 1, own, True)
        worst = np.where(beyond, 255, worst)
        hit = self.collisions(worst, own)
        alive = np.cumsum(hit, axis=1) == 0
        scale = layer.cost_scaling_factor
        distance = (scale * self.inscribed - np.log(np.maximum(worst, 1)) + math.log(253.0)) / scale
        distance -= np.where(looked, 0.0, self.inscribed)
        counted = alive & (worst > 0)
        near = np.where(
            counted, np.maximum(own.collision_margin_distance - distance, 0.0), 0.0
        ).sum(axis=1)
        repulsion = np.where(counted, layer.inflation_radius - distance, 0.0).sum(axis=1)
        if self.to_goal < own.near_goal_distance:
            repulsion[:] = 0.0
        self.hits = hit.any(axis=1)
        near[self.hits] = own.collision_cost
        return (
            own.critical_weight * near
            + own.repulsion_weight * (repulsion - repulsion.min()) / self.x.shape[1]
        )

    def _GoalCritic(self, own):  # noqa: N802
        if self.to_goal >= own.threshold_to_consider:
            return None
        return np.hypot(self.x - self.goal.x, self.y - self.goal.y).mean(axis=1)

    def _GoalAngleCritic(self, own):  # noqa: N802
        if self.to_goal >= own.threshold_to_consider:
            return None
        angles = abs(wrapped(self.path[-1, 2] - self.yaw))
        if own.symmetric_yaw_tolerance:
            opposite = abs(wrapped(self.path[-1, 2] + math.pi - self.yaw))
            angles = np.minimum(angles, opposite)
        return angles.mean(axis=1)

    def _PathAlignCritic(self, own):  # noqa: N802
        n = self.furthest
        if self.to_goal < own.threshold_to_consider or n < max(own.offset_from_furthest, 1):
            return None
        blocked = int((~self.free[:n]).sum())
        if blocked > 2 and blocked / n > own.max_path_occupancy_ratio:
            return None
        path = self.path[:n]
        along = np.r_[0.0, np.cumsum(np.hypot(np.diff(path[:, 0]), np.diff(path[:, 1])))]
        x, y, yaw = (each[:, :: own.trajectory_point_step] for each in (self.x, self.y, self.yaw))
        driven = np.cumsum(np.hypot(np.diff(x), np.diff(y)), axis=1)
        nearest = abs(driven[:, :, None] - along).argmin(axis=2)
        squared = (path[nearest, 0] - x[:, 1:]) ** 2 + (path[nearest, 1] - y[:, 1:]) ** 2
        if own.use_path_orientations:
            squared += wrapped(yaw[:, 1:] - path[nearest, 2]) ** 2
        counted = self.free[:n][nearest]
        return (np.sqrt(squared) * counted).sum(axis=1) / np.maximum(counted.sum(axis=1), 1)

    def _PathAngleCritic(self, own):  # noqa: N802
        if self.to_goal < own.threshold_to_consider:
            return None
        x, y, yaw = self.path[min(self.furthest + own.offset_from_furthest, len(self.path) - 1)]
        mode = 0 if own.mode == 1 and self.params.vx_min >= 0.0 else own.mode
        bearing = math.atan2(y - self.pose.y, x - self.pose.x)
        now = abs(wrapped(bearing - self.pose.yaw))
        if (mode == 1 and now > math.pi / 2) or (
            mode == 2 and abs(wrapped(bearing - yaw)) > math.pi / 2
        ):
            now = math.pi - now
        if now < own.max_angle_to_furthest:
            return None
        bearings = np.arctan2(y - self.y[:, -1], x - self.x[:, -1])
        errors = abs(wrapped(bearings - self.yaw[:, -1]))
        backwards = {
            0: False,
            1: errors > math.pi / 2,
            2: abs(wrapped(bearings - yaw)) > math.pi / 2,
        }[mode]
        return np.where(backwards, math.pi - errors, errors)

    def _PathFollowCritic(self, own):  # noqa: N802
        if self.to_goal < own.threshold_to_consider or len(self.path) < 2:
            return None
        i = min(self.furthest + own.offset_from_furthest, len(self.path) - 1)
        while i < len(self.path) - 2 and not self.free[i]:
            i += 1
        return np.hypot(self.x[:, -1] - self.path[i, 0], self.y[:, -1] - self.path[i, 1])

    def _PreferForwardCritic(self, own):  # noqa: N802
        if self.to_goal < own.threshold_to_consider:
            return None
        return (np.maximum(-self.v, 0.0) * self.params.model_dt).sum(axis=1)

    def _TwirlingCritic(self, own):  # noqa: N802
        return None if self.to_goal < self.tolerance else abs(self.w).mean(axis=1)

    def _VelocityDeadbandCritic(self, own):  # noqa: N802
        v, vy, w = (abs(each) for each in own.deadband_velocities)
        below = np.maximum(v - abs(self.v), 0.0) + np.maximum(w - abs(self.w), 0.0)
        if self.params.motion_model == "Omni":
            below += np.maximum(vy - abs(self.vy), 0.0)
        return (below * self.params.model_dt).sum(axis=1)

    def update(self, costs, sequences):
        """The new sequences (A, T), within the limits."""
        p = self.params
        for control, sequence, std in zip(
            self.controls, sequences, (p.vx_std, p.wz_std, p.vy_std), strict=False
        ):
            costs = costs + p.gamma / std**2 * ((control - sequence) * sequence).sum(axis=1)
        shares = np.exp(-(costs - costs.min()) / p.temperature)
        shares /= shares.sum()
        updated = []
        for control, (least, most, fall, rise) in zip(self.controls, self.limits, strict=False):
            new = (shares @ control).clip(least, most)
            for t in range(1, len(new)):
                new[t] = min(new[t - 1] + rise, max(new[t], new[t - 1] + fall))
            updated.append(new)
        return updated


def smoothed(sequence, history):
    """Savitzky and Golay's filter by a least-squares parabola over nine values."""
    padded = np.r_[history, sequence, np.repeat(sequence[-1], 4)]
    result = np.array(sequence, dtype=float)
    for t in range(len(sequence) - 1):
        result[t] = np.polynomial.polynomial.polyfit(np.arange(-4, 5), padded[t : t + 9], 2)[0]
    return result
