import json
import math
import os
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from navstack.costmap.costmap import LETHAL_OBSTACLE, NO_INFORMATION
from navstack.costmap.inflation import Inflation, inflation_cost, make_kernel
from navstack.geometry import footprint_radii, pad_footprint
from navstack.params.costmap import CostmapParams, InflationLayerParams, robot_footprint
from navstack.types import ByteArray

GOLDEN = Path(os.environ.get("NAVSTACK_GOLDEN", Path(__file__).parents[1] / "golden"))
VECTORS = np.load(GOLDEN / "inflation.npz")
META = json.loads(str(VECTORS["meta_json"]))
GRIDS = sorted(key[: -len("_out_legacy")] for key in VECTORS.files if key.endswith("_out_legacy"))
CURVES = sorted(key[: -len("_dist_m")] for key in VECTORS.files if key.endswith("_dist_m"))


def inflation_of(case: str) -> Inflation:
    meta = META[case]
    params = InflationLayerParams(
        inflation_radius=meta["inflation_radius"],
        cost_scaling_factor=meta["cost_scaling_factor"],
        inflate_unknown=meta["inflate_unknown"],
        inflate_around_unknown=meta["inflate_around_unknown"],
    )
    return Inflation(params, meta["resolution"], meta["inscribed_circumscribed"][0])  # Jazzy knows no custom radius


@pytest.mark.parametrize("case", GRIDS)
def test_grids_equal_nav2s(case: str) -> None:
    costs = VECTORS[f"{case}_in"].copy()
    inflation_of(case).apply(costs, 0, costs.shape[1], 0, costs.shape[0])
    differing = int((costs != VECTORS[f"{case}_out_legacy"]).sum())
    # With inflate_around_unknown, Jazzy's breadth-first search misses the nearest source of one cell.
    assert differing <= (1 if case.endswith("_around1") else 0)


@pytest.mark.parametrize("case", CURVES)
def test_cost_curves_equal_nav2s(case: str) -> None:
    meta = META[case]
    params = CostmapParams(footprint=meta["footprint"])
    radii = footprint_radii(pad_footprint(robot_footprint(params), meta["footprint_padding"]))
    assert radii == pytest.approx(meta["inscribed_circumscribed"], abs=1e-15)
    scaling = meta["cost_scaling_factor"]
    by_metres = [inflation_cost(float(d), radii[0], scaling) for d in VECTORS[f"{case}_dist_m"]]
    np.testing.assert_array_equal(by_metres, VECTORS[f"{case}_cost"])
    by_cells = [inflation_cost(float(d) * meta["resolution"], radii[0], scaling) for d in VECTORS[f"{case}_cells"]]
    np.testing.assert_array_equal(by_cells, VECTORS[f"{case}_cost_cells"])


def test_the_vectors_hold_cases() -> None:
    assert len(GRIDS) >= 10
    assert len(CURVES) >= 3


def slow_inflation(costs: ByteArray, inflation: Inflation, resolution: float, inscribed: float) -> ByteArray:
    """The rule cell by cell, on scipy's exact distances."""
    params = inflation.params
    sources = costs == LETHAL_OBSTACLE
    if params.inflate_around_unknown:
        sources |= costs == NO_INFORMATION
    if not sources.any():
        return costs.copy()
    distance = distance_transform_edt(~sources)
    result = costs.copy()
    for (y, x), cells in np.ndenumerate(distance):
        if cells > inflation.kernel.radius:
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
def test_stamping_equals_the_distance_transform(radius: float, flags: tuple[bool, bool], unknown: float) -> None:
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
    inflation = Inflation(InflationLayerParams(inflation_radius=0.9, cost_scaling_factor=2.0), 0.05, 0.2)
    whole, part = costs.copy(), costs.copy()
    inflation.apply(whole, 0, 150, 0, 80)
    inflation.apply(part, 21, 140, 13, 61)
    np.testing.assert_array_equal(part[13:61, 21:140], whole[13:61, 21:140])
    part[13:61, 21:140] = costs[13:61, 21:140]
    np.testing.assert_array_equal(part, costs)


def test_more_sources_than_the_buffer_holds() -> None:
    costs = np.zeros((200, 200), dtype=np.uint8)
    costs[::2, ::2] = LETHAL_OBSTACLE
    Inflation(InflationLayerParams(inflation_radius=0.05), 0.05, 0.05).apply(costs, 0, 200, 0, 200)
    assert (costs[::2, ::2] == LETHAL_OBSTACLE).all()
    assert (costs[::2, 1::2] == 253).all()
    assert (costs[1::2, 1::2] == 0).all()


def test_the_kernel_is_round_and_falls_outwards() -> None:
    kernel = make_kernel(InflationLayerParams(inflation_radius=1.5, cost_scaling_factor=3.0), 0.05, 0.19)
    assert kernel.radius == 30
    assert kernel.costs[30, 30] == LETHAL_OBSTACLE
    assert kernel.costs[30, 34] == 252 * math.exp(-3.0 * (4 * 0.05 - 0.19)) // 1
    assert kernel.costs[0, 30] > 0
    assert kernel.costs[0, 31] == 0
    assert (np.diff(kernel.costs[30, 30:61].astype(int)) <= 0).all()
