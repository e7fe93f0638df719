"""What single parameters of Nav2's layers do, in both ways to update a costmap."""

import dataclasses
import math

import numpy as np
import pytest

from navstack.costmap.costmap import NO_INFORMATION
from navstack.costmap.layered_costmap import LayeredCostmap
from navstack.costmap.observations import ObservationBuffer, PointObservation
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.params.costmap import (
    MAXIMUM,
    MAXIMUM_WITHOUT_UNKNOWN,
    OVERWRITE,
    CostmapParams,
    InflationLayerParams,
    LayerParams,
    ObservationSourceParams,
    ObstacleLayerParams,
    StaticLayerParams,
    VoxelLayerParams,
)
from navstack.types import LaserScan, Pose2D

USUAL = ("static_layer", "obstacle_layer", "inflation_layer")
SOURCE = ObservationSourceParams(
    clearing=True,
    obstacle_max_range=4.0,
    raytrace_max_range=4.5,
    inf_is_valid=True,
)
ways = pytest.mark.parametrize("prefer_fast", [True, False], ids=["fast", "full"])


def make_costmap(
    plugins: tuple[str, ...] = USUAL,
    source: ObservationSourceParams = SOURCE,
    data: np.ndarray | None = None,
    prefer_fast: bool = False,
    obstacles: dict[str, object] | None = None,
    **others: object,
) -> LayeredCostmap:
    """Over 10 m x 10 m around the origin, by default all free."""
    layers: dict[str, LayerParams] = {
        "static_layer": StaticLayerParams(),
        "obstacle_layer": ObstacleLayerParams(
            observation_sources=("scan",),
            sources={"scan": source},
            **(obstacles or {}),  # type: ignore[arg-type]
        ),
        "inflation_layer": InflationLayerParams(inflation_radius=0.6, cost_scaling_factor=5.0),
    }
    basis = CostmapParams(
        width=8.0,
        height=8.0,
        resolution=0.05,
        robot_radius=0.1,
        plugins=plugins,
        layers={name: layers[name] for name in plugins},
    )
    cells = np.zeros((200, 200), dtype=np.int8) if data is None else data
    params = dataclasses.replace(basis, **others)  # type: ignore[arg-type]
    return LayeredCostmap(
        params, OccupancyGrid(cells, 0.05, Pose2D(-5.0, -5.0)), prefer_fast=prefer_fast
    )


def ahead(*ranges: float, stamp: float = 0.0) -> LaserScan:
    """Beams 0.2 rad apart, the first straight ahead."""
    return LaserScan(stamp, np.array(ranges), 0.0, 0.2, 0.05, 20.0)


def is_marked(costmap: LayeredCostmap, distance: float, beam: int = 0) -> bool:
    return (
        costmap.master.cost_at(distance * math.cos(0.2 * beam), distance * math.sin(0.2 * beam))
        == 254
    )


@pytest.mark.parametrize(("kind", "short"), [(ObstacleLayerParams, 0), (VoxelLayerParams, 2)])
@ways
def test_beams_of_a_voxel_layer_end_two_cells_before_the_return(
    prefer_fast: bool, kind: type[ObstacleLayerParams], short: int
) -> None:
    """What stood one to four cells nearer was seen first; Nav2's voxel_layer.cpp, lines 343 ff."""
    for cells in range(1, 5):
        layers = {"static_layer": StaticLayerParams()}
        layers["obstacle_layer"] = kind(observation_sources=("scan",), sources={"scan": SOURCE})
        layers["inflation_layer"] = InflationLayerParams(inflation_radius=0.6)
        costmap = make_costmap(prefer_fast=prefer_fast, layers=layers)
        assert costmap.is_fast is prefer_fast
        nearer = 1.025 - 0.05 * cells
        costmap.update(Pose2D(), ahead(nearer), 0.0)
        assert is_marked(costmap, nearer)
        costmap.update(Pose2D(), ahead(1.025, stamp=0.1), 0.1)
        assert is_marked(costmap, 1.025)
        assert is_marked(costmap, nearer) is (cells < short), cells


def test_a_return_nearer_than_two_cells_clears_the_sensors_own_at_most() -> None:
    observation = PointObservation(0.0, 1.0, 2.0, lambda: np.array(((1.06, 2.08), (1.3, 1.6))))
    shortened = observation.shortened(0.1)
    np.testing.assert_allclose(shortened.points, ((1.0, 2.0), (1.24, 1.68)))
    assert (shortened.origin_x, shortened.origin_y) == (1.0, 2.0)


@pytest.mark.parametrize(
    ("order", "map_spreads", "scan_spreads"),
    [
        (USUAL, True, True),
        # the map overwrites what the scan showed
        (("obstacle_layer", "static_layer", "inflation_layer"), True, False),
        (("static_layer", "inflation_layer", "obstacle_layer"), True, False),
        (("obstacle_layer", "inflation_layer", "static_layer"), False, False),
        (("inflation_layer", "static_layer", "obstacle_layer"), False, False),
    ],
)
@pytest.mark.parametrize("rolling", [True, False])
@ways
def test_layers_write_in_the_order_of_the_file(
    order: tuple[str, ...],
    map_spreads: bool,
    scan_spreads: bool,
    rolling: bool,
    prefer_fast: bool,
) -> None:
    data = np.zeros((200, 200), dtype=np.int8)
    data[140, 100] = 100  # (0.025, 2.025) m
    costmap = make_costmap(order, data=data, prefer_fast=prefer_fast, rolling_window=rolling)
    assert costmap.is_fast is (prefer_fast and order == USUAL)
    for step in range(3):
        costmap.update(Pose2D(), ahead(1.5, stamp=0.1 * step), 0.1 * step)
    assert costmap.master.cost_at(0.02, 2.02) == 254
    assert (costmap.master.cost_at(0.02, 2.3) > 0) is map_spreads
    assert (costmap.master.cost_at(1.5, 0.25) > 0) is scan_spreads
    assert costmap.obstacle_costs[0].max() == 254


@ways
@pytest.mark.parametrize("padding", [0.0, 0.05, 0.25])
def test_the_inscribed_radius_is_that_of_the_padded_footprint(
    padding: float, prefer_fast: bool
) -> None:
    data = np.zeros((200, 200), dtype=np.int8)
    data[100, 100] = 100
    costmap = make_costmap(
        data=data,
        prefer_fast=prefer_fast,
        footprint="[[0.14, 0.25], [0.14, -0.25], [-0.607, -0.25], [-0.607, 0.25]]",
        footprint_padding=padding,
    )
    assert costmap.inscribed_radius == pytest.approx(0.14 + padding, abs=1e-7)
    assert costmap.circumscribed_radius == pytest.approx(
        math.hypot(0.607 + padding, 0.25 + padding), abs=1e-7
    )
    costmap.update(Pose2D(3.0, 3.0), None, 0.0)
    row = costmap.master.data[100, 101:]
    inside = np.arange(1, len(row) + 1) * 0.05 <= costmap.inscribed_radius
    assert (row[inside] == 253).all()
    assert (row[~inside] < 253).all()


@ways
def test_only_returns_between_the_obstacle_ranges_mark(prefer_fast: bool) -> None:
    source = dataclasses.replace(SOURCE, obstacle_min_range=1.0, obstacle_max_range=2.5)
    costmap = make_costmap(source=source, prefer_fast=prefer_fast)
    costmap.update(Pose2D(), ahead(0.7, 1.2, 2.3, 2.7), 0.0)
    seen = [
        is_marked(costmap, distance, beam) for beam, distance in enumerate((0.7, 1.2, 2.3, 2.7))
    ]
    assert seen == [False, True, True, False]


@ways
@pytest.mark.parametrize(
    ("least", "most", "stays"),
    [
        (0.0, 2.5, [False, False, False, True]),
        (1.0, 4.5, [True, False, False, False]),
        # as in Nav2 a least range carries the greatest too far
        (1.0, 2.5, [True, False, False, False]),
    ],
)
def test_beams_clear_between_the_raytrace_ranges_only(
    least: float,
    most: float,
    stays: list[bool],
    prefer_fast: bool,
) -> None:
    source = dataclasses.replace(SOURCE, raytrace_min_range=least, raytrace_max_range=most)
    costmap = make_costmap(
        source=source,
        prefer_fast=prefer_fast,
        obstacles={"footprint_clearing_enabled": False},
    )
    costmap.update(Pose2D(), ahead(0.7, 1.2, 2.3, 2.7), 0.0)
    assert all(
        is_marked(costmap, distance, beam) for beam, distance in enumerate((0.7, 1.2, 2.3, 2.7))
    )
    costmap.update(Pose2D(), LaserScan(0.1, np.full(200, 3.5), -0.1, 0.005, 0.05, 20.0), 0.1)
    seen = [
        is_marked(costmap, distance, beam) for beam, distance in enumerate((0.7, 1.2, 2.3, 2.7))
    ]
    assert seen == stays


@pytest.mark.parametrize("persistence", [0.0, 0.25, 0.5, 1.0])
def test_observations_of_a_buffer_are_no_older_than_it_remembers(persistence: float) -> None:
    """Their stamps are exact in binary, so that some are just as old as they may be."""
    buffer, stamps = (
        ObservationBuffer(dataclasses.replace(SOURCE, observation_persistence=persistence)),
        [7.0],
    )
    for gap in (0.25, 0.5, 0.25, 0.25, 1.25, 0.25):
        stamps.append(stamps[-1] + gap)
    for count, newest in enumerate(stamps, 1):
        buffer.add(PointObservation(newest, 0.0, 0.0, lambda: np.empty((0, 2))))
        young = [
            stamp
            for stamp in stamps[count - 2 :: -1]
            if persistence > 0.0 and newest - stamp <= persistence
        ]
        assert [each.stamp for each in buffer.observations] == [
            newest,
            *(young if count > 1 else ()),
        ]


@ways
@pytest.mark.parametrize(("persistence", "gone_after"), [(0.0, 0.1), (0.25, 0.3), (0.45, 0.5)])
def test_a_scan_marks_again_for_as_long_as_it_persists(
    persistence: float,
    gone_after: float,
    prefer_fast: bool,
) -> None:
    """Each update clears with all kept scans, then marks with all.

    An old return outlives the beams through it.
    """
    costmap = make_costmap(
        source=dataclasses.replace(SOURCE, observation_persistence=persistence),
        prefer_fast=prefer_fast,
    )
    costmap.update(Pose2D(), ahead(1.5), 0.0)
    for step in range(1, 8):
        costmap.update(Pose2D(), ahead(math.inf, stamp=0.1 * step), 0.1 * step)
        assert is_marked(costmap, 1.5) is (0.1 * step < gone_after - 1e-9), step


@ways
def test_an_obstacle_stays_as_last_seen_while_no_scan_comes(prefer_fast: bool) -> None:
    costmap = make_costmap(prefer_fast=prefer_fast)
    costmap.update(Pose2D(), ahead(1.5), 0.0)
    for step in range(1, 20):
        costmap.update(Pose2D(), None, 0.1 * step)
        assert is_marked(costmap, 1.5)
        assert costmap.is_current


@ways
def test_a_costmap_is_not_current_when_expected_scans_stay_away(prefer_fast: bool) -> None:
    source = dataclasses.replace(SOURCE, expected_update_rate=0.3)
    costmap = make_costmap(source=source, prefer_fast=prefer_fast)
    costmap.update(Pose2D(), None, 0.0)
    assert not costmap.is_current  # there was none yet
    costmap.update(Pose2D(), ahead(1.5, stamp=0.1), 0.1)
    current = []
    for stamp in (0.2, 0.39, 0.5):
        costmap.update(Pose2D(), None, stamp)
        current.append(costmap.is_current)
    assert current == [True, True, False]
    costmap.update(Pose2D(), ahead(1.5, stamp=0.6), 0.6)
    assert costmap.is_current
    costmap.reset()
    costmap.update(Pose2D(), None, 0.0)
    assert not costmap.is_current


@pytest.mark.parametrize(
    ("combination_method", "expected"),
    [
        (OVERWRITE, [NO_INFORMATION, 0, 254]),
        (MAXIMUM, [NO_INFORMATION, 0, 254]),
        (MAXIMUM_WITHOUT_UNKNOWN, [NO_INFORMATION, NO_INFORMATION, NO_INFORMATION]),
    ],
)
def test_whether_a_scan_makes_unknown_cells_known(
    combination_method: int, expected: list[int]
) -> None:
    data = np.full((200, 200), -1, dtype=np.int8)
    costmap = make_costmap(
        USUAL[:2],
        data=data,
        track_unknown_space=True,
        obstacles={"combination_method": combination_method},
    )
    costmap.update(Pose2D(), ahead(1.5), 0.0)
    assert [costmap.master.cost_at(x, 0.01) for x in (-1.0, 1.0, 1.51)] == expected


def test_overwriting_lets_a_scan_free_what_the_map_shows() -> None:
    data = np.zeros((200, 200), dtype=np.int8)
    data[100, 120] = 100  # 1 m ahead, on the beam's way
    for method, expected in ((OVERWRITE, 0), (MAXIMUM, 254)):
        costmap = make_costmap(USUAL[:2], data=data, obstacles={"combination_method": method})
        costmap.update(Pose2D(), ahead(1.5), 0.0)
        assert costmap.master.cost_at(1.02, 0.01) == expected


@ways
@pytest.mark.parametrize("enabled", [True, False])
def test_cells_under_the_robot_are_free_where_the_layer_says_so(
    enabled: bool, prefer_fast: bool
) -> None:
    source = dataclasses.replace(SOURCE, clearing=False)
    costmap = make_costmap(
        USUAL[:2],
        source,
        prefer_fast=prefer_fast,
        obstacles={"footprint_clearing_enabled": enabled},
        footprint="[[0.3, 0.15], [0.3, -0.15], [-0.3, -0.15], [-0.3, 0.15]]",
    )
    costmap.update(Pose2D(0.0, 0.0, 0.0), ahead(0.6, 0.6, 0.6), 0.0)
    costmap.update(Pose2D(0.4, 0.0, 0.0), None, 0.1)  # onto the first return
    assert is_marked(costmap, 0.6) is not enabled
    assert is_marked(costmap, 0.6, beam=2)  # beside the robot
    costmap.update(Pose2D(-1.0, 0.0, 0.0), ahead(4.4, stamp=0.2), 0.2)
    # what was freed stays free when the robot has left
    assert is_marked(costmap, 0.6) is not enabled
