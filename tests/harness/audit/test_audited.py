"""Two stored stacks audited: what the run's own files say of them, and what is refused."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import navbench
from harness.audit.auditor import Audit
from harness.audit.findings import Check
from harness.audit.manners import NOT_RECORDED
from harness.report.audit import audit_blocks, audit_sentence
from harness.report.blocks import Table
from harness.report.comparison import comparison_blocks
from harness.storage.shipped import shipped
from harness.study.stored_run import load_run
from navstack.errors import InputError

WriteRun = Callable[..., Path]
Row = dict[str, Any]


def compared(first: Path, second: Path) -> Audit:
    audit = navbench.compare(navbench.load(first), navbench.load(second)).audit
    assert audit is not None
    return audit


def check(audit: Audit, key: str) -> Check:
    return next(each for each in audit.checks if each.key == key)


def paid_alike(row: Row) -> None:
    row |= {"outcome": "sla", "pieces_lost": 0, "goal_distance_m": 1.0}


def test_compare_audits_with_the_events_of_both(write_run: WriteRun) -> None:
    first, second = write_run("first"), write_run("second")
    found = compared(first, second)
    assert not found.flagged and {*found.scores} > {"published", "no_threshold"}
    assert check(found, "threshold").says.startswith("touches close to 50 N s")
    assert check(found, "threshold").evidence[1].original, "its contacts are there"


@pytest.mark.slow
def test_a_position_that_only_a_simulation_has_is_flagged(write_run: WriteRun) -> None:
    """Unless the world's own GPS is the true position, as the published one."""
    first = write_run("first", change=paid_alike, crowd=0.0)
    truth = write_run("second", change=paid_alike, crowd=0.0, localizer="ground_truth")
    audit = compared(first, truth)
    assert [each.key for each in audit.flagged] == ["truth"]
    table, sentence = audit_blocks(audit)
    assert isinstance(table, Table) and "navbench ablate" in " ".join(table.notes)
    assert "THE AUDITOR FLAGS: a position that no robot can know" in audit_sentence(audit)
    shown = comparison_blocks(navbench.compare(navbench.load(first), navbench.load(truth)))
    assert shown[-1] == sentence
    sensors = (shipped("params") / "sensors" / "published.yaml").read_text(encoding="utf-8")
    (truth / "params" / "mine-sensors.yaml").write_text(sensors, encoding="utf-8")
    assert check(compared(first, truth), "truth").state == "not examined"


def test_columns_that_an_older_program_did_not_write_are_not_recorded(write_run: WriteRun) -> None:
    def bare(row: Row) -> None:
        row.update(dict.fromkeys(("road_distance_m", "off_walkable_distance_m")))

    ground = check(compared(write_run("first", change=bare), write_run("second")), "ground")
    assert (ground.state, ground.says) == ("not examined", NOT_RECORDED)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"distance_m": 0.3, "average_speed_mps": 0.01}, "m from its start"),
        ({"average_speed_mps": 9.0}, "average_speed_mps 9 is not"),
        ({"outcome": "sla", "goal_distance_m": 5.0}, "it counts within 2 m"),
        ({"outcome": "sla", "pieces_lost": 40}, "40 of 100 pieces lost, but not spoiled"),
        ({"pieces_lost": 400}, "400 pieces lost of 100"),
    ],
)
def test_a_run_with_an_impossible_row_is_refused(
    write_run: WriteRun,
    changes: Row,
    said: str,
) -> None:
    def change(row: Row) -> None:
        if row["episode"] == 3:
            row |= {"outcome": "physical_assistance", "distance_m": 50.0, "duration_s": 50.0}
            row |= {"average_speed_mps": 1.0, **changes}

    folder = write_run("odd", change=change)
    with pytest.raises(InputError, match="delivery 3 of 'mine' cannot have gone so") as caught:
        load_run(str(folder))
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_a_robot_is_no_faster_than_its_file_says(write_run: WriteRun) -> None:
    folder = write_run("fast", change=paid_alike)
    load_run(str(folder))
    robot = (shipped("params") / "robots" / "segway_e1.yaml").read_text(encoding="utf-8")
    slow = robot.replace("max_speed: 3.56", "max_speed: 0.1")
    assert slow != robot
    (folder / "params" / "mine-robot.yaml").write_text(slow, encoding="utf-8")
    with pytest.raises(InputError, match=r"its robot drives at most 0\.11 m/s"):
        load_run(str(folder))
