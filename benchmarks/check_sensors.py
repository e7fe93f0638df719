"""What the satellite receivers of the presets deliver along missions, and what a suite of sensors costs.

Usage: python benchmarks/check_sensors.py [--missions 300] [--map sidewalk]

Each mission's shortest path is driven at 1.5 m/s in thought, with the receiver's draws of that mission. Errors count
each mission's fixes; an outage lasts longer than a second. Costs are those of a suite that is asked 30 times a second.
"""

import time

import numpy as np
from fix_picture import fixes_along
from options import parsed

from harness.storage.shipped import shipped
from harness.task.mission import Mission, MissionSampler
from harness.task.shortest_paths import shortest_path
from harness.task.study import make_generators
from harness.world.body_state import BodyState
from harness.world.scene import Scene
from harness.world.scene_io import load_scene
from harness.world.sensors import SensorParams, SensorSuite
from navstack.params.strict import load_dataclass

SPEED = 1.5  # [m/s]
CELL = 8  # cells of the map along the side of one of the paths' cells
OUTAGE = 1.0  # [s]
TICKS, RATE = 3000, 30.0  # of the suite, [Hz]


def way(scene: Scene, mission: Mission) -> np.ndarray:
    """Stamps and positions (n, 3) every 0.5 m along a mission's shortest path."""
    mesh = scene.navigation_mesh
    rows, columns = (size // CELL * CELL for size in mesh.data.shape)
    blocks = mesh.data[:rows, :columns].reshape(rows // CELL, CELL, columns // CELL, CELL)
    free, size, origin = (blocks == 0).all(axis=(1, 3)), CELL * mesh.resolution, (mesh.origin.y, mesh.origin.x)
    ends = [((pose.y - origin[0]) / size, (pose.x - origin[1]) / size) for pose in (mission.start, mission.goal)]
    cells = shortest_path(free, *(tuple(map(int, end)) for end in ends))
    if cells is None:
        return np.empty((0, 3))
    corners = (cells + 0.5) * size + origin
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(corners, axis=0).T))))
    distances = np.arange(0.0, along[-1], 0.5)
    y, x = (np.interp(distances, along, corners[:, k]) for k in (0, 1))
    return np.column_stack((distances / SPEED, x, y))


def fixes(scene: Scene, missions: int) -> None:
    """Print the statistics of each receiver."""
    sampler, ways = MissionSampler(scene.navigation_mesh), []
    for episode in range(missions):
        path = way(scene, sampler.sample(make_generators(0, episode)["mission"]))
        if len(path) > 2:
            ways.append((episode, path))
    driven = sum(path[-1, 0] for _, path in ways) * SPEED
    print(f"{len(ways)} of {missions} missions, {driven / 1000.0:.1f} km")
    print("preset          median    95 %     RMS  stated RMS  without fix  missions with outage  longest")
    for name in ("rtk_good", "white_noise", "rtk_urban", "consumer_gps"):
        rate = load_dataclass(SensorParams, shipped("params") / "sensors" / f"{name}.yaml").gps.rate
        found, gaps, expected = [], [], 0
        for episode, path in ways:
            rows = fixes_along(path, scene, name, 0, episode)
            stamps = np.concatenate(([path[0, 0]], rows[:, 0], [path[-1, 0]]))
            gaps.append(np.diff(stamps).max())
            expected += len(np.arange(path[0, 0], path[-1, 0], 1.0 / rate))
            found.append(rows)
        table = np.concatenate(found)
        errors, stated = np.hypot(table[:, 1], table[:, 2]), np.sqrt(2.0 * np.mean(table[:, 3] ** 2))
        sizes = np.median(errors), np.percentile(errors, 95), np.sqrt(np.mean(errors**2))
        print(
            f"{name:14}{sizes[0]:7.3f} m {sizes[1]:6.3f} m {sizes[2]:6.3f} m"
            f" {stated:9.3f} m {100.0 * (1.0 - len(table) / expected):10.1f} %"
            f" {np.sum(np.array(gaps) > OUTAGE):21d} {max(gaps):7.0f} s"
        )


def costs(scene: Scene) -> None:
    """Print what a suite costs, driving about the middle of the map."""
    mesh = scene.navigation_mesh
    rows, columns = np.nonzero(mesh.data == 0)
    middle = len(rows) // 3
    x, y = mesh.origin.x + columns[middle] * mesh.resolution, mesh.origin.y + rows[middle] * mesh.resolution
    print("preset            building  per simulated second")
    for name in ("published", "rtk_good", "white_noise", "rtk_urban", "consumer_gps"):
        params = load_dataclass(SensorParams, shipped("params") / "sensors" / f"{name}.yaml")
        started = time.perf_counter()
        suite = SensorSuite(params, scene, 0.3)
        built = time.perf_counter() - started
        suite.reset(BodyState(x, y), {key: np.random.default_rng(0) for key in ("odometry", "imu", "gps", "lidar")})
        bodies = [BodyState(x + SPEED / RATE * (k % 400), y, 0.3, SPEED) for k in range(TICKS)]
        suite.measure(bodies[0], np.empty((0, 4)), 0.0)  # compiles
        started = time.perf_counter()
        for k, body in enumerate(bodies):
            suite.measure(body, np.empty((0, 4)), (k + 1) / RATE)
        spent = time.perf_counter() - started
        print(f"{name:14} {built:8.2f} s {1000.0 * spent / TICKS * RATE:10.2f} ms")


def main() -> None:
    """Run it."""
    arguments = parsed(__doc__, missions=300, map="sidewalk")
    scene = load_scene(arguments.map)
    if arguments.missions:
        fixes(scene, arguments.missions)
    costs(scene)


if __name__ == "__main__":
    main()
