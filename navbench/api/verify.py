"""Whether runs are as they were written and repeat, and situations come out as they should."""

from collections.abc import Iterable
from pathlib import Path

from harness.execution.process_cache import forget_changed
from harness.scenarios.runner import Result, run_scenario
from harness.storage.new_run import MANIFEST
from harness.study.suite_folder import TABLE
from harness.study.verification import Verification, verify_run
from navbench.api.progress import count_shown, say
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
    if driven := [run for run in runs if (run / TABLE).is_file()]:
        for run in sorted({*runs} - {*driven}):
            say(f"note: '{run}' has no deliveries yet, and is left out")
        runs = driven
    forget_changed()
    with count_shown("deliveries driven again", sample * len(runs)) as tell:
        return [verify_run(run, sample, seed, tell) for run in runs]


def scenario(files: Iterable[Path]) -> list[Result]:
    """Drive scenario files one after the other and check what comes of them.

    Raises:
        InputError: a file, or something that it names, cannot be used.
    """
    forget_changed()
    return [run_scenario(path) for path in files]
