import dataclasses
import itertools
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest

from navstack.costmap.costmap import NO_INFORMATION
from navstack.costmap.filters import FilterMask, KeepoutMask, SpeedFilter, mask_costs
from navstack.costmap.layered_costmap import LayeredCostmap
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
)
from navstack.params.filters import (
    SPEED_ABSOLUTE,
    SPEED_PERCENT,
    KeepoutFilterParams,
    SpeedFilterParams,
)
from navstack.types import LaserScan, Pose2D

RESOLUTION = 0.05
MAP_ORIGIN = Pose2D(-7.025, -5.5, 0.0)
SOURCE = ObservationSourceParams(
    clearing=True,
    obstacle_max_range=4.0,
    raytrace_max_range=4.5,
    inf_is_valid=True,
)
USUAL = ("static_layer", "obstacle_layer", "inflation_layer")
BEFORE = ("static_layer", "obstacle_layer", "keepout_filter", "inflation_layer")


def make_map(rng: np.random.Generator, unknown: float = 0.0) -> OccupancyGrid:
    """A map of 15 m x 11 m with a wall, a block and single cells."""
    data = np.zeros((220, 300), dtype=np.int8)
    data[:8] = 100
    data[120:150, 90:140] = 100
    data[rng.random(data.shape) < 0.001] = 100
    data[rng.random(data.shape) < unknown] = -1
    return OccupancyGrid(data, RESOLUTION, MAP_ORIGIN)


def make_mask(
    rng: np.random.Generator,
    resolution: float,
    origin: Pose2D,
    size: tuple[int, int],
) -> FilterMask:
    """Blobs of all occupancies, some cells unknown."""
    data = np.zeros(size, dtype=np.int8)
    for _ in range(12):
        row, column = rng.integers(0, size[0]), rng.integers(0, size[1])
        data[row : row + int(rng.integers(1, 30)), column : column + int(rng.integers(1, 30))] = (
            rng.integers(1, 101)
        )
    data[size[0] // 2 :, : size[1] // 3] = 100
    data[rng.random(size) < 0.02] = -1
    return FilterMask(OccupancyGrid(data, resolution, origin))


def make_costmap(
    static: OccupancyGrid,
    plugins: tuple[str, ...] = BEFORE,
    filters: tuple[str, ...] = (),
    masks: Mapping[str, FilterMask] | None = None,
    keepout: np.ndarray | None = None,
    prefer_fast: bool = True,
    filter_params: LayerParams = KeepoutFilterParams(),  # noqa: B008 - frozen
    **others: object,
) -> LayeredCostmap:
    layers: dict[str, LayerParams] = {
        "static_layer": StaticLayerParams(),
        "obstacle_layer": ObstacleLayerParams(
            observation_sources=("scan",), sources={"scan": SOURCE}
        ),
        "inflation_layer": InflationLayerParams(inflation_radius=0.8, cost_scaling_factor=3.0),
        "keepout_filter": filter_params,
        "speed_filter": SpeedFilterParams(),
    }
    basis = CostmapParams(
        width=6.0,
        height=6.0,
        resolution=RESOLUTION,
        robot_radius=0.3,
        plugins=plugins,
        filters=filters,
        layers={name: layers[name] for name in (*plugins, *filters)},
    )
    params = dataclasses.replace(basis, **others)  # type: ignore[arg-type]
    return LayeredCostmap(params, static, keepout=keepout, masks=masks, prefer_fast=prefer_fast)


def drive(*costmaps: LayeredCostmap, steps: int = 8, seed: int = 3) -> list[list[np.ndarray]]:
    """The masters after each update of a robot that wanders among returns at random places."""
    rng = np.random.default_rng(seed)
    x, y, yaw = 0.5, -1.0, 0.3
    shown = []
    for step in range(steps):
        yaw += rng.normal(0.0, 0.4)
        x, y = x + 0.4 * math.cos(yaw), y + 0.4 * math.sin(yaw)
        ranges = rng.uniform(0.3, 6.0, 240)
        ranges[rng.random(240) < 0.1] = math.inf
        scan = LaserScan(0.1 * step, ranges, -math.pi, 2.0 * math.pi / 240, 0.1, 10.0)
        for costmap in costmaps:
            costmap.update(Pose2D(x, y, yaw), scan, 0.1 * step)
        shown.append([costmap.master.data.copy() for costmap in costmaps])
    return shown


def test_occupancies_of_a_mask_become_costs_linearly() -> None:
    grid = OccupancyGrid(np.arange(-1, 101, dtype=np.int8)[None], 1.0, Pose2D())
    expected = [NO_INFORMATION, *(math.floor(value * 2.54 + 0.5 + 1e-12) for value in range(101))]
    assert mask_costs(grid)[0].tolist() == expected
    assert mask_costs(grid)[0, [1, 26, 51, 100, 101]].tolist() == [0, 64, 127, 251, 254]


@pytest.mark.parametrize("resolution", [0.02, 0.05, 0.07, 0.3])
def test_a_cell_takes_the_masks_cost_at_its_centre(resolution: float) -> None:
    rng = np.random.default_rng(1)
    mask = make_mask(rng, resolution, Pose2D(-1.013, 0.46, 0.0), (40, 60))
    window = Window(-2.0, -1.5, RESOLUTION, 10, 10)
    sampled = KeepoutMask(KeepoutFilterParams(), mask, window, rolling=True)
    costs = mask_costs(mask.grid)
    own, left, low = sampled.part((0, 1, 0, 1), 0, 0)
    for y in range(-20, 320):
        for x in range(-20, 420):
            column = math.floor((-2.0 + (x + 0.5) * RESOLUTION + 1.013) / resolution)
            row = math.floor((-1.5 + (y + 0.5) * RESOLUTION - 0.46) / resolution)
            expected = costs[row, column] if 0 <= column < 60 and 0 <= row < 40 else NO_INFORMATION
            inside = 0 <= x - left < own.shape[1] and 0 <= y - low < own.shape[0]
            assert (own[y - low, x - left] if inside else NO_INFORMATION) == expected


@pytest.mark.parametrize(
    ("resolution", "first"), [(1.0, 50), (0.5, 45), (0.2, 42), (0.05, 40), (0.03, 40)]
)
def test_a_coarse_mask_begins_half_a_cell_later_on_a_costmap_that_does_not_move(
    resolution: float, first: int
) -> None:
    """The first columns are those of a transcription of keepout_filter.cpp (Jazzy)."""
    data = np.full((round(3.0 / resolution),) * 2, 100, dtype=np.int8)
    mask = FilterMask(OccupancyGrid(data, resolution, Pose2D(2.0, 2.0)))
    window = Window(0.0, 0.0, RESOLUTION, 200, 200)
    for rolling, begins in ((False, first), (True, 40)):
        costs = np.zeros((200, 200), dtype=np.uint8)
        keepout = KeepoutMask(KeepoutFilterParams(), mask, window, rolling)
        keepout.raise_costs(costs, (0, 200, 0, 200), 0, 0)
        columns = np.flatnonzero(costs.any(axis=0))
        assert (columns[0], columns[-1]) == (begins, 99)
        assert np.array_equal(costs, costs.T)


def test_a_mask_acts_within_a_map_where_all_its_costs_but_zero_are_cells_of_it() -> None:
    """Masks of 3 x 2 cells all around a map of 5 x 4, with one known cell each or none."""
    window = Window(0.0, 0.0, 1.0, 5, 4)
    for x, y, cell in itertools.product(range(-5, 8), range(-4, 7), range(7)):
        data = np.array([[0, -1, 0], [-1, 0, -1]], dtype=np.int8)
        if cell < 6:
            data[cell // 3, cell % 3] = 1
        mask = KeepoutMask(
            KeepoutFilterParams(),
            FilterMask(OccupancyGrid(data, 1.0, Pose2D(x + 0.25, y + 0.25))),
            window,
            rolling=False,
        )
        inside = 0 <= x + cell % 3 < 5 and 0 <= y + cell // 3 < 4
        assert (mask.x, mask.y) == (x, y)
        assert mask.acts_within(5, 4) == (cell == 6 or inside)


@pytest.mark.parametrize("rolling", [True, False])
def test_the_worlds_mask_before_the_inflation_is_what_the_static_layer_made_of_it(
    rolling: bool,
) -> None:
    static = make_map(np.random.default_rng(5))
    keepout = np.random.default_rng(6).random(static.data.shape) < 0.003
    keepout[150:, 180:] = True
    for order in (BEFORE, ("static_layer", "keepout_filter", "obstacle_layer", "inflation_layer")):
        through_map = make_costmap(static, USUAL, keepout=keepout, rolling_window=rolling)
        filtered = make_costmap(static, order, keepout=keepout, rolling_window=rolling)
        assert filtered.is_fast
        for one, other in drive(through_map, filtered):
            np.testing.assert_array_equal(one, other)
        if not rolling:
            np.testing.assert_array_equal(through_map.master.floor, filtered.master.floor)
    stock = ("obstacle_layer", "inflation_layer", "static_layer")
    for one, other in drive(
        make_costmap(static, stock, keepout=keepout, rolling_window=rolling),
        make_costmap(static, (*stock, "keepout_filter"), keepout=keepout, rolling_window=rolling),
    ):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("rolling", [True, False])
@pytest.mark.parametrize(
    ("plugins", "filters"),
    [
        (BEFORE, ()),
        ((*USUAL, "keepout_filter"), ()),
        (USUAL, ("keepout_filter",)),
        (USUAL[:2], ("keepout_filter",)),
    ],
    ids=["before", "behind", "filters", "no inflation"],
)
@pytest.mark.parametrize(("resolution", "size"), [(0.05, (150, 200)), (0.08, (90, 100))])
def test_the_fast_way_equals_the_full_way(
    rolling: bool,
    plugins: tuple[str, ...],
    filters: tuple[str, ...],
    resolution: float,
    size: tuple[int, int],
) -> None:
    rng = np.random.default_rng(7)
    static, mask = make_map(rng), make_mask(rng, resolution, Pose2D(-3.3, -2.41, 0.0), size)
    given: dict[str, Any] = {"masks": {"keepout_filter": mask}, "rolling_window": rolling}
    fast = make_costmap(static, plugins, filters, **given)
    full = make_costmap(static, plugins, filters, prefer_fast=False, **given)
    without = make_costmap(
        static, tuple(name for name in plugins if name != "keepout_filter"), rolling_window=rolling
    )
    assert fast.is_fast
    assert not full.is_fast
    for one, other, bare in drive(fast, full, without):
        np.testing.assert_array_equal(one, other)
        assert (one >= bare).all()
        assert (one != bare).any()


def test_a_filter_behind_the_layers_is_not_inflated_and_none_of_them_sees_it() -> None:
    static = make_map(np.random.default_rng(8))
    data = np.zeros((20, 20), dtype=np.int8)
    data[:] = 100
    masks = {"keepout_filter": FilterMask(OccupancyGrid(data, RESOLUTION, Pose2D(1.0, 1.0, 0.0)))}
    inflated = make_costmap(static, BEFORE, masks=masks, prefer_fast=False)
    plain = make_costmap(static, USUAL, ("keepout_filter",), masks=masks, prefer_fast=False)
    drive(inflated, plain, steps=1)
    for costmap in (inflated, plain):
        costmap.clear_entirely()
    assert [costmap.master.cost_at(1.5, 1.5) for costmap in (inflated, plain)] == [254, 254]
    assert inflated.master.cost_at(2.2, 1.5) == 253
    assert plain.master.cost_at(2.2, 1.5) == 0
    # An update of the part beside the mask inflates there: what the filter wrote must not be a
    # source.
    for step in range(3):
        scan = LaserScan(0.1 * step, np.array((0.9, 0.91)), 0.0, 0.01, 0.1, 10.0)
        plain.update(Pose2D(2.7, 1.5, 0.0), scan, 0.1 * step)
    # [m] from where on it writes: 1.1 m behind the robot
    left = plain.region[0] * RESOLUTION + MAP_ORIGIN.x
    # what the mask forbids before that is in reach
    assert left == pytest.approx(1.6, abs=RESOLUTION)
    assert plain.master.cost_at(3.62, 1.5) == 254
    assert plain.master.cost_at(2.1, 1.5) == 0


def test_an_inflation_among_the_filters_inflates_the_mask() -> None:
    static = make_map(np.random.default_rng(8))
    masks = {
        "keepout_filter": FilterMask(
            OccupancyGrid(np.full((9, 9), 100, np.int8), RESOLUTION, Pose2D(1.0, 1.0))
        )
    }
    costmap = make_costmap(static, USUAL[:2], ("keepout_filter", "inflation_layer"), masks=masks)
    assert not costmap.is_fast
    drive(costmap, steps=1)
    costmap.clear_entirely()
    assert costmap.master.cost_at(1.6, 1.2) == 253


def test_a_mask_beyond_the_map_counts_too() -> None:
    static = make_map(np.random.default_rng(9))
    masks = {
        "keepout_filter": FilterMask(
            OccupancyGrid(np.full((40, 40), 100, np.int8), RESOLUTION, Pose2D(7.0, 0.0))
        )
    }
    rolling = make_costmap(static, masks=masks, rolling_window=True)
    assert not rolling.is_fast  # the map's costs, made once, do not reach there
    rolling.update(Pose2D(7.2, 1.0, 0.0), None, 0.0)
    assert rolling.master.cost_at(8.5, 1.0) == 254
    assert make_costmap(static, masks=masks).is_fast  # a fixed costmap ends with the map


@pytest.mark.parametrize("plugins", [BEFORE, USUAL])
def test_unknown_cells(plugins: tuple[str, ...]) -> None:
    static = OccupancyGrid(np.full((40, 80), -1, dtype=np.int8), RESOLUTION, Pose2D())
    mask = np.full((40, 80), -1, dtype=np.int8)
    mask[:, 10:20], mask[:, 20:60], mask[:, 60:] = 0, 40, 100
    filters = () if "keepout_filter" in plugins else ("keepout_filter",)
    masks = {"keepout_filter": FilterMask(OccupancyGrid(mask, RESOLUTION, Pose2D()))}
    costmap = make_costmap(static, plugins, filters, masks=masks, track_unknown_space=True)
    costmap.update(Pose2D(0.2, 0.2, 0.0), None, 0.0)
    row = costmap.master.data[39]
    assert row[5] == NO_INFORMATION  # unknown in both
    assert row[10] == 0  # a mask that is known makes the master known
    assert row[22] == 102
    assert row[65] == 254


def test_without_a_mask_or_disabled_a_filter_has_no_effect() -> None:
    static = make_map(np.random.default_rng(10))
    keepout = np.ones(static.data.shape, dtype=bool)
    bare = make_costmap(static, USUAL, rolling_window=True)
    waiting = make_costmap(static, (*BEFORE, "speed_filter"), rolling_window=True)
    off = make_costmap(
        static,
        keepout=keepout,
        filter_params=KeepoutFilterParams(enabled=False),
        rolling_window=True,
    )
    assert waiting.is_fast
    for one, two, three in drive(bare, waiting, off):
        np.testing.assert_array_equal(one, two)
        np.testing.assert_array_equal(one, three)


def test_a_mask_of_its_own_replaces_the_worlds() -> None:
    static = make_map(np.random.default_rng(11))
    keepout = np.zeros(static.data.shape, dtype=bool)
    keepout[200, 200] = True
    masks = {
        "keepout_filter": FilterMask(
            OccupancyGrid(np.full((4, 4), 100, np.int8), RESOLUTION, Pose2D(1.0, 1.0))
        )
    }
    costmap = make_costmap(static, keepout=keepout, masks=masks)
    assert costmap.master.data[200, 200] != 254
    assert costmap.master.cost_at(1.1, 1.1) == 254


@pytest.mark.parametrize("rolling", [True, False])
@pytest.mark.parametrize("filters", [(), ("keepout_filter",)])
def test_a_robot_inside_a_lethal_zone_is_let_out_where_the_file_says_so(
    rolling: bool, filters: tuple[str, ...]
) -> None:
    static = make_map(np.random.default_rng(12))
    mask = np.full((40, 40), 100, dtype=np.int8)
    mask[:10] = 30
    masks = {"keepout_filter": FilterMask(OccupancyGrid(mask, RESOLUTION, Pose2D(0.0, 0.0, 0.0)))}
    params = KeepoutFilterParams(override_lethal_cost=True, lethal_override_cost=200)
    costmap = make_costmap(
        static,
        USUAL if filters else BEFORE,
        filters,
        masks,
        filter_params=params,
        rolling_window=rolling,
    )
    assert not costmap.is_fast
    seen = []
    for stamp, x in enumerate((-1.0, 1.0, 1.2, -1.0)):
        costmap.update(Pose2D(x, 1.0, 0.0), None, float(stamp))
        seen.append((costmap.master.cost_at(0.9, 1.4), costmap.master.cost_at(0.9, 0.2)))
    outside, inside = (254, 253 if not filters else 76), (200, 200)
    assert seen == [outside, inside, inside, outside]
    assert KeepoutFilterParams(lethal_override_cost=253).lethal_override_cost == 252
    with pytest.raises(ParameterError, match="lethal_override_cost -1"):
        KeepoutFilterParams(lethal_override_cost=-1)


def test_masks_that_cannot_be_used_are_refused() -> None:
    static = make_map(np.random.default_rng(13))
    rotated = FilterMask(
        OccupancyGrid(np.zeros((4, 4), dtype=np.int8), RESOLUTION, Pose2D(0.0, 0.0, 0.3))
    )
    with pytest.raises(MapError, match="keepout mask is rotated"):
        make_costmap(static, masks={"keepout_filter": rotated})
    with pytest.raises(MapError, match="keepout mask has the shape"):
        make_costmap(static, keepout=np.zeros((3, 3), dtype=bool))
    huge = FilterMask(OccupancyGrid(np.zeros((2000, 2000), dtype=np.int8), 1.0, Pose2D()))
    with pytest.raises(MapError, match="check the resolutions of map, masks and costmap"):
        make_costmap(static, masks={"keepout_filter": huge})


def speed_mask(kind: int, base: float, multiplier: float) -> FilterMask:
    """Cells of 1 m in a row: unknown, no limit, then 10, 50 and 100."""
    data = np.array([[-1, 0, 10, 50, 100]], dtype=np.int8)
    return FilterMask(OccupancyGrid(data, 1.0, Pose2D()), kind, base, multiplier)


@pytest.mark.parametrize(
    ("kind", "base", "multiplier", "places", "expected"),
    [
        (SPEED_PERCENT, 100.0, -1.0, (2.5, 3.5, 4.5), [90.0, 50.0, 0.0]),
        (SPEED_PERCENT, 0.0, 1.0, (4.5, 2.5, 2.6, 1.5), [100.0, 10.0, 0.0]),
        (SPEED_PERCENT, 60.0, 1.0, (2.5, 3.5), [70.0, 0.0]),  # 110 % is no limit
        # unknown, beyond: the last one holds
        (SPEED_ABSOLUTE, 0.0, 0.02, (2.5, 3.5, 0.5, 9.0, 4.5), [0.2, 1.0, 2.0]),
        (SPEED_ABSOLUTE, -0.3, 0.02, (3.5, 2.5), [0.7, 0.0]),  # -0.1 m/s is no limit
    ],
)
def test_speed_limits(
    kind: int,
    base: float,
    multiplier: float,
    places: tuple[float, ...],
    expected: list[float],
) -> None:
    told: list[tuple[float, bool]] = []
    speed_filter = SpeedFilter(speed_mask(kind, base, multiplier))
    for x in places:
        speed_filter.update(Pose2D(x, 0.5, 0.0), lambda *limit: told.append(limit))
    assert [limit for limit, _ in told] == pytest.approx(expected)
    assert {is_percentage for _, is_percentage in told} == {kind == SPEED_PERCENT}


@pytest.mark.parametrize(
    ("plugins", "filters"), [((*USUAL, "speed_filter"), ()), (USUAL, ("speed_filter",))]
)
def test_a_costmap_tells_its_receivers_when_a_limit_changes(
    plugins: tuple[str, ...], filters: tuple[str, ...]
) -> None:
    static = make_map(np.random.default_rng(14))
    masks = {"speed_filter": speed_mask(SPEED_ABSOLUTE, 0.0, 0.02)}
    costmap = make_costmap(static, plugins, filters, masks)
    assert costmap.is_fast  # a speed filter writes no costs
    told: list[tuple[float, bool]] = []
    costmap.on_speed_limit(lambda *limit: told.append(limit))
    for stamp, x in enumerate((1.5, 2.5, 2.7, 3.5)):
        costmap.update(Pose2D(x, 0.5, 0.0), None, float(stamp))
    assert told == [(pytest.approx(0.2), False), (1.0, False)]
    costmap.reset()
    assert told[2:] == [(0.0, False)]
    costmap.reset()
    assert len(told) == 3


def test_a_speed_mask_of_another_type_has_no_effect() -> None:
    costmap = make_costmap(
        make_map(np.random.default_rng(14)),
        (*USUAL, "speed_filter"),
        masks={"speed_filter": speed_mask(0, 0.0, 1.0)},
    )
    told: list[tuple[float, bool]] = []
    costmap.on_speed_limit(lambda *limit: told.append(limit))
    costmap.update(Pose2D(3.5, 0.5, 0.0), None, 0.0)
    assert not told
