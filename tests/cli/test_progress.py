"""One line after the other where there is no terminal."""

import time

import pytest

from harness.storage.texts import time_text
from navbench.api import progress


def test_lines_tell_how_far_it_is_where_there_is_no_terminal(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "LINE_PERIOD", 0.01)
    with progress.share_shown("messages") as update:
        for share in (0.25, 0.5, 1.0):
            update(share)
            time.sleep(0.1)
    amounts = [line.split(",")[0] for line in capsys.readouterr().err.splitlines()]
    assert list(dict.fromkeys(amounts)) == [
        "25% of the messages",
        "50% of the messages",
        "100% of the messages",
    ]


def test_the_time_left_falls_between_two_deliveries(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr("navbench.api.progress.time.monotonic", lambda: now[0])
    bar = progress.Bar("{done} of {total}", 20)
    now[0] += 10.0
    bar.done += 5
    assert bar.text == "5 of 20, about 30 s left"
    now[0] += 4.0  # a long one is under way
    assert bar.text == "5 of 20, about 26 s left"
    now[0] += 40.0
    assert bar.text == "5 of 20"
    bar.move(20)
    assert bar.left == 0.0


def test_nothing_is_said_of_nothing(capsys: pytest.CaptureFixture[str]) -> None:
    with progress.share_shown("messages"):
        pass
    assert capsys.readouterr().err == ""


def test_days_tell_how_many_are_simulated(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(progress, "LINE_PERIOD", 0.01)
    with progress.count_shown("days", 8) as tell:
        for _ in range(2):
            tell()
            time.sleep(0.1)
    amounts = [line.split(",")[0] for line in capsys.readouterr().err.splitlines()]
    assert list(dict.fromkeys(amounts)) == ["1 of 8 days", "2 of 8 days"]


@pytest.mark.parametrize(
    ("seconds", "told"), [(99.4, "99 s"), (100.0, "2 min"), (5990.0, "100 min"), (6000.0, "1.7 h")]
)
def test_a_time_is_told_in_the_unit_in_which_one_speaks_of_it(seconds: float, told: str) -> None:
    assert time_text(seconds) == told
