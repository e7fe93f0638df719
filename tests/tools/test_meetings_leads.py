"""Whether the lead time of meetings matters: what the table says of finished missions."""

import json
from pathlib import Path

import pytest

from tools.check_meetings import leads
from tools.check_meetings.leads import Mission, printed


def test_each_lead_is_held_against_the_first() -> None:
    missions = [
        Mission(0, [0.2, 0.1, 0.2], [10.0, 5.0, 20.0]),
        Mission(1, [0.0, 0.0, 0.1], [0.0, 0.0, 10.0]),
    ]
    lines = printed(missions).splitlines()
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[2:]]
    assert rows[0] == ["6 s", "2", "0.1000", "", "5.00", ""]
    assert rows[1][2] == "0.0500" and rows[1][3].startswith("0.50 [")
    assert rows[2][4] == "15.00" and rows[2][5].startswith("3.00 [")


def test_what_is_finished_is_not_driven_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = tmp_path / "kept.jsonl"
    kept.write_text(json.dumps({"episode": 0, "hits": [0.0] * 3, "losses": [0.0] * 3}) + "\n")
    monkeypatch.setattr(
        leads, "driven", lambda task: Mission(task.episode, [0.1, 0.2, 0.1], [1.0, 2.0, 1.0])
    )
    monkeypatch.setattr("sys.argv", ["leads", "--missions", "3", "--kept", str(kept)])
    leads.main()
    episodes = [json.loads(line)["episode"] for line in kept.read_text().splitlines()]
    assert episodes == [0, 1, 2]
    assert "2.00 [" in capsys.readouterr().out
