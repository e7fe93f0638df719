"""Global localization on real scans: MRPT's localization demo."""

import importlib.util
import os
import sys
from pathlib import Path

import pytest

DATA = os.environ.get("NAVSTACK_DATA")
SCRIPT = Path(__file__).parents[2] / "benchmarks" / "amcl_demo.py"


@pytest.mark.skipif(DATA is None, reason="NAVSTACK_DATA is unset: no real scans")
def test_it_finds_itself_in_a_real_building() -> None:
    spec = importlib.util.spec_from_file_location("amcl_demo", SCRIPT)
    assert spec is not None and spec.loader is not None
    demo = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = demo
    spec.loader.exec_module(demo)
    assert demo.localize_globally(Path(str(DATA)), range(100, 105)) == 5
