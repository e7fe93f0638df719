"""Global localization on real scans: MRPT's localization demo."""

import importlib.util
import os
import sys
from pathlib import Path

import pytest

DATA = os.environ.get("NAVSTACK_DATA")
SCRIPT = Path(__file__).parents[2] / "benchmarks" / "check_amcl.py"


@pytest.mark.skipif(DATA is None, reason="NAVSTACK_DATA is unset: no real scans")
def test_it_finds_itself_in_a_real_building() -> None:
    spec = importlib.util.spec_from_file_location("check_amcl", SCRIPT)
    assert spec is not None and spec.loader is not None
    check = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = check
    spec.loader.exec_module(check)
    demo = check.Demo(Path(str(DATA)))
    localizer = check.AmclLocalizer(check.DEMO, demo.map())
    assert sum(check.finds_itself(localizer, demo, seed) for seed in range(100, 105)) == 5
