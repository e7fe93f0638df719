"""Bags of all formats are read alike, whole or damaged."""

import bz2
import gzip
import os
import random
import shutil
import struct
from pathlib import Path

import pytest
from rosbags.highlevel import AnyReader

from harness.recorded.bag import METADATA, Bag
from harness.recorded.bag_file import BagError, DamageError
from harness.recorded.ros_messages import IMU, ODOMETRY, TYPES, decode
from navstack.types import Pose2D

from .writing import FORMATS, START, Entry, imu, odometry, write

DATA = os.environ.get("NAVSTACK_DATA")


def entries(count: int = 300) -> list[Entry]:
    """Odometry and IMU in turn, every 10 ms; the forward position is the number."""
    return [
        odometry(START + 0.01 * i, Pose2D(float(i)), 1.0, 0.0)
        if i % 3 == 0
        else imu(START + 0.01 * i, 0.001 * i, 0.0)
        for i in range(count)
    ]


def contents(bag: Bag) -> list[tuple[str, float, object]]:
    messages = [bag.read(place) for place in bag.places(set(bag.topics))]
    return [(message.topic.name, message.arrival, message.content) for message in messages]


@pytest.mark.parametrize("form", FORMATS)
def test_every_format_gives_every_message_once_and_in_order(tmp_path, form):
    written = entries()
    with Bag([write(tmp_path / "log", written, form)], TYPES) as bag:
        assert bag.damage is None
        assert bag.topics == {"/odom": ODOMETRY, "/imu/data": IMU}
        assert bag.counts() == {"/odom": 100, "/imu/data": 200}
        read = [bag.read(place) for place in bag.places({"/odom", "/imu/data"})]
        assert [message.topic.name for message in read] == [entry.topic for entry in written]
        assert [message.arrival for message in read] == pytest.approx(
            [entry.stamp for entry in written], abs=1e-6
        )
        only = [decode(bag.read(place)).pose.pose.position.x for place in bag.places({"/odom"})]
        assert only == [float(i) for i in range(0, 300, 3)]


@pytest.mark.parametrize("form", ["ros1", "sqlite3", "mcap"])
def test_messages_come_in_the_order_of_arrival_however_they_are_written(tmp_path, form):
    written = entries()
    shuffled = random.Random(0).sample(written, len(written))
    with Bag([write(tmp_path / "log", shuffled, form)], TYPES) as bag:
        arrivals = [arrival for _, arrival, _ in contents(bag)]
    assert len(arrivals) == 300 and arrivals == sorted(arrivals)


@pytest.mark.skipif(DATA is None, reason="NAVSTACK_DATA is unset: no real bag")
def test_a_real_bag_reads_as_rosbags_own_reader_reads_it():
    path = Path(str(DATA)) / "robot_localization" / "test1.bag"
    with AnyReader([path]) as reader:
        expected = [
            (connection.topic, time, bytes(raw)) for connection, time, raw in reader.messages()
        ]
    with Bag([path], TYPES) as bag:
        ours = [(name, round(arrival * 1e9), content) for name, arrival, content in contents(bag)]
    assert len(ours) == 16806
    assert [(name, content) for name, _, content in ours] == [
        (name, content) for name, _, content in expected
    ]
    # [ns]
    assert max(abs(a - b) for (_, a, _), (_, b, _) in zip(ours, expected, strict=True)) < 1000


@pytest.mark.parametrize("form", ["ros1", "ros1-bz2", "ros1-lz4", "mcap", "mcap-zstd", "sqlite3"])
def test_what_stands_before_the_cut_is_read(tmp_path, form):
    written = entries(3000 if form == "sqlite3" else 6000)
    path = write(tmp_path / "log", written, form)
    path = path if path.is_file() else next(path.glob("*[3p]"))  # .db3 or .mcap
    whole = path.read_bytes()
    path.write_bytes(whole[: len(whole) * 2 // 3])
    with Bag([path], TYPES) as bag:
        assert bag.damage is not None and str(path) in bag.damage and "\n" not in bag.damage
        places = bag.places(set(bag.topics))
        numbers = []
        for place in places:
            try:
                numbers.append(round((bag.read(place).arrival - START) * 100))
            except DamageError:
                break
    assert numbers == list(range(len(numbers)))
    assert len(numbers) > len(written) // 4


@pytest.mark.parametrize(
    ("suffix", "pack", "is_cut"),
    [(".gz", gzip.compress, False), (".gz", gzip.compress, True), (".bz2", bz2.compress, False)],
)
def test_a_bag_that_was_packed_as_a_whole_is_read(tmp_path, suffix, pack, is_cut):
    path = write(tmp_path / "log", entries(6000 if is_cut else 300), "ros1")
    with Bag([path], TYPES) as bag:
        whole = contents(bag)
    content = pack(path.read_bytes())
    if is_cut:
        content = content[: len(content) * 2 // 3]
    folder = tmp_path / "packed"
    folder.mkdir()
    (folder / f"log.bag{suffix}").write_bytes(content)
    (folder / "log.bag.txt").write_text("notes")
    for given in (folder, folder / f"log.bag{suffix}"):
        with Bag([given], TYPES) as bag:
            assert (bag.damage is not None) is is_cut
            places = bag.places(set(bag.topics))
            assert (len(places) == len(whole)) is not is_cut
            assert len(places) > len(whole) // 4
            if not is_cut:
                assert contents(bag) == whole


def test_a_packed_bag_without_a_whole_block_is_named(tmp_path):
    path = write(tmp_path / "log", entries(), "ros1")
    packed = tmp_path / "log.bag.bz2"
    packed.write_bytes(bz2.compress(path.read_bytes())[:1000])
    with pytest.raises(BagError, match=rf"bag '{packed}' holds nothing that can be unpacked"):
        Bag([packed], TYPES)


def test_a_bag_that_was_never_closed_says_so(tmp_path):
    path = write(tmp_path / "log", entries(), "ros1")
    content = path.read_bytes()
    index = int.from_bytes(content[content.index(b"index_pos=") + 10 :][:8], "little")
    at = content.index(b"index_pos=") + 10
    path.write_bytes(content[:at] + bytes(8) + content[at + 8 : index])
    with Bag([path], TYPES) as bag:
        assert "never closed" in str(bag.damage)
        assert len(bag.places(set(bag.topics))) == 300


def test_a_connection_of_3_gb_is_not_read(tmp_path):
    path = write(tmp_path / "log", entries(3), "ros1")
    fields = b"".join(
        struct.pack("<I", len(field)) + field
        for field in (b"op=\x07", b"conn=\x09\0\0\0", b"topic=/x")
    )
    with path.open("ab") as stream:
        stream.write(struct.pack("<I", len(fields)) + fields + struct.pack("<I", 3_000_000_000))
        stream.truncate(stream.tell() + 3_000_000_000)  # a file of holes
    with Bag([path], TYPES) as bag:
        assert (
            str(bag.damage)
            == f"{path}: has a connection of 3000000000 bytes; at most 10000000 are read"
        )
        assert bag.counts() == {"/odom": 1, "/imu/data": 2}


def test_a_split_log_is_one(tmp_path):
    first, second = entries()[:150], entries()[150:]
    paths = [write(tmp_path / "b", second, "ros1"), write(tmp_path / "a", first, "ros1")]
    with Bag(paths, TYPES) as bag:
        assert [name for name, _, _ in contents(bag)] == [entry.topic for entry in entries()]


def test_a_folder_of_ros_2_needs_no_metadata(tmp_path):
    folder = write(tmp_path / "log", entries(), "sqlite3")
    (folder / METADATA).unlink()
    with Bag([folder], TYPES) as bag:
        assert len(bag.places(set(bag.topics))) == 300


def test_metadata_leads_to_no_file_outside_its_folder(tmp_path):
    secret = write(tmp_path / "secret", entries(), "sqlite3")
    folder = write(tmp_path / "log", entries(3), "sqlite3")
    metadata = folder / METADATA
    text = metadata.read_text().replace("log.db3", f"../secret/{secret.name}.db3")
    metadata.write_text(text)
    with pytest.raises(BagError, match="cannot be read: No such file"):
        Bag([folder], TYPES)


def test_a_block_with_another_checksum_is_not_read(tmp_path):
    path = next(write(tmp_path / "log", entries(), "mcap-zstd").glob("*.mcap"))
    content = bytearray(path.read_bytes())
    position = 8  # after the magic
    while content[position] != 6:  # a chunk
        position += 9 + struct.unpack_from("<Q", content, position + 1)[0]
    struct.pack_into("<I", content, position + 9 + 24, 1)  # CRC-32, after two times and the size
    path.write_bytes(content)
    with Bag([path], TYPES) as bag:
        assert "does not have the checksum" in str(bag.damage)
        assert len(bag.places(set(bag.topics))) == 0


def test_a_type_that_only_has_the_name_of_a_known_one_is_refused(tmp_path):
    path = write(tmp_path / "log", entries(3), "ros1")
    content = path.read_bytes()
    path.write_bytes(
        content.replace(b"md5sum=6a62c6daae103f4ff57a132d6f95cec2", b"md5sum=" + b"0" * 32)
    )
    with Bag([path], TYPES) as bag:
        places = bag.places({"/imu/data"})
        with pytest.raises(DamageError, match="another definition of sensor_msgs/msg/Imu"):
            decode(bag.read(places[0]))


def test_messages_compressed_one_by_one_are_read_without_metadata(tmp_path):
    folder = write(tmp_path / "log", entries(3), "sqlite3-message")
    (folder / METADATA).write_text("")
    with pytest.raises(BagError, match="no section .*; without this file the folder is read"):
        Bag([folder], TYPES)
    (folder / METADATA).unlink()
    with Bag([folder], TYPES) as bag:
        assert decode(bag.read(bag.places({"/odom"})[0])).child_frame_id == "base_link"


def test_a_compressed_message_that_grows_without_bound_is_refused(tmp_path, monkeypatch):
    folder = write(tmp_path / "log", entries(3), "sqlite3-message")
    monkeypatch.setattr("harness.recorded.blocks.LARGEST_MESSAGE", 100)
    with Bag([folder], TYPES) as bag:
        with pytest.raises(DamageError, match="more than 100 bytes"):
            bag.read(bag.places({"/odom"})[0])


def test_files_of_one_log_may_lie_in_a_folder(tmp_path):
    folder = tmp_path / "split"
    folder.mkdir()
    for number, part in enumerate((entries()[:150], entries()[150:])):
        made = write(tmp_path / f"part{number}", part, "mcap")
        shutil.move(next(made.glob("*.mcap")), folder / f"split_{number}.mcap")
    with Bag([folder], TYPES) as bag:
        assert [name for name, _, _ in contents(bag)] == [entry.topic for entry in entries()]


def test_a_file_that_is_given_twice_is_refused(tmp_path):
    path = write(tmp_path / "log", entries(), "ros1")
    link = tmp_path / "link.bag"
    link.symlink_to(path)
    with pytest.raises(BagError, match=r"log.bag' is given twice; give each once"):
        Bag([path, path], TYPES)
    with pytest.raises(BagError, match=r"link.bag' is given twice, also as '.*log.bag'"):
        Bag([path, link], TYPES)


@pytest.mark.parametrize("count", [300, 100])
def test_a_copy_of_a_file_is_refused_also_in_another_format(tmp_path, count):
    paths = [
        write(tmp_path / "log", entries(), "ros1"),
        write(tmp_path / "converted", entries(count), "mcap"),
    ]
    with pytest.raises(BagError, match=rf"hold the same messages \({count} of topic and time"):
        Bag(paths, TYPES)


def test_two_recorders_of_different_topics_may_overlap(tmp_path):
    paths = [
        write(
            tmp_path / kind.rpartition("/")[2],
            [entry for entry in entries() if entry.type == kind],
            "ros1",
        )
        for kind in (ODOMETRY, IMU)
    ]
    with Bag(paths, TYPES) as bag:
        assert len(contents(bag)) == 300
