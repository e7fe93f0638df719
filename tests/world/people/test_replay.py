"""Recorded people: files, their place, and who is there when."""

import math
import os
import re
from pathlib import Path

import numpy as np
import pytest

from harness.episode.files import with_recording
from harness.world.people.params import PedestrianParams, ReplayParams
from harness.world.people.replay import ReplayPedestrians
from harness.world.people.replay_file import MAX_BYTES, Recording, _arrange, load_recording
from harness.world.people.walk_kernels import replay
from harness.world.physics.body_state import BodyState
from harness.world.sensors.lidar_kernels import cast_circles
from harness.world.world_params import WorldParams
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.errors import InputError
from navstack.types import Pose2D
from tools.pedestrian_statistics import companions, prediction_errors, record_states, separations

SQUARE = OccupancyGrid(np.zeros((60, 60), dtype=np.int8), 1.0, Pose2D(-20.0, -20.0))
AWAY = Pose2D(1000.0, 0.0)
TWO = """id,t,x,y
7,10,0,0
7,12,2,0
7,13,2,3
9,11,5,5
9,14,5,2
"""


def write(folder, text, name="people.csv"):
    path = folder / name
    path.write_text(text)
    return str(path)


def people(file, loop=False, placement=None, **changes):
    replay = ReplayParams(file, placement or Pose2D(), loop=loop)
    return ReplayPedestrians(PedestrianParams(model="replay", replay=replay, **changes), SQUARE)


def at(model, time, robot=AWAY, dt=0.01):
    """States after ``time`` [s] from the beginning."""
    model.reset(np.random.default_rng(0), robot)
    for _ in range(round(time / dt)):
        model.see_robot(BodyState(robot.x, robot.y))
        model.step(dt)
    return model.states


ABSENT = (math.inf, math.inf, 0.0, 0.0)


@pytest.mark.parametrize(
    ("time", "first", "second"),
    [
        (0.0, (0.0, 0.0, 1.0, 0.0), ABSENT),
        (0.5, (0.5, 0.0, 1.0, 0.0), ABSENT),
        (1.5, (1.5, 0.0, 1.0, 0.0), (5.0, 4.5, 0.0, -1.0)),
        (2.5, (2.0, 1.5, 0.0, 3.0), (5.0, 3.5, 0.0, -1.0)),
        (3.5, ABSENT, (5.0, 2.5, 0.0, -1.0)),
        (4.5, ABSENT, ABSENT),
    ],
)
def test_people_walk_straight_between_samples_and_are_absent_outside(tmp_path, time, first, second):
    states = at(people(write(tmp_path, TWO)), time)
    assert tuple(states[0]) == pytest.approx(first, abs=1e-6)
    assert tuple(states[1]) == pytest.approx(second, abs=1e-6)


def test_people_and_columns_may_come_in_any_order(tmp_path):
    mixed = "y, note, t, id, x\n5,d,11,9,5\n0,a,10,7,0\n0,b,12,7,2\n2,e,14,9,5\n3,c,13,7,2\n"
    one, other = (load_recording(ReplayParams(write(tmp_path, text))) for text in (TWO, mixed))
    assert np.array_equal(one.times, other.times) and np.array_equal(one.positions, other.positions)
    assert np.array_equal(one.firsts, (0, 3, 5)) and np.array_equal(other.firsts, one.firsts)


def test_a_recording_is_put_where_it_belongs(tmp_path):
    states = at(people(write(tmp_path, TWO), placement=Pose2D(10.0, 20.0, math.pi / 2)), 1.0)
    assert tuple(states[0]) == pytest.approx((10.0, 21.0, 0.0, 1.0), abs=1e-6)


def test_an_obsmat_file_is_in_frames(tmp_path):
    rows = "0 3 1.0 0 2.0 9 9 9\n10 3 1.4 0 2.2 9 9 9\n"
    recording = load_recording(ReplayParams(write(tmp_path, rows, "obsmat.txt")))
    assert recording.times == pytest.approx((0.0, 0.4))
    assert recording.positions == pytest.approx(np.array(((1.0, 2.0), (1.4, 2.2))))


def test_a_loop_starts_anew_and_is_joined_at_a_random_moment(tmp_path):
    model = people(write(tmp_path, TWO), loop=True)
    joined = set()
    for seed in range(5):
        model.reset(np.random.default_rng(seed), AWAY)
        states = [model.states]
        for _ in range(800):
            model.step(0.01)
            states.append(model.states)
        joined.add(tuple(states[0].ravel().round(3)))
        np.testing.assert_allclose(states[400:], states[:401], atol=1e-6)  # the recording lasts 4 s
    assert len(joined) == 5


def test_nobody_appears_where_the_robot_is(tmp_path):
    model = people(write(tmp_path, TWO))
    assert tuple(at(model, 1.5, Pose2D(0.5, 0.5))[0]) == ABSENT
    assert tuple(at(model, 1.5, Pose2D(5.0, 4.0))[1]) == ABSENT
    assert tuple(at(model, 1.5, Pose2D(2.5, 0.5))[0]) != ABSENT  # who was there before walks on


def test_whoever_begins_a_new_round_does_not_appear_where_the_robot_is_either(tmp_path):
    model = people(write(tmp_path, "id,t,x,y\n1,0,0,0\n1,4,8,0\n"), loop=True)
    assert at(model, 4.0)[0, 0] < 8.0  # after one round; nobody was there
    assert tuple(at(model, 4.0, Pose2D(0.2, 0.0))[0]) == ABSENT


@pytest.mark.parametrize(("clearance", "x"), [(5.0, 3.0), (math.nextafter(5.0, 6.0), math.inf)])
def test_somebody_may_appear_just_beyond_the_clearance(clearance, x):
    states, sample = np.empty((1, 4)), (np.array((0, 1)), np.zeros(1), np.array(((3.0, 4.0),)))
    replay(0.0, *sample, 0.0, 0.0, clearance, np.array((True,)), np.array((False,)), states)
    assert states[0, 0] == x


def test_somebody_with_one_sample_is_there_for_a_moment(tmp_path):
    model = people(write(tmp_path, "id,t,x,y\n1,0,1,1\n2,0,4,4\n2,1,5,4\n"))
    assert tuple(at(model, 0.0)[0]) == (1.0, 1.0, 0.0, 0.0)
    assert tuple(at(model, 0.5)[0]) == ABSENT


def test_the_lidar_sees_only_who_is_there():
    angles = np.linspace(-math.pi, math.pi, 360, endpoint=False)
    ranges, alone = np.full(360, 30.0), np.full(360, 30.0)
    here = np.array([(3.0, 0.0, 0.0, 0.0)])
    beams = (
        0.3,
        0.0,
        0.0,
        0.4,
        np.column_stack((np.cos(angles), np.sin(angles))),
        -math.pi,
        angles[1] - angles[0],
    )
    cast_circles(np.vstack((ABSENT, here, ABSENT)), *beams, 30.0, ranges)
    cast_circles(here, *beams, 30.0, alone)
    assert np.array_equal(ranges, alone) and ranges.min() == pytest.approx(2.7, abs=0.01)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.csv", "", "line 1: the columns are missing"),
        ("a.csv", "id,t,x\n1,2,3\n", "line 1: the columns are id, t, x; needed are id, t"),
        ("a.csv", "id,t,x,y\n", "has no samples"),
        ("a.csv", "id,t,x,y\n1,0,1,1\n1,1,abc,1\n", "line 3: x 'abc'; a finite number is needed"),
        ("a.csv", "id,t,x,y\n1,0,nan,1\n", "line 2: x 'nan'; a finite number"),
        (
            "a.csv",
            "id,t,x,y\n1,0,2e8,1\n",
            "line 2: x '2e8'; a finite number is needed, at most 1e",
        ),
        ("a.csv", "id,t,x,y\n1,12,1,1\n2,12,2,2\n", r"lasts 0 s; more than 0 and at most 1e\+08 s"),
        ("a.csv", "id,t,x,y\n1,0,1,1\n1,2e8,2,2\n", r"lasts 2e\+08 s; more than 0"),
        ("a.csv", "id,t,x,y\n1,0,1\n", "line 2: 3 columns; 4 are needed"),
        ("a.csv", "id,t,x,y\n1,0,1,1\n1,0,2,1\n", "id 1 has two samples at the time 0 s"),
        (
            "a.csv",
            "id,t,x,y\n1,0,1,-1.1e8\n",
            r"line 2: y '-1\.1e8'; a finite number is needed, at most 1e\+08",
        ),
        ("a.txt", "1 2 3\n", "line 1: 3 columns; 8 are needed"),
        ("a.txt", "\n1 2 3 0 z 0 0 0\n", "line 2: y 'z'; a finite number is needed"),
    ],
)
def test_a_bad_file_is_refused_in_one_line(tmp_path, name, text, message):
    with pytest.raises(InputError, match=message) as caught:
        load_recording(ReplayParams(write(tmp_path, text, name)))
    assert name in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "text", "message"),
    [
        ("a.csv", "id,t,x,y\n1,0,0,0\n1,1e-6,3,4\n", "id 1 moves 5 m in the 1e-06 s after 0 s"),
        ("a.csv", "id,t,x,y\n1,0,0,0\n1,1,0,15.1\n", "id 1 moves 15.1 m in the 1 s after 0 s"),
        (
            "a.csv",
            "id,t,x,y\n2,0,0,0\n1,0,0,0\n2,5,1,0\n1,5,70,0\n1,9,180,0\n",
            "id 1 moves 110 m in the 4 s after 5 s",
        ),
        ("a.csv", "id,t,x,y\n1,0,0,0\n1,2,1,0\n1,1,2,0\n", "id 1 goes back in time, from 2 s to 1"),
        ("a.csv", "id,t,x,y\n1,3,0,0\n2,4,0,0\n1,2,0,0\n", "id 1 goes back in time, from 3 s to 2"),
        ("a.txt", "30 4 3 9 4 0 0 0\n0 4 5 9 6 0 0 0\n", "id 4 goes back in time, from 1.2 s to 0"),
        ("a.txt", "0 4 3 9 4 0 0 0\n1 4 5 9 6 0 0 0\n", "id 4 moves 2.83 m in the 0.04 s after 0"),
    ],
)
def test_who_cannot_have_walked_so_is_refused_in_one_line(tmp_path, name, text, message):
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        load_recording(ReplayParams(write(tmp_path, text, name)))
    assert name in str(caught.value) and "\n" not in str(caught.value)


def test_a_clock_may_count_from_1970_and_numbers_of_people_be_long(tmp_path):
    rows = "id,t,x,y\n99999999999,1700000000.0,0,0\n99999999999,1700000002.5,3,0\n"
    recording = load_recording(ReplayParams(write(tmp_path, rows, "a.csv")))
    assert (recording.count, recording.duration) == (1, 2.5)
    assert recording.times.tolist() == [0.0, 2.5]


def test_a_sprint_is_no_teleport_and_another_person_may_be_anywhere(tmp_path):
    rows = "id,t,x,y\n1,0,0,0\n1,1,15,0\n2,0.5,500,500\n2,1,500,505\n"
    assert load_recording(ReplayParams(write(tmp_path, rows))).count == 2


def test_a_sample_may_be_as_far_as_can_be(tmp_path):
    found = load_recording(ReplayParams(write(tmp_path, "y,id,t,x\n-1e8,1,0,1e8\n7,1e8,1e8,5\n")))
    assert found.positions.tolist() == [[1e8, -1e8], [5.0, 7.0]] and found.times.tolist() == [
        0.0,
        1e8,
    ]


def test_a_data_set_counts_frames_and_has_x_and_y_in_its_third_and_fifth_column(tmp_path):
    file = write(tmp_path, "0 1 5 9 6 0 0 0\n\n30 1 3 9 4 0 0 0\n", "a.txt")
    found = load_recording(ReplayParams(file, frame_rate=15.0))
    assert found.positions.tolist() == [[5.0, 6.0], [3.0, 4.0]] and found.times.tolist() == [
        0.0,
        2.0,
    ]


def test_ten_thousand_people_are_read_and_no_more():
    samples = np.zeros((10_001, 4))
    samples[:, 0] = samples[:, 1] = np.arange(10_001)
    assert _arrange(samples[:-1], ReplayParams(), Path("a.csv")).count == 10_000
    with pytest.raises(InputError, match=r"'a\.csv' has 10001 people; at most 10000 are read"):
        _arrange(samples, ReplayParams(), Path("a.csv"))


def test_files_that_cannot_be_read_are_refused(tmp_path):
    (tmp_path / "b.csv").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="it is not a text file"):
        load_recording(ReplayParams(str(tmp_path / "b.csv")))
    with pytest.raises(InputError, match="cannot be read"):
        load_recording(ReplayParams(str(tmp_path / "none.csv")))
    with pytest.raises(InputError, match="need a recording; give --people"):
        load_recording(ReplayParams())


def test_a_recording_off_the_map_is_refused(tmp_path):
    file = write(tmp_path, TWO)
    people(file, placement=Pose2D(38.0, 0.0))  # some of it is on the map
    with pytest.raises(
        InputError,
        match=r"walk at x 100\.0\.\.105\.0, y 0\.0\.\.5\.0 m, off the map of 60 m x 60 m",
    ):
        people(file, placement=Pose2D(100.0, 0.0))


def test_constant_velocity_on_real_people_scores_as_published():
    """ADE/FDE 0.45/1.00 m over 12 steps of 0.4 s after 8, a known figure for UCY zara01."""
    data = os.environ.get("NAVSTACK_DATA")
    if not data:
        pytest.skip("NAVSTACK_DATA is not set: no ucy_zara01")
    recording = load_recording(ReplayParams(str(Path(data) / "ucy_zara01" / "obsmat.txt")))
    assert recording.count == 148
    ade, fde, windows = prediction_errors(recording)
    assert (round(ade, 2), round(fde, 2)) == (0.45, 1.00) and windows > 2000


def test_separations_leave_out_company():
    """Two walk together, a third comes the other way, a fourth keeps 4 m to them."""
    ticks = np.arange(20)
    rows = [np.column_stack((0.5 * ticks, np.full(20, y))) for y in (0.0, 0.8, -4.0)]
    rows.insert(2, np.column_stack((10.0 - 0.5 * ticks, np.full(20, 2.0))))
    recording = Recording(np.arange(0, 81, 20), np.tile(0.4 * ticks, 4), np.concatenate(rows))
    together = companions(recording, 0.4)
    assert together[0, 1] and together[1, 0] and together.sum() == 6
    assert separations(recording, 0.4).min() == pytest.approx(1.2)


def test_a_camera_sees_a_window():
    states = np.zeros((6, 1, 4))
    states[:, 0, 0] = (0.0, 2.0, 3.0, 9.0, 2.5, 2.6)
    recording = record_states(states, 0.4, (1.0, 4.0))
    assert np.array_equal(recording.firsts, (0, 2, 4))
    assert recording.times == pytest.approx((0.4, 0.8, 1.6, 2.0))


def test_a_run_keeps_a_recording_of_any_size_that_is_read_as_it_is(tmp_path):
    head = "\ufeffid,t,x,y\r\n1,0,5,5\r\n"
    file = tmp_path / "mine.csv"
    file.write_text(head + "#" * (MAX_BYTES - len(head.encode())), encoding="utf-8", newline="")
    asked = PedestrianParams(model="replay", replay=ReplayParams(str(file)))
    world, kept = with_recording(WorldParams(people=asked))
    assert world.people.replay.file == "people.csv"
    assert kept["people.csv"].encode() == file.read_bytes()
    with file.open("a", encoding="utf-8") as stream:
        stream.write("#")
    with pytest.raises(InputError, match=f"at most {MAX_BYTES}"):
        with_recording(WorldParams(people=asked))


@pytest.mark.parametrize(
    "text", [TWO, "\ufeff" + TWO, TWO.replace("\n", "\r\n"), TWO.replace("\n", "\r")]
)
def test_marks_and_line_ends_do_not_matter(tmp_path, text):
    file = tmp_path / "people.csv"
    file.write_text(text, encoding="utf-8", newline="")
    assert load_recording(ReplayParams(str(file))).times.tolist() == [0.0, 2.0, 3.0, 1.0, 4.0]
