"""A leg of a mission is explained as a delivery is."""

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from harness.episode.street_delivery import DrivenLeg
from harness.explain.legs import spoiling_leg
from harness.storage.shipped import shipped
from harness.world.outcome import Rules
from navstack.params.strict import load_dataclass
from tests.command import status
from tests.street.town import BOX, small_town

pytest.importorskip("osmium", reason="needs osmium (pip install 'navbench[street]')")


@pytest.fixture(scope="module")
def late(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of one mission for which there is less time than two of its legs take."""
    folder = tmp_path_factory.mktemp("streets")
    file = small_town().write(folder / "map.osm")
    assert status("map", "osm", str(file), "--bbox", BOX, "--out", str(folder / "streets")) == 0
    rules = folder / "late.yaml"
    usual = (shipped("params") / "rules" / "costnav.yaml").read_text(encoding="utf-8")
    rules.write_text(usual.replace("timeout: 241.0", "timeout: 5.0"), encoding="utf-8")
    words = ["--map", str(folder / "streets"), "--stack", "rpp-gps-ekf", "--world", "easy"]
    words += ["--pedestrians", "0", "--distance", "0.13,0.25", "--episodes", "1"]
    out = folder / "run"
    assert status("run", *words, "--rules", str(rules), "--out", str(out), "--workers", "1") == 0
    return out


@pytest.mark.slow
def test_the_leg_that_was_late_is_told_of(
    late: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], in_process: None
) -> None:
    capsys.readouterr()
    assert status("explain", str(late), "0", "--out", str(tmp_path / "why")) == 0
    screen = capsys.readouterr().out
    told: Any = json.loads((tmp_path / "why" / "explanation.json").read_text(encoding="utf-8"))
    assert told["outcome"] == "timeout"
    leg = told["leg"]
    assert leg["number"] == leg["count"] - 1 > 0
    assert leg["costly"] == [leg["number"]]
    assert 20.0 < leg["begin_s"] < 93.0
    assert (tmp_path / "why" / "event-1.png").is_file()
    assert f"leg {leg['number']} (0 to {leg['number']} were driven)" in screen
    assert "next: navbench map losses" in screen


@pytest.mark.slow
def test_what_a_leg_cannot_be_asked_is_one_line(
    late: Path, capsys: pytest.CaptureFixture[str], in_process: None
) -> None:
    capsys.readouterr()
    asked = (("--leg", "0"), "nothing on it cost anything"), (("--rewind", "a=1"), "on one map")
    for words, why in asked:
        assert status("explain", str(late), "0", *words) == 1
        error = capsys.readouterr().err
        assert why in error


def leg(at_start: int, lost: int) -> DrivenLeg:
    row = {"pieces_at_start": at_start, "pieces_lost": lost}
    return cast(DrivenLeg, SimpleNamespace(row=row))


@pytest.mark.parametrize(
    ("legs", "spoiling"),
    [
        ([leg(50, 1), leg(49, 9), leg(40, 0)], 1),
        ([leg(50, 1), leg(0, 0), leg(0, 0)], 0),  # the bucket fell
        ([leg(50, 0), leg(50, 3)], 1),
    ],
)
def test_the_leg_on_which_too_much_was_lost(legs: list[DrivenLeg], spoiling: int) -> None:
    rules = load_dataclass(Rules, shipped("params") / "rules" / "costnav.yaml")
    assert spoiling_leg({"pieces_at_start": 50}, legs, rules) == spoiling
