"""Maps as nav2_map_server reads and map_saver writes them.

The cases are worked out by hand from map_io.cpp.
"""

import math
import os
import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from ruamel.yaml import YAML

from navstack.costmap.map_image import MAX_PIXELS
from navstack.costmap.map_io import load_map, save_map
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import MapError
from navstack.types import Pose2D

DEFAULTS = {
    "image": "m.pgm",
    "resolution": "0.05",
    "origin": "[-1.5, 2.0, 0.25]",
    "occupied_thresh": "0.65",
    "free_thresh": "0.196",
    "negate": "0",
}


def write_yaml(folder: Path, **changes: str | None) -> Path:
    values = {key: value for key, value in {**DEFAULTS, **changes}.items() if value is not None}
    path = folder / "m.yaml"
    path.write_text("".join(f"{key}: {value}\n" for key, value in values.items()))
    return path


def write_pgm(folder: Path, values: np.ndarray, largest: int = 255) -> None:
    height, width = values.shape
    raw = values.astype(">u2" if largest > 255 else "u1").tobytes()
    (folder / "m.pgm").write_bytes(
        b"P5\n# made by hand\n%d %d\n%d\n" % (width, height, largest) + raw
    )


def loaded(folder: Path, pixels: list[list[int]], **changes: str | None) -> list[list[int]]:
    write_pgm(folder, np.array(pixels))
    return load_map(write_yaml(folder, **changes)).data.tolist()


def test_geometry_and_first_row_on_top(tmp_path: Path) -> None:
    write_pgm(tmp_path, np.array([[0, 254, 205], [254, 254, 0]]))
    grid = load_map(write_yaml(tmp_path))
    assert grid.data.tolist() == [[0, 0, 100], [100, 0, -1]]
    assert grid.data.flags.c_contiguous
    assert (grid.resolution, grid.origin) == (0.05, Pose2D(-1.5, 2.0, 0.25))


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        # occupancy 1 - v/255 of 0, 89, 90, 204, 205, 206, 255: 1, .651, .647, .2, .196078, .192, 0
        ({}, [100, 100, -1, -1, -1, 0, 0]),
        ({"free_thresh": "0.25"}, [100, 100, -1, 0, 0, 0, 0]),
        ({"negate": "1"}, [0, -1, -1, 100, 100, 100, 100]),
        ({"negate": "true"}, [0, -1, -1, 100, 100, 100, 100]),
        ({"free_thresh": "0.65"}, [100, 100, 0, 0, 0, 0, 0]),
        ({"mode": "Trinary"}, [100, 100, -1, -1, -1, 0, 0]),
        ({"mode": "scale"}, [100, 100, 99, 1, 0, 0, 0]),
        ({"mode": "scale", "negate": "1"}, [0, 34, 35, 100, 100, 100, 100]),
        ({"mode": "raw"}, [0, 89, 90, -1, -1, -1, -1]),
        ({"mode": "raw", "negate": "1"}, [0, 89, 90, -1, -1, -1, -1]),
    ],
)
def test_modes_negate_and_thresholds(
    tmp_path: Path,
    changes: dict[str, str],
    expected: list[int],
) -> None:
    assert loaded(tmp_path, [[0, 89, 90, 204, 205, 206, 255]], **changes) == [expected]


def test_both_thresholds_are_inclusive(tmp_path: Path) -> None:
    # negated, occupancy is brightness: 50, 51, 153, 154 of 255 around 0.2 and 0.6
    cells = loaded(
        tmp_path,
        [[50, 51, 52, 152, 153, 154]],
        negate="1",
        free_thresh="0.2",
        occupied_thresh="0.6",
    )
    assert cells == [[0, 0, -1, -1, 100, 100]]


def test_scale_rounds_half_up_and_has_8_bits(tmp_path: Path) -> None:
    # thresholds 0 and 0.8 (negated): bytes 51, 4, 5, 5, 6, 7 of 255 in percent of 204
    write_pgm(tmp_path, np.array([[200, 17, 18, 20, 22, 28]]), 1000)
    wide = {"mode": "scale", "negate": "1", "free_thresh": "0.0", "occupied_thresh": "0.8"}
    assert load_map(write_yaml(tmp_path, **wide)).data.tolist() == [[25, 2, 2, 2, 3, 3]]
    # thresholds 0 and 1, brightness 1/8, 3/8 and 5/8: bytes 32, 96 and 159
    write_pgm(tmp_path, np.array([[1, 3, 5]]), 8)
    cells = load_map(write_yaml(tmp_path, **{**wide, "occupied_thresh": "1.0"})).data
    assert cells.tolist() == [[13, 38, 62]]
    # 51 of 102: 50 percent; 50 and 52 of 102: 49.02 and 50.98; 1 of 200: exactly a half
    half = {**wide, "occupied_thresh": repr(200.0 / 255.0)}
    write_pgm(tmp_path, np.array([[1, 3, 199]]), 255)
    assert load_map(write_yaml(tmp_path, **half)).data.tolist() == [[1, 2, 100]]


def test_transparent_pixels_are_unknown(tmp_path: Path) -> None:
    pixels = [
        [
            (255, 255, 255, 255),
            (255, 255, 255, 0),
            (0, 0, 0, 255),
            (0, 0, 0, 0),
            (255, 255, 255, 254),
        ]
    ]
    Image.fromarray(np.array(pixels, dtype=np.uint8)).save(tmp_path / "m.png")
    trinary = load_map(write_yaml(tmp_path, image="m.png", free_thresh="0.25"))
    assert trinary.data.tolist() == [[0, -1, 100, -1, -1]]
    scale = load_map(write_yaml(tmp_path, image="m.png", mode="scale"))
    assert scale.data.tolist() == [[0, -1, 100, -1, -1]]
    raw = load_map(write_yaml(tmp_path, image="m.png", mode="raw"))
    assert raw.data.tolist() == [[-1, -1, 0, 0, -1]]


def test_colours_count_by_their_luma(tmp_path: Path) -> None:
    pixels = np.array(
        [[(255, 0, 0), (255, 255, 0), (205, 205, 205), (255, 255, 200)]], dtype=np.uint8
    )
    Image.fromarray(pixels).save(tmp_path / "m.png")
    # luma 76, 226, 205, 249: occupancy .702, .114, .196, .024
    assert load_map(write_yaml(tmp_path, image="m.png")).data.tolist() == [[100, 0, -1, 0]]


def test_palette_grey_alpha_16_bit_and_1_bit_png(tmp_path: Path) -> None:
    grey = np.array([[0, 254, 205]], dtype=np.uint8)
    images = {
        "palette": Image.fromarray(grey).convert("P"),
        "grey_alpha": Image.fromarray(np.stack((grey, np.full_like(grey, 255)), axis=-1)),
        "deep": Image.fromarray(grey.astype(np.uint16) * 257),
    }
    for name, image in images.items():
        image.save(tmp_path / f"{name}.png")
    assert load_map(write_yaml(tmp_path, image="palette.png")).data.tolist() == [[100, 0, -1]]
    assert load_map(write_yaml(tmp_path, image="deep.png")).data.tolist() == [[100, 0, -1]]
    # an opaque alpha channel changes nothing
    assert load_map(write_yaml(tmp_path, image="grey_alpha.png")).data.tolist() == [[100, 0, -1]]
    Image.fromarray(grey > 100).save(tmp_path / "bit.png")
    assert load_map(write_yaml(tmp_path, image="bit.png")).data.tolist() == [[100, 0, 0]]


def test_16_bit_images_may_have_transparent_pixels_and_be_white_at_zero(tmp_path: Path) -> None:
    deep = Image.fromarray(np.array([[0, 65535, 52685]], dtype=np.uint16))
    deep.save(tmp_path / "m.png", transparency=0)
    assert load_map(write_yaml(tmp_path, image="m.png")).data.tolist() == [[-1, 0, -1]]
    deep.save(tmp_path / "m.tiff", tiffinfo={262: 0})
    assert load_map(write_yaml(tmp_path, image="m.tiff")).data.tolist() == [[0, 100, 100]]


def test_thresholds_mean_nothing_in_mode_raw(tmp_path: Path) -> None:
    write_pgm(tmp_path, np.array([[0, 100, 255]]), 255)
    file = write_yaml(tmp_path, mode="raw", free_thresh=0.9, occupied_thresh=0.2)
    assert load_map(file).data.tolist() == [[0, 100, -1]]


def test_ascii_pgm_with_comments_and_other_largest_values(tmp_path: Path) -> None:
    (tmp_path / "m.pgm").write_bytes(
        b"P2 # ascii\n#second\n3 2\n# third\n15\n0 15\n12 # in between\n15 3 99\n"
    )
    # largest value 15: brightness 0, 1, .8 and 1, .2, and 99 counts as 15
    assert load_map(write_yaml(tmp_path)).data.tolist() == [[0, 100, 0], [100, 0, -1]]
    write_pgm(tmp_path, np.array([[0, 1000, 800]]), 1000)
    assert load_map(write_yaml(tmp_path)).data.tolist() == [[100, 0, -1]]


def test_keys_beyond_nav2s_are_passed_over_and_image_paths_are_relative_to_the_yaml(
    tmp_path: Path,
) -> None:
    (tmp_path / "sub").mkdir()
    write_pgm(tmp_path / "sub", np.array([[0, 255]]))
    grid = load_map(
        write_yaml(tmp_path, image="./sub/m.pgm", map_type="occupancy", floor="{level: 3}")
    )
    assert grid.data.tolist() == [[100, 0]]
    absolute = load_map(write_yaml(tmp_path, image=str(tmp_path / "sub" / "m.pgm"), mode=None))
    assert absolute.data.tolist() == [[100, 0]]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"resolution": None}, "key 'resolution' is missing"),
        ({"origin": None}, "key 'origin' is missing"),
        ({"image": None}, "key 'image' is missing"),
        ({"negate": None}, "key 'negate' is missing"),
        (
            {"free_thresh": None, "free_treshold": "0.2"},
            "key 'free_thresh' is missing; the file has image, resolution",
        ),
        ({"resolution": "-0.05"}, "not positive"),
        ({"resolution": "0"}, "not positive"),
        ({"resolution": ".nan"}, "not a finite number"),
        ({"resolution": "fine"}, "not a finite number"),
        ({"resolution": "true"}, "not a finite number"),
        ({"origin": "[0, .inf, 0]"}, "origin[1] inf is not a finite number"),
        ({"origin": "[0, 0]"}, "is not a list [x, y, yaw]"),
        ({"origin": "7"}, "is not a list [x, y, yaw]"),
        ({"free_thresh": "0.7"}, "0 <= free_thresh <= occupied_thresh <= 1"),
        ({"occupied_thresh": "65"}, "0 <= free_thresh <= occupied_thresh <= 1"),
        ({"free_thresh": "0.65", "mode": "scale"}, "must differ in mode scale"),
        ({"negate": "maybe"}, "neither 0 or 1 nor true or false"),
        ({"mode": "trinery"}, "did you mean 'trinary'"),
        ({"image": "absent.pgm"}, "absent.pgm: cannot be read (No such file or directory)"),
        ({"image": "."}, "cannot be read (Is a directory)"),
        ({"image": "[a]"}, "is not a file name"),
        ({"image": "m.yaml"}, "is not an image"),
    ],
)
def test_bad_yaml_values_are_one_clear_line(
    tmp_path: Path,
    changes: dict[str, str | None],
    words: str,
) -> None:
    write_pgm(tmp_path, np.array([[0, 255]]))
    with pytest.raises(MapError) as error:
        load_map(write_yaml(tmp_path, **changes))
    assert words in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    "content", ["image: [m.pgm", "- a\n- b\n", "just words", "", "a: b: c", "\x00"]
)
def test_what_is_no_mapping_is_refused(tmp_path: Path, content: str) -> None:
    path = tmp_path / "m.yaml"
    path.write_text(content)
    with pytest.raises(MapError):
        load_map(path)
    with pytest.raises(MapError, match="cannot be read"):
        load_map(tmp_path / "absent.yaml")


@pytest.mark.parametrize(
    ("resolution", "is_allowed"), [(1e-4, True), (1e3, True), (0.99e-4, False), (1.01e3, False)]
)
def test_cells_of_a_tenth_of_a_millimetre_to_a_kilometre_are_allowed(
    tmp_path: Path,
    resolution: float,
    is_allowed: bool,
) -> None:
    if is_allowed:
        assert loaded(tmp_path, [[0]], resolution=str(resolution)) == [[100]]
    else:
        with pytest.raises(MapError, match=r"allowed is 0.0001 to 1000"):
            loaded(tmp_path, [[0]], resolution=str(resolution))


def png_header(width: int, height: int) -> bytes:
    """A PNG that promises an image and does not contain it."""
    body = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    header = struct.pack(">I", 13) + body + struct.pack(">I", zlib.crc32(body))
    return (
        b"\x89PNG\r\n\x1a\n"
        + header
        + struct.pack(">I", 4)
        + b"IDATabcd"
        + struct.pack(">I", zlib.crc32(b"IDATabcd"))
    )


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"P5 2 2 255\n\x00\x00\x00", "truncated, 3 of 2 x 2 = 4 pixels"),
        (b"P5 2 2 65535\n\x00\x00\x00\x00\x00\x00\x00", "truncated, 3 of 2 x 2"),
        (b"P2 2 2 255\n0 0 0", "truncated, 3 of 2 x 2"),
        (b"P2 2 1 255\n0 zero", "not a whole number"),
        (b"P2 2 1 255\n0 -3", "negative"),
        (b"P5 2 two 255\n\x00", "corrupt PGM header"),
        (b"P5", "corrupt PGM header"),
        (b"P5 0 2 255\n", "0 x 2 pixels"),
        (b"P5 99999999999999999999 9 255\n", "pixels; allowed"),
        (b"P5 100000 100000 255\n", "100000 x 100000 pixels; allowed"),
        (b"P5 1 1 70000\n\x00\x00", "largest value 70000"),
        (b"", "is not an image"),
        (b"GIF98 nonsense", "is not an image"),
        (png_header(5, 5), "m.pgm"),
        (png_header(13360, 13360), f"allowed: 1 to {MAX_PIXELS}"),
        (png_header(60000, 60000), f"allowed: 1 to {MAX_PIXELS}"),
    ],
)
def test_bad_images_are_one_clear_line(tmp_path: Path, content: bytes, words: str) -> None:
    (tmp_path / "m.pgm").write_bytes(content)
    with pytest.raises(MapError) as error:
        load_map(write_yaml(tmp_path))
    assert words in str(error.value)
    assert "\n" not in str(error.value)


def test_an_image_may_have_as_many_pixels_as_are_allowed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("navstack.costmap.map_image.MAX_PIXELS", 12)
    assert loaded(tmp_path, [[0] * 4] * 3) == [[100] * 4] * 3
    with pytest.raises(MapError, match="13 x 1 pixels; allowed: 1 to 12"):
        loaded(tmp_path, [[0] * 13])


@pytest.mark.parametrize("name", ["m.png", "m.pgm"])
def test_a_part_of_a_large_image_is_read(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    name: str,
) -> None:
    levels = np.random.default_rng(5).choice([0, 205, 254], (9, 14)).astype(np.uint8)
    Image.fromarray(levels).save(tmp_path / name)
    path = write_yaml(tmp_path, image=name, origin="[445000.0, 2.0, 0.5]", resolution="0.25")
    whole = load_map(path)
    monkeypatch.setattr("navstack.costmap.map_image.MAX_PIXELS", 20)
    with pytest.raises(MapError, match=r"14 x 9 pixels; .* e\.g\. crop: \[0, 0, 4, 4\]"):
        load_map(path)
    head = path.read_text()
    path.write_text(f"{head}crop: [3, 2, 5, 4]\n")
    part = load_map(path)
    np.testing.assert_array_equal(part.data, whole.data[2:6, 3:8])
    x, y = 3 * 0.25, 2 * 0.25
    turned = math.cos(0.5) * x - math.sin(0.5) * y, math.sin(0.5) * x + math.cos(0.5) * y
    assert part.origin.x - 445000.0 == pytest.approx(turned[0], abs=1e-9)
    assert part.origin.y - 2.0 == pytest.approx(turned[1], abs=1e-9)
    for crop, said in (
        ("[0, 0, 5, 5]", "allowed: 20 pixels"),
        ("[10, 0, 5, 4]", "reaches beyond its 14 x 9 pixels"),
        ("[0, 6, 5, 4]", "reaches beyond"),
        ("[0, 0, 5]", "is not a list"),
        ("[0, 0, 0, 4]", "is not a list"),
        ("[-1, 0, 2, 4]", "is not a list"),
        ("all", "is not a list"),
    ):
        path.write_text(f"{head}crop: {crop}\n")
        with pytest.raises(MapError, match=said):
            load_map(path)


def test_a_png_cut_anywhere_is_refused(tmp_path: Path) -> None:
    noise = np.random.default_rng(3).integers(0, 256, (40, 40), dtype=np.uint8)
    Image.fromarray(noise).save(tmp_path / "m.png")
    whole = (tmp_path / "m.png").read_bytes()
    path = write_yaml(tmp_path, image="m.png")
    for length in range(0, len(whole) - 40, 97):
        (tmp_path / "m.png").write_bytes(whole[:length])
        with pytest.raises(MapError):
            load_map(path)


def test_saved_pixels_are_map_savers(tmp_path: Path) -> None:
    cells = np.array([[0, 20, 25, 26, 64, 65, 100, -1, 50]], dtype=np.int8)
    save_map(OccupancyGrid(cells, 0.05, Pose2D(-100.875, 3.0, 0.1)), tmp_path / "t.yaml")
    pixels = np.asarray(Image.open(tmp_path / "t.png"))
    assert pixels.tolist() == [[254, 254, 254, 205, 205, 0, 0, 205, 205]]
    assert YAML(typ="safe").load(tmp_path / "t.yaml") == {
        "image": "t.png",
        "mode": "trinary",
        "resolution": 0.05,
        "origin": [-100.875, 3.0, 0.1],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    }


def test_round_trip(tmp_path: Path) -> None:
    cells = np.random.default_rng(0).choice([-1, 0, 100], (37, 53)).astype(np.int8)
    grid = OccupancyGrid(cells, 0.0512345, Pose2D(-100.875, 7.123456789, -1.5))
    save_map(grid, tmp_path / "m.yaml")
    back = load_map(tmp_path / "m.yaml")
    assert np.array_equal(back.data, cells)
    assert (back.resolution, back.origin) == (grid.resolution, grid.origin)


def test_what_cannot_be_saved(tmp_path: Path) -> None:
    cells = np.zeros((2, 2), dtype=np.int8)
    with pytest.raises(MapError, match="cannot be written"):
        save_map(OccupancyGrid(cells, 0.1, Pose2D()), tmp_path / "absent" / "m.yaml")
    with pytest.raises(MapError, match="allowed is 0.0001 to 1000"):
        save_map(OccupancyGrid(cells, 1e4, Pose2D()), tmp_path / "m.yaml")


# file stem: (height, width, unknown, free, occupied cells), counted from the pixels by the rules of
# map_io
REAL = {
    "100by100_10": (2000, 2000, 0, 3586940, 413060),
    "map": (384, 384, 138683, 7903, 870),
    "epuck_world_map": (300, 300, 0, 89173, 827),
    "playground": (490, 575, 0, 279347, 2403),
    "depot_keepout": (307, 604, 0, 154215, 31213),
    "testmap": (10, 10, 0, 71, 29),
    "map_circular": (384, 384, 138606, 7930, 920),
    "testmap2": (12, 12, 0, 88, 56),
    "depot": (380, 755, 12493, 266968, 7439),
}


def test_real_maps_load() -> None:
    if "NAVSTACK_DATA" not in os.environ:
        pytest.skip("NAVSTACK_DATA is not set: real maps are not there")
    files = sorted((Path(os.environ["NAVSTACK_DATA"]) / "ros_maps").glob("*/*.yaml"))
    if not files:
        pytest.skip("NAVSTACK_DATA has no ros_maps")
    assert set(REAL) <= {file.stem for file in files}
    for file in files:
        grid = load_map(file)
        assert set(np.unique(grid.data)) <= {-1, 0, 100}
        if file.stem in REAL:
            counts = tuple(int((grid.data == value).sum()) for value in (-1, 0, 100))
            assert (*grid.data.shape, *counts) == REAL[file.stem], file.stem


def test_nav2s_own_test_map() -> None:
    if "NAVSTACK_DATA" not in os.environ:
        pytest.skip("NAVSTACK_DATA is not set: real maps are not there")
    file = Path(
        os.environ["NAVSTACK_DATA"],
        "ros_maps/ros-navigation__nav2_map_server_test_testmap/testmap.yaml",
    )
    grid = load_map(file)
    assert grid.origin == Pose2D(2.0, 3.0, 1.0)
    pixels = np.asarray(Image.open(file.with_suffix(".png")).convert("RGB")).mean(axis=-1)[::-1]
    assert np.array_equal(grid.data == 100, pixels < 0.35 * 255)
