import io
import multiprocessing
import os
import sys
import tempfile
import zlib
from pathlib import Path

import numpy as np
import pytest

from navstack.costmap import field_cache
from navstack.costmap.field_cache import (
    cache_folder,
    cached_array,
    content_key,
    give_back,
    passing_map,
)


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("NAVSTACK_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_a_user_without_a_folder_has_one_for_temporary_files(monkeypatch):
    monkeypatch.delenv("NAVSTACK_CACHE", raising=False)
    monkeypatch.setattr(os.path, "expanduser", lambda name: name)  # as of a user without a name
    assert cache_folder() == Path(tempfile.gettempdir()) / f"navbench-{os.getuid()}"


class Source:
    """Computes an array and counts how often."""

    def __init__(self, array):
        self.array = array
        self.calls = 0

    def __call__(self):
        self.calls += 1
        return self.array


@pytest.mark.parametrize("dtype", [np.uint8, np.float32, np.int64, np.bool_])
def test_the_second_time_comes_from_disk(folder, dtype):
    source = Source(np.arange(12).reshape(3, 4).astype(dtype).T)
    first, second = cached_array("key", source), cached_array("key", source)
    assert source.calls == 1
    for array in (first, second):
        assert array.dtype == dtype and array.flags.c_contiguous and array.flags.writeable
        assert np.array_equal(array, source.array)
    assert len(list(folder.iterdir())) == 1  # nothing half-written stays behind


def test_fields_of_a_map_that_is_left_soon_are_not_kept(folder):
    source, lasting = Source(np.arange(3)), Source(np.arange(4))
    with passing_map():
        assert cached_array("key", source).tolist() == [0, 1, 2]
        assert not folder.exists()
        cached_array("heap", lasting, is_of_map=False)
        cached_array("heap", lasting, is_of_map=False)
    cached_array("key", source)
    assert (source.calls, lasting.calls) == (2, 1)
    assert len(list(folder.iterdir())) == 2


def test_other_keys_are_other_arrays(folder):
    cached_array("a", Source(np.zeros(2)))
    assert cached_array(b"b", Source(np.ones(2))).tolist() == [1.0, 1.0]


def test_any_damaged_byte_or_cut_leads_to_the_right_array(folder):
    source = Source(np.arange(50, dtype=np.uint8))
    cached_array("key", source)
    (file,) = folder.iterdir()
    intact = file.read_bytes()
    damaged = [intact[:n] for n in range(0, len(intact), 7)]
    damaged += [
        intact[:n] + bytes([intact[n] ^ 0xFF]) + intact[n + 1 :] for n in range(len(intact))
    ]
    for content in damaged:
        file.write_bytes(content)
        assert np.array_equal(cached_array("key", source), source.array)
    file.write_bytes(b"\x80\x04pickled?")
    calls = source.calls
    cached_array("key", source)
    assert source.calls == calls + 1
    cached_array("key", source)
    assert source.calls == calls + 1  # the damaged file was replaced


def test_a_whole_file_with_columns_first_is_none_of_ours(folder):
    source = Source(np.arange(6.0).reshape(2, 3))
    cached_array("key", source)
    (file,) = folder.iterdir()
    stream = io.BytesIO()
    np.save(stream, np.asfortranarray(source.array))
    content = stream.getvalue()
    file.write_bytes(
        content + zlib.crc32(content).to_bytes(len(file.read_bytes()) - len(content), "little")
    )
    assert np.array_equal(cached_array("key", source), source.array)
    assert source.calls == 2


def test_a_folder_that_cannot_be_written_is_no_error(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("not a folder")
    monkeypatch.setenv("NAVSTACK_CACHE", str(blocked))
    source = Source(np.ones(3))
    assert (
        cached_array("key", source).tolist()
        == cached_array("key", source).tolist()
        == [1.0, 1.0, 1.0]
    )
    assert source.calls == 2


def test_a_folder_that_can_only_be_read_is_no_error(folder, monkeypatch):
    source = Source(np.arange(4.0))
    cached_array("known", source)

    def refuse(*_arguments, **_names):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(field_cache.tempfile, "NamedTemporaryFile", refuse)
    monkeypatch.setattr(field_cache.os, "utime", refuse)
    assert cached_array("known", source).tolist() == [0.0, 1.0, 2.0, 3.0] and source.calls == 1
    for _ in range(2):
        assert cached_array("new", source).tolist() == [0.0, 1.0, 2.0, 3.0]
    assert source.calls == 3 and len(list(folder.iterdir())) == 1


@pytest.mark.skipif(
    not Path("/dev/full").exists(), reason="no /dev/full here to stand for a full disk"
)
def test_a_full_disk_is_no_error_and_leaves_nothing_behind(folder, monkeypatch, capfd):
    real = field_cache.tempfile.NamedTemporaryFile

    def on_full_disk(*arguments, **names):
        stream = real(*arguments, **names)
        os.dup2(os.open("/dev/full", os.O_WRONLY), stream.fileno())
        return stream

    monkeypatch.setattr(field_cache.tempfile, "NamedTemporaryFile", on_full_disk)
    source = Source(np.ones(1000))
    for calls in (1, 2):
        assert np.array_equal(cached_array("key", source), source.array) and source.calls == calls
    assert list(folder.iterdir()) == [] and capfd.readouterr() == ("", "")


def test_who_writes_to_an_array_leaves_that_of_others_alone(folder):
    source = Source(np.zeros(5000))
    mine, yours = cached_array("key", source), cached_array("key", source)
    mine[:] = 7.0
    assert not yours.any() and not cached_array("key", source).any() and source.calls == 1


@pytest.mark.skipif(
    sys.platform != "linux", reason="elsewhere pages that were written to stay as they are"
)
def test_an_array_given_back_is_what_it_was(folder):
    array = cached_array("key", Source(np.arange(5000)))
    array[:] = 7
    assert give_back(array.reshape(50, 100)) and np.array_equal(array, np.arange(5000))
    array[0] = 7
    assert np.array_equal(cached_array("key", Source(array)), np.arange(5000))


def test_an_array_that_is_not_of_the_cache_stays(folder):
    array = np.full(5000, 7)
    assert not give_back(array) and (array == 7).all()


def test_arrays_are_mapped_and_outlive_their_file(folder):
    array = cached_array("key", Source(np.arange(100_000)))
    (file,) = folder.iterdir()
    assert str(file) in Path("/proc/self/maps").read_text() or not Path("/proc/self/maps").exists()
    file.unlink()
    assert array[-1] == 99_999


def test_the_arrays_used_last_are_kept(folder, monkeypatch):
    sources = {name: Source(np.full(1000, k, dtype=np.uint8)) for k, name in enumerate("abc")}
    for age, name in enumerate("ab"):
        cached_array(name, sources[name])
        for file in folder.iterdir():
            os.utime(file, (age, age))
    cached_array("a", sources["a"])  # now used after b
    monkeypatch.setattr(field_cache, "MOST_BYTES", 2500)
    cached_array("c", sources["c"])
    assert len(list(folder.iterdir())) == 2
    for name in "acb":
        cached_array(name, sources[name])
    assert [source.calls for source in sources.values()] == [1, 2, 1]


def test_only_files_of_the_cache_make_room(folder, monkeypatch):
    folder.mkdir(parents=True)
    left_over = folder / f"{40 * 'a'}-x1_.partial"  # of a process that was killed
    others = [folder / "my_map.npy", folder / "results.npz", folder / "other.partial"]
    for file in (left_over, *others):
        file.write_bytes(bytes(5000))
        os.utime(file, (1, 1))
    monkeypatch.setattr(field_cache, "MOST_BYTES", 2500)
    cached_array("key", Source(np.ones(10)))
    assert not left_over.exists() and all(file.exists() for file in others)
    assert len(list(folder.iterdir())) == len(others) + 1


def _total(seed):
    """What a process of its own makes of a shared array."""
    return (
        int(
            cached_array(
                "shared", lambda: np.random.default_rng(1).integers(1000, size=200_000)
            ).sum()
        )
        + seed
    )


def test_many_processes_start_at_once(folder):
    with multiprocessing.get_context("spawn").Pool(4) as pool:
        totals = pool.map(_total, range(8), chunksize=1)
    expected = int(np.random.default_rng(1).integers(1000, size=200_000).sum())
    assert totals == [expected + seed for seed in range(8)]
    assert len(list(folder.iterdir())) == 1


def test_errors_of_the_computation_are_passed_on(folder):
    with pytest.raises(ZeroDivisionError):
        cached_array("key", lambda: np.ones(1) * (1 // 0))


def test_keys_change_with_everything_that_goes_in():
    grid = np.arange(6, dtype=np.int8)
    keys = {
        content_key("field 1", grid, 0.05),
        content_key("field 2", grid, 0.05),
        content_key("field 1", grid, 0.1),
        content_key("field 1", grid.reshape(2, 3), 0.05),
        content_key("field 1", grid.astype(np.uint8), 0.05),
        content_key("field 1", grid[::-1], 0.05),
    }
    assert len(keys) == 6
    assert content_key("field 1", grid.copy(), 0.05) in keys


def test_the_default_folder_is_in_the_users_cache(monkeypatch):
    monkeypatch.delenv("NAVSTACK_CACHE", raising=False)
    monkeypatch.setenv("HOME", "/home/somebody")
    assert str(cache_folder()) == "/home/somebody/.cache/navbench"
