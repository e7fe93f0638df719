"""How far the GPS-EKF drives before it knows its heading, and whether it errs by as much as it says.

Usage: python benchmarks/check_heading.py [--count 60] [--std 0.05 0.5 2 4] [--rest 0 60]

Fixes once a second with the filter's own model of their errors (the defaults of ``GpsEkfParams``), wheels and gyro at
50 Hz; a robot that knows nothing of its heading stands for ``rest`` seconds, then drives at 1.5 m/s along a bend.
Medians of the way and of the heading's error at that moment; means of the normalized squared errors of yaw and pose.
"""

import math

import numpy as np
from options import parsed

from harness.report.markdown import table
from navstack.geometry import normalize_angle
from navstack.localization.gps_ekf import GpsEkfLocalizer
from navstack.params.gps_ekf import GpsEkfParams
from navstack.types import Belief, GpsFix, Imu, Observation, Odometry, Pose2D, Twist2D

STEP, SPEED, LONGEST = 0.02, 1.5, 60.0  # [s], [m/s], [s] of driving
UNKNOWN = np.diag((1.0, 1.0, math.pi**2 / 3.0))


def trial(seed: int, std: float, rest: float) -> tuple[float, float, float, float]:
    """Way [m], error of the heading [rad], normalized squared errors of yaw and of the pose when it is known."""
    params, rng = GpsEkfParams(), np.random.default_rng(seed)
    localizer = GpsEkfLocalizer(params)
    localizer.reset(Belief(Pose2D(), UNKNOWN), rng)
    share, decay = params.gps0_correlated_share, math.exp(-1.0 / params.gps0_correlation_time)
    x = y = way = 0.0
    yaw, shared = rng.uniform(-math.pi, math.pi), std * math.sqrt(share) * rng.standard_normal(2)
    for k in range(round((rest + LONGEST) / STEP)):
        t = k * STEP
        v = min(SPEED, max(t - rest, 0.0))
        w = 0.1 * math.sin(0.3 * (t - rest)) if v > 0.0 else 0.0
        x, y = x + v * STEP * math.cos(yaw), y + v * STEP * math.sin(yaw)
        yaw, way, fix = yaw + w * STEP, way + v * STEP, None
        if k % round(1.0 / STEP) == 0:
            shared = decay * shared + std * math.sqrt(share * (1.0 - decay**2)) * rng.standard_normal(2)
            error = shared + std * math.sqrt(1.0 - share) * rng.standard_normal(2)
            fix = GpsFix(t, x + error[0], y + error[1], std)
        wheels = Odometry(t, Pose2D(), Twist2D(v + 0.01 * rng.standard_normal(), 0.0, w), 0.01, 0.02)
        unit = Imu(t, math.nan, w + 0.002 * rng.standard_normal(), 0.05 * rng.standard_normal(), 0.0, 0.0, 0.002)
        belief = localizer.update(Observation(t, wheels, unit, fix))
        if localizer.knows_heading:
            break
    off = np.array((belief.pose.x - x, belief.pose.y - y, normalize_angle(belief.pose.yaw - yaw)))
    return way, abs(off[2]), off[2] ** 2 / belief.covariance[2, 2], float(off @ np.linalg.solve(belief.covariance, off))


def main() -> None:
    """Drive and print."""
    given = parsed(__doc__, count=60, std=[0.05, 0.5, 2.0, 4.0], rest=[0.0, 60.0])
    rows = []
    for std in given.std:
        for rest in given.rest:
            found = np.array([trial(seed, std, rest) for seed in range(given.count)])
            way, error = np.median(found[:, :2], axis=0)
            squares = found[:, 2:].mean(axis=0)
            rows.append([f"{std:g}", f"{rest:g}", f"{way:.1f}", f"{error:.3f}", *(f"{each:.2f}" for each in squares)])
    print(table(["fix std [m]", "rest [s]", "way [m]", "heading error [rad]", "yaw", "pose"], rows))


if __name__ == "__main__":
    main()
