"""The workers of a study: processes of this machine, or those of a Dask cluster."""

import contextlib
import multiprocessing
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from harness.execution.workers import TIME_LIMIT, NoExecutorError, Workers
from harness.storage.texts import quoted
from navstack.errors import InputError

if TYPE_CHECKING:
    from harness.task.study import Study

EXECUTORS = ("local", "dask")
ADDRESS = re.compile(r"((tcp|tls|ws|wss)://)?([\w.-]+|\[[\w.:%-]+\]):(?P<port>\d{1,5})", re.ASCII)
MOST_PORT = 65535
MOST_AT_ONCE = 100_000  # deliveries; a cluster's room is less


@dataclass(frozen=True, slots=True)
class Where:
    """Where a user wants deliveries to be driven."""

    executor: str = "local"  # of EXECUTORS
    scheduler: str | None = None  # address of a Dask scheduler
    # deliveries at a time; None: one per core, on a cluster one per worker
    workers: int | None = None
    time_limit: float = TIME_LIMIT  # [s] of wall time per delivery

    def __post_init__(self) -> None:
        """Check that the options fit, and what can be known of a cluster without asking it.

        Raises:
            InputError: they do not, this process may start no workers, or the scheduler cannot be
                reached.
        """
        if self.executor == "dask" and not self.scheduler:
            raise InputError("--executor dask needs a scheduler; give --scheduler tcp://HOST:8786")
        if self.executor == "local" and self.scheduler:
            raise InputError(
                f"--scheduler {self.scheduler} is for --executor dask; give both, or neither"
            )
        if self.scheduler:
            _check_scheduler(self.scheduler)
        elif multiprocessing.current_process().daemon:
            raise InputError(
                "this is a daemonic process, as of multiprocessing.Pool, which may start no "
                "workers; call from one of concurrent.futures.ProcessPoolExecutor"
            )

    @property
    def is_local(self) -> bool:
        """Whether deliveries stay on this machine."""
        return self.executor == "local"


def _check_scheduler(address: str) -> None:
    """Check an address, and that what is installed and configured here can use it.

    Raises:
        InputError: it cannot be an address, Dask is missing, or not configured for it.
    """
    match = ADDRESS.fullmatch(address)
    if match is None or not 1 <= int(match["port"]) <= MOST_PORT:
        raise InputError(
            f"--scheduler {address!r} is no address of a Dask scheduler; give SCHEME://HOST:PORT "
            "(tcp, tls, ws or wss; "
            f"port 1 to {MOST_PORT}; IPv6 in brackets), e.g. tcp://HOST:8786"
        )
    try:
        from harness.execution.dask_security import check_security
    except ModuleNotFoundError as error:
        raise InputError(
            f"--executor dask needs the package {error.name}, which is not installed; pip install "
            "'navbench[dask]'"
        ) from None
    check_security(address)


@contextlib.contextmanager
def open_workers(
    where: Where,
    count: int,
    folder: Path,
    runs: "Mapping[Path, Study]",
) -> Iterator[Workers]:
    """Workers for the deliveries of a study.

    Args:
        where: they are driven.
        count: of processes on this machine.
        folder: of the study, with which it can go on.
        runs: what is driven, by its run folder; for a study that is one run, that is ``folder``.

    Raises:
        InputError: a cluster cannot be used, or is lost; what is finished by then is kept.
    """
    if where.is_local:
        with Workers(count, time_limit=where.time_limit) as workers:
            yield workers
        return
    from harness.execution.dask_cluster import DaskCluster
    from harness.study.manifest import LIBRARIES, PROGRAM
    from navstack.params.extensions import plugin_packages

    libraries = (PROGRAM, *LIBRARIES, *plugin_packages())
    files = sorted(
        {str(file.absolute()) for run, study in runs.items() for file in files_of(run, study)}
    )
    try:
        with (
            DaskCluster(str(where.scheduler), libraries, files, _warn) as cluster,
            Workers(
                where.workers or MOST_AT_ONCE, cluster.place, where.time_limit, cluster.room
            ) as workers,
        ):
            yield workers
    except NoExecutorError as error:
        raise InputError(
            f"{error}, then go on with --resume {quoted(folder)}: finished deliveries are kept"
        ) from None


def files_of(folder: Path, study: "Study") -> Iterator[Path]:
    """What the deliveries of a run read from disk, beside what comes with the program.

    Args:
        folder: of the run.
        study: as the folder tells it.
    """
    from harness.episode.files import nav2_parameters
    from harness.storage.new_run import MANIFEST
    from harness.storage.parameters import parameter_folder
    from harness.storage.shipped import district_files
    from harness.task.stack import policy_files, policy_module
    from navstack.costmap.map_io import load_metadata
    from navstack.params.nav2_file.views import read_costmap, read_masks

    yield folder / MANIFEST
    yield from (path for path in parameter_folder(folder).iterdir() if path.is_file())
    maps = {Path(study.template.map_name)} if Path(study.template.map_name).is_absolute() else set()
    for stack in study.stacks:
        yield from (*policy_files(stack), *policy_module(stack))
        if stack.nav2_file:
            nav2 = nav2_parameters(stack.nav2_file, study.template.allow_unknown)
            for costmap in ("local_costmap", "global_costmap"):
                maps |= {
                    mask.path for mask in read_masks(nav2, read_costmap(nav2, costmap)).values()
                }
    for path in maps:
        if path.is_dir():
            yield from district_files(path)
            continue
        yield load_metadata(path).image
        # its companions, too
        yield from (each for each in path.parent.glob(f"{path.stem}*") if each.is_file())


def _warn(line: str) -> None:
    sys.stderr.write(f"note: {line}\n")
    sys.stderr.flush()
