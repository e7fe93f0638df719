"""Compiled code is dropped when anything changes that it was compiled from, and only then."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numba
import pytest

from navstack import dispatch, jit

KERNEL = """
from {njit_from} import njit
from {helper} import OFFSET, doubled
import {unrelated}

@njit(cache=True)
def kernel(x):
    return doubled(x) + OFFSET
"""
HELPER = """
from {constants} import OFFSET
from navstack.jit import njit

@njit(cache=True)
def doubled(x):
    return 2 * x
"""


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A package whose kernel takes a function from another file and a constant from a third one."""
    folder = tmp_path / "robot_kernels"
    (folder / "inner").mkdir(parents=True)
    for each in (folder, folder / "inner"):
        (each / "__init__.py").write_text("")
    (folder / "inner" / "constants.py").write_text("OFFSET = 1\n")
    (folder / "helper.py").write_text(HELPER.format(constants=".inner.constants"))
    write_kernel(folder, "navstack.jit")
    return folder


def write_kernel(folder: Path, njit_from: str) -> None:
    text = KERNEL.format(njit_from=njit_from, helper="robot_kernels.helper", unrelated="json")
    (folder / "kernel.py").write_text(text)


def answer(package: Path, x: int = 10, **variables: str) -> tuple[int, int]:
    """What the kernel gives in a new process, and how often it was taken from the cache."""
    code = (
        f"from robot_kernels.kernel import kernel as k; print(k({x}), "
        f"sum(k.stats.cache_hits.values()))"
    )
    places = os.pathsep.join([str(package.parent), str(Path(jit.__file__).parents[1])])
    variables = {"NUMBA_CACHE_DIR": str(package.parent / "cache"), **variables}
    environment = {**os.environ, "PYTHONPATH": places, **variables}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True
    )
    value, hits = done.stdout.split()
    return int(value), int(hits)


def test_changed_constant_of_a_file_behind_another_is_seen(package: Path) -> None:
    assert answer(package) == (21, 0)
    assert answer(package) == (21, 1)
    (package / "inner" / "constants.py").write_text("OFFSET = 5\n")
    assert answer(package) == (25, 0)


def test_numbas_own_cache_does_not_see_it(package: Path) -> None:
    write_kernel(package, "numba")
    assert answer(package) == (21, 0)
    (package / "inner" / "constants.py").write_text("OFFSET = 5\n")
    assert answer(package) == (21, 1), "numba has learnt it: navstack.jit is no longer needed"


def test_changed_function_of_another_file_is_seen(package: Path) -> None:
    answer(package)
    helper = package / "helper.py"
    helper.write_text(helper.read_text().replace("2 * x", "3 * x"))
    assert answer(package) == (31, 0)


def test_unrelated_file_changes_nothing(package: Path) -> None:
    answer(package)
    (package / "other.py").write_text("OFFSET = 7\n")
    assert answer(package) == (21, 1)


def test_compiled_code_for_types_that_are_gone_is_dropped(package: Path) -> None:
    kernel = package / "kernel.py"
    text = (
        "from typing import NamedTuple\nfrom navstack.jit import njit\n"
        "class Given(NamedTuple):\n    x: int\n"
        "@njit()\ndef inner(given):\n    return given.x\n"
        "def kernel(x):\n    return inner(Given(x))\nkernel.stats = inner.stats\n"
    )
    kernel.write_text(text)
    assert answer(package) == (10, 0)
    assert answer(package) == (10, 1)
    kernel.write_text(text.replace("Given", "Taken"))
    assert answer(package) == (10, 0)


def test_damaged_code_is_compiled_anew(package: Path) -> None:
    answer(package)
    for file in (package.parent / "cache").rglob("*.nb?"):
        file.write_bytes(file.read_bytes()[:-9])
    assert answer(package) == (21, 0)
    assert answer(package) == (21, 1)


def test_compiled_code_moves_with_its_sources(package: Path, tmp_path: Path) -> None:
    assert answer(package, NUMBA_CACHE_DIR="") == (21, 0)
    moved = tmp_path / "elsewhere" / "robot_kernels"
    shutil.copytree(package, moved)
    shutil.rmtree(package)
    assert answer(moved, NUMBA_CACHE_DIR="") == (21, 1)


def test_one_processor_stands_for_all_that_can_run_its_code(
    package: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    every = dict.fromkeys(dispatch.LEVEL_NEEDS, True)
    config = numba.config
    for features, chosen, expected in (
        (every, None, dispatch.LEVEL),
        ({**every, "avx2": False}, None, None),
        ({}, None, None),  # another architecture
        (every, "znver4", "znver4"),
    ):
        monkeypatch.setattr(config, "CPU_NAME", chosen)
        monkeypatch.setattr(jit, "get_host_cpu_features", lambda features=features: features)
        jit.fix_processor()
        assert expected == config.CPU_NAME
    assert answer(package, NUMBA_CPU_NAME="x86-64-v2") == (21, 0)
    assert answer(package) == (21, 0)  # compiled for another processor


@pytest.mark.parametrize(
    "line",
    [
        "from robot_kernels.inner import constants",
        "from robot_kernels.inner import (\n    other,\n    constants,\n)",
        "import robot_kernels.inner.constants",
        "from .inner.constants import OFFSET",
        "from .inner import constants as named",
        "from . import inner\nfrom robot_kernels.inner.constants import OFFSET",
    ],
)
def test_every_way_to_import_is_followed(package: Path, line: str) -> None:
    source = package / "given.py"
    source.write_text(f"import numpy as np\n{line}\n")
    before = jit.source_stamp.__wrapped__(source)
    (package / "inner" / "constants.py").write_text("OFFSET = 5\n")
    jit._content.cache_clear()
    assert jit.source_stamp.__wrapped__(source) != before


def test_other_peoples_kernels_keep_their_cache() -> None:
    before = numba.config.CACHE_LOCATOR_CLASSES

    @jit.njit(cache=False)
    def kernel(x: float) -> float:
        return x + 1.0

    assert kernel(1.0) == 2.0
    assert numba.config.CACHE_LOCATOR_CLASSES == before
