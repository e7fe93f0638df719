"""The finished missions of a check by meetings, a line each in its run folder."""

import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from harness.meetings.drive import ArmDrive, Weighed
from harness.meetings.mission import MissionDrive
from harness.storage.checksums import sealed, unsealed
from harness.storage.files import no_links, replacing, writing
from harness.storage.new_run import MEETINGS_FILE
from navstack.errors import InputError
from navstack.files import check_regular

FILE = MEETINGS_FILE
MOST = 1_000_000_000  # [bytes] of it


@dataclass(slots=True)
class KeptMissions:
    """Missions in their order, from the first one."""

    file: Path
    drives: list[MissionDrive] = field(default_factory=list)
    errors: int = 0  # missions that ended in one

    @property
    def number(self) -> int:
        """How many are finished."""
        return len(self.drives) + self.errors

    def add(self, drive: MissionDrive | None) -> None:
        """Keep the next mission.

        Args:
            drive: what came of it; None: an error.

        Raises:
            InputError: the file cannot be written.
        """
        with writing(self.file), open(self.file, "ab", opener=no_links) as stream:
            stream.write(_line_of(drive))
            stream.flush()
            os.fsync(stream.fileno())
        self._note(drive)

    def _note(self, drive: MissionDrive | None) -> None:
        if drive is None:
            self.errors += 1
        else:
            self.drives.append(drive)


def kept_missions(folder: Path, is_ours: bool = False) -> KeptMissions:
    """The missions that are finished in a run folder.

    Args:
        folder: of the run.
        is_ours: whether nobody else writes it now; then a line that was cut off is removed.

    Raises:
        InputError: the file is none of ours, is damaged, or cannot be written.
    """
    found = KeptMissions(folder / FILE)
    if not found.file.exists():
        return found
    check_regular(found.file, MOST)
    lines = found.file.read_bytes().splitlines(keepends=True)
    is_cut = bool(lines) and not lines[-1].endswith(b"\n")
    whole = lines[:-1] if is_cut else lines
    for number, line in enumerate(whole, start=1):
        try:
            found._note(_drive_in(line))
        except (ValueError, KeyError, TypeError):
            # what comes after it was drawn by what it said
            raise InputError(
                f"'{found.file}': line {number} of {len(lines)} is damaged; restore the file, or "
                "begin anew in another folder"
            ) from None
    if is_ours and is_cut:
        with writing(found.file), replacing(found.file) as stream:
            stream.writelines(whole)
    return found


def _line_of(drive: MissionDrive | None) -> bytes:
    content: dict[str, Any] | None = None
    if drive is not None:
        content = {
            "episode": drive.episode,
            "usual": drive.usual.tolist(),
            "strata": drive.strata.tolist(),
            "stands_for": drive.stands_for.tolist(),
            "arms": [
                {
                    "row": arm.row,
                    "margin": arm.margin,
                    "farthest_off": arm.farthest_off,
                    "met": [
                        (each.weight, each.loss, each.people_hit, each.contacts) for each in arm.met
                    ],
                }
                for arm in drive.arms
            ],
        }
    return sealed(json.dumps({"mission": content}))


def _drive_in(line: bytes) -> MissionDrive | None:
    """The mission of a line.

    Raises:
        ValueError, KeyError, TypeError: it is not what was written.
    """
    content = json.loads(unsealed(line))["mission"]
    if content is None:
        return None
    arms = tuple(
        ArmDrive(
            row=arm["row"],
            margin=arm["margin"],
            farthest_off=arm["farthest_off"],
            met=tuple(Weighed(*each) for each in arm["met"]),
        )
        for arm in content["arms"]
    )
    return MissionDrive(
        episode=content["episode"],
        usual=np.array(content["usual"], dtype=np.float64),
        strata=np.array(content["strata"], dtype=np.int64),
        stands_for=np.array(content["stands_for"], dtype=np.float64),
        arms=arms,
    )
