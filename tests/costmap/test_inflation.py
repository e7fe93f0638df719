import math

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from navstack.costmap import inflation_kernels
from navstack.costmap.costmap import LETHAL_OBSTACLE, NO_INFORMATION
from navstack.costmap.inflation import Inflation, cost_kernel, inflation_cost
from navstack.params.costmap import InflationLayerParams
from navstack.types import ByteArray


def slow_inflation(
    costs: ByteArray,
    inflation: Inflation,
    resolution: float,
    inscribed: float,
) -> ByteArray:
    """The rule cell by cell, on scipy's exact distances."""
    params = inflation.params
    sources = costs == LETHAL_OBSTACLE
    if params.inflate_around_unknown:
        sources |= costs == NO_INFORMATION
    if not sources.any():
        return costs.copy()
    # rounded up
    distance, reach = (
        distance_transform_edt(~sources),
        -math.floor(-params.inflation_radius / resolution),
    )
    result = costs.copy()
    for (y, x), cells in np.ndenumerate(distance):
        if cells > reach:
            continue
        cost = inflation_cost(float(cells) * resolution, inscribed, params.cost_scaling_factor)
        if costs[y, x] == NO_INFORMATION:
            if cost > 0 if params.inflate_unknown else cost >= 253:
                result[y, x] = cost
        else:
            result[y, x] = max(cost, costs[y, x])
    return result


@pytest.mark.parametrize("radius", [0.0, 0.12, 0.53, 1.7])
@pytest.mark.parametrize("flags", [(False, False), (True, False), (False, True)])
@pytest.mark.parametrize("unknown", [0.0, 0.1])
def test_costs_equal_those_of_the_distance_transform(
    radius: float,
    flags: tuple[bool, bool],
    unknown: float,
) -> None:
    rng = np.random.default_rng(3)
    costs = rng.choice(np.array([0, 0, 0, 60, 253], dtype=np.uint8), size=(90, 110))
    costs[rng.random(costs.shape) < 0.01] = LETHAL_OBSTACLE
    costs[30:50, 40:70] = LETHAL_OBSTACLE
    costs[rng.random(costs.shape) < unknown] = NO_INFORMATION
    inflation = Inflation(InflationLayerParams(True, radius, 3.0, *flags), 0.05, 0.11)
    expected = slow_inflation(costs, inflation, 0.05, 0.11) if radius else costs.copy()
    inflation.apply(costs, 0, 110, 0, 90)
    np.testing.assert_array_equal(costs, expected)


def test_a_part_of_the_grid_takes_costs_from_sources_outside_and_leaves_the_rest() -> None:
    rng = np.random.default_rng(4)
    costs = np.where(rng.random((80, 150)) < 0.005, LETHAL_OBSTACLE, 0).astype(np.uint8)
    inflation = Inflation(
        InflationLayerParams(inflation_radius=0.9, cost_scaling_factor=2.0), 0.05, 0.2
    )
    whole, part = costs.copy(), costs.copy()
    inflation.apply(whole, 0, 150, 0, 80)
    inflation.apply(part, 21, 140, 13, 61)
    np.testing.assert_array_equal(part[13:61, 21:140], whole[13:61, 21:140])
    part[13:61, 21:140] = costs[13:61, 21:140]
    np.testing.assert_array_equal(part, costs)


@pytest.mark.parametrize("around_unknown", [False, True])
@pytest.mark.parametrize("box", [(0, 90, 0, 40), (3, 80, 5, 33), (89, 90, 0, 40), (0, 65, 39, 40)])
def test_costs_spread_from_the_rims_of_lethal_areas_alone(
    box: tuple[int, ...], around_unknown: bool
) -> None:
    """A lethal cell between four sources, or the grid's edges, is none.

    Unknown cells all are where they count.
    """
    rng = np.random.default_rng(9)
    costs = rng.choice(
        np.array((0, 100, 253, 254, 255), dtype=np.uint8), (40, 90), p=(0.2, 0.02, 0.03, 0.7, 0.05)
    )
    costs[20:, 70:], costs[:, 10:13], costs[5:9, :] = 0, 254, 254
    sources = (costs == LETHAL_OBSTACLE) | (around_unknown & (costs == NO_INFORMATION))
    whole = np.pad(sources, 1, constant_values=True)
    between_four = whole[:-2, 1:-1] & whole[2:, 1:-1] & whole[1:-1, :-2] & whole[1:-1, 2:]
    is_rim = sources & ~((costs == LETHAL_OBSTACLE) & between_four)
    x0, xn, y0, yn = box
    expected = np.argwhere(is_rim[y0:yn, x0:xn])[:, ::-1] + (x0, y0)
    cells = np.full((len(expected) + 1, 2), -7, dtype=np.int32)
    assert inflation_kernels.find_sources(costs, *box, around_unknown, cells) == len(expected)
    np.testing.assert_array_equal(cells[:-1], expected)
    few = np.full((len(expected) // 2 + 1, 2), -7, dtype=np.int32)
    assert inflation_kernels.find_sources(costs, *box, around_unknown, few[:-1]) == len(expected)
    np.testing.assert_array_equal(few[:-1], expected[: len(few) - 1])
    assert few[-1].tolist() == [-7, -7]


def test_more_sources_than_the_buffer_holds() -> None:
    costs = np.zeros((200, 200), dtype=np.uint8)
    costs[::2, ::2] = LETHAL_OBSTACLE
    Inflation(InflationLayerParams(inflation_radius=0.05), 0.05, 0.05).apply(costs, 0, 200, 0, 200)
    assert (costs[::2, ::2] == LETHAL_OBSTACLE).all()
    assert (costs[::2, 1::2] == 253).all()
    assert (costs[1::2, 1::2] == 0).all()


def test_the_kernel_is_round_and_falls_outwards() -> None:
    costs = cost_kernel(
        InflationLayerParams(inflation_radius=1.5, cost_scaling_factor=3.0), 0.05, 0.19
    )
    assert len(costs) // 2 == 30
    assert costs[30, 30] == LETHAL_OBSTACLE
    assert costs[30, 34] == 252 * math.exp(-3.0 * (4 * 0.05 - 0.19)) // 1
    assert costs[0, 30] > 0
    assert costs[0, 31] == 0
    assert (np.diff(costs[30, 30:61].astype(int)) <= 0).all()
