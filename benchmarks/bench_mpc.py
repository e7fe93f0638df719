"""The jerk-limited MPC: how long it takes, how near it is to the fastest, whether a limit is ever exceeded.

python benchmarks/bench_mpc.py            time and rest to rest
python benchmarks/bench_mpc.py limits     1000 random drives (minutes)
"""

import math
import sys
import time
from dataclasses import replace

import numpy as np
from ruckig import InputParameter, Ruckig, Trajectory

from navstack.control.controller import Surroundings
from navstack.control.mpc.mpc_controller import JerkLimitedMpcController
from navstack.costmap.costmap import Costmap
from navstack.costmap.inflation import Inflation
from navstack.params.costmap import InflationLayerParams
from navstack.params.mpc import MpcParams
from navstack.types import FloatArray, Path, Pose2D, RobotState, Track, Twist2D

FOOTPRINT = np.array(((0.19, 0.3), (0.19, -0.3), (-0.657, -0.3), (-0.657, 0.3)))
FREQUENCY = 30.0  # [Hz]
PERIOD = 1.0 / FREQUENCY
PARAMS = MpcParams()
DRIVES = 1000  # random ones, for the limits
COVARIANCE = np.diag((0.01, 0.01, 0.04, 0.04))
VARIANTS = {
    "CasADi, generated C": PARAMS,
    "CasADi, its own machine": replace(PARAMS, generated_code=False),
}


def costmap(*boxes: tuple[float, float, float, float]) -> Costmap:
    made = Costmap(np.zeros((480, 960), dtype=np.uint8), 0.05, -12.0, -12.0)
    for x0, x1, y0, y1 in boxes:
        (left, low), (right, high) = made.world_to_map(x0, y0), made.world_to_map(x1, y1)
        made.data[low : high + 1, left : right + 1] = 254
    inflation = Inflation(InflationLayerParams(inflation_radius=1.5, cost_scaling_factor=3.0), 0.05, 0.19)
    inflation.apply(made.data, 0, 960, 0, 480)
    return made


def straight(length: float) -> Path:
    count = max(2, round(length / 0.05) + 1)
    return Path(np.column_stack((np.linspace(0.0, length, count), np.zeros((count, 2)))))


def walkers(people: FloatArray, now: float) -> tuple[Track, ...]:
    return tuple(
        Track(i, now, x + now * vx, y + now * vy, vx, vy, 0.3, COVARIANCE) for i, (x, y, vx, vy) in enumerate(people)
    )


def drive(
    controller: JerkLimitedMpcController, plan: Path, grid: Costmap, people: FloatArray, seconds: float
) -> FloatArray:
    """Rows (time, x, y, yaw, v, omega, CPU time of the cycle) of a robot that does what it is told."""
    x = y = yaw = v = omega = a = alpha = 0.0
    rows = []
    controller.reset()
    for cycle in range(round(seconds * FREQUENCY)):
        now = cycle * PERIOD
        state = RobotState(Pose2D(x, y, yaw), Twist2D(v, 0.0, omega), now)
        surroundings = Surroundings(grid, walkers(people, now))
        began = time.thread_time()
        command = controller.compute_velocity(state, plan, surroundings)
        spent = time.thread_time() - began
        last = (v, omega, a, alpha)
        v, omega, a, alpha = controller._motion.tolist()
        assert (v, omega) == (command.linear_x, command.angular_z)
        way = 0.5 * PERIOD * (last[0] + v) + PERIOD**2 / 12.0 * (last[2] - a)
        turn = 0.5 * PERIOD * (last[1] + omega) + PERIOD**2 / 12.0 * (last[3] - alpha)
        x, y = x + way * math.cos(yaw + 0.5 * turn), y + way * math.sin(yaw + 0.5 * turn)
        yaw += turn
        rows.append((now + PERIOD, x, y, yaw, v, omega, spent))
        if math.hypot(x - plan.poses[-1, 0], y - plan.poses[-1, 1]) < 2e-3 and v < 2e-3:
            break
    return np.array(rows)


def show_times() -> None:
    """Solves and cycles on a path with walls, among eight people who walk."""
    rng = np.random.default_rng(3)
    grid = costmap((3.0, 20.0, 1.6, 1.8), (3.0, 20.0, -1.8, -1.6))
    print("CPU time in us, N = 30, 8 people      solve: median    p99   cycle: median    p99     n  failures")
    for name, params in VARIANTS.items():
        controller = JerkLimitedMpcController(params, FOOTPRINT, FREQUENCY)
        drive(controller, straight(15.0), grid, np.empty((0, 4)), 1.0)
        solves: list[float] = []
        solve = controller._solver.step

        def timed(*given: FloatArray, solve: object = solve, solves: list[float] = solves) -> object:
            began = time.thread_time()
            found = solve(*given)  # type: ignore[operator]
            solves.append(time.thread_time() - began)
            return found

        controller._solver.step = timed  # type: ignore[method-assign, assignment]
        cycles = []
        for _ in range(8):
            people = rng.uniform((2.0, -1.3, -1.3, -0.3), (15.0, 1.3, 1.3, 0.3), size=(8, 4))
            cycles += drive(controller, straight(15.0), grid, people, 10.0)[:, 6].tolist()
        values = [1e6 * np.percentile(each, q) for each in (solves, cycles) for q in (50, 99)]
        print(f"{name:36s} {values[0]:14.0f} {values[1]:6.0f} {values[2]:15.0f} {values[3]:6.0f} "
              f"{len(cycles):5d} {controller.failures:9d}")  # fmt: skip


def show_rest_to_rest() -> None:
    """Durations against the analytic optimum; arrived: within 2 mm at less than 2 mm/s."""
    print("\nrest to rest [m]      optimum [s]   ours [s]")
    controller = JerkLimitedMpcController(PARAMS, FOOTPRINT, FREQUENCY, 0.01)
    grid = costmap()
    for length in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0):
        given, trajectory = InputParameter(1), Trajectory(1)
        given.target_position, given.max_velocity = [length], [PARAMS.max_speed]
        given.max_acceleration, given.min_acceleration = [PARAMS.max_acceleration], [-PARAMS.max_deceleration]
        given.max_jerk = [PARAMS.max_jerk]
        Ruckig(1).calculate(given, trajectory)
        seconds = trajectory.duration + 3.0
        ours = drive(controller, straight(length), grid, np.empty((0, 4)), seconds)[-1, 0]
        print(f"{length:16.1f} {trajectory.duration:16.3f} {ours:10.3f}")


def random_plan(rng: np.random.Generator) -> Path:
    """Curves, some too tight for the speed."""
    yaw = np.cumsum(np.repeat(rng.normal(scale=1.2, size=8), 30)) * 0.05 + rng.uniform(-3.0, 3.0)
    return Path(np.column_stack((np.cumsum(np.cos(yaw)) * 0.05, np.cumsum(np.sin(yaw)) * 0.05, yaw)))


def excess(v: FloatArray, omega: FloatArray) -> FloatArray:
    """By how much commands (n,) from standstill on exceed: speed, yaw rate, their accelerations and jerks, v omega."""
    worst = []
    for rate, low, high, slower, faster, jerk in (
        (v, 0.0, PARAMS.max_speed, PARAMS.max_deceleration, PARAMS.max_acceleration, PARAMS.max_jerk),
        (omega, -PARAMS.max_yaw_rate, PARAMS.max_yaw_rate, PARAMS.max_yaw_acceleration,
         PARAMS.max_yaw_acceleration, PARAMS.max_yaw_jerk),
    ):  # fmt: skip
        rate = np.concatenate(((0.0, 0.0), rate))
        first, second = np.diff(rate) / PERIOD, np.diff(rate, 2) / PERIOD**2
        worst += [max(low - rate.min(), rate.max() - high), max(-slower - first.min(), first.max() - faster)]
        worst.append(np.abs(second).max() - jerk)
    worst.append(np.abs(v * omega).max() - PARAMS.max_lateral_acceleration)
    return np.array(worst)


def show_limits() -> None:
    """The largest excess over random drives of 3 s among obstacles and people; negative: never reached."""
    print("\nlargest excess over the limits: v, a, jerk, omega, alpha, yaw jerk, v omega")
    controller = JerkLimitedMpcController(PARAMS, FOOTPRINT, FREQUENCY)
    rng = np.random.default_rng(7)
    worst = np.full(7, -math.inf)
    for _ in range(DRIVES):
        grid = costmap(*((x, x + 0.3, y, y + 0.3) for x, y in rng.uniform(-6.0, 6.0, size=(6, 2))))
        people = rng.uniform((-6.0, -6.0, -1.5, -1.5), (6.0, 6.0, 1.5, 1.5), size=(4, 4))
        driven = drive(controller, random_plan(rng), grid, people, 3.0)
        worst = np.maximum(worst, excess(driven[:, 4], driven[:, 5]))
    print(f"{DRIVES} drives: " + "  ".join(f"{value:.1e}" for value in worst) + f"  failures {controller.failures}")


def main() -> None:
    if sys.argv[1:] == ["limits"]:
        show_limits()
        return
    show_times()
    show_rest_to_rest()


if __name__ == "__main__":
    main()
