"""Animated GIFs: whole or not there, and of the delivery that they claim to show."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from harness.report import replay_gif
from harness.report.replay import Replay, contacts_shown
from harness.report.replay_gif import write_gif
from harness.world.truth import Partner
from navstack.errors import InputError

ROW = {"duration_s": 5.0, "start_x_m": 0.0, "start_y_m": 0.0, "goal_x_m": 8.0, "goal_y_m": 0.0}
CORNERS = np.array([[0.1, 0.2], [0.1, -0.2], [-0.6, -0.2], [-0.6, 0.2]])
HIT = {
    "stamp": 1.0,
    "partner": Partner.PEDESTRIAN,
    "kind": "pedestrian",
    "partner_id": 3,
    "x": 0.3,
    "y": 0.0,
}
SPEEDS = {"robot_speed": 1.0, "partner_speed": 0.5}


class Stopped(Exception):
    """What ends an animation early."""


@pytest.mark.parametrize("shown", [0, 3])
def test_an_animation_that_ends_early_leaves_the_old_one(
    shown: int,
    tmp_path: Path,
    make_arrays: Callable[..., dict[str, Any]],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    times: list[float] = []

    def show(self: Any, time: float) -> float:
        times.append(time)
        if len(times) > shown:
            raise Stopped
        return 0.0

    monkeypatch.setattr(replay_gif._Picture, "show", show)
    (tmp_path / "d.gif").write_bytes(b"old")
    with pytest.raises(Stopped):
        write_gif(tmp_path / "d.gif", Replay("", "over", make_arrays(ROW), [], CORNERS, 0.3), None)
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("d.gif", b"old")]


def test_contacts_are_marked_from_when_they_happened(
    make_arrays: Callable[..., dict[str, Any]],
) -> None:
    hit = {"x_m": 2.0, "y_m": 1.0, "type": "counted_contact", "cost_usd": 0.0, "partner_id": 3}
    person = {**hit, "stamp_s": 2.0, "kind": "pedestrian", "partner": "pedestrian"}
    thing = {**hit, "stamp_s": 3.0, "kind": "mailbox", "partner": "property", "cost_usd": 4.5}
    free = {**thing, "stamp_s": 1.0, "cost_usd": 0.0}
    delivery = Replay("", "", make_arrays(ROW), contacts_shown([thing, free, person]), CORNERS, 0.3)
    picture = replay_gif._Picture(Figure().subplots(), delivery, None)
    assert [picture.show(time) for time in (1.5, 2.5, 3.5)] == [0.0, 0.0, 4.5]
    assert len(picture._hits.get_xdata()) == 2
    picture.show(2.5)
    assert len(picture._hits.get_xdata()) == 1, "who was hit is marked, even where it cost nothing"


def test_an_animation_that_cannot_be_written_leaves_nothing_and_is_said_in_one_line(
    tmp_path: Path, make_arrays: Callable[..., dict[str, Any]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*args: Any, **kwargs: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Image.Image, "save", full)
    with pytest.raises(
        InputError, match=r"d\.gif' cannot be written \(No space left on device\); make room"
    ):
        write_gif(tmp_path / "d.gif", Replay("", "", make_arrays(ROW), [], CORNERS, 0.3), None)
    assert list(tmp_path.iterdir()) == []
