"""Rows do not depend on which loops the processor would let libraries choose."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path

import pyarrow.parquet as pq
import pytest
import yaml

from harness.storage.shipped import names, shipped
from navstack.dispatch import PINS, TUNABLES

# Every controller, localizer, planner and planning map of the shipped stacks is in one of them.
STACKS = (
    "dwb-contact-gps-ekf",
    "evasive-amcl-gps",
    "graceful-gps-ekf",
    "mpc-gps-ekf",
    "mppi-contact-gps-ekf",
    "nav2-amcl",
    "nav2-stock",
    "ompl-gps-ekf",
    "paper-gps",
    "rpp-gps-ekf",
    "smac-gps-ekf",
)
SEED, MAP, PEOPLE = 42, "sidewalk_2", 40
SECONDS = 8.0  # of each delivery
NEAR = 3.5  # [m] that somebody comes to the robot in each
NO_AVX512 = "X86_V4 AVX512_ICL AVX512_SPR"
NUMPY_AVX2 = {"NPY_DISABLE_CPU_FEATURES": NO_AVX512}
# A user's environment that asks for other loops than the program's.
ENVIRONMENTS: Mapping[str, Mapping[str, str]] = {
    "the machine's own": {},
    "oldest": {
        "NPY_DISABLE_CPU_FEATURES": f"X86_V3 {NO_AVX512}",
        "OPENBLAS_CORETYPE": "Nehalem",
        TUNABLES: "glibc.cpu.hwcaps=-FMA,-AVX2",
    },
    "AVX2": {"NPY_DISABLE_CPU_FEATURES": NO_AVX512, "OPENBLAS_CORETYPE": "Zen"},
}
FARTHEST = ("the machine's own", "oldest")
ARITHMETIC = (
    "import json; from harness.execution.arithmetic import arithmetic;"
    "print(json.dumps(dict(arithmetic())))"
)


def environment(asked: Mapping[str, str]) -> dict[str, str]:
    """This process's environment without what its own start has pinned, and with what is asked."""
    kept = {name: value for name, value in os.environ.items() if name not in PINS}
    return {**kept, **asked}


def drive(asked: Mapping[str, str], folder: Path) -> Path:
    """One delivery of each of the stacks, by the program."""
    rules = folder / "short.yaml"
    published = (shipped("params") / "rules" / "costnav.yaml").read_text(encoding="utf-8")
    rules.write_text(published.replace("timeout: 241.0", f"timeout: {SECONDS}"))
    words = [word for name in STACKS for word in ("--stack", name)]
    words += ["--episodes", "1", "--seed", str(SEED), "--map", MAP, "--pedestrians", str(PEOPLE)]
    words += ["--rules", str(rules), "--workers", "1", "--out", str(folder / "run")]
    command = [sys.executable, "-m", "navbench", "run", *words]
    done = subprocess.run(
        command,
        env=environment(asked),
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return folder / "run"


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A run under each of the environments that are farthest apart."""
    return {
        title: drive(ENVIRONMENTS[title], tmp_path_factory.mktemp("dispatch")) for title in FARTHEST
    }


def parts(stack: str) -> set[tuple[str, str]]:
    """What a shipped stack is made of."""
    folder = shipped("params")
    said = yaml.safe_load((folder / "stacks" / f"{stack}.yaml").read_text(encoding="utf-8"))
    found = {(key, str(said[key])) for key in ("localizer", "planning_map")}
    if "nav2_file" in said:
        nav2 = (folder / "nav2" / f"{said['nav2_file']}.yaml").read_text(encoding="utf-8")
        found |= {("plugin", name) for name in re.findall(r'plugin: "?([\w:/]+)', nav2)}
    return found


def test_no_part_of_a_shipped_stack_is_left_out() -> None:
    # a Jackal has worlds of its own; ros2 is driven by another program, parked by nothing
    others = [
        name
        for name in names(shipped("params") / "stacks")
        if "jackal" not in name and name not in ("ros2", "parked")
    ]
    driven = set().union(*(parts(name) for name in STACKS))
    assert set().union(*(parts(name) for name in others)) <= driven


@pytest.mark.slow
def test_rows_are_equal_byte_for_byte(runs: dict[str, Path]) -> None:
    own = runs["the machine's own"]
    for table in ("episodes", "events"):
        expected = (own / f"{table}.parquet").read_bytes()
        assert (runs["oldest"] / f"{table}.parquet").read_bytes() == expected, table


@pytest.mark.slow
def test_somebody_comes_near_in_each_delivery(runs: dict[str, Path]) -> None:
    rows = pq.read_table(runs["the machine's own"] / "episodes.parquet").to_pylist()
    assert len(rows) == len(STACKS)
    assert all(row["min_pedestrian_distance_m"] < NEAR for row in rows)
    assert any(row["pedestrian_contacts"] for row in rows)


@pytest.mark.slow
def test_a_run_says_on_which_machine_it_was_driven(runs: dict[str, Path]) -> None:
    machines = [json.loads((run / "run.json").read_text())["machine"] for run in runs.values()]
    assert machines[1:] == machines[:-1]
    assert {"processor", "features", "c_library", "python", "arithmetic"} == set(machines[0])


def test_other_loops_have_another_digest() -> None:
    """What is pinned matters: where numpy is first, digests tell the environments apart."""
    digests = {}
    for title, asked in ENVIRONMENTS.items():
        command = [sys.executable, "-c", f"import numpy; {ARITHMETIC}"]
        told = subprocess.run(
            command,
            env=environment(asked),
            capture_output=True,
            text=True,
            check=True,
        )
        digests[title] = json.loads(told.stdout)
    for name in ("c_library", "blas"):
        assert digests["oldest"][name] != digests["AVX2"][name]


@pytest.mark.parametrize(
    ("first", "asked", "says"),
    [
        ("navbench", {"OPENBLAS_CORETYPE": "Nehalem"}, ""),
        ("numpy", {"OPENBLAS_CORETYPE": "Nehalem", **NUMPY_AVX2}, "with OpenBLAS for Nehalem"),
        ("numpy", {"OPENBLAS_CORETYPE": "Haswell", **NUMPY_AVX2}, ""),
        ("navbench", {TUNABLES: "glibc.cpu.hwcaps=-FMA"}, f"{TUNABLES} hides"),
    ],
)
def test_who_imports_into_other_loops_gets_one_line(
    first: str,
    asked: Mapping[str, str],
    says: str,
) -> None:
    code = f"import {first}, navbench; navbench.run; navbench.load"
    command = [sys.executable, "-W", "default", "-c", code]
    done = subprocess.run(
        command,
        env=environment(asked),
        capture_output=True,
        text=True,
        check=True,
    )
    told = [line for line in done.stderr.splitlines() if "NavstackWarning" in line]
    assert len(told) == bool(says)
    assert not says or (says in told[0] and "differ in last bits" in told[0])
