"""Runs cases of the parity check on a copy of the sources.

In it one constant at a time reads otherwise. A program of its own: standard input says what to do
(JSON), standard output which cases went wrong. Each run happens in a fresh child process, because
modules are imported and kernels compiled with the constants of that moment; the heavy libraries,
and the parameters, are imported once for all.
"""

import importlib
import json
import multiprocessing
import os
import sys
from pathlib import Path
from typing import Any

import numba
import numpy as np  # noqa: F401 - for the children
import ruamel.yaml  # noqa: F401 - for the children
import scipy.ndimage  # noqa: F401 - for the children
import scipy.signal  # noqa: F401 - for the children

numba.njit(lambda: 0)()  # noqa: TID251 - numba makes itself ready, for the children
sys.dont_write_bytecode = True  # two changes of equal length within a second would look alike
PARAMETERS = "navstack.params"  # has no kernels, and imports none


def run(job: dict[str, Any]) -> list[str]:
    """What is wrong in the job's cases with its change in place; the file is put back as it was."""
    file = Path(job["copy"]) / job["file"] if job["file"] else None
    before = file.read_text(encoding="utf-8") if file else ""
    times = file.stat() if file else None
    if file:
        file.write_text(before.replace(job["old"], job["new"]), encoding="utf-8")
    try:
        return _wrong(job)
    finally:
        if file and times:
            file.write_text(before, encoding="utf-8")
            # compiled code of the unchanged file stays valid
            os.utime(file, ns=(times.st_atime_ns, times.st_mtime_ns))


def _wrong(job: dict[str, Any]) -> list[str]:
    if job["file"].startswith(PARAMETERS.replace(".", "/")):
        for name in [name for name in sys.modules if name.startswith(PARAMETERS)]:
            del sys.modules[name]
    numba.config.DISABLE_JIT = not job["jit"]
    import navstack
    from navstack import jit

    content, copy = jit._content, Path(job["copy"]).resolve()
    # Compiled code is known as that of the unchanged sources: no constant that is changed with
    # compiled kernels is in them, and what others have compiled is not thrown away.
    jit._content = lambda source: content(Path(job["sources"]) / source.relative_to(copy))
    from tools.parity import certificate
    from tools.parity.golden import read_folder

    for module in (navstack, certificate):
        assert module.__file__ is not None and module.__file__.startswith(job["copy"]), (
            module.__file__
        )
    cases = certificate.discover(read_folder(Path(job["golden"])))
    found = [(part, case) for part, case in cases if [part.name, case.name] in job["cases"]]
    assert len(found) == len(job["cases"]), f"{len(found)} cases are called {job['cases']}"
    return [wrong for part, case in found for wrong in certificate.compare(part, case).wrong]


if __name__ == "__main__":
    jobs = json.load(sys.stdin)
    sys.path.insert(0, jobs[0]["copy"])  # which all have in common
    importlib.import_module(f"{PARAMETERS}.registry.nodes")
    with multiprocessing.get_context("fork").Pool(1, maxtasksperchild=1) as pool:
        json.dump(pool.map(run, jobs, chunksize=1), sys.stdout)
