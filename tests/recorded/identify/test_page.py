"""The four commands of docs/your_robot.md, on a small log that is driven here."""

import shutil
from pathlib import Path

import pytest

from harness.storage.shipped import shipped
from tests.docs.blocks import ROOT, blocks_of, commands_of
from tests.docs.given import in_this_process, make_short, status_of
from tests.docs.shortened import shortened

from . import drives, missions
from .test_bad_logs import URDF

pytestmark = pytest.mark.slow

PAGE = ROOT / "docs" / "your_robot.md"


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with what the page's reader has: a log, a Nav2 file, a URDF and a map."""
    monkeypatch.chdir(tmp_path)
    make_short(tmp_path)
    missions.write_yard(tmp_path).rename("depot.yaml")
    shutil.copy(shipped("params") / "nav2" / "tuned.yaml", "my_robot_nav2.yaml")
    Path("my_robot.urdf").write_text(URDF)
    driven = drives.record(11, 40.0).entries
    seen = [entry for entry in driven if "scan" not in entry.topic]
    drives.write_mcap(Path("drive.mcap"), seen)
    return tmp_path


def test_from_a_log_to_a_tuned_file(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    block = next(block for block in blocks_of(PAGE) if block.language == "sh")
    commands = [command for command in commands_of(block) if command.words[0] == "navbench"]
    names = [command.words[1] for command in commands]
    assert names == ["identify", "run", "tune", "cost-log"]
    with in_this_process():
        for command in commands:
            words = shortened(command.words)
            assert status_of(words) == 0, " ".join(words)
    assert (place / "my_robot.yaml").is_file()
    assert (place / "my_robot_sensors.yaml").is_file()
    assert list(place.glob("results/*/tuned.nav2.yaml"))
    assert "contacts by the imu" in capsys.readouterr().out
