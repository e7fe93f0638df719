"""Recordings of deliveries that somebody else made, or damaged."""

import io
import struct
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from .case import Case, Make, pipe
from .runs import copy_of

ROWS, BEAMS = 50, 20
Arrays = dict[str, Any]
CHANGES: dict[str, Callable[[Arrays], object]] = {
    "has numbers of another kind": lambda arrays: arrays.update(trace=np.full((ROWS, 11), "x")),
    "has objects": lambda arrays: arrays.update(crowd=np.array([{"a": 1}] * ROWS, dtype=object)),
    "has one number for many": lambda arrays: arrays.update(pieces_lost=np.array(3)),
    "has a scan's time without dimension": lambda arrays: arrays.update(scan_stamp=np.array(3.0)),
    "has sizes that are no whole numbers": lambda arrays: arrays.update(
        plan_size=np.array([2.5, 1.5])
    ),
    "has sizes below zero": lambda arrays: arrays.update(plan_size=np.array([-4, 8])),
    "has sizes whose sum overflows": lambda arrays: arrays.update(
        plan_size=np.array([2**63 - 1, 2**63 - 1, 6])
    ),
    "runs backwards": lambda arrays: arrays.update(trace=arrays["trace"][::-1]),
    "has times that are no numbers": lambda arrays: arrays.update(plan_stamp=np.full(2, np.nan)),
    "has plans to infinity": lambda arrays: arrays.update(plan_xy=np.full((4, 2), np.inf)),
    "has other lengths": lambda arrays: arrays.update(odometry=np.zeros((ROWS + 1, 5))),
    "has no rows": lambda arrays: arrays.update(trace=np.zeros((0, 11)), crowd=np.zeros((0, 1, 2))),
}


def valid() -> Arrays:
    """A robot that stands for five seconds."""
    trace = np.zeros((ROWS, 11))
    trace[:, 0] = 0.1 * np.arange(ROWS)
    return {
        "trace": trace,
        "crowd": np.zeros((ROWS, 1, 2)),
        "pieces_lost": np.zeros(ROWS, dtype=np.int32),
        "motion_energy_j": np.zeros(ROWS),
        "odometry": np.zeros((ROWS, 5)),
        "belief_covariance": np.zeros((ROWS, 3)),
        "track_count": np.zeros(ROWS, dtype=np.int32),
        "tracks": np.zeros((0, 6)),
        "scan_stamp": trace[:, 0],
        "scan_mm": np.full((ROWS, BEAMS), 5000, dtype=np.uint16),
        "scan_geometry": np.array((0.0, 0.1, 0.1, 12.0, 0.0, 0.0, 0.0)),
        "plan_stamp": np.array((0.0, 1.0)),
        "plan_size": np.array((2, 2)),
        "plan_xy": np.zeros((4, 2)),
    }


def cases() -> Iterator[Case]:
    """Recordings to replay."""
    for what, change in CHANGES.items():
        yield Case(f"recording: {what}", "parked-0.npz", _replayed(_changed(change)))
    for what, write in {
        "is empty": lambda path: path.write_bytes(b""),
        "is no archive": lambda path: path.write_bytes(b"PK\x03\x04" + bytes(90)),
        "is cut off": lambda path: path.write_bytes(_saved(valid())[:3000]),
        "has an array of 350 TB": _with_vast_array,
        "unpacks to 300 MB": _that_unpacks,
    }.items():
        yield Case(f"recording: {what}", "parked-0.npz", _replayed(write))
    yield Case("recording: is a pipe", "parked-0.npz", _replayed(pipe))


def _saved(arrays: Arrays) -> bytes:
    content = io.BytesIO()
    np.savez_compressed(content, **arrays)
    return content.getvalue()


def _changed(change: Callable[[Arrays], object]) -> Callable[[Path], object]:
    def write(path: Path) -> None:
        arrays = valid()
        change(arrays)
        path.write_bytes(_saved(arrays))

    return write


def _with_vast_array(path: Path) -> None:
    """An array of which only the head is there."""
    path.write_bytes(_saved({name: array for name, array in valid().items() if name != "trace"}))
    head = (
        b"{'descr': '<f8', 'fortran_order': False, 'shape': (4000000000000, 11), }".ljust(117)
        + b"\n"
    )
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("trace.npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head)


def _that_unpacks(path: Path) -> None:
    """A small file of 300 MB."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        with archive.open("trace.npy", "w") as stream:
            for _ in range(300):
                stream.write(bytes(1_000_000))


def _replayed(write: Callable[[Path], object]) -> Make:
    def make(folder: Path) -> list[str]:
        run = copy_of(folder)
        (run / "recordings").mkdir()
        write(run / "recordings" / "parked-0.npz")
        return ["replay", str(run), "0", "--html", str(folder / "page.html")]

    return make
