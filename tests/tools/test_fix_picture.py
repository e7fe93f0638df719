import json

import numpy as np
import pytest
from PIL import Image

from harness.world.map.scene_io import load_scene
from navstack.errors import InputError
from tools.fix_picture import draw_fixes, fixes_along


def straight(length=40.0):
    stamps = np.arange(0.0, length, 0.5)
    return np.column_stack((stamps, -70.0 + stamps, np.full(len(stamps), -20.0)))


def test_errors_are_those_of_the_receiver_and_repeat():
    scene = load_scene("sidewalk")
    fixes = fixes_along(straight(), scene, "white_noise", 5, 0)
    assert len(fixes) == pytest.approx(10 * 39.5, abs=1)
    assert np.std(fixes[:, 1:3]) == pytest.approx(0.5, rel=0.15)
    assert set(fixes[:, 3]) == {0.5}
    assert np.array_equal(fixes, fixes_along(straight(), scene, "white_noise", 5, 0))
    assert not np.array_equal(fixes, fixes_along(straight(), scene, "white_noise", 5, 1))


def test_a_recorded_delivery_becomes_a_picture(tmp_path):
    (tmp_path / "recordings").mkdir()
    np.savez(tmp_path / "recordings" / "nav2-gps-3.npz", trace=straight())
    (tmp_path / "run.json").write_text(json.dumps({"map_name": "sidewalk", "seed": 0}))
    picture = tmp_path / "fixes.png"
    draw_fixes(tmp_path, "nav2-gps", 3, picture)
    with Image.open(picture) as image:
        assert image.width > 1000
        assert len(image.convert("RGB").getcolors(maxcolors=1_000_000)) > 50
    with pytest.raises(InputError, match="--record full"):
        draw_fixes(tmp_path, "nav2-gps", 4, picture)
