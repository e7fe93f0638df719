"""Whether runs are as they were written, and whether their deliveries repeat."""

from pathlib import Path

from harness.storage.new_run import MANIFEST
from harness.study.verification import Verification, verify_run
from navstack.errors import InputError


def verify(folder: Path, sample: int = 3, seed: int = 0) -> list[Verification]:
    """Check the files of a run, or of a suite's runs, and drive some deliveries again.

    Args:
        folder: of the run or of the suite.
        sample: deliveries of each run that are driven again.
        seed: by which they are drawn.

    Raises:
        InputError: the folder holds no run.
    """
    runs = sorted(file.parent for file in folder.glob(f"*/{MANIFEST}"))
    if (folder / MANIFEST).is_file():
        runs = [folder]
    if not runs:
        raise InputError(f"'{folder}' holds no run; give the folder that a run or a suite wrote")
    return [verify_run(run, sample, seed) for run in runs]
