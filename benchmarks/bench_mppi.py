"""MPPI: what a cycle of 2000 trajectories of 56 poses takes, part by part and against the NumPy twin of the tests.

python benchmarks/bench_mppi.py
"""

import importlib.util
import math
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path as FilePath

import numpy as np

from navstack.control.controller import Surroundings
from navstack.control.mppi.mppi_controller import MppiController
from navstack.costmap.costmap import Costmap
from navstack.costmap.inflation import Inflation
from navstack.geometry import pad_footprint
from navstack.params.costmap import InflationLayerParams, robot_footprint
from navstack.params.mppi import MppiParams
from navstack.params.nav2_file.file import load_nav2
from navstack.params.nav2_file.views import read_controller, read_costmap
from navstack.types import Path, Pose2D, RobotState, Twist2D

ROOT = FilePath(__file__).parents[1]
FILE = load_nav2(ROOT / "params" / "nav2" / "mppi.yaml")
LOCAL = read_costmap(FILE, "local_costmap")
FOOTPRINT = pad_footprint(robot_footprint(LOCAL), LOCAL.footprint_padding)
FREQUENCY = 20.0  # [Hz]
CYCLES = 400
BOXES = [(x, x + 0.3, y, y + 0.3) for x in (-1.0, 1.0, 3.0, 5.0) for y in (-1.25, 1.0)]  # beside the path, 1 m off


def surroundings(boxes: list[tuple[float, float, float, float]]) -> Surroundings:
    costmap = Costmap(np.zeros((480, 480), dtype=np.uint8), 0.05, -12.0, -12.0)
    for x0, x1, y0, y1 in boxes:
        (left, low), (right, high) = costmap.world_to_map(x0, y0), costmap.world_to_map(x1, y1)
        costmap.data[low : high + 1, left : right + 1] = 254
    layer = next(layer for layer in LOCAL.layers.values() if isinstance(layer, InflationLayerParams))
    Inflation(layer, 0.05, 0.19).apply(costmap.data, 0, 480, 0, 480)
    return Surroundings(costmap)


def straight(length: float) -> Path:
    count = round(length / 0.05) + 1
    return Path(np.column_stack((np.linspace(0.0, length, count), np.zeros((count, 2)))))


def spent(work: Callable[[], object]) -> float:
    """Processor time in [ms]."""
    began = time.process_time_ns()
    work()
    return (time.process_time_ns() - began) * 1e-6


def told(name: str, times: list[float]) -> None:
    middle, least, most = np.percentile(times, (50.0, 0.0, 99.0))
    print(f"{name:32s} median {middle:6.3f} ms   least {least:6.3f} ms   99 % {most:6.3f} ms")


def cycles(params: MppiParams, around: Surroundings) -> tuple[MppiController, list[float]]:
    """A robot that is held at 1.5 m/s at one place, and what its cycles take after the first ones."""
    controller = MppiController(params, FOOTPRINT, FREQUENCY, 0.5)
    controller.seed(np.random.default_rng(0))
    plan, times = straight(11.0), []
    for cycle in range(CYCLES + 20):
        state = RobotState(Pose2D(), Twist2D(1.5), cycle / FREQUENCY)
        times.append(spent(lambda state=state: controller.compute_velocity(state, plan, around)))
    return controller, times[20:]


def parts(controller: MppiController) -> None:
    """What the parts of a cycle take."""
    optimizer, scene = controller._optimizer, controller._cycle.scene
    v, w, noise = optimizer._v, optimizer._w, optimizer._next_noise()
    rollouts = optimizer._rollouts
    told(
        "  noise and trajectories",
        [spent(lambda: optimizer._roll_out(rollouts, v, w, noise, scene)) for _ in range(99)],
    )
    for critic in optimizer._critics:
        told(f"  {critic.name}", [spent(lambda critic=critic: critic.score(rollouts, scene)) for _ in range(99)])
    costs = np.zeros(rollouts.count, dtype=np.float32)
    told("  update", [spent(lambda: optimizer._update(rollouts, costs.copy())) for _ in range(99)])


def twin_cycle(controller: MppiController, around: Surroundings) -> float:
    """The same work, once, by the NumPy twin, in [ms]."""
    spec = importlib.util.spec_from_file_location("mppi_twin", ROOT / "tests" / "control" / "mppi_twin.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    params, optimizer = controller._params, controller._optimizer
    noise, pose, twist = optimizer._next_noise(), Pose2D(), Twist2D(1.5)
    path = straight(11.0).poses[:113]
    twin = module.Twin(params, FOOTPRINT, 0.5)
    v, w = optimizer._v.astype(float), optimizer._w.astype(float)

    def work() -> None:
        twin.roll_out(noise.v.T, noise.w.T, v, w, pose, twist)
        twin.look(path, Pose2D(11.0), pose, around.costmap)
        told_costs = [twin.cost_of(name) for name in params.critics]
        twin.update(sum(costs for costs in told_costs if costs is not None), v, w)

    return min(spent(work) for _ in range(3))


def closed_loop(params: MppiParams, seed: int) -> tuple[float, float, float]:
    """Mean speed [m/s], RMS distance to a winding path [m] and RMS yaw acceleration [rad/s2] of a perfect robot."""
    controller = MppiController(params, FOOTPRINT, FREQUENCY, 0.5)
    controller.seed(np.random.default_rng(seed))
    s = np.arange(0.0, 40.0, 0.05)
    plan = Path(np.column_stack((s, 0.5 * np.sin(0.6 * s), np.arctan(0.3 * np.cos(0.6 * s)))))
    costmap = Costmap(np.zeros((480, 1200), dtype=np.uint8), 0.05, -12.0, -12.0)
    x, y, yaw, v, w = 0.0, 0.0, 0.3, 0.0, 0.0
    rows = []
    for cycle in range(300):
        state = RobotState(Pose2D(x, y, yaw), Twist2D(v, 0.0, w), cycle / FREQUENCY)
        command = controller.compute_velocity(state, plan, Surroundings(costmap))
        v, w = command.linear_x, command.angular_z
        yaw += w / FREQUENCY
        x, y = x + v * math.cos(yaw) / FREQUENCY, y + v * math.sin(yaw) / FREQUENCY
        rows.append((v, y - 0.5 * math.sin(0.6 * x), w))
    settled = np.array(rows)[60:]
    jitter = np.diff(settled[:, 2]) * FREQUENCY
    return float(settled[:, 0].mean()), float(np.sqrt((settled[:, 1] ** 2).mean())), float(np.sqrt((jitter**2).mean()))


def main() -> None:
    params = read_controller(FILE).params
    print(f"{params.batch_size} trajectories of {params.time_steps} poses, processor time, n = {CYCLES}")
    for name, boxes in (("free", []), ("8 obstacles", BOXES)):
        around = surroundings(boxes)
        controller, times = cycles(params, around)
        told(f"cycle, {name}", times)
        parts(controller)
        slow = twin_cycle(controller, around)
        print(f"  NumPy twin {slow:.0f} ms: {slow / np.median(times):.0f} times as long")
    print("closed loop on a winding path, 10 seeds: mean speed, RMS distance to it, RMS yaw acceleration; a cycle")
    for kept in (True, False):
        changed = replace(params, regenerate_noises=not kept)
        results = np.array([closed_loop(changed, seed) for seed in range(10)])
        (v, off, jitter), spread = results.mean(axis=0), results.std(axis=0)
        times = cycles(changed, surroundings([]))[1]
        name = "one noise set" if kept else "new noise every cycle"
        print(
            f"  {name:22s} {v:.3f} +- {spread[0]:.3f} m/s  {100 * off:.2f} +- {100 * spread[1]:.2f} cm  "
            f"{jitter:.3f} +- {spread[2]:.3f} rad/s2  {np.median(times):.2f} ms"
        )


if __name__ == "__main__":
    main()
