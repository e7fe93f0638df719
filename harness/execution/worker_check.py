"""Whether a process elsewhere drives a delivery as this one does.

One thread, the same code, versions and files.
"""

import hashlib
import platform
import socket
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from harness.execution.arithmetic import arithmetic
from harness.execution.executors import give_memory_back
from harness.execution.process_cache import forget
from harness.storage.shipped import keep_compiled_code, shipped
from navstack.dispatch import PINS

PACKAGES = ("navstack", "harness")  # of this project
PRELOAD = "--preload-nanny navbench"  # sets up the arithmetic of the workers that a nanny starts


@dataclass(frozen=True, slots=True)
class Look:
    """What a process is and sees."""

    host: str
    threads: int  # that run tasks
    is_guarded: bool  # whether a process (Dask's nanny) would start it anew
    # of Python, the machine and libraries; "" where a library is missing
    versions: Mapping[str, str]
    # SHA-256 of the code, parameters and maps that come with the program, as they are on disk
    project: str
    arithmetic: Mapping[str, str]  # how it computes, see harness.execution.arithmetic
    files: Mapping[str, str]  # absolute path -> SHA-256; "" where there is none
    code: str  # SHA-256 of the code, as it was on disk when the process began to use it


def look(libraries: Sequence[str], files: Sequence[str], dask_worker: Any = None) -> Look:
    """Look at this process, and prepare it for deliveries if it is a Dask worker.

    What earlier ones read is forgotten.

    Args:
        libraries: names of distributions.
        files: absolute paths.
        dask_worker: given by Dask when it runs this on a worker.
    """
    if dask_worker is not None:
        keep_compiled_code()
        give_memory_back()
    seen = Look(
        host=socket.gethostname(),
        threads=1 if dask_worker is None else int(dask_worker.state.nthreads),
        is_guarded=dask_worker is not None and dask_worker.nanny is not None,
        versions={
            "Python": ".".join(platform.python_version_tuple()[:2]),
            "machine": platform.machine(),
            **{name: _version(name) for name in libraries},
        },
        arithmetic=arithmetic(),
        project=_digest_of(_project()),
        files={path: _digest(path) for path in files},
        code=_code_digest(),
    )
    if dask_worker is not None:
        forget()  # last: what is read from now on is what was seen
    return seen


def trouble(here: Look, there: Look) -> str:
    """Why a worker cannot be used, and what to do; empty if it can."""
    if there.threads != 1:
        return (
            f"has {there.threads} threads, and PyBullet's worlds are kept per process: start "
            "workers with "
            "--nthreads 1, and --nworkers for more of them"
        )
    for name, ours in here.versions.items():
        if (theirs := there.versions.get(name, "")) != ours:
            what = f"has {name} {theirs or 'not at all'}, here it is {ours}"
            return f"{what}: rows could differ; install the same and restart its workers"
    if there.arithmetic != here.arithmetic:
        differing = here.arithmetic.items() - there.arithmetic.items()
        names = ", ".join(sorted(name for name, _ in differing))
        settings = " ".join(f"{name}='{value}'" for name, value in PINS.items())
        return (
            f"computes otherwise ({names}), so rows would differ in last bits: start its workers "
            f"with {PRELOAD}, or with {settings} in their environment, and with the same C library"
        )
    if there.project != here.project:
        return (
            "has other code, parameters or maps of this program: use the same checkout on every "
            "machine and restart "
            "its workers"
        )
    if there.code != here.code:
        return "runs code of this program from before it was changed there: restart its workers"
    for path, ours in here.files.items():
        theirs = there.files.get(path, "")
        if not theirs and ours:
            return (
                f"has no file '{path}': put it, and the run folder, where every machine finds "
                f"them under this path"
            )
        if theirs != ours:
            return f"has another file '{path}' than this machine: copy it, or share the file system"
    return ""


@lru_cache(maxsize=1)
def project_digest() -> str:
    """SHA-256 of the program's code, parameters and maps, as they were when first asked for."""
    return _digest_of(_project())


@lru_cache(maxsize=1)
def _code_digest() -> str:
    return _digest_of(_code())


def _digest_of(paths: Sequence[Path]) -> str:
    digest = hashlib.sha256()
    for path in paths:
        digest.update(path.name.encode() + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def _project() -> list[Path]:
    return [*_code(), *_all_files(shipped("params")), *_all_files(shipped("maps"))]


def _code() -> list[Path]:
    root = Path(__file__).resolve().parents[2]
    files = (path for package in PACKAGES for path in sorted((root / package).rglob("*")))
    return [path for path in files if path.suffix in (".py", ".toml", ".json")]


def _all_files(folder: Path) -> list[Path]:
    return [
        path
        for path in sorted(folder.rglob("*"))
        if path.is_file() and "__pycache__" not in path.parts
    ]


def _digest(path: str) -> str:
    try:
        return hashlib.sha256(Path(path).read_bytes()).hexdigest()
    except OSError:
        return ""


@cache
def _version(name: str) -> str:
    """A version as it was when first asked for.

    What is imported stays when another one is installed.
    """
    try:
        return version(name)
    except PackageNotFoundError:
        return ""
