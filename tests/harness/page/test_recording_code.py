"""Recordings as a page carries them: what the browser gets back, and what is refused."""

import base64
import gzip
import json
import struct
import tracemalloc
import zipfile
from typing import Any

import numpy as np
import pytest

from harness.report.page.recording_code import COARSE, FINE, encode, load_recording
from navstack.errors import InputError

ROW = {"duration_s": 30.0, "start_x_m": -5.0, "start_y_m": 2.0, "goal_x_m": 30.0, "goal_y_m": 40.0}
Arrays = dict[str, Any]


def decoded(text):
    """What the page's script makes of it: an array (columns, n) per field."""
    content = gzip.decompress(base64.b64decode(text))
    (size,) = struct.unpack_from("<I", content)
    position, fields = 4 + size, {}
    for head in json.loads(content[4 : 4 + size]):
        shape = (head["columns"], head["n"])
        steps = np.frombuffer(content, f"<i{head['bytes']}", shape[0] * shape[1], position).reshape(
            shape
        )
        position += steps.nbytes
        first = np.array(head["first"] or [0] * head["columns"]).reshape(-1, 1)
        fields[head["name"]] = (first + steps.cumsum(axis=1)) * np.array(head["scales"])[
            :, np.newaxis
        ]
    assert position == len(content)
    return fields


def test_what_is_decoded_is_what_was_recorded(make_arrays):
    arrays = make_arrays(ROW)
    fields = decoded(encode(arrays, FINE))
    trace = arrays["trace"]
    np.testing.assert_allclose(fields["t"][0], trace[:, 0], atol=6e-4)
    np.testing.assert_allclose(fields["pose"][:2].T, trace[:, 1:3], atol=6e-3)
    np.testing.assert_allclose(fields["belief"][2], np.unwrap(trace[:, 8]), atol=6e-4)
    np.testing.assert_allclose(
        fields["crowd"].T, arrays["crowd"].reshape(len(trace), -1), atol=6e-3
    )
    np.testing.assert_array_equal(fields["lost"][0], arrays["pieces_lost"])
    np.testing.assert_allclose(fields["tracks"][1:].T, arrays["tracks"][:, 1:5], atol=6e-3)
    scans = arrays["scan_mm"] / 1000.0
    scans[:, 0] = 0.0
    np.testing.assert_allclose(fields["scan"], scans, atol=0.011)
    assert fields["planSize"].sum() == fields["plan"].shape[1]
    np.testing.assert_array_equal(fields["optionSize"][0], arrays["option_size"])
    np.testing.assert_array_equal(fields["optionTotal"][0], arrays["option_total"])
    np.testing.assert_allclose(fields["options"].T, arrays["option_xy"], atol=6e-3)


def test_a_recording_without_options_has_none(make_arrays, tmp_path):
    arrays = {
        name: array for name, array in make_arrays(ROW).items() if not name.startswith("option")
    }
    np.savez_compressed(tmp_path / "r.npz", **arrays)
    found = load_recording(tmp_path / "r.npz")
    assert found["option_count"].tolist() == [0] * len(arrays["trace"])
    assert decoded(encode(found, FINE))["options"].shape == (2, 0)


def test_coarse_scans_keep_their_angles(make_arrays):
    arrays = make_arrays(ROW)
    fields = decoded(encode(arrays, COARSE))
    assert fields["scan"].shape == (-(-len(arrays["scan_mm"]) // 2), 18)
    assert fields["scanGeometry"][0, 1] == pytest.approx(2.0 * arrays["scan_geometry"][1], abs=1e-6)


def test_a_heading_does_not_jump_and_nobody_is_far_away(make_arrays):
    arrays = make_arrays(ROW)
    arrays["trace"][:, 3] = np.linspace(3.0, 3.4, len(arrays["trace"])) % (2 * np.pi)
    arrays["trace"][:, 3][arrays["trace"][:, 3] > np.pi] -= 2 * np.pi
    arrays["crowd"][:50, 0] = np.nan
    fields = decoded(encode(arrays, FINE))
    assert np.abs(np.diff(fields["pose"][2])).max() < 0.01
    assert fields["crowd"][0, 0] > 1e4
    np.testing.assert_allclose(fields["crowd"][0, 50:], arrays["crowd"][50:, 0, 0], atol=6e-3)


def test_a_robot_that_does_not_localize_has_no_belief(make_arrays):
    arrays = make_arrays(ROW)
    arrays["trace"][:, 6:9] = np.nan
    assert "belief" not in decoded(encode(arrays, FINE))


def test_a_belief_that_begins_later_is_absent_until_then(make_arrays):
    arrays = make_arrays(ROW)
    arrays["trace"][:20, 6:9] = np.nan
    believed = decoded(encode(arrays, FINE))["belief"]
    assert (believed[0, :20] > 5e4).all(), "the page takes it for none"
    np.testing.assert_allclose(believed[:2, 20:].T, arrays["trace"][20:, 6:8], atol=6e-3)
    np.testing.assert_allclose(believed[2, 20:], np.unwrap(arrays["trace"][20:, 8]), atol=6e-4)


def test_a_long_recording_takes_little_memory(make_arrays):
    arrays = make_arrays({**ROW, "duration_s": 600.0}, beams=1000)
    tracemalloc.start()
    encode(arrays, FINE)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 8 * arrays["scan_mm"].nbytes


def test_an_array_larger_than_any_memory_is_refused(make_arrays, tmp_path):
    np.savez_compressed(
        tmp_path / "r.npz", **{k: v for k, v in make_arrays(ROW).items() if k != "trace"}
    )
    head = b"{'descr': '<f8', 'fortran_order': False, 'shape': (4000000000000, 11), }"
    size = 118
    with zipfile.ZipFile(tmp_path / "r.npz", "a") as archive:
        archive.writestr(
            "trace.npy",
            b"\x93NUMPY\x01\x00" + struct.pack("<H", size) + head.ljust(size - 1) + b"\n",
        )
    with pytest.raises(InputError, match="is damaged"):
        load_recording(tmp_path / "r.npz")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            lambda arrays: arrays.pop("crowd"),
            "is no recording of a delivery, or an older one: it lacks crowd",
        ),
        (lambda arrays: arrays.update(trace=arrays["trace"][:, :5]), "do not match"),
        (
            lambda arrays: arrays.update(trace=np.full_like(arrays["trace"], np.nan)),
            "no sound trajectory",
        ),
        (lambda arrays: arrays.update(crowd=arrays["crowd"][1:]), "do not match"),
        (lambda arrays: arrays.update(track_count=arrays["track_count"] * 2), "do not match"),
        (lambda arrays: arrays.update(plan_size=arrays["plan_size"][1:]), "do not match"),
        (lambda arrays: arrays.update(crowd=np.array(["x"])), "something else than numbers"),
        (lambda arrays: arrays.pop("scan_mm"), "lacks scan_mm"),
        (lambda arrays: arrays.update(trace=arrays["trace"][::-1]), "has no sound trajectory"),
        (lambda arrays: arrays.update(pieces_lost=np.array(3)), "do not match"),
        (
            lambda arrays: arrays.update(scan_stamp=np.full(len(arrays["trace"]), np.nan)),
            "do not match",
        ),
        (lambda arrays: arrays.update(plan_size=arrays["plan_size"] * 1.0), "do not match"),
        (lambda arrays: arrays.update(track_count=arrays["track_count"] - 2), "do not match"),
        (
            lambda arrays: arrays.update(plan_xy=np.full_like(arrays["plan_xy"], np.inf)),
            "do not match",
        ),
    ],
)
def test_a_damaged_recording_is_refused(make_arrays, tmp_path, change, said):
    arrays = make_arrays(ROW)
    change(arrays)
    np.savez_compressed(tmp_path / "r.npz", **arrays)
    with pytest.raises(InputError, match=said):
        load_recording(tmp_path / "r.npz")


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04" + bytes(40), b"no archive at all"])
def test_what_is_no_archive_is_refused(tmp_path, content):
    (tmp_path / "r.npz").write_bytes(content)
    with pytest.raises(InputError, match="is damaged"):
        load_recording(tmp_path / "r.npz")
