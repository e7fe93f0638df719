import dataclasses
import math
from collections.abc import Iterator

import numpy as np
import pytest

from navstack.costmap import lattice_costs, layered_costmap
from navstack.costmap.costmap import FREE_SPACE, LETHAL_OBSTACLE, NO_INFORMATION
from navstack.costmap.lattice_costs import DenseCosts
from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.costmap.layers import Bounds, resampled, static_costs
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.costmap.window import Window
from navstack.errors import MapError, ParameterError
from navstack.params.costmap import (
    CostmapParams,
    InflationLayerParams,
    LayerParams,
    ObservationSourceParams,
    ObstacleLayerParams,
    StaticLayerParams,
    robot_footprint,
)
from navstack.params.filters import KeepoutFilterParams
from navstack.types import ByteArray, LaserScan, Pose2D

RESOLUTION = 0.05
FOOTPRINT = "[[0.14, 0.25], [0.14, -0.25], [-0.607, -0.25], [-0.607, 0.25]]"
SOURCE = ObservationSourceParams(clearing=True, obstacle_max_range=4.0, raytrace_max_range=4.5)
USUAL = ("static_layer", "obstacle_layer", "inflation_layer")


def make_params(
    plugins: tuple[str, ...] = USUAL,
    source: ObservationSourceParams = SOURCE,
    size: float = 8.0,
    **others: object,
) -> CostmapParams:
    layers: dict[str, LayerParams] = {
        "static_layer": StaticLayerParams(),
        "obstacle_layer": ObstacleLayerParams(
            observation_sources=("scan",), sources={"scan": source}
        ),
        "keepout_filter": KeepoutFilterParams(),
        "inflation_layer": InflationLayerParams(inflation_radius=0.8, cost_scaling_factor=3.0),
    }
    basis = CostmapParams(
        width=size,
        height=size,
        resolution=RESOLUTION,
        footprint=FOOTPRINT,
        footprint_padding=0.05,
        plugins=plugins,
        layers={name: layers[name] for name in plugins},
    )
    return dataclasses.replace(basis, **others)  # type: ignore[arg-type]


def make_map(rng: np.random.Generator, unknown: float = 0.0) -> OccupancyGrid:
    """A map of 15 m x 11 m with blocks and single cells."""
    data = np.zeros((220, 300), dtype=np.int8)
    data[:8] = 100
    data[120:150, 90:140] = 100
    data[rng.random(data.shape) < 0.001] = 100
    data[rng.random(data.shape) < unknown] = -1
    return OccupancyGrid(data, RESOLUTION, Pose2D(-7.025, -5.5, 0.0))


def random_scan(rng: np.random.Generator, stamp: float, beams: int = 240) -> LaserScan:
    """Returns anywhere, as if everything around moved all the time; some beams without return."""
    ranges = rng.uniform(0.3, 6.0, beams)
    ranges[rng.random(beams) < 0.1] = math.inf
    return LaserScan(
        stamp,
        ranges,
        -math.pi,
        2.0 * math.pi / beams,
        0.1,
        10.0,
        Pose2D(-0.2, 0.03, 0.4),
    )


def drive(
    rng: np.random.Generator, steps: int = 25
) -> Iterator[tuple[Pose2D, LaserScan | None, float]]:
    """A wandering robot whose scan comes with two updates out of three."""
    x, y, yaw = 0.5, -1.0, 0.3
    for step in range(steps):
        yaw += rng.normal(0.0, 0.4)
        x += 0.3 * math.cos(yaw)
        y += 0.3 * math.sin(yaw)
        yield Pose2D(x, y, yaw), None if step % 3 == 2 else random_scan(rng, 0.1 * step), 0.1 * step


SOURCES = {
    "plain": SOURCE,
    "least ranges": dataclasses.replace(SOURCE, raytrace_min_range=0.62, obstacle_min_range=0.9),
    "infinite beams clear": dataclasses.replace(SOURCE, inf_is_valid=True),
    "persistent": dataclasses.replace(SOURCE, observation_persistence=0.25),
    "marking only": dataclasses.replace(SOURCE, clearing=False),
}


def in_window(costs: ByteArray, static: OccupancyGrid, costmap: LayeredCostmap) -> ByteArray:
    """The costs of a map's cells where a costmap lies; 0 beyond the map."""
    height, width = costmap.master.data.shape
    left = round((costmap.master.origin_x - static.origin.x) / RESOLUTION)
    low = round((costmap.master.origin_y - static.origin.y) / RESOLUTION)
    beyond = max(height, width, abs(left), abs(low))
    return np.pad(costs, beyond)[beyond + low :, beyond + left :][:height, :width]


@pytest.mark.parametrize("rolling", [True, False])
@pytest.mark.parametrize("source", SOURCES.values(), ids=SOURCES.keys())
def test_the_fast_way_equals_the_full_way_bit_for_bit(
    rolling: bool, source: ObservationSourceParams
) -> None:
    rng = np.random.default_rng(11)
    params = make_params(source=source, rolling_window=rolling)
    static = make_map(rng)
    fast, full = LayeredCostmap(params, static), LayeredCostmap(params, static, prefer_fast=False)
    assert fast.is_fast
    assert not full.is_fast
    for step, (pose, scan, stamp) in enumerate(drive(rng)):
        for costmap in (fast, full):
            costmap.update(pose, scan, stamp)
            if step == 12:
                costmap.update(pose, None, stamp)
            if step == 18:
                costmap.clear_entirely()
                assert (costmap.obstacle_costs[0] == 0).all()
                costmap.update(pose, None, stamp)
        assert (fast.master.origin_x, fast.master.origin_y) == (
            full.master.origin_x,
            full.master.origin_y,
        )
        seen, seen_by_full = (
            costmap.obstacle_costs[0] == LETHAL_OBSTACLE for costmap in (fast, full)
        )
        left_out = in_window(static_costs(static, params), static, fast) == LETHAL_OBSTACLE
        np.testing.assert_array_equal(seen, seen_by_full & ~left_out)
        np.testing.assert_array_equal(fast.master.data, full.master.data)
    assert (fast.obstacle_costs[0] == LETHAL_OBSTACLE).sum() > 50


@pytest.mark.parametrize(("dx", "dy"), [(0.0, 0.23), (0.31, -0.27), (-0.6, 0.05)])
def test_a_window_that_moves_far_and_jumps_equals_the_full_way(dx: float, dy: float) -> None:
    rng = np.random.default_rng(12)
    params = make_params(rolling_window=True, size=3.0)
    static = make_map(rng)
    fast, full = LayeredCostmap(params, static), LayeredCostmap(params, static, prefer_fast=False)
    for step in range(60):
        jump = 2.5 if step >= 40 else 0.0
        pose = Pose2D(
            -3.0 * np.sign(dx) + dx * step, -4.0 * np.sign(dy) + dy * step + jump, 0.1 * step
        )
        scan = random_scan(rng, 0.1 * step) if step % 3 == 0 else None
        for costmap in (fast, full):
            costmap.update(pose, scan, 0.1 * step)
        np.testing.assert_array_equal(fast.master.data, full.master.data)
        assert fast.master.data.flags.c_contiguous


def test_updating_what_changed_equals_building_anew() -> None:
    rng = np.random.default_rng(5)
    static = make_map(rng)
    costmap = LayeredCostmap(make_params(), static)
    for pose, scan, stamp in drive(rng, 10):
        costmap.update(pose, scan, stamp)
        rebuilt = static_costs(static, costmap.params)
        rebuilt = np.maximum(rebuilt, costmap.obstacle_costs[0])
        inflation = layered_costmap.Inflation(
            costmap.params.layers["inflation_layer"],  # type: ignore[arg-type]
            RESOLUTION,
            costmap.inscribed_radius,
        )
        inflation.apply(rebuilt, 0, rebuilt.shape[1], 0, rebuilt.shape[0])
        np.testing.assert_array_equal(costmap.master.data, rebuilt)


def test_a_rolling_window_shows_what_the_fixed_costmap_shows() -> None:
    rng = np.random.default_rng(6)
    static = make_map(rng)
    fixed = LayeredCostmap(make_params(), static)
    rolling = LayeredCostmap(make_params(rolling_window=True, size=5.0), static)
    scan = random_scan(rng, 0.0)
    for costmap in (fixed, rolling):
        costmap.update(Pose2D(0.3, -0.2, 0.4), scan, 0.0)
    left = round((rolling.master.origin_x - fixed.master.origin_x) / RESOLUTION)
    low = round((rolling.master.origin_y - fixed.master.origin_y) / RESOLUTION)
    inner = slice(16, 84)  # cells that no obstacle outside the window can reach
    shown = fixed.master.data[low : low + 100, left : left + 100]
    np.testing.assert_array_equal(rolling.master.data[inner, inner], shown[inner, inner])
    cell = rolling.master.world_to_map(0.3, -0.2)
    assert all(abs(index - 50) <= 1 for index in cell)


def circle_scan(robot: Pose2D, person: tuple[float, float], stamp: float, wall: float) -> LaserScan:
    """What a lidar sees of a person of radius 0.3 m in front of a round wall (``inf``.

    Nothing behind).
    """
    angles = np.linspace(-math.pi, math.pi, 360, endpoint=False)
    dx, dy = person[0] - robot.x, person[1] - robot.y
    along = dx * np.cos(angles) + dy * np.sin(angles)
    inside = 0.3**2 - (dx**2 + dy**2 - along**2)
    hit = (inside > 0.0) & (along > 0.0)
    ranges = np.where(hit, along - np.sqrt(np.maximum(inside, 0.0)), wall)
    return LaserScan(stamp, ranges, -math.pi, 2.0 * math.pi / 360, 0.05, 20.0)


@pytest.mark.parametrize("prefer_fast", [True, False])
@pytest.mark.parametrize(
    ("inf_is_valid", "wall", "leaves_ghosts"),
    [(False, 3.5, False), (True, math.inf, False), (False, math.inf, True)],
)
def test_a_pedestrian_that_walks_by_leaves_ghosts_only_where_no_beam_clears(
    prefer_fast: bool,
    inf_is_valid: bool,
    wall: float,
    leaves_ghosts: bool,
) -> None:
    static = OccupancyGrid(
        np.zeros((220, 300), dtype=np.int8), RESOLUTION, Pose2D(-7.025, -5.5, 0.0)
    )
    source = dataclasses.replace(SOURCE, inf_is_valid=inf_is_valid)
    params = make_params(source=source, rolling_window=True)
    costmap = LayeredCostmap(params, static, prefer_fast=prefer_fast)
    for step in range(60):
        robot = Pose2D(0.02 * step, 0.0, 0.0)
        person = (-1.5 + 0.05 * step, 1.5)
        costmap.update(robot, circle_scan(robot, person, step / 30, wall), step / 30)
    y, x = np.nonzero(costmap.obstacle_costs[0])
    x_world = costmap.master.origin_x + (x + 0.5) * RESOLUTION - person[0]
    y_world = costmap.master.origin_y + (y + 0.5) * RESOLUTION - person[1]
    near_wall = np.hypot(x_world + person[0] - robot.x, y_world + person[1] - robot.y) > 3.0
    ghosts = (np.hypot(x_world, y_world) > 0.45) & ~near_wall
    assert ghosts.any() == leaves_ghosts
    assert (np.hypot(x_world, y_world) < 0.45).any()


def test_a_static_layer_last_hides_what_the_layers_before_it_wrote() -> None:
    static = make_map(np.random.default_rng(7))
    order = ("obstacle_layer", "inflation_layer", "static_layer")
    scan = circle_scan(Pose2D(), (1.5, 0.0), 0.0, math.inf)
    for use_maximum in (False, True):
        costmap = LayeredCostmap(
            make_params(order, use_maximum=use_maximum, rolling_window=True), static
        )
        costmap.update(Pose2D(), scan, 0.0)
        assert (costmap.master.cost_at(1.22, 0.0) == LETHAL_OBSTACLE) is use_maximum
        # beside the block, whose surroundings are not inflated
        assert costmap.master.cost_at(-2.6, 1.2) == 0


def test_of_a_map_that_moves_the_highest_number_counts() -> None:
    """Cells of a map a third each unknown, free and occupied, below marks (static_layer.cpp)."""
    data = np.repeat(np.array([[-1, 0, 100]], dtype=np.int8), 40, axis=0).repeat(14, axis=1)
    static = OccupancyGrid(data, RESOLUTION, Pose2D(-1.0, -1.0, 0.0))
    unknown, free, occupied = (-0.8, 0.0), (-0.1, 0.0), (0.9, 0.0)
    for rolling, expected in ((True, NO_INFORMATION), (False, FREE_SPACE)):
        params = make_params(
            ("static_layer",),
            use_maximum=True,
            track_unknown_space=True,
            rolling_window=rolling,
            size=1.9,
        )
        costmap = LayeredCostmap(params, static)
        costmap.update(Pose2D(), None, 0.0)
        assert costmap.master.cost_at(*unknown) == NO_INFORMATION
        # the window's own cells are unknown before the map's come
        assert costmap.master.cost_at(*free) == expected
        assert costmap.master.cost_at(*occupied) == (NO_INFORMATION if rolling else LETHAL_OBSTACLE)


@pytest.mark.parametrize(("rolling", "reach"), [(False, 26), (True, 25)])
@pytest.mark.parametrize("enabled", [True, False])
def test_the_resolution_of_a_map_is_in_single_precision(
    rolling: bool, reach: int, enabled: bool
) -> None:
    """0.5 m are 25 cells of 0.02 m, but 26 of its nearest number in single precision."""
    layers = {
        "static_layer": StaticLayerParams(enabled),
        "obstacle_layer": ObstacleLayerParams(
            observation_sources=("scan",), sources={"scan": SOURCE}
        ),
        "inflation_layer": InflationLayerParams(inflation_radius=0.5, cost_scaling_factor=3.0),
    }
    params = CostmapParams(
        plugins=("static_layer", "obstacle_layer", "inflation_layer"),
        layers=layers,
        rolling_window=rolling,
        resolution=0.02,
        width=3,
        height=3,
        robot_radius=0.2,
    )
    data = np.zeros((151, 151), dtype=np.int8)
    data[75, 75] = 100
    costmap = LayeredCostmap(params, OccupancyGrid(data, 0.02, Pose2D(-1.51, -1.51, 0.0)))
    scan = None
    if not enabled:
        scan = LaserScan(0.0, np.array([1.2]), 0.0, 1.0, 0.1, 9.0)
    costmap.update(Pose2D(), scan, 0.0)
    assert costmap.master.data.any(axis=1).sum() == 2 * reach + 1


def test_a_static_layer_that_is_disabled_gives_the_size_and_no_costs() -> None:
    """Nav2's takes in the map whether it is enabled or not."""
    static = make_map(np.random.default_rng(7))
    params = make_params()
    layers = {**params.layers, "static_layer": StaticLayerParams(enabled=False)}
    costmap = LayeredCostmap(dataclasses.replace(params, layers=layers), static)
    assert costmap.master.data.shape == static.data.shape
    assert not costmap.master.data.any()
    without = dataclasses.replace(params, plugins=("obstacle_layer", "inflation_layer"))
    assert LayeredCostmap(without, static).master.data.shape != static.data.shape


def test_unknown_cells_are_kept_and_freed_by_beams() -> None:
    static = make_map(np.random.default_rng(8), unknown=0.2)
    costmap = LayeredCostmap(make_params(track_unknown_space=True), static)
    assert not costmap.is_fast
    costmap.update(Pose2D(), circle_scan(Pose2D(), (1.5, 0.0), 0.0, 3.0), 0.0)
    unknown = costmap.master.data == NO_INFORMATION
    assert not unknown[105:115, 145:165].any()
    assert unknown[180:, 200:].any()


def test_the_footprint_is_cleared_in_the_obstacle_layer_only() -> None:
    data = np.zeros((220, 300), dtype=np.int8)
    static = OccupancyGrid(data, RESOLUTION, Pose2D(-7.5, -5.5, 0.0))
    data[110, 150] = 100  # under the robot
    costmap = LayeredCostmap(
        make_params(source=dataclasses.replace(SOURCE, clearing=False)), static
    )
    scan = LaserScan(0.0, np.array((0.1, 0.4)), -math.pi, math.pi, 0.0, 10.0)
    costmap.update(Pose2D(), scan, 0.0)
    assert costmap.master.cost_at(0.01, 0.01) == LETHAL_OBSTACLE
    assert costmap.master.cost_at(-0.1, 0.01) < LETHAL_OBSTACLE
    assert costmap.master.cost_at(0.4, 0.01) == LETHAL_OBSTACLE


def test_reset_forgets_the_place_and_the_scans() -> None:
    rng = np.random.default_rng(9)
    static = make_map(rng)
    used, fresh = (LayeredCostmap(make_params(rolling_window=True), static) for _ in range(2))
    for pose, scan, stamp in drive(rng, 6):
        used.update(pose, scan, stamp)
    used.reset()
    for costmap in (used, fresh):
        costmap.update(Pose2D(-1.02, 0.51, 0.2), None, 0.0)
    np.testing.assert_array_equal(used.master.data, fresh.master.data)
    assert (used.master.origin_x, used.master.origin_y) == (
        fresh.master.origin_x,
        fresh.master.origin_y,
    )
    assert not used.obstacle_costs[0].any()


@pytest.mark.parametrize("prefer_fast", [True, False])
def test_a_costmap_is_current_from_an_update_until_it_is_cleared(prefer_fast: bool) -> None:
    costmap = LayeredCostmap(
        make_params(), make_map(np.random.default_rng(2)), prefer_fast=prefer_fast
    )
    for forget in (costmap.clear_entirely, costmap.reset):
        assert not costmap.is_current
        costmap.update(Pose2D(), random_scan(np.random.default_rng(2), 0.5), 0.5)
        assert (costmap.is_current, costmap.stamp) == (True, 0.5)
        forget()
        assert costmap.stamp == (0.5 if forget == costmap.clear_entirely else 0.0)
    assert not costmap.is_current


def test_bounds_hold_nothing_then_what_they_are_joined_with() -> None:
    bounds, window = Bounds.empty(), Window(-1.0, 2.0, 0.5, 10, 8)
    assert bounds.values.tolist() == [math.inf, -math.inf, math.inf, -math.inf]
    bounds.join(np.array((0.6, 1.3, 3.2, 4.4)))
    assert bounds.values.tolist() == [0.6, 1.3, 3.2, 4.4]
    assert bounds.region(window) == (3, 5, 2, 5)  # the last cells that they touch, too
    bounds.join(np.array((-9.0, 1.0, 4.0, 9.0)))
    assert bounds.values.tolist() == [-9.0, 1.3, 3.2, 9.0]
    assert bounds.region(window) == (0, 5, 2, 8)
    bounds.join(Bounds.empty().values)
    assert bounds.values.tolist() == [-9.0, 1.3, 3.2, 9.0]
    bounds.hold_everything()
    assert bounds.region(window) == (0, 10, 0, 8)


@pytest.mark.parametrize("rolling", [True, False])
@pytest.mark.parametrize("plugins", [USUAL, USUAL[1:]])
def test_a_costmap_that_was_reset_equals_a_fresh_one_in_every_cell(
    rolling: bool, plugins: tuple[str, ...]
) -> None:
    static = make_map(np.random.default_rng(3), unknown=0.1)
    window = {"rolling_window": rolling, "origin_x": -4.0, "origin_y": -4.0}
    params = make_params(plugins, track_unknown_space=True, **window)
    used, fresh = (LayeredCostmap(params, static) for _ in range(2))
    for pose, scan, stamp in drive(np.random.default_rng(4), 6):
        used.update(pose, scan, stamp)
    used.reset()
    assert (used.obstacle_costs[0] == NO_INFORMATION).all()
    for pose, scan, stamp in drive(np.random.default_rng(5), 6):
        for costmap in (used, fresh):
            costmap.update(Pose2D(pose.x - 2.0, pose.y + 1.0, pose.yaw), scan, stamp)
        np.testing.assert_array_equal(used.master.data, fresh.master.data)
        np.testing.assert_array_equal(used.obstacle_costs[0], fresh.obstacle_costs[0])


def test_a_keepout_mask_is_lethal() -> None:
    static = make_map(np.random.default_rng(10))
    mask = np.zeros(static.data.shape, dtype=bool)
    mask[200, 10] = True
    costmap = LayeredCostmap(make_params(), static, keepout=mask)
    assert costmap.master.data[200, 10] == LETHAL_OBSTACLE
    assert costmap.master.data[200, 12] == 253
    with pytest.raises(MapError, match="keepout"):
        LayeredCostmap(make_params(), static, keepout=mask[1:])


@pytest.mark.parametrize(
    ("trinary", "track_unknown", "expected"),
    [
        (True, False, [0, 0, 254, 0]),
        (False, True, [0, 127, 254, 255]),
        (True, True, [0, 0, 254, 255]),
    ],
)
def test_occupancies_become_costs(trinary: bool, track_unknown: bool, expected: list[int]) -> None:
    grid = OccupancyGrid(np.array([[0, 50, 100, -1]], dtype=np.int8), 0.1, Pose2D())
    params = CostmapParams(trinary_costmap=trinary, track_unknown_space=track_unknown)
    assert static_costs(grid, params)[0].tolist() == expected


def test_a_coarser_map_keeps_its_places() -> None:
    costs = np.array([[0, 254], [100, 7]], dtype=np.uint8)
    finer = resampled(costs, 0.1, 0.05)
    assert isinstance(finer, DenseCosts)
    np.testing.assert_array_equal(finer.costs, costs.repeat(2, axis=0).repeat(2, axis=1))
    same = resampled(costs, 0.05, 0.05000001)
    assert isinstance(same, DenseCosts)
    assert same.costs is costs


@pytest.mark.parametrize("use_maximum", [True, False])
def test_a_rolling_costmap_samples_what_it_shows_of_a_map_that_is_too_fine(
    use_maximum: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(4)
    static = make_map(rng)
    keepout = rng.random(static.data.shape) < 0.01
    params = make_params(
        ("static_layer", "obstacle_layer", "keepout_filter", "inflation_layer"),
        rolling_window=True,
        resolution=0.02,
        size=3.0,
        use_maximum=use_maximum,
    )
    whole = LayeredCostmap(params, static, keepout, prefer_fast=False)
    monkeypatch.setattr(lattice_costs, "MOST_CELLS", 20_000)
    sampled = LayeredCostmap(params, static, keepout)
    assert not sampled.is_fast
    for stamp, x in enumerate((-3.0, -2.9, 0.0, 4.0, 9.5, -12.0)):  # the last two beyond the map
        scan = random_scan(rng, float(stamp))
        for costmap in (whole, sampled):
            costmap.update(Pose2D(x, 0.7 * x, 0.3), scan, float(stamp))
        np.testing.assert_array_equal(sampled.master.data, whole.master.data)


def test_a_fine_rolling_costmap_has_a_place_on_every_map() -> None:
    static = OccupancyGrid(np.zeros((1000, 1000), dtype=np.int8), 0.2, Pose2D())
    static.data[500, 500] = 100
    plugins = ("static_layer", "inflation_layer")
    params = make_params(plugins, rolling_window=True, resolution=0.04, size=3.0)
    costmap = LayeredCostmap(params, static)  # the map has 25 million cells of 0.04 m
    costmap.update(Pose2D(100.1, 99.0, 0.0), None, 0.0)
    assert costmap.master.cost_at(100.1, 100.1) == LETHAL_OBSTACLE
    assert costmap.master.cost_at(100.1, 99.9) == 253
    with pytest.raises(ParameterError, match="25,000,000 cells; at most 20,000,000 are allowed"):
        dataclasses.replace(params, width=200.0, height=200.0)


def test_what_cannot_be_used_is_refused() -> None:
    with pytest.raises(MapError, match="no map was given"):
        LayeredCostmap(make_params())
    rotated = OccupancyGrid(np.zeros((9, 9), dtype=np.int8), RESOLUTION, Pose2D(0.0, 0.0, 0.3))
    with pytest.raises(MapError, match="rotated"):
        LayeredCostmap(make_params(), rotated)
    with pytest.raises(ParameterError, match="footprint"):
        robot_footprint(CostmapParams(footprint="[[0, 0], [1, 0]]"))
    with pytest.raises(ParameterError, match="footprint"):
        robot_footprint(CostmapParams(footprint="0.3"))
    with pytest.raises(ParameterError, match="not described"):
        CostmapParams(plugins=("voxel_layer",))


@pytest.mark.parametrize("prefer_fast", [True, False])
def test_what_is_no_place_marks_and_clears_nothing(prefer_fast: bool) -> None:
    costmap = LayeredCostmap(
        make_params(rolling_window=True),
        make_map(np.random.default_rng(1)),
        prefer_fast=prefer_fast,
    )
    costmap.update(Pose2D(0.3, 0.2, 0.1), random_scan(np.random.default_rng(2), 0.0), 0.0)
    seen = costmap.obstacle_costs[0].copy()
    assert (seen == LETHAL_OBSTACLE).sum() > 20
    odd = (math.nan, math.inf, -math.inf)
    points = np.array(
        [(x, y, 0.1) for x in (*odd, 0.5) for y in (*odd, 0.5) if (x, y) != (0.5, 0.5)]
    )
    costmap.observe_points(points, math.nan, 0.2, 0.1)
    costmap.update(Pose2D(0.3, 0.2, 0.1), None, 0.1)
    np.testing.assert_array_equal(costmap.obstacle_costs[0], seen)
    for x in (1e7, 3e8, -3e9, 0.3):  # some beyond what 32 bits count
        costmap.update(Pose2D(x, 0.2, 0.1), random_scan(np.random.default_rng(2), 0.2), 0.2)
    np.testing.assert_array_equal(costmap.obstacle_costs[0], seen)
