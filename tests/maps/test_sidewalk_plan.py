"""Plans of sidewalk worlds, which are drawn in no time: streets and furniture.

What is not drawn of a mesh.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy import ndimage

from harness.storage.shipped import shipped
from harness.world.map.geojson import load_objects
from harness.world.map.scene import Obstacle
from harness.world.map.shapes import Rect
from harness.world.map.sidewalk import LEAST_WIDTH, without_slivers
from harness.world.map.sidewalk_blocks import (
    Block,
    Streets,
    _alleys,
    _crossing_ends,
    _lanes,
    _lots,
    lay_out,
)
from harness.world.map.sidewalk_furniture import Furnisher

MOST_ATTEMPTS = 4
Thing = tuple[str, float, list[list[float]]]


def plan(seed: int, widening: float) -> Streets:
    return lay_out(np.random.default_rng((seed,)), widening)


@pytest.mark.parametrize(("name", "seed"), [("sidewalk", 0), ("sidewalk_1", 1), ("sidewalk_2", 2)])
def test_streets_and_furniture_are_those_of_the_seed(name: str, seed: int) -> None:
    """The first block's place says by how much its sidewalks were widened.

    The furniture is of one of few attempts.
    """
    obstacles, zones, _ = load_objects(Path(shipped("maps") / f"{name}.geojson"))
    corner = next(zone.polygon[0, 0] for zone in zones if zone.kind == "sidewalk")
    widening = round(plan(seed, 0.0).blocks[0].area.x0 - corner, 3)
    ground: list[Thing] = [(zone.kind, zone.elevation, zone.polygon.tolist()) for zone in zones]
    things: list[Thing] = [(each.kind, each.height, each.polygon.tolist()) for each in obstacles]
    for attempt in range(MOST_ATTEMPTS):
        streets = plan(seed, widening)
        placed = Furnisher(streets, np.random.default_rng((seed, attempt, 1))).furnish()
        if [
            (each.kind, each.height, each.polygon.tolist())
            for each in (*streets.buildings, *placed)
        ] == things:
            break
    else:
        pytest.fail("no attempt gives these buildings and this furniture")
    assert [
        (zone.kind, zone.elevation, zone.polygon.tolist()) for zone in streets.zones()
    ] == ground


def test_quotas_hold_for_alleys_and_crosswalks() -> None:
    """Of eleven blocks eight are quartered.

    Half of the roads are crossed at both ends, the others by turns at one.
    """
    alleys = _alleys(np.random.default_rng(3), 11)
    assert sorted(map(len, alleys)) == [1] * 3 + [3] * 8
    assert sorted(width for each in alleys for width in each) == pytest.approx(
        np.linspace(1.1, 3.0, 27).tolist()
    )
    ends = [(each.start, each.stop) for each in _crossing_ends(np.random.default_rng(3), 17)]
    assert [ends.count(each) for each in ((0, 2), (0, 1), (1, 2))] == [8, 5, 4]


@pytest.mark.parametrize("count", [3, 4])
def test_rows_of_blocks_fill_the_world_between_its_outer_roads(count: int) -> None:
    """From -93.5 m to 93.5 m but for rounding, with roads of 7 m to 9.5 m between them."""
    lanes = np.array(_lanes(np.random.default_rng(count), count))
    assert lanes[0, 0] == -93.5 and lanes[-1, 1] == pytest.approx(93.5, abs=0.05 * count + 0.01)
    roads, sizes = lanes[1:, 0] - lanes[:-1, 1], lanes[:, 1] - lanes[:, 0]
    assert (roads >= 6.99).all() and (roads <= 9.51).all()
    assert sizes.max() / sizes.min() <= 1.15 / 0.85 + 0.01


def test_a_blocks_sidewalks_lie_along_its_sides_and_around_what_they_enclose() -> None:
    block = Block(Rect(10.0, 20.0, 40.0, 60.0), (1.0, 2.0, 3.0, 4.0), "buildings")
    left, bottom, right, top = (block.strip(side) for side in range(4))
    assert (left, right) == (Rect(10.0, 20.0, 11.0, 60.0), Rect(37.0, 20.0, 40.0, 60.0))
    assert (bottom, top) == (Rect(10.0, 20.0, 40.0, 22.0), Rect(10.0, 56.0, 40.0, 60.0))
    assert block.interior == Rect(11.0, 22.0, 37.0, 56.0)


class Quarter:
    """A generator that draws a quarter of the way from low to high; it knows what it was asked."""

    def __init__(self) -> None:
        self.asked: list[tuple[float, float]] = []

    def uniform(self, low: float, high: float) -> float:
        self.asked.append((low, high))
        return 0.75 * low + 0.25 * high


@pytest.mark.parametrize(
    ("area", "lots"),
    [
        (Rect(1.0, 2.0, 22.75, 23.75), (Rect(1.0, 2.0, 22.75, 23.75),)),
        (Rect(1.0, 2.0, 23.0, 12.0), (Rect(1.0, 2.0, 10.68, 12.0), Rect(10.68, 2.0, 23.0, 12.0))),
        (Rect(1.0, 2.0, 11.0, 24.0), (Rect(1.0, 2.0, 11.0, 11.68), Rect(1.0, 11.68, 11.0, 24.0))),
        (
            Rect(0.0, 0.0, 22.0, 22.0),
            (
                Rect(0.0, 0.0, 9.68, 9.68),
                Rect(0.0, 9.68, 9.68, 22.0),
                Rect(9.68, 0.0, 22.0, 9.68),
                Rect(9.68, 9.68, 22.0, 22.0),
            ),
        ),
    ],
)
def test_lots_are_halved_across_their_longer_side_until_it_is_below_22_metres(
    area: Rect, lots: tuple[Rect, ...]
) -> None:
    """At 0.38 to 0.62 of it, here at 0.44; a square first along x."""
    drawn = Quarter()
    found = _lots(area, drawn)  # type: ignore[arg-type]
    assert np.array([lot.polygon for lot in found]) == pytest.approx(
        np.array([lot.polygon for lot in lots])
    )
    assert drawn.asked == [(0.38, 0.62)] * (len(lots) - 1)


def test_slivers_are_not_drawn() -> None:
    mask = ndimage.binary_dilation(np.random.default_rng(0).random((80, 90)) > 0.97, iterations=3)
    for resolution in (0.05, 0.06):
        size = round(LEAST_WIDTH / resolution)
        assert np.array_equal(
            without_slivers(mask, resolution), ndimage.binary_opening(mask, np.ones((size, size)))
        )


@pytest.mark.parametrize(
    ("blocks", "ends"),
    [((), ((-0.35, -0.45), (7.35, 3.45))), ((Rect(-9, 0, 0, 3),), ((-0.45, -0.35), (7.45, 3.35)))],
)
@pytest.mark.parametrize(("gap", "lights"), [(0.01, 2), (-0.01, 1)])
def test_a_traffic_light_keeps_its_own_length_from_other_things(
    blocks: tuple[Rect, ...],
    ends: tuple[tuple[float, float], ...],
    gap: float,
    lights: int,
) -> None:
    """It stands aside of both ends of a crosswalk; a bin is before the first place."""
    streets = Streets(
        [Block(area, (1.0,) * 4, "buildings") for area in blocks], [Rect(0.0, 0.0, 7.0, 3.0)]
    )
    furnisher = Furnisher(streets, np.random.default_rng(0))
    piece = ("traffic_light", np.array((0.3, 0.9, 4.0)))
    furnisher._draw = lambda mix: piece  # type: ignore[method-assign]
    (x, y), beside = ends[0], 0.3 + gap
    furnisher.pieces.append(
        Obstacle("trash_bin", Rect(x + beside, y, x + beside + 0.1, y + 0.1).polygon, 1.0)
    )
    furnisher._signal_crosswalks(1.0)
    placed = [tuple(piece.polygon.mean(axis=0)) for piece in furnisher.pieces[1:]]
    assert placed == [pytest.approx(end) for end in ends[2 - lights :]]
    assert {(piece.kind, piece.height) for piece in furnisher.pieces[1:]} == {
        ("traffic_light", 4.0)
    }
