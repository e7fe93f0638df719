import dataclasses

import numpy as np
import pytest

from navstack.costmap.denoise import remove_small_groups
from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.params.costmap import (
    CostmapParams,
    DenoiseLayerParams,
    InflationLayerParams,
    LayerParams,
    ObservationSourceParams,
    ObstacleLayerParams,
    StaticLayerParams,
)
from navstack.types import LaserScan, Pose2D


def slow_removal(
    costs: np.ndarray,
    minimal_size: int,
    connectivity: int,
    unknown_is_obstacle: bool,
) -> np.ndarray:
    """Follow each group from cell to cell."""
    obstacles = {253, 254, 255} if unknown_is_obstacle else {253, 254}
    steps = [(y, x) for y in (-1, 0, 1) for x in (-1, 0, 1) if connectivity == 8 or 0 in (y, x)]
    waiting = {(y, x) for (y, x), cost in np.ndenumerate(costs) if int(cost) in obstacles}
    left = costs.copy()
    while waiting:
        group = [waiting.pop()]
        for y, x in group:
            beside = {(y + dy, x + dx) for dy, dx in steps} & waiting
            group += beside
            waiting -= beside
        if len(group) < minimal_size:
            for cell in group:
                left[cell] = 0
    return left


@pytest.mark.parametrize("unknown_is_obstacle", [True, False])
@pytest.mark.parametrize("connectivity", [4, 8])
@pytest.mark.parametrize("minimal_size", [-1, 1, 2, 3, 7, 40])
def test_groups_are_those_that_a_walk_finds(
    minimal_size: int,
    connectivity: int,
    unknown_is_obstacle: bool,
) -> None:
    rng = np.random.default_rng(4)
    for density, shape in (
        (0.02, (60, 90)),
        (0.2, (60, 90)),
        (0.5, (33, 20)),
        (1.0, (5, 4)),
        (0.3, (1, 50)),
    ):
        whole = rng.integers(0, 253, (shape[0] + 4, shape[1] + 6)).astype(np.uint8)
        is_set = rng.random(whole.shape) < density
        whole[is_set] = rng.integers(253, 256, is_set.sum())
        before = whole.copy()
        part = whole[2:-2, 3:-3]
        expected = slow_removal(part, minimal_size, connectivity, unknown_is_obstacle)
        remove_small_groups(part, minimal_size, connectivity, unknown_is_obstacle)
        np.testing.assert_array_equal(part, expected)
        whole[2:-2, 3:-3] = before[2:-2, 3:-3]
        np.testing.assert_array_equal(whole, before)  # nothing beyond the part


SOURCE = ObservationSourceParams(clearing=True, obstacle_max_range=4.0, raytrace_max_range=4.5)


def costmap_of(
    plugins: tuple[str, ...],
    denoise: DenoiseLayerParams,
    **others: object,
) -> LayeredCostmap:
    layers: dict[str, LayerParams] = {
        "static_layer": StaticLayerParams(),
        "obstacle_layer": ObstacleLayerParams(
            observation_sources=("scan",), sources={"scan": SOURCE}
        ),
        "denoise_layer": denoise,
        "inflation_layer": InflationLayerParams(inflation_radius=0.5, cost_scaling_factor=3.0),
    }
    basis = CostmapParams(
        width=8.0,
        height=8.0,
        resolution=0.05,
        robot_radius=0.2,
        plugins=plugins,
        layers={name: layers[name] for name in plugins},
    )
    static = OccupancyGrid(np.zeros((200, 200), dtype=np.int8), 0.05, Pose2D(-5.0, -5.0, 0.0))
    return LayeredCostmap(dataclasses.replace(basis, **others), static)  # type: ignore[arg-type]


def scan_of_a_speck_and_a_wall() -> LaserScan:
    """One return at 1.5 m straight ahead, thirty beside each other at 2.5 m on the left."""
    ranges = np.full(360, np.inf)
    ranges[180] = 1.5
    ranges[255:285] = 2.5
    return LaserScan(0.0, ranges, -np.pi, 2.0 * np.pi / 360, 0.05, 20.0)


@pytest.mark.parametrize("rolling", [True, False])
def test_specks_vanish_and_walls_stay(rolling: bool) -> None:
    order = ("static_layer", "obstacle_layer", "denoise_layer", "inflation_layer")
    for enabled in (True, False):
        costmap = costmap_of(
            order, DenoiseLayerParams(enabled=enabled, minimal_group_size=3), rolling_window=rolling
        )
        assert costmap.is_fast is not enabled
        for step in range(3):
            costmap.update(Pose2D(), scan_of_a_speck_and_a_wall(), 0.1 * step)
        assert costmap.master.cost_at(1.52, 0.01) == (0 if enabled else 254)
        # its surroundings are not inflated either
        assert (costmap.master.cost_at(1.3, 0.01) == 0) is enabled
        assert costmap.master.cost_at(0.01, 2.52) == 254
        assert costmap.obstacle_costs[0].max() == 254  # the obstacle layer itself keeps the speck


def test_the_layer_works_at_its_place_in_the_order() -> None:
    before = ("static_layer", "denoise_layer", "obstacle_layer", "inflation_layer")
    after = ("static_layer", "obstacle_layer", "inflation_layer", "denoise_layer")
    for order in (before, after):
        costmap = costmap_of(order, DenoiseLayerParams(minimal_group_size=3))
        costmap.update(Pose2D(), scan_of_a_speck_and_a_wall(), 0.0)
        # Before the obstacles it has nothing to free; after the inflation the speck is a group of
        # many cells >= 253.
        assert costmap.master.cost_at(1.52, 0.01) == 254


def test_unknown_cells_are_obstacles_only_where_nothing_starts_unknown() -> None:
    order = ("static_layer", "obstacle_layer", "denoise_layer")
    costmap = costmap_of(order, DenoiseLayerParams(minimal_group_size=2), track_unknown_space=True)
    costmap.update(Pose2D(), scan_of_a_speck_and_a_wall(), 0.0)
    costmap.update(Pose2D(), None, 0.1)
    assert costmap.master.cost_at(1.52, 0.01) == 0


def test_other_connectivities_count_as_8_as_in_nav2() -> None:
    assert DenoiseLayerParams(group_connectivity_type=6).group_connectivity_type == 8
