"""Recordings as a page carries them: whole numbers, differences along time, gzip, base64.

A recording becomes a list of fields. Each is an array (columns, n) of whole numbers times a scale, stored as the first
entry of every column and the differences after it, in the smallest of Int8, Int16 and Int32 that holds them. The bytes
are the length of the JSON head (4 bytes, little-endian), the head, and the fields' numbers one after the other, all
little-endian, gzipped; ``replay_code.js`` reads them.
"""

import base64
import gzip
import json
import struct
import zipfile
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from harness.metrics.replay_log import NO_RETURN
from navstack.errors import InputError
from navstack.files import check_regular
from navstack.types import FloatArray, IntArray

CENTIMETRE, MILLIRADIAN = 0.01, 0.001
FAR = 1e7  # scaled numbers are cut off here: whoever is absent stands there
MOST_BYTES = 1_000_000_000  # of a recording, packed or not; an hour of driving has some 40 MB
PLAN_TOLERANCE = 0.05  # [m] of a plan on a page
NEEDED = ("trace", "crowd")  # arrays that every recording has
SEEN = (
    *("pieces_lost", "belief_covariance", "track_count", "tracks", "scan_stamp", "scan_mm", "scan_geometry"),
    *("plan_stamp", "plan_size", "plan_xy", "odometry", "motion_energy_j"),
)  # those of newer ones


@dataclass(frozen=True, slots=True)
class Fineness:
    """How much of the scans a page keeps."""

    every_scan: int
    every_beam: int
    range_step: float  # [m]


COARSE = Fineness(every_scan=2, every_beam=2, range_step=0.05)  # where many replays share a page
FINE = Fineness(every_scan=1, every_beam=1, range_step=0.02)


def load_recording(path: Path) -> dict[str, Any]:
    """The arrays of a recording.

    Raises:
        InputError: it is damaged, or lacks what a replay needs.
    """
    try:
        check_regular(path, MOST_BYTES)
        with zipfile.ZipFile(path) as archive:
            unpacked = sum(entry.file_size for entry in archive.infolist())
        if unpacked > MOST_BYTES:
            raise InputError(f"{path}: unpacks to {unpacked} bytes; at most {MOST_BYTES} are read")
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in (*NEEDED, *SEEN) if name in file}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile, zlib.error, NotImplementedError) as error:
        raise InputError(f"{path}: is damaged ({error}); make the run again with --record full") from None
    trouble = _trouble_with(arrays)
    if trouble:
        raise InputError(f"{path}: {trouble}; make the run again with --record full")
    return arrays


def _trouble_with(arrays: Mapping[str, Any]) -> str:
    """Why arrays are no recording; empty: they are one."""
    if any(name not in arrays for name in NEEDED):
        return "is no recording of a delivery"
    if any(array.dtype.kind not in "iuf" for array in arrays.values()):
        return "holds something else than numbers"
    trace, crowd = arrays["trace"], arrays["crowd"]
    if trace.ndim != 2 or trace.shape[1] != 11 or len(trace) < 2 or not np.isfinite(trace[:, :6]).all():
        return "has no sound trajectory"
    if crowd.ndim != 3 or len(crowd) != len(trace) or crowd.shape[2] != 2:
        return "is damaged: people and robot do not match"
    missing = [name for name in SEEN if name not in arrays]
    if not missing and not _match(arrays):
        return "is damaged: its arrays do not match"
    return "" if not missing or len(missing) == len(SEEN) else f"is damaged: it lacks {missing[0]}"


def _match(arrays: Mapping[str, Any]) -> bool:
    """Whether what the robot saw and meant fits together."""
    rows = len(arrays["trace"])
    of_rows = ("pieces_lost", "belief_covariance", "track_count", "odometry", "motion_energy_j")
    sound = all(len(arrays[name]) == rows for name in of_rows) and arrays["tracks"].shape[1:] == (6,)
    sound = sound and arrays["scan_mm"].ndim == 2 and len(arrays["scan_mm"]) == len(arrays["scan_stamp"])
    sound = sound and arrays["plan_xy"].shape[1:] == (2,) and len(arrays["plan_size"]) == len(arrays["plan_stamp"])
    sound = sound and arrays["odometry"].shape[1:] == (5,) and arrays["belief_covariance"].shape[1:] == (3,)
    counts = ((arrays["track_count"], arrays["tracks"]), (arrays["plan_size"], arrays["plan_xy"]))
    return sound and arrays["scan_geometry"].shape == (7,) and all(sizes.sum() == len(what) for sizes, what in counts)


def encode(arrays: Mapping[str, Any], fineness: Fineness) -> str:
    """A recording as text; see the module."""
    fields = _Fields()
    trace = arrays["trace"]
    fields.add("t", trace[:, 0], 0.001)
    fields.add("pose", _with_yaw(trace[:, 1:4]), CENTIMETRE, yaw_column=2)
    fields.add("motion", trace[:, (4, 5, 9, 10)], CENTIMETRE)  # speed, yaw rate, and both as commanded
    if not np.isnan(trace[:, 6:9]).any():
        fields.add("belief", _with_yaw(trace[:, 6:9]), CENTIMETRE, yaw_column=2)
    fields.add("crowd", arrays["crowd"].reshape(len(trace), -1), CENTIMETRE)
    if "pieces_lost" in arrays:
        _add_seen(fields, arrays, fineness)
    return base64.b64encode(gzip.compress(fields.content(), 9, mtime=0)).decode()


def _add_seen(fields: "_Fields", arrays: Mapping[str, Any], fineness: Fineness) -> None:
    fields.add("lost", arrays["pieces_lost"], 1.0)
    fields.add("energy", arrays["motion_energy_j"], 1.0)
    fields.add("covariance", arrays["belief_covariance"], 1e-4)
    fields.add("trackCount", arrays["track_count"], 1.0)
    fields.add("tracks", arrays["tracks"][:, :5], CENTIMETRE, whole_column=0)
    stamps, plans = arrays["plan_stamp"], _plans(arrays)
    fields.add("planStamp", stamps, 0.001)
    fields.add("planSize", np.array([len(plan) for plan in plans]), 1.0)
    fields.add("plan", np.concatenate(plans) if plans else np.empty((0, 2)), CENTIMETRE)
    every, beam, step = fineness.every_scan, fineness.every_beam, fineness.range_step
    geometry = arrays["scan_geometry"]
    ranges = arrays["scan_mm"][::every, ::beam]
    fields.add("scanStamp", arrays["scan_stamp"][::every], 0.001)
    fields.add("scanGeometry", geometry * (1, beam, 1, 1, 1, 1, 1), 1e-6)
    fields.add("scan", np.where(ranges == NO_RETURN, 0.0, ranges / 1000.0).T, step)  # scan by scan, beam after beam


def _plans(arrays: Mapping[str, Any]) -> list[FloatArray]:
    """Corners (n, 2) of each plan [m], as few as tell it."""
    corners = np.split(arrays["plan_xy"].astype(np.float64), np.cumsum(arrays["plan_size"])[:-1])
    return [
        shapely.get_coordinates(shapely.simplify(shapely.linestrings(plan), PLAN_TOLERANCE, preserve_topology=False))
        if len(plan) > 2
        else plan
        for plan in corners
    ]


def _with_yaw(poses: FloatArray) -> FloatArray:
    """Poses (T, 3) whose yaw does not jump from pi to -pi."""
    return np.column_stack((poses[:, :2], np.unwrap(poses[:, 2])))


class _Fields:
    """Fields on their way into bytes."""

    def __init__(self) -> None:
        self._heads: list[dict[str, Any]] = []
        self._bodies: list[bytes] = []

    def add(
        self, name: str, values: Any, scale: float, yaw_column: int | None = None, whole_column: int | None = None
    ) -> None:
        """Take in an array (n,) or (n, columns) in steps of ``scale``; one column may be an angle, one a number."""
        table = np.asarray(values, dtype=np.float64)
        table = table[:, np.newaxis] if table.ndim == 1 else table
        scales = np.full(table.shape[1], scale)
        if yaw_column is not None:
            scales[yaw_column] = MILLIRADIAN
        if whole_column is not None:
            scales[whole_column] = 1.0
        whole = np.rint(np.clip(np.nan_to_num(table / scales, nan=FAR), -FAR, FAR)).astype(np.int64).T
        first = whole[:, :1]
        steps = np.diff(whole, axis=1, prepend=first) if whole.shape[1] else whole
        kind = _smallest(steps)
        body = np.ascontiguousarray(steps, dtype=f"<i{kind}").tobytes()
        self._heads.append(
            {
                "name": name,
                "columns": whole.shape[0],
                "n": whole.shape[1],
                "bytes": kind,
                "scales": scales.tolist() if len(set(scales.tolist())) > 1 else [scale],
                "first": first.ravel().tolist(),
            }
        )
        self._bodies.append(body)

    def content(self) -> bytes:
        """All of it."""
        head = json.dumps(self._heads, separators=(",", ":")).encode()
        return b"".join((struct.pack("<I", len(head)), head, *self._bodies))


def _smallest(steps: IntArray) -> int:
    """Bytes of the smallest whole number that holds them all."""
    largest = int(np.abs(steps).max()) if steps.size else 0
    return 1 if largest < 2**7 else 2 if largest < 2**15 else 4
