"""Recordings of people: CSV files, and the obsmat.txt of the UCY and ETH data sets."""

import csv
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from harness.world.people.params import ReplayParams
from navstack.errors import InputError
from navstack.files import check_regular
from navstack.geometry import transform_points
from navstack.types import BoolArray, FloatArray, IntArray

MAX_BYTES = 20_000_000  # of a recording; an hour of a busy square has about 10 MB
FARTHEST = 1e8  # [m] of a sample, and [s] from the first one to the last
LATEST = 1e12  # [s] or [frames] of a sample, whose clock may count from 1970; number of a person
MAX_PEOPLE = 10_000  # each costs time in every step
MAX_SPEED = 15.0  # [m/s] between two samples; the fastest sprinter runs 12.4 m/s
COLUMNS = ("id", "t", "x", "y")
_OBSMAT_WIDTH = 8  # frame, id, x, z, y, vx, vz, vy
_OBSMAT = {"id": 1, "frame": 0, "x": 2, "y": 4}  # its columns in the order of a sample

Sample = tuple[float, float, float, float]  # id, t [s], x [m], y [m]


@dataclass(frozen=True, slots=True, eq=False)
class Recording:
    """Trajectories in the map frame, person after person, each in order of time."""

    # (n + 1,) index of each person's first sample; the last entry is the number of samples
    firsts: IntArray
    times: FloatArray  # (N,) [s], the earliest of all is 0
    positions: FloatArray  # (N, 2) [m]

    @property
    def count(self) -> int:
        """How many people it holds."""
        return len(self.firsts) - 1

    @property
    def duration(self) -> float:
        """From the first to the last sample, in [s]."""
        return float(self.times.max())


def load_recording(params: ReplayParams) -> Recording:
    """Read a recording and put it in its place.

    Raises:
        InputError: no file is given, or it is not a recording; the message names the line.
    """
    if not params.file:
        raise InputError(
            "people of the model 'replay' need a recording; give --people FILE.csv, or "
            "replay.file in the world file"
        )
    path = Path(params.file)
    lines = recording_text(path).removeprefix("\ufeff").splitlines()
    try:
        if path.suffix == ".txt":
            samples = _obsmat(lines, path, params.frame_rate)
        else:
            samples = _csv(lines, path)
    except csv.Error as error:
        raise InputError(f"people file '{path}' is not a CSV file ({error})") from None
    if not samples:
        raise InputError(
            f"people file '{path}' has no samples; at least one line of id, t [s], x [m], y [m] "
            "is needed"
        )
    return _arrange(np.array(samples), params, path)


def recording_text(path: Path) -> str:
    """The text of a recording as it is.

    Raises:
        InputError: the file is absent, unreadable, too large or not UTF-8.
    """
    try:
        check_regular(path, MAX_BYTES)
        with path.open(encoding="utf-8", newline="") as stream:  # line ends stay as they are
            return stream.read()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", "it is not a text file")
        raise InputError(
            f"people file '{path}' cannot be read ({reason}); give a CSV file with the columns "
            "id, t, x, y"
        ) from None


def _csv(lines: list[str], path: Path) -> list[Sample]:
    rows = csv.reader(lines)
    header = [name.strip() for name in next(rows, [])]
    if any(header.count(name) != 1 for name in COLUMNS):
        raise InputError(
            f"people file '{path}', line 1: the columns are {', '.join(header) or 'missing'}; "
            "needed are id, t [s], x [m], y [m], each once"
        )
    chosen = {name: header.index(name) for name in COLUMNS}
    return [_sample(row, len(header), chosen, path, rows.line_num) for row in rows if row]


def _obsmat(lines: list[str], path: Path, frame_rate: float) -> list[Sample]:
    samples = []
    for number, line in enumerate(lines, start=1):
        if line.strip():
            person, frame, x, y = _sample(line.split(), _OBSMAT_WIDTH, _OBSMAT, path, number)
            samples.append((person, frame / frame_rate, x, y))
    return samples


def _sample(row: list[str], width: int, chosen: dict[str, int], path: Path, line: int) -> Sample:
    """The id, the time (or frame), x and y of a row, which ``chosen`` names in this order.

    Raises:
        InputError: a column too many or too few, or a value that is no number within its limit.
    """
    if len(row) != width:
        raise InputError(
            f"people file '{path}', line {line}: {len(row)} columns; {width} are needed"
        )
    values = {}
    for name, column in chosen.items():
        try:
            values[name] = float(row[column])
        except ValueError:
            values[name] = math.nan
        most = FARTHEST if name in ("x", "y") else LATEST
        if not abs(values[name]) <= most:
            raise InputError(
                f"people file '{path}', line {line}: {name} '{row[column].strip()}'; a finite "
                f"number is needed, at most {most:g}"
            )
    person, time, x, y = (values[name] for name in chosen)
    return person, time, x, y


def _arrange(samples: FloatArray, params: ReplayParams, path: Path) -> Recording:
    """Sort (N, 4) samples by person; those of one person are in order of time as they stand.

    Raises:
        InputError: somebody cannot have walked so, or there are too many.
    """
    samples = samples[np.argsort(samples[:, 0], kind="stable")]
    same = np.diff(samples[:, 0]) == 0.0
    _check_walks(samples, same, path)
    people = 1 + np.count_nonzero(~same)
    if people > MAX_PEOPLE:
        raise InputError(
            f"people file '{path}' has {people} people; at most {MAX_PEOPLE} are read: cut a part "
            "of it"
        )
    lasts = float(np.ptp(samples[:, 1]))
    if not 0.0 < lasts <= FARTHEST:
        raise InputError(
            f"people file '{path}' lasts {lasts:g} s; more than 0 and at most {FARTHEST:g} s are "
            "needed, as people are there from their first sample to their last"
        )
    return Recording(
        firsts=np.concatenate(([0], np.flatnonzero(~same) + 1, [len(samples)])),
        times=samples[:, 1] - samples[:, 1].min(),
        positions=transform_points(params.placement, samples[:, 2:]),
    )


def _check_walks(samples: FloatArray, same: BoolArray, path: Path) -> None:
    """Check that people can have walked as their samples say.

    Args:
        samples: (N, 4) person after person.
        same: (N - 1,) whether the next sample is of the same person.
        path: of the file.

    Raises:
        InputError: somebody is in two places at once, goes back in time, or is too fast.
    """
    duration = np.diff(samples[:, 1])  # [s]
    distance = np.hypot(*np.diff(samples[:, 2:], axis=0).T)  # [m]
    impossible = same & ((duration <= 0.0) | (distance > MAX_SPEED * duration))
    if not impossible.any():
        return
    at = int(impossible.argmax())
    person, before = samples[at, :2]
    after = samples[at + 1, 1]
    told = f"people file '{path}': id {person:g}"
    if after == before:
        raise InputError(
            f"{told} has two samples at the time {after:g} s; one per person and time is allowed"
        )
    if after < before:
        raise InputError(
            f"{told} goes back in time, from {before:.9g} s to {after:.9g} s; the samples of a "
            "person are needed in order of time"
        )
    raise InputError(
        f"{told} moves {distance[at]:.3g} m in the {duration[at]:.3g} s after {before:.9g} s; at "
        f"most {MAX_SPEED:g} m/s are taken for a walk: give somebody who is lost and found again "
        "another id"
    )
