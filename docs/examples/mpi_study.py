"""A study on the processes of an MPI program, or on any other executor of ``concurrent.futures``.

Usage: mpiexec -n 5 python -m mpi4py.futures docs/examples/mpi_study.py --stack nav2-gps --episodes
400 --out DIR

Of five processes one keeps the study and four drive deliveries, with one after the other on each.
The same command again goes on with a study that was cut off. DIR is an ordinary run folder, which
``navbench report`` and others read. Every process must find the program, DIR and the map under the
same paths.
"""

import argparse
import sys
from concurrent.futures import Executor
from pathlib import Path

from harness.execution.executors import Place, give_memory_back
from harness.execution.workers import Workers
from harness.storage.new_run import MANIFEST, create_run
from harness.storage.run_folder import RunFolder
from harness.study.drive import TABLES, drive_missing, finish
from harness.study.manifest import about, load_study, parameters
from harness.task.study import Study, make_study
from navbench.api.progress import say
from navstack.errors import InputError, NavstackError


def asked(study: Study) -> tuple[object, ...]:
    """What makes two studies the same."""
    return study.episodes, study.template.seed, parameters(study)


def drive(executor: Executor, at_once: int, study: Study, path: Path) -> None:
    """Drive what a run folder lacks; it is made if there is none.

    Args:
        executor: whose workers are processes with one thread each.
        at_once: number of its workers.
        study: to be driven.
        path: of the folder.

    Raises:
        InputError: the folder has another study.
    """
    if not (path / MANIFEST).is_file():
        create_run(path, about(study, sys.argv), parameters(study))
    begun = load_study(path)
    if asked(begun) != asked(study):
        raise InputError(f"'{path}' has another study; give what it began with, or another --out")
    study = begun
    with RunFolder(path, TABLES, study.total) as folder:
        if not folder.is_closed:
            with Workers(at_once, lambda: Place(executor.submit)) as workers:
                drive_missing(study, folder, workers, lambda finished, record: None)
        finish(study, folder)
        say(f"{len(folder.rows)} of {study.total} deliveries are in {path}")


def main() -> None:
    """Read the command line; this runs in the first process only."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--stack", nargs="+", default=["nav2-gps"])
    parser.add_argument("--episodes", type=int, default=400)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--rules", default="costnav")
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    try:
        begin(given)
    except NavstackError as error:
        sys.exit(f"mpi_study: {error}")


def begin(given: argparse.Namespace) -> None:
    """Drive what was asked for.

    Raises:
        NavstackError: it cannot be.
    """
    from mpi4py.futures import MPIPoolExecutor

    study = make_study(
        stacks=given.stack, episodes=given.episodes, seed=given.seed, rules=given.rules
    )
    with MPIPoolExecutor(initializer=give_memory_back) as executor:
        drive(executor, executor.num_workers, study, given.out)


if __name__ == "__main__":
    main()
