"""``navbench localize`` from the command line to the trajectory."""

import contextlib
import functools
import io
import json
import math
import os
import sqlite3
import time
from pathlib import Path

import numpy as np
import pytest

from harness.recorded.replay import Replay
from harness.recorded.trajectory import Trajectory, read_tum, write_tum
from navbench.cli.app import main
from navstack.localization.amcl import AmclLocalizer
from navstack.types import Pose2D

from . import hill
from .writing import (
    DATUM,
    FROM,
    START,
    Entry,
    fix,
    imu,
    odometry,
    sidewalk_drive,
    transforms,
    write,
)

DATA = os.environ.get("NAVSTACK_DATA")
HUSKY_MOUNTING = ("--static-tf", "base_link imu_link 0 -0.3 0.52 1.570796327 0 -1.570796327")
ON_SIDEWALK = ("--map", "sidewalk", "--params", "amcl", "--localizer", "amcl")
KNOWN_START = ("--initial-pose", "0,0,0,0.1,0.01")
AT_THE_START = ("--initial-pose", f"{FROM.x + 0.2},{FROM.y},{FROM.yaw},0.3,0.1")


def localize(*arguments: object) -> int:
    """The exit status."""
    with pytest.raises(SystemExit) as leaving:
        main(["localize", *map(str, arguments)])
    return int(leaving.value.code or 0)


def complaint(capsys, *arguments: object) -> str:
    """What a command that must fail with status 1 says in its last line."""
    assert localize(*arguments) == 1
    said = capsys.readouterr().err.splitlines()
    assert said[-1].startswith("navbench: ")
    for line in said[:-1]:  # a slow machine also tells how far it is
        assert line.startswith("note: ") or "of the messages" in line
    return said[-1]


def replay(bag: Path, localizer: str, *more: object) -> dict:
    """The document of a replay beside the bag, without a map."""
    out = bag.parent / "out.tum"
    with contextlib.redirect_stdout(io.StringIO()) as said:
        assert (
            localize(
                "--bag",
                bag,
                "--params",
                "stock",
                "--localizer",
                localizer,
                "--out",
                out,
                "--json",
                *more,
            )
            == 0
        )
    return json.loads(said.getvalue())


def straight(count: int = 500, **of_imu: str) -> list[Entry]:
    """1 m/s to the east: odometry 10 % short, exact headings and fixes with 0.2 m of noise."""
    rng = np.random.default_rng(0)
    entries = []
    for i in range(count):
        t = 0.02 * i
        entries.append(odometry(START + t, Pose2D(0.9 * t, 0.0, 0.0), 0.9, 0.0))
        entries.append(imu(START + t, 0.0, 0.0, **of_imu))
        if i % 10 == 0:
            entries.append(fix(START + t, *((t, 0.0) + 0.2 * rng.standard_normal(2)), std=0.2))
    return entries


@pytest.mark.parametrize("form", ["ros1-lz4", "sqlite3", "mcap-zstd"])
def test_amcl_finds_a_drive_through_the_sidewalk(tmp_path, capsys, form):
    bag = write(tmp_path / "drive", sidewalk_drive().entries, form)
    out = tmp_path / "out.tum"
    status = localize(
        "--bag", bag, *ON_SIDEWALK, *AT_THE_START, "--out", out, "--reference", "/truth", "--json"
    )  # fmt: skip
    captured = capsys.readouterr()
    assert status == 0 and captured.err == ""
    document = json.loads(captured.out)
    keys = {"poses", "final", "degraded_s", "lost_s", "ape", "rpe", "worth", "doubt", "out"}
    keys |= {"reference_is_input", "held_out"}
    assert set(document) == keys and document["out"] == str(out)
    assert document["lost_s"] == 0.0
    assert (
        document["ape"]["n"] == 100
        and document["ape"]["median_m"] < 0.1
        and document["ape"]["max_m"] < 0.3
    )
    assert document["rpe"]["median_m"] < 0.05  # of 1.5 m in an interval; the odometry alone: 0.03
    written = read_tum(out)
    assert len(written) == document["poses"] and written.poses[-1] == pytest.approx(
        document["final"], abs=1e-5
    )
    _, last = sidewalk_drive().truth[-1]
    # 0.2 s later
    assert math.hypot(document["final"][0] - last.x, document["final"][1] - last.y) < 0.6


def test_odometry_may_stand_in_tf_alone(tmp_path, capsys):
    entries = []
    for entry in sidewalk_drive().entries[:800]:
        if entry.topic == "/odom":
            at = entry.fields["pose"]["pose"]
            place, turn = at["position"], at["orientation"]
            numbers = (place["x"], place["y"], 0.0, 0.0, 0.0, turn["z"], turn["w"])
            entry = transforms(entry.stamp, ("/odom", "/base_link", numbers), topic="/tf")
        elif entry.topic == "/tf_static":
            entry = Entry("/tf", entry.type, entry.stamp, entry.fields)
        entries.append(entry)
    bag, out = write(tmp_path / "drive", entries, "ros1"), tmp_path / "out.tum"
    assert (
        localize(
            "--bag",
            bag,
            *ON_SIDEWALK,
            *AT_THE_START,
            "--out",
            out,
            "--reference",
            "/truth",
            "--json",
        )
        == 0
    )
    captured = capsys.readouterr()
    assert captured.err.splitlines() == [
        "note: there is no topic of odometry: it is taken from odom -> base_link in /tf"
    ]
    assert json.loads(captured.out)["ape"]["median_m"] < 0.1


def test_a_seed_gives_the_same_bytes(tmp_path):
    bag = write(tmp_path / "drive", sidewalk_drive().entries[:400], "mcap")
    texts = []
    for seed in (3, 3, 4):
        localize(
            "--bag", bag, *ON_SIDEWALK, *AT_THE_START, "--out", tmp_path / "out.tum", "--seed", seed
        )
        texts.append((tmp_path / "out.tum").read_bytes())
    assert texts[0] == texts[1] != texts[2]


def test_a_laser_upside_down_is_understood(tmp_path, capsys):
    entries = []
    for entry in sidewalk_drive().entries[:800]:
        if entry.topic == "/tf_static":  # rolled by pi, then turned by 0.2 rad
            turned = (0.3, 0.0, 0.4, math.cos(0.1), math.sin(0.1), 0.0, 0.0)
            entry = transforms(START, ("base_link", "laser", turned))
        elif entry.topic == "/scan":  # the beam at -pi stays the first one
            ranges = entry.fields["ranges"]
            fields = {**entry.fields, "ranges": ranges[:1] + ranges[:0:-1]}
            entry = Entry(entry.topic, entry.type, entry.stamp, fields, entry.frame)
        entries.append(entry)
    bag, out = write(tmp_path / "drive", entries, "ros1"), tmp_path / "out.tum"
    assert (
        localize(
            "--bag",
            bag,
            *ON_SIDEWALK,
            *AT_THE_START,
            "--out",
            out,
            "--reference",
            "/truth",
            "--json",
        )
        == 0
    )
    assert json.loads(capsys.readouterr().out)["ape"]["median_m"] < 0.1


@pytest.mark.slow
def test_fixes_take_away_the_error_of_the_wheels(tmp_path):
    bag = write(tmp_path / "straight", straight(1500), "sqlite3")
    by_wheels, with_fixes = (
        replay(bag, localizer)["final"][0] for localizer in ("odom_imu", "gps-ekf")
    )
    assert by_wheels == pytest.approx(0.9 * 29.98, abs=0.1)
    assert with_fixes == pytest.approx(29.98, abs=1.0)


def test_the_datum_is_the_origin(tmp_path):
    bag = write(tmp_path / "straight", straight(100), "mcap")
    east, north = (
        replay(bag, "gps", "--datum", datum)["final"]
        for datum in ("37.4,-122.1", "37.4,-122.1,1.5707963267948966")
    )
    assert east[0] == pytest.approx(1.8, abs=0.8) and east[2] == pytest.approx(0.0, abs=1e-6)
    assert north == pytest.approx((east[1], -east[0], -math.pi / 2), abs=1e-6)


@pytest.mark.parametrize("count", [1, 10])
def test_fixes_that_begin_elsewhere_do_not_end_a_log_with_a_datum(tmp_path, capsys, count):
    entries = straight(100)
    fixes = [entry for entry in entries if entry.topic == "/fix"]
    for entry in fixes[:count]:
        entry.fields |= {"latitude": 22.5, "longitude": 114.0}
    bag, out = write(tmp_path / "straight", entries, "mcap"), tmp_path / "out.tum"
    given = ("--bag", bag, "--params", "stock", "--localizer", "gps", "--out", out)
    if count < len(fixes):
        last = replay(bag, "gps", "--datum", "37.4,-122.1")["final"]
        assert last[0] == pytest.approx(1.8, abs=0.8)
        assert "1 messages of NavSatFix hold nothing usable" in capsys.readouterr().err
        return
    line = complaint(capsys, *given, "--datum", "37.4,-122.1")
    assert "(22.5, 114.0) degrees is more than 100 km from the datum (37.4, -122.1)" in line


def test_stamps_that_repeat_in_tf_are_no_standstill(tmp_path):
    """1 m/s without fixes."""
    entries = []
    for i in range(500):
        t = 0.02 * i
        stamp, at = START + 0.04 * (i // 2), 0.04 * (i // 2)  # each twice
        moved = ("odom", "base_link", (at, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0))
        entry = transforms(stamp, moved, topic="/tf")
        entry.arrival = START + t
        entries += [entry, imu(START + t, 0.0, 0.0)]
    bag = write(tmp_path / "straight", entries, "ros1")
    assert replay(bag, "odom_imu")["final"][0] == pytest.approx(9.98, abs=0.15)


def test_odometry_without_velocities_moves_by_its_poses(tmp_path, capsys):
    entries = straight(300)
    for entry in entries:
        if entry.topic == "/odom":
            del entry.fields["twist"]
    bag = write(tmp_path / "straight", entries, "mcap")
    assert replay(bag, "odom_imu")["final"][0] == pytest.approx(0.9 * 5.98, abs=0.02)
    assert "note: /odom tells no velocities" in capsys.readouterr().err


@pytest.mark.parametrize("changes", [{"status": {"status": -1}}, {"latitude": math.nan}])
def test_a_receiver_without_a_single_fix_is_told_in_the_end(tmp_path, capsys, changes):
    entries = straight(50)
    for entry in entries:
        if entry.topic == "/fix":
            entry.fields |= changes
    bag, out = write(tmp_path / "straight", entries, "mcap"), tmp_path / "out.tum"
    given = ("--bag", bag, "--params", "stock", "--localizer", "gps", "--out", out)
    line = complaint(capsys, *given)
    assert "none of the 5 messages of /fix holds anything usable, which localizer gps needs" in line
    assert len(read_tum(out)) == 50


def test_a_log_in_which_no_time_passes_is_refused(tmp_path, capsys):
    entries = straight(20)
    for entry in entries:
        entry.stamp = START
    bag, out = write(tmp_path / "still", entries, "mcap"), tmp_path / "out.tum"
    given = ("--bag", bag, "--params", "stock", "--localizer", "odom_imu", "--out", out)
    assert "no time passes in the log: its 40 messages arrived at once" in complaint(capsys, *given)
    assert not out.exists()


@pytest.fixture(scope="module")
def over_hill(tmp_path_factory):
    """The bag of a drive over a hill of a slope, and x, y and way [m] at its end."""

    @functools.cache
    def made(slope):
        entries, end = hill.drive(slope)
        return write(tmp_path_factory.mktemp("hill") / "hill", entries, "mcap"), end

    return made


@pytest.mark.slow
@pytest.mark.parametrize("localizer", ["odom_imu", "gps-ekf"])
@pytest.mark.parametrize("slope", [0.0, 0.2])
def test_over_a_hill_the_way_is_as_long_as_it_is_on_the_map(over_hill, slope, localizer):
    """Up and down again, with bends on the slope: the end to 1 % of the way."""
    bag, (x, y, way) = over_hill(slope)
    datum = ("--datum", ",".join(map(str, DATUM))) if localizer == "gps-ekf" else ()
    end = replay(bag, localizer, *datum)["final"]
    assert math.hypot(end[0] - x, end[1] - y) <= 0.01 * way


@pytest.mark.slow
@pytest.mark.parametrize("slope", [0.1, 0.3])
def test_gravity_is_not_taken_for_slipping_wheels(tmp_path, slope):
    """A unit without orientation: nothing tells the slope, so that the way is as long as driven."""
    entries, (x, y, _) = hill.drive(slope)
    for entry in entries:
        if entry.topic == "/imu/data":
            entry.fields["orientation_covariance"] = np.array([-1.0] + [0.0] * 8)
    end = replay(write(tmp_path / "hill", entries, "mcap"), "odom_imu", *KNOWN_START)["final"]
    along = x * (math.hypot(slope, 1.0) - 1.0)  # of the way that is not on the map
    assert math.hypot(end[0] - x, end[1] - y) <= along + 1.0


@pytest.mark.parametrize("stuck", [0.0, 1_600_000_000.0])
def test_unset_stamps_of_a_busy_topic_spoil_no_other(tmp_path, capsys, stuck):
    entries = straight(300)
    for entry in entries:
        if entry.topic == "/imu/data":
            entry.arrival, entry.stamp = entry.stamp, stuck
    entries = sorted(
        entries, key=lambda entry: (entry.arrival or entry.stamp, entry.topic != "/imu/data")
    )
    more = [Entry(e.topic, e.type, stuck, e.fields, e.frame, e.arrival + 0.005 * k)
            for e in entries if e.topic == "/imu/data" for k in (1, 2, 3)]  # fmt: skip
    bag = write(tmp_path / "straight", entries + more, "ros1")
    replay(bag, "odom_imu")
    said = [line for line in capsys.readouterr().err.splitlines() if "another time" in line]
    assert said == ["note: 1200 messages of /imu/data have stamps that are unset or of another "
                    "time; taken as measured when they arrived"]  # fmt: skip
    written = read_tum(tmp_path / "out.tum")
    assert written.stamps[0] == pytest.approx(START) and written.stamps[-1] == pytest.approx(
        START + 5.995, abs=0.01
    )
    assert written.poses[-1, 0] == pytest.approx(0.9 * 5.98, abs=0.1)


def test_amcl_tells_poses_of_the_odometrys_times_alone(tmp_path):
    """Scans come between messages of odometry, where the belief is still that of the last one."""
    entries = sidewalk_drive().entries
    bag, out = write(tmp_path / "drive", entries, "mcap"), tmp_path / "out.tum"
    assert localize("--bag", bag, *ON_SIDEWALK, *AT_THE_START, "--out", out) == 0
    moved = [entry.stamp for entry in entries if entry.topic == "/odom"]
    assert read_tum(out).stamps == pytest.approx(moved, abs=1e-6)


def test_global_localization_with_fixes_needs_a_datum(tmp_path, capsys):
    bag = write(tmp_path / "drive", sidewalk_drive().entries[:60], "mcap")
    base = (
        "--bag",
        bag,
        "--map",
        "sidewalk",
        "--params",
        "amcl",
        "--localizer",
        "amcl-gps",
        "--out",
        tmp_path / "o",
    )
    line = complaint(capsys, *base, "--global")
    assert (
        "--global without --datum: localizer amcl-gps would place the first fix at a start "
        "that nobody knows" in line
    )
    assert "give --datum LAT,LON[,HEADING], or --initial-pose in place of --global" in line
    assert localize(*base, "--global", "--datum", "37.4,-122.1") == 0
    assert "nobody says where the robot" not in capsys.readouterr().err
    assert localize(*base) == 0
    told = capsys.readouterr().err
    assert "taken to be at 0,0,0, and fixes are placed from there; give --initial-pose" in told
    assert "lies off the map" not in told
    assert localize(*base, "--initial-pose", "900,3,0") == 0
    assert "the start (900, 3) m lies off the map, which has x -" in capsys.readouterr().err


def test_a_reference_from_a_file(tmp_path, capsys):
    bag = write(tmp_path / "straight", straight(200), "ros1")
    stamps = START + np.arange(0.0, 4.0, 0.1)
    poses = np.column_stack((0.9 * (stamps - START), np.zeros(40), np.zeros(40)))
    write_tum(tmp_path / "ref.tum", Trajectory(stamps, poses))
    base = (
        "--bag",
        bag,
        "--params",
        "stock",
        "--localizer",
        "odom_imu",
        "--out",
        tmp_path / "o.tum",
    )
    assert localize(*base, "--reference", tmp_path / "ref.tum") == 0
    said = capsys.readouterr().out
    assert "APE against" in said and "n 40" in said and "RPE over 1 s: median 0.00" in said
    first, worth, arrives, *_ = lines = said.splitlines()
    told = "stock.yaml has no parameters for gps_ekf: those are the program's defaults; "
    assert first.startswith(f"odom_imu over {bag}; {told}") and len(lines) <= 25
    assert (
        worth.startswith("an error of ") and " m (RMSE) " in worth and " USD a delivery (" in worth
    )
    assert arrives.startswith("100 % of the poses are near enough to the reference to arrive")
    line = complaint(capsys, *base, "--reference", "/nowhere")
    assert "reference '/nowhere' is no file, and topic '/nowhere' is not in the bag" in line


def test_agreement_with_the_localizers_own_input_is_no_error_and_has_no_price(tmp_path, capsys):
    bag = write(tmp_path / "straight", straight(400), "ros1")
    own = ("--params", "gps_ekf", "--localizer", "gps-ekf", "--out", tmp_path / "o.tum")
    given = ("--bag", bag, *own, "--reference", "/fix")
    assert localize(*given) == 0
    first, second, *rest = capsys.readouterr().out.splitlines()
    assert "; parameters from gps_ekf.yaml: gps_ekf" in first
    assert second.startswith("/fix is an input of gps-ekf: below is how closely it follows its own")
    assert "USD" not in "".join(rest) and "good enough" not in "".join(rest)
    document = replay(bag, "gps-ekf", "--reference", "/fix")
    assert document["worth"] is None and document["reference_is_input"]
    assert document["ape"]["n"] == 40


def test_a_wrong_mounting_is_said_first_and_nothing_is_priced(tmp_path, capsys):
    entries = straight(400)
    for entry in entries:
        if entry.type.endswith("Imu"):
            entry.fields["linear_acceleration"] = {"y": 9.8}  # it lies on its side
    bag = write(tmp_path / "straight", entries, "ros1")
    own = ("--params", "gps_ekf", "--localizer", "gps-ekf", "--out", tmp_path / "o.tum")
    assert localize("--bag", bag, *own, "--reference", "/fix", "--hold-out") == 0
    _, second, *rest = capsys.readouterr().out.splitlines()
    assert second.startswith("gravity is 90 degrees off the vertical in frame 'imu_link'")
    assert "roll 1.57 and pitch 0.00 rad would set it upright" in second
    assert "USD" not in "".join(rest) and "APE" not in "".join(rest)
    assert not rest[-1].startswith("next:")


def test_a_reference_that_is_held_out_is_priced_by_what_the_localizer_never_had(tmp_path, capsys):
    entries = straight(400)
    for entry in entries:  # every other fix is 0.6 m beside the way
        if entry.topic == "/fix" and round((entry.stamp - START) * 5.0) % 2:
            entry.fields["latitude"] += 0.6 / 111_000.0
    bag = write(tmp_path / "straight", entries, "ros1")
    document = replay(bag, "gps-ekf", "--reference", "/fix", "--hold-out")
    assert document["held_out"] and document["ape"]["n"] == 20
    assert document["ape"]["median_m"] == pytest.approx(0.6, abs=0.2), "it has none of these"
    assert document["worth"]["usd_per_run"] > 5.0 and document["doubt"] == ""
    followed = replay(bag, "gps-ekf", "--reference", "/fix")
    assert followed["final"][1] > document["final"][1] + 0.1, "it has all of them"
    capsys.readouterr()
    own = ("--params", "stock", "--localizer", "odom_imu", "--out", tmp_path / "o.tum")
    line = complaint(capsys, "--bag", bag, *own, "--reference", "/fix", "--hold-out")
    assert "the reference is no input of localizer odom_imu; leave --hold-out out" in line


@pytest.mark.slow
def test_a_damaged_bag_keeps_what_was_computed(tmp_path, capsys):
    bag = write(tmp_path / "straight", straight(5000), "ros1-lz4")
    content = bag.read_bytes()
    bag.write_bytes(content[: len(content) // 2])
    out = tmp_path / "out.tum"
    line = complaint(
        capsys, "--bag", bag, "--params", "stock", "--localizer", "gps-ekf", "--out", out
    )
    kept = len(read_tum(out))
    assert (
        f"is cut off at byte {len(content) // 2}; the {kept} poses until then are kept in {out}"
        in line
    )
    assert kept > 1000


def test_a_message_of_garbage_ends_the_replay_there(tmp_path, capsys):
    folder = write(tmp_path / "straight", straight(100), "sqlite3")
    with sqlite3.connect(next(folder.glob("*.db3"))) as database:
        database.execute("UPDATE messages SET data = x'0001' WHERE id IN (150, 151)")
    out = tmp_path / "out.tum"
    line = complaint(
        capsys, "--bag", folder, "--params", "stock", "--localizer", "odom_imu", "--out", out
    )
    assert "a message of /" in line and " is no " in line and "poses until then are kept" in line
    assert 60 < len(read_tum(out)) < 80


def test_a_log_without_a_usable_message_leaves_no_file(tmp_path, capsys):
    entries = [fix(START + i, 0.0, 0.0) for i in range(5)]
    for entry in entries:
        entry.fields["latitude"] = math.nan
    bag, out = write(tmp_path / "log", entries, "mcap"), tmp_path / "out.tum"
    line = complaint(capsys, "--bag", bag, "--params", "stock", "--localizer", "gps", "--out", out)
    assert "none of the 5 messages of /fix holds anything usable" in line
    assert "no pose was computed" in line
    assert not out.exists()


def test_global_localization_is_asked_of_amcl(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(AmclLocalizer, "localize_globally", lambda self: asked.append(self))
    bag = write(tmp_path / "drive", sidewalk_drive().entries[:60], "mcap")
    assert localize("--bag", bag, *ON_SIDEWALK, "--out", tmp_path / "out.tum", "--global") == 0
    assert len(asked) == 1


def test_an_interrupt_keeps_what_was_computed(tmp_path, capsys, monkeypatch):
    take = Replay._take

    def interrupted(self, message, decoded, stamp, now, belief):
        if stamp > START + 5.0:
            raise KeyboardInterrupt
        return take(self, message, decoded, stamp, now, belief)

    monkeypatch.setattr(Replay, "_take", interrupted)
    bag = write(tmp_path / "straight", straight(), "mcap")
    out = tmp_path / "out.tum"
    assert (
        localize("--bag", bag, "--params", "stock", "--localizer", "odom_imu", "--out", out) == 130
    )
    assert "interrupted after 50% of the messages" in capsys.readouterr().err
    assert read_tum(out).stamps[-1] == pytest.approx(START + 5.0, abs=0.03)


def test_what_is_missing_is_one_line(tmp_path, capsys):
    bag = write(tmp_path / "straight", straight(20), "ros1")
    base = ("--bag", bag, "--params", "stock", "--out", tmp_path / "o.tum", "--localizer")
    assert (
        "has no topic of sensor_msgs/msg/LaserScan (usually /scan), which localizer amcl needs"
        in complaint(capsys, *base, "amcl", "--map", "sidewalk")
    )
    assert "unknown localizer 'ground_truth'" in complaint(capsys, *base, "ground_truth")
    assert "--global: localizer gps cannot" in complaint(capsys, *base, "gps", "--global")
    assert "the type sensor_msgs/msg/Imu, not sensor_msgs/msg/NavSatFix" in complaint(
        capsys, *base, "gps", "--remap", "/fix:=/imu/data"
    )
    assert "--initial-pose '1,2' is not x,y,yaw" in complaint(
        capsys, *base, "gps", "--initial-pose", "1,2"
    )
    assert "reference /imu/data is of the type" in complaint(
        capsys, *base, "gps", "--reference", "/imu/data"
    )
    drive = write(tmp_path / "drive", sidewalk_drive().entries[:30], "ros1")
    assert "needs a map; give --map" in complaint(
        capsys,
        "--bag",
        drive,
        "--params",
        "stock",
        "--out",
        tmp_path / "o.tum",
        "--localizer",
        "amcl",
    )
    line = complaint(
        capsys,
        "--bag",
        bag,
        "--params",
        "stock",
        "--localizer",
        "gps",
        "--out",
        tmp_path / "no" / "o.tum",
    )
    assert "--out" in line and "its folder does not exist" in line
    assert not (tmp_path / "o.tum").exists()
    assert "more than 100 km from the datum" in complaint(capsys, *base, "gps", "--datum", "10,10")


@pytest.mark.skipif(DATA is None, reason="NAVSTACK_DATA is unset: no real bag")
class TestTheHusky:
    """A real robot on a parking lot, 395 s."""

    bag = Path(str(DATA)) / "robot_localization" / "test1.bag"

    @pytest.mark.slow
    def test_it_ends_where_robot_localization_says(self, tmp_path):
        """Final position and tolerance as in robot_localization.

        Its file is test_ekf_localization_node_bag1.test.
        """
        began = time.process_time()
        x, y, _ = self._replay(tmp_path, "odom_imu")["final"]
        assert math.hypot(x + 40.0454, y + 76.9988) < 1.0452
        assert time.process_time() - began < 60.0  # 4 s on an idle machine, with compiled kernels

    @pytest.mark.slow
    def test_it_stays_near_its_fixes(self, tmp_path):
        ape = self._replay(tmp_path, "gps-ekf", "--reference", "/fix", "--align", "start")["ape"]
        assert ape["n"] == 989 and ape["median_m"] <= 1.5 and ape["p95_m"] <= 4.0

    def _replay(self, folder: Path, localizer: str, *more: str) -> dict:
        link = folder / "test1.bag"
        link.symlink_to(self.bag)
        return replay(link, localizer, *HUSKY_MOUNTING, *more)


def test_what_is_read_is_never_overwritten(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bag = tmp_path / "drive.bag"
    bag.write_bytes(b"#ROSBAG V2.0\n")
    given = ("--params", "stock", "--localizer", "odom_imu", "--bag")
    for name in (bag, tmp_path):
        line = complaint(capsys, *given, name, "--out", bag)
        assert "is a file that is read; give another" in line
    out = tmp_path / "out.tum"
    out.write_text("of another time")
    assert "is a file that is read" not in complaint(capsys, *given, tmp_path, "--out", out)
    assert bag.read_bytes() == b"#ROSBAG V2.0\n"
