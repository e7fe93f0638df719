"""``navbench check --estimator meetings``: what it prints, and where it cannot be."""

from pathlib import Path

import pytest

from harness.analysis.meetings_check import MeetingsChecked
from harness.meetings import crowd, estimate
from harness.report.short.meetings import short_meetings
from harness.storage.shipped import shipped
from harness.study.places import Where
from navbench.api.check_meetings import check_by_meetings
from tests.rules import short_rules

STOCK = (shipped("params") / "nav2" / "stock.yaml").read_text(encoding="utf-8")


@pytest.fixture
def short(
    tmp_path: Path, hall: Path, in_process: None, monkeypatch: pytest.MonkeyPatch
) -> list[str]:
    """Two files, and options of deliveries of two seconds with one or two meetings."""
    monkeypatch.setattr(crowd, "LONG", 130.0)
    monkeypatch.setattr(estimate, "NUMBER", 1)
    (tmp_path / "short.yaml").write_text(short_rules(2.0))
    (tmp_path / "old.yaml").write_text(STOCK)
    (tmp_path / "new.yaml").write_text(STOCK.replace("max_vel_x: ", "max_vel_x: 0.2  # was "))
    files = [str(tmp_path / name) for name in ("old.yaml", "new.yaml")]
    conditions = ["--rules", str(tmp_path / "short.yaml"), "--map", str(hall), "--workers", "1"]
    return [*files, *conditions, "--estimator", "meetings"]


def test_the_method_and_what_it_cannot_see_are_told(short: list[str]) -> None:
    old, new, *words = short
    options = dict(zip(words[::2], words[1::2], strict=True))
    checked = check_by_meetings(
        old,
        new,
        within=20.0,
        rules=options["--rules"],
        map=options["--map"],
        where=Where(workers=1),
    )
    assert isinstance(checked, MeetingsChecked)
    document = checked.as_json()
    assert (document["estimator"], document["verdict"]) == ("meetings", "alike")
    assert document["margin_difference"]["n"] == 4 and len(document["not_seen"]) == 3
    assert document["meetings"] == sum(each["driven"] for each in document["strata"])
    assert document["old"]["contacts_per_1000_km"]["n"] == 4
    lines = [block.text for block in short_meetings(checked)]
    assert len(lines) <= 25
    assert lines[1].startswith("alike within 20 USD a delivery: NEW less OLD is")
    assert any(line.startswith("estimator meetings: ") for line in lines)


def test_the_budget_ends_it(navbench, short: list[str]) -> None:
    status, text, _ = navbench("check", *short, "--budget", "0.01s")
    assert status == 0 and "not decided: no mission is finished" in text


@pytest.mark.parametrize(
    ("words", "status", "told"),
    [
        (("--world", "social_force"), 1, "react to the robot"),
        (("--world", "easy"), 1, "stationary"),
        (("--pedestrians", "0"), 1, "nobody to meet"),
        (("--within", "80"), 1, "--within 80"),
        (("--out", "somewhere"), 2, "leave out --out"),
    ],
)
def test_where_it_cannot_be_it_is_one_line(
    navbench, short: list[str], words: tuple[str, ...], status: int, told: str
) -> None:
    found, out, err = navbench("check", *short, *words)
    assert (found, out) == (status, "") and told in err
