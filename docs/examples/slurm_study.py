"""A study on a SLURM cluster, with dask-jobqueue.

It submits jobs whose processes are the workers of ``--executor dask``.

Usage: python docs/examples/slurm_study.py [--jobs N] [--per-job N] [--queue Q] [--account A]
           [--walltime H:MM:SS] [--script]
           -- run --stack nav2-gps --episodes 100000 --out /shared/study

Run it where the program may stay for the whole study: it holds the scheduler and starts
``navbench``. What follows ``--`` is a command of navbench, which begins with the first job that
starts; workers of later jobs join it. A job that ends takes its deliveries with it, and they are
driven again elsewhere. ``--script`` only prints what is submitted.
"""

import argparse
import signal
import subprocess
import sys
from typing import Any

from navbench.cli.signals import run_script

MEMORY = 3.0  # [GB] per worker: see docs/scaling.md
NAVBENCH = [sys.executable, "-c", "from navbench.cli.app import main; main()"]


def make_cluster(cluster_class: Any, per_job: int, **options: Any) -> Any:
    """A cluster of jobs, each with as many workers of one thread; nothing is submitted yet.

    Args:
        cluster_class: ``SLURMCluster``, or another one of dask_jobqueue.
        per_job: workers, and so cores, of a job.
        options: of the class: queue, account, walltime ...
    """
    return cluster_class(
        cores=per_job,
        processes=per_job,  # as many as cores: one thread each
        memory=f"{MEMORY * per_job:g}GB",
        nanny=True,
        python=sys.executable,
        worker_extra_args=["--preload-nanny", "navbench"],  # it sets up their arithmetic
        **options,
    )


def run(cluster: Any, jobs: int, command: list[str]) -> int:
    """Submit jobs and drive a study on them.

    Returns navbench's exit status, also when it is interrupted.
    """
    cluster.scale(jobs=jobs)
    cluster.wait_for_workers(1)
    navbench = subprocess.Popen(
        [*NAVBENCH, *command, "--executor", "dask", "--scheduler", cluster.scheduler_address]
    )
    # Ctrl-C reaches navbench, too, which keeps what is finished
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    return navbench.wait()


def main() -> None:
    """Read the command line."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--jobs", type=int, default=4)
    parser.add_argument("--per-job", type=int, default=16)
    parser.add_argument("--queue")
    parser.add_argument("--account")
    parser.add_argument("--walltime", default="4:00:00")
    parser.add_argument("--script", action="store_true")
    parser.add_argument("command", nargs="*")
    given = parser.parse_args()
    from dask_jobqueue import SLURMCluster

    # the import has made Ctrl-C an exit with status 0
    signal.signal(signal.SIGINT, signal.default_int_handler)
    options = {"queue": given.queue, "account": given.account, "walltime": given.walltime}
    with make_cluster(SLURMCluster, given.per_job, **options) as cluster:
        if given.script:
            sys.stdout.write(cluster.job_script())
        else:
            sys.exit(run(cluster, given.jobs, given.command))


if __name__ == "__main__":
    run_script(main)
