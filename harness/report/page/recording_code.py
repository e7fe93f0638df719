"""Recordings as a page carries them: whole numbers, differences along time, gzip, base64.

A recording becomes a list of fields. Each is an array (columns, n) of whole numbers times a scale,
stored as the first entry of every column and the differences after it, in the smallest of Int8,
Int16 and Int32 that holds them. The bytes are the length of the JSON head (4 bytes, little-endian),
the head, and the fields' numbers one after the other, all little-endian, gzipped;
``replay_code.js`` reads them.
"""

import base64
import gzip
import json
import struct
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from harness.metrics.replay_log import NO_RETURN, simplified
from harness.storage.files import BROKEN
from navstack.errors import InputError
from navstack.files import check_regular
from navstack.types import FloatArray

CENTIMETRE, MILLIRADIAN = 0.01, 0.001
FAR = 1e7  # scaled numbers are cut off here: whoever is absent stands there
MOST_BYTES = 100_000_000  # of a recording, packed or not; an hour of driving has some 40 MB
PLAN_TOLERANCE = 0.05  # [m] of a plan on a page
# of the arrays of a recording; equal words are equal lengths
SHAPES: dict[str, tuple[int | str, ...]] = {
    "trace": ("rows", 11),
    "crowd": ("rows", "people", 2),
    "pieces_lost": ("rows",),
    "odometry": ("rows", 5),
    "belief_covariance": ("rows", 3),
    "motion_energy_j": ("rows",),
    "track_count": ("rows",),
    "tracks": ("tracks", 6),
    "scan_stamp": ("scans",),
    "scan_mm": ("scans", "beams"),
    "scan_geometry": (7,),
    "plan_stamp": ("plans",),
    "plan_size": ("plans",),
    "plan_xy": ("corners", 2),
    "option_count": ("rows",),
    "option_total": ("options",),
    "option_size": ("options",),
    "option_xy": ("ways", 2),
}
FINITE = ("scan_geometry", "plan_xy", "option_xy")
# Those of them that hold whole numbers from 0 on.
WHOLE = ("pieces_lost", "scan_mm", *(name for name in SHAPES if name.endswith(("_count", "_size"))))


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
            arrays = {name: file[name] for name in SHAPES if name in file}
            if "option_count" not in arrays:  # made before options were kept
                arrays |= _without_options(len(np.atleast_1d(arrays.get("trace", ()))))
    except BROKEN as error:  # an array that says it is larger than any memory
        raise InputError(
            f"{path}: is damaged ({error}); make the run again with --record full"
        ) from None
    trouble = _trouble_with(arrays)
    if trouble:
        raise InputError(f"{path}: {trouble}; make the run again with --record full")
    return arrays


def _without_options(rows: int) -> dict[str, Any]:
    none = np.zeros(0, dtype=np.int32)
    return {
        "option_count": np.zeros(rows, dtype=np.int32),
        "option_size": none,
        "option_total": none,
        "option_xy": np.empty((0, 2)),
    }


def _trouble_with(arrays: Mapping[str, Any]) -> str:
    """Why arrays are no recording; empty: they are one."""
    missing = [name for name in SHAPES if name not in arrays]
    if missing:
        return f"is no recording of a delivery, or an older one: it lacks {missing[0]}"
    if any(array.dtype.kind not in "iuf" for array in arrays.values()):
        return "holds something else than numbers"
    if not _match(arrays):
        return "is damaged: its arrays do not match"
    trace = arrays["trace"]
    if len(trace) < 2 or not np.isfinite(trace[:, :6]).all() or not _is_rising(trace[:, 0]):
        return "has no sound trajectory"
    return ""


def _match(arrays: Mapping[str, Any]) -> bool:
    """Whether the arrays fit together."""
    return (
        _have_declared_shapes(arrays)
        and all(_are_counts(arrays[name]) for name in WHOLE)
        and _add_up(arrays["track_count"], arrays["tracks"])
        and _add_up(arrays["plan_size"], arrays["plan_xy"])
        and _add_up(arrays["option_count"], arrays["option_size"])
        and _add_up(arrays["option_size"], arrays["option_xy"])
        and _is_rising(arrays["scan_stamp"])
        and _is_rising(arrays["plan_stamp"])
        and all(np.isfinite(arrays[name]).all() for name in FINITE)
    )


def _have_declared_shapes(arrays: Mapping[str, Any]) -> bool:
    """Whether lengths that are declared by number are so, and those of one name are equal."""
    lengths: dict[int | str, int] = {}
    for name, shape in SHAPES.items():
        if arrays[name].ndim != len(shape):
            return False
        for declared, actual in zip(shape, arrays[name].shape, strict=True):
            if isinstance(declared, int):
                lengths[declared] = declared
            elif declared not in lengths:
                lengths[declared] = actual
            if lengths[declared] != actual:
                return False
    return True


def _are_counts(numbers: npt.NDArray[Any]) -> bool:
    """Whether all are whole numbers from 0 on."""
    return numbers.dtype.kind in "iu" and bool((numbers >= 0).all())


def _add_up(sizes: npt.NDArray[Any], parts: npt.NDArray[Any]) -> bool:
    """Whether parts of these sizes make up the whole; a single one may not wrap the sum around."""
    return bool((sizes <= len(parts)).all()) and int(sizes.sum()) == len(parts)


def _is_rising(stamps: FloatArray) -> bool:
    """Whether stamps (n,) [s] are finite and never decrease."""
    return bool(np.isfinite(stamps).all() and (np.diff(stamps) >= 0.0).all())


def encode(arrays: Mapping[str, Any], fineness: Fineness) -> str:
    """A recording as text; see the module."""
    trace, plans, geometry = arrays["trace"], _plans(arrays), arrays["scan_geometry"]
    pose = (CENTIMETRE, CENTIMETRE, MILLIRADIAN)
    every, beam = fineness.every_scan, fineness.every_beam
    ranges = arrays["scan_mm"][::every, ::beam]
    fields = [
        _field("t", trace[:, 0], 0.001),
        _field("pose", _with_yaw(trace[:, 1:4]), pose),
        # speed, yaw rate, and both as commanded
        _field("motion", trace[:, (4, 5, 9, 10)], CENTIMETRE),
        _field("crowd", arrays["crowd"].reshape(len(trace), -1), CENTIMETRE),
        _field("lost", arrays["pieces_lost"], 1.0),
        _field("energy", arrays["motion_energy_j"], 1.0),
        _field("covariance", arrays["belief_covariance"], 1e-4),
        _field("trackCount", arrays["track_count"], 1.0),
        _field("tracks", arrays["tracks"][:, :5], (1.0, *(CENTIMETRE,) * 4)),
        _field("planStamp", arrays["plan_stamp"], 0.001),
        _field("planSize", np.array([len(plan) for plan in plans]), 1.0),
        _field("plan", np.concatenate(plans) if plans else np.empty((0, 2)), CENTIMETRE),
        _field("optionCount", arrays["option_count"], 1.0),
        _field("optionSize", arrays["option_size"], 1.0),
        _field("optionTotal", arrays["option_total"], 0.001),
        _field("options", arrays["option_xy"], CENTIMETRE),
        _field("scanStamp", arrays["scan_stamp"][::every], 0.001),
        _field("scanGeometry", geometry * (1, beam, 1, 1, 1, 1, 1), 1e-6),
        # [mm] scan by scan, beam after beam
        _field("scan", np.where(ranges == NO_RETURN, 0, ranges).T, fineness.range_step, unit=0.001),
    ]
    if not np.isnan(trace[:, 6:9]).all():
        fields.append(_field("belief", _with_yaw(trace[:, 6:9]), pose))  # FAR where it has none
    head = json.dumps([head for head, _ in fields], separators=(",", ":")).encode()
    content = b"".join((struct.pack("<I", len(head)), head, *(body for _, body in fields)))
    return base64.b64encode(gzip.compress(content, 9, mtime=0)).decode()


def _plans(arrays: Mapping[str, Any]) -> list[FloatArray]:
    """Corners (n, 2) of each plan [m], as few as tell it."""
    corners = np.split(arrays["plan_xy"].astype(np.float64), np.cumsum(arrays["plan_size"])[:-1])
    return [simplified(plan, PLAN_TOLERANCE) for plan in corners]


def _with_yaw(poses: FloatArray) -> FloatArray:
    """Poses (T, 3) whose yaw does not jump from pi to -pi; rows with NaN stay as they are."""
    known = ~np.isnan(poses).any(axis=1)
    yaws = np.full(len(poses), np.nan)
    yaws[known] = np.unwrap(poses[known, 2])
    return np.column_stack((poses[:, :2], yaws))


def _field(
    name: str,
    values: Any,
    scale: float | tuple[float, ...],
    unit: float = 1.0,
) -> tuple[dict[str, Any], bytes]:
    """Head and numbers of an array (n,) or (n, columns) of ``unit``, in steps of ``scale``."""
    table = np.asarray(values)
    if table.ndim == 1:
        table = table[:, np.newaxis]
    scales = _tuple(scale)
    if len(scales) == 1:
        scales *= table.shape[1]
    first: list[int] = []
    steps: npt.NDArray[np.int32] = np.zeros(table.T.shape, dtype=np.int32)
    # one at a time: scans are large
    for column, own, step in zip(table.T, steps, scales, strict=True):
        scaled = np.nan_to_num(column.astype(np.float64) * (unit / step), nan=FAR)
        whole = np.rint(np.clip(scaled, -FAR, FAR)).astype(np.int32)
        first += whole[:1].tolist()
        own[1:] = np.diff(whole)
    largest = 0
    if steps.size:
        largest = max(int(steps.max()), -int(steps.min()))
    # bytes of the smallest number that holds them all
    if largest < 2**7:
        size = 1
    elif largest < 2**15:
        size = 2
    else:
        size = 4
    head = {
        "name": name,
        "columns": steps.shape[0],
        "n": steps.shape[1],
        "bytes": size,
        "first": first,
    }
    return {**head, "scales": _tuple(scale)}, steps.astype(f"<i{size}").tobytes()


def _tuple(scale: float | tuple[float, ...]) -> tuple[float, ...]:
    if isinstance(scale, tuple):
        return scale
    return (scale,)
