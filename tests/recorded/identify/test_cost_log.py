"""What happened on a drive is found in its log alone."""

import dataclasses
import json
import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.economics.contact_costs import injury_costs
from harness.economics.prices import load_prices
from harness.identify.collisions import find_impacts, strongest_steps
from harness.identify.drive_difference import rate_difference
from harness.metrics.delivery_log import JOULES_PER_KWH
from harness.recorded.drive_log import DriveLog
from harness.recorded.log import LogRequest, read_log
from navbench.api.cost_log import cost_log
from navbench.cli.app import main
from navstack.errors import InputError
from navstack.params.strict import dump_dataclass

from ..writing import Entry
from . import drives, missions

TOGETHER = 0.5  # [s] between a contact and what was found of it


@pytest.fixture(scope="module")
def drive() -> drives.Recorded:
    return drives.record(3, 60.0, people=14)


@pytest.fixture
def bag(drive: drives.Recorded, tmp_path: Path) -> Path:
    return drives.write_mcap(tmp_path / "drive.mcap", drive.entries)


@pytest.fixture
def log(bag: Path) -> DriveLog:
    return read_log(LogRequest((bag,)), lambda _: None)


@pytest.fixture
def map_file(tmp_path: Path) -> Path:
    return missions.write_yard(tmp_path)


def test_contacts_are_found_with_their_impulse(drive: drives.Recorded, log: DriveLog) -> None:
    found = find_impacts(log, drive.robot).found
    hard = [contact for contact in drive.contacts if contact.impulse >= 50.0]
    assert hard
    for contact in hard:
        near = [each for each in found if abs(each.stamp - contact.stamp) < TOGETHER]
        assert len(near) == 1
        assert near[0].impulse == pytest.approx(contact.impulse, rel=0.25)


def test_nothing_else_is_taken_for_a_contact(drive: drives.Recorded, log: DriveLog) -> None:
    for each in find_impacts(log, drive.robot).found:
        gaps = [abs(each.stamp - contact.stamp) for contact in drive.contacts]
        assert min(gaps) < TOGETHER


def test_without_inertial_unit_hard_contacts_are_left(
    drive: drives.Recorded, log: DriveLog
) -> None:
    gyro = log.imu.copy()
    gyro[:, 3:5] = 0.0
    assert find_impacts(dataclasses.replace(log, imu=gyro), drive.robot).source == "odometry"
    without = dataclasses.replace(log, imu=log.imu[:0])
    impacts = find_impacts(without, drive.robot)
    assert impacts.source == "odometry"
    stamps = [each.stamp for each in impacts.found]
    for contact in drive.contacts:
        if contact.impulse >= 50.0:
            assert min(abs(stamp - contact.stamp) for stamp in stamps) < TOGETHER


@pytest.mark.slow
def test_the_command_prices_the_drive(
    drive: drives.Recorded,
    bag: Path,
    map_file: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    robot = tmp_path / "robot.yaml"
    robot.write_text(dump_dataclass(drive.robot))
    page = tmp_path / "drive.html"
    words = ["cost-log", str(bag), "--robot", str(robot), "--map", str(map_file)]
    with pytest.raises(SystemExit) as leaving:
        main([*words, "--json", "--html", str(page)])
    assert leaving.value.code == 0
    document = json.loads(capsys.readouterr().out)
    assert document["energy_kwh"] == pytest.approx(drive.energy / JOULES_PER_KWH, rel=0.1)
    paid = document["costs_usd"]["pedestrian_safety"]
    # impulses that are found are up to a quarter off
    assert 0.0 < expected_usd(drive, 0.75) <= paid <= expected_usd(drive, 1.25)
    kinds = [event["what"] for event in document["events"] if event["kind"] == "contact"]
    assert set(kinds) == {"person"}
    assert document["per_km"]["contact"] > 0.0
    _check_page(page, document)


def test_the_strongest_step_exchanges_seven_tenths_of_an_impact_and_never_more_than_all() -> None:
    steps = strongest_steps(100.0)
    assert (steps.mean(), steps.std()) == pytest.approx((71.0, 15.0), abs=0.5)
    assert steps.max() <= 100.0
    assert (strongest_steps(45.0) < 50.0).all(), "too weak to count in any step"


def expected_usd(drive: drives.Recorded, share: float) -> float:
    """What the contacts of a drive are expected to cost, were each this share as strong."""
    usd = 0.0
    for contact in drive.contacts:
        steps = strongest_steps(share * contact.impulse)
        usd += float(np.mean((steps >= 50.0) * injury_costs(steps, load_prices())))
    return usd


def _check_page(page: Path, document: dict[str, Any]) -> None:
    """The page replays the drive with its events."""
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page.read_text())
    assert found
    (replay,) = json.loads(found[1])["replays"]
    assert len(replay["contacts"]) == document["counts"]["contact"]
    assert len(replay["reasons"]) == len(document["events"])
    paid = sum(contact[5] for contact in replay["contacts"])
    assert paid == pytest.approx(document["costs_usd"]["pedestrian_safety"], abs=0.1)
    assert replay["duration"] == pytest.approx(document["duration_s"], abs=0.3)


def test_a_log_without_poses_has_no_page(
    drive: drives.Recorded,
    map_file: Path,
    tmp_path: Path,
) -> None:
    entries = [entry for entry in drive.entries if entry.topic != "/amcl_pose"]
    bag, page = drives.write_mcap(tmp_path / "blind.mcap", entries), tmp_path / "page.html"
    with pytest.raises(InputError, match="no poses"):
        cost_log(LogRequest((bag,)), "segway_e1", str(map_file), html=page)
    assert not page.exists()


def test_a_takeover_is_an_intervention(
    drive: drives.Recorded,
    tmp_path: Path,
    map_file: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    stamps = (drives.START + 10.0, drives.START + 10.1, drives.START + 20.0)
    pressed = [
        Entry("/joy", "sensor_msgs/msg/Joy", stamp, {"axes": [0.0, 0.9], "buttons": [0]})
        for stamp in stamps
    ]
    driven = [entry for entry in drive.entries if entry.stamp < drives.START + 25.0]
    entries = sorted((*driven, *pressed), key=lambda entry: entry.arrival or entry.stamp)
    bag = drives.write_mcap(tmp_path / "joy.mcap", entries)
    calm = drives.write_mcap(tmp_path / "calm.mcap", driven)
    words = ["cost-log", str(bag), "--against", str(calm), "--robot", "segway_e1"]
    with pytest.raises(SystemExit):
        main([*words, "--map", str(map_file), "--json"])
    document = json.loads(capsys.readouterr().out)
    assert document["counts"]["intervention"] == 2
    prices = load_prices("costnav")
    assert document["costs_usd"]["repair"] == pytest.approx(
        2.0 * prices.repair_per_physical_assistance
    )
    lost = document["costs_usd"]["service_compensation"]
    assert lost in (None, pytest.approx(prices.delivery_fee.value)), "the fee is lost once"
    other, found = document["against"], document["differences"]
    assert other["counts"]["intervention"] == 0
    more = document["per_km"]["intervention"]
    assert found["intervention_per_km"]["value"] == pytest.approx(more)
    # 2 against 0: not yet more than chance
    assert found["intervention_per_km"]["low"] < 0.0
    assert found["contact_per_km"]["value"] == pytest.approx(0.0)


def test_differences_of_rates_have_intervals() -> None:
    # Garwood 1936: 10 events lie between 4.795 and 18.39
    alike = rate_difference((10, 2.0), (10, 2.0))
    assert alike.value == 0.0
    apart = math.hypot(10.0 - 4.795, 18.39 - 10.0) / 2.0
    assert (alike.low, alike.high) == pytest.approx((-apart, apart), rel=1e-3)
    more = rate_difference((30, 1.0), (5, 1.0))
    assert more.low is not None and more.low > 0.0
