"""A scene drawn with letters.

``#`` wall, ``.`` sidewalk, ``x`` crosswalk, ``=`` road (a curb lower than the sidewalk), ``,``
ground where nobody is meant to be (a closed site), level with the sidewalk. The robot may be on
sidewalk and crosswalk.
"""

from dataclasses import replace

import numpy as np

from harness.scenarios.scenario import Drawing, Thing
from harness.world.map.extrude import extrude, merge_rectangles
from harness.world.map.scene import Obstacle, Scene, Zone
from harness.world.map.shapes import Rect, fill_convex
from navstack.costmap.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from navstack.errors import ParameterError
from navstack.types import BoolArray, Pose2D

CELL = 0.05  # [m] of the maps made from a drawing
CURB = -0.12  # [m] height of the road
GROUND = {"#": "wall", ".": "sidewalk", "x": "crosswalk", "=": "road", ",": "closed"}
WALKABLE = (".", "x")
MOST_CELLS = 4_000_000  # 100 m x 100 m


def draw_scene(drawing: Drawing, name: str) -> Scene:
    """The scene of a drawing.

    Raises:
        ParameterError: an unknown letter, rows of different lengths, or a place too large.
    """
    letters = _letters(drawing)
    per_letter = round(drawing.letter / CELL)
    # row 0: lowest y
    cells = np.kron(letters[::-1], np.ones((per_letter, per_letter), dtype=np.uint32))
    origin = Pose2D(*drawing.origin, 0.0)
    wall = cells == ord("#")
    walkable = np.isin(cells, [ord(letter) for letter in WALKABLE])
    zones = []
    for letter, kind in GROUND.items():
        if letter == "#":
            continue
        height = 0.0
        if kind == "road":
            height = CURB
        for rectangle in _rectangles(letters[::-1] == ord(letter), drawing):
            zones.append(Zone(kind, rectangle.polygon, height))
    geometry = _grid(wall, origin)
    return Scene(name, extrude(geometry, wall), tuple(zones), geometry, _grid(~walkable, origin))


def with_things(scene: Scene, things: tuple[Thing, ...]) -> Scene:
    """The scene with things put down in it.

    Raises:
        ParameterError: one of them is not in the place, or too thin for its cells.
    """
    grid = scene.geometry
    solid = grid.data.copy()
    obstacles = []
    for thing in things:
        box = Rect(*thing.box).polygon
        mask = np.zeros(solid.shape, dtype=bool)
        fill_convex(mask, box, True, grid.resolution, grid.origin.x, grid.origin.y)
        if not mask.any():
            raise ParameterError(
                f"thing: box {list(thing.box)} covers no cell of {grid.resolution:g} m of the "
                f"place, which is x {_span(grid.origin.x, grid.width * grid.resolution)}, "
                f"y {_span(grid.origin.y, grid.height * grid.resolution)} m"
            )
        solid[mask] = OCCUPIED
        obstacles.append(Obstacle(thing.kind, box, thing.height))
    geometry = OccupancyGrid(solid, grid.resolution, grid.origin)
    return replace(scene, obstacles=(*scene.obstacles, *obstacles), geometry=geometry)


def _span(begin: float, length: float) -> str:
    return f"{begin:g}..{begin + length:g}"


def _letters(drawing: Drawing) -> np.ndarray:
    """The drawing as an array of code points (H, W), the northern row first."""
    rows = [row.strip() for row in drawing.rows.strip().splitlines()]
    if not rows or not rows[0] or len({len(row) for row in rows}) != 1:
        raise ParameterError(
            f"drawing: {len(rows)} rows; all must have the same length of at least one letter"
        )
    unknown = sorted({letter for row in rows for letter in row} - set(GROUND))
    if unknown:
        known = ", ".join(f"'{letter}' {kind}" for letter, kind in GROUND.items())
        raise ParameterError(f"drawing: unknown letter '{unknown[0]}'; known: {known}")
    per_letter = drawing.letter / CELL
    if per_letter < 1.0 or abs(per_letter - round(per_letter)) > 1e-6:
        raise ParameterError(f"drawing: letter {drawing.letter} m is not a multiple of {CELL} m")
    if len(rows) * len(rows[0]) * per_letter**2 > MOST_CELLS:
        raise ParameterError(
            f"drawing: {len(rows)} x {len(rows[0])} letters of {drawing.letter} m are too large a "
            "place"
        )
    return np.array([[ord(letter) for letter in row] for row in rows], dtype=np.uint32)


def _rectangles(mask: BoolArray, drawing: Drawing) -> list[Rect]:
    x0, y0, side = *drawing.origin, drawing.letter
    return [
        Rect(x0 + c0 * side, y0 + r0 * side, x0 + c1 * side, y0 + r1 * side)
        for r0, c0, r1, c1 in merge_rectangles(np.ascontiguousarray(mask)).tolist()
    ]


def _grid(occupied: BoolArray, origin: Pose2D) -> OccupancyGrid:
    return OccupancyGrid(np.where(occupied, np.int8(OCCUPIED), np.int8(FREE)), CELL, origin)
