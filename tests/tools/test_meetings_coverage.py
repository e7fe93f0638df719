"""How often intervals by meetings hold the truth is told of a folder's own missions."""

from pathlib import Path

import numpy as np
import pytest

from harness.meetings.drive import ArmDrive, Weighed
from harness.meetings.kept import KeptMissions
from harness.meetings.mission import MissionDrive
from harness.statistics.interval import NO_INTERVAL, Interval
from tools.check_meetings import coverage


def mission(episode: int, losses: list[float]) -> MissionDrive:
    """A mission by two arms; the second meets nobody to whom anything happens."""
    row = {"distance_m": 100.0}
    met = tuple(Weighed(0.1, loss, int(loss > 50.0), 0) for loss in losses)
    nothing = tuple(Weighed(0.1, 0.0, 0, 0) for _ in losses)
    old = ArmDrive(row, 3.0, 0.0, met)
    new = ArmDrive(row, 3.0, 0.0, nothing)
    strata = np.zeros(len(losses), dtype=np.int64)
    return MissionDrive(episode, np.ones(15), strata, np.full(len(losses), 0.1), (old, new))


def missions() -> list[MissionDrive]:
    """Thirty, with a hit in every third, and one without a meeting."""
    found = [mission(number, [60.0 * (number % 3 == 0), 1.0]) for number in range(30)]
    return [*found, mission(30, [])]


def test_an_interval_without_ends_holds_everything() -> None:
    assert coverage.holds(NO_INTERVAL, 5.0)
    assert coverage.holds(Interval(1.0, 0.0, 2.0, 9), 2.0)
    assert not coverage.holds(Interval(1.0, 0.0, 2.0, 9), 2.1)


def test_most_intervals_hold_the_truth_and_a_false_one_is_seen() -> None:
    found = coverage.covered(missions(), 20, 60, np.random.default_rng(0))
    assert set(found) == {"margin", "people hit", "difference, at all looks"}
    assert [of for _, of in found.values()] == [120, 120, 60]
    assert all(held >= 0.9 * of for held, of in found.values())
    drives = missions()[:20]
    assert not coverage.errs(drives, 2.1, 0)
    assert coverage.errs(drives, 60.0, 0)


def test_the_table_is_of_finished_folders(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    argv = ["coverage", "--runs", str(tmp_path), "--studies", "5", "--missions", "8"]
    monkeypatch.setattr("sys.argv", argv)
    with pytest.raises(SystemExit, match="has 0 finished missions by meetings, too few"):
        coverage.main()
    kept = KeptMissions(tmp_path / "missions.jsonl")
    for each in missions():
        kept.add(each)
    coverage.main()
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 5 and str(tmp_path) in lines[2]
    assert [cell.strip() for cell in lines[2].split("|")][2:5] == ["31", "margin", "10"]
