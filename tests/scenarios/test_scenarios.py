"""Every scenario file, driven: passes, or fails as it says.

What is known to fail and passes is an error.
"""

from pathlib import Path

import pytest

from harness.scenarios.runner import _told, run_scenario
from harness.scenarios.scenario import load_scenario
from navstack.errors import NoPathFoundError, PluginError

FILES = sorted(Path(__file__).parent.glob("*.yaml"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_scenario(path: Path, request: pytest.FixtureRequest) -> None:
    scenario = load_scenario(path)
    result = run_scenario(path)
    broken = {finding.check: finding.measured for finding in result.findings if not finding.holds}
    if scenario.fails and not broken.keys() <= set(scenario.fails):
        pytest.fail(f"{scenario.title} It fails in more than is known: {broken}")
    if scenario.expect == "known_to_fail":
        request.applymarker(
            pytest.mark.xfail(strict=True, raises=AssertionError, reason=scenario.reason)
        )
    assert not broken, f"{scenario.title} {broken}"


def test_there_are_enough() -> None:
    assert len(FILES) >= 15
    assert len({load_scenario(path).title for path in FILES}) == len(FILES)


def test_what_algorithms_of_others_raise_is_told_in_one_line() -> None:
    """As a delivery's; what the machine is to blame for, and what is told already, as it is."""
    for raised in (MemoryError("full"), OSError("gone"), NoPathFoundError("no path")):
        with pytest.raises(type(raised), match=str(raised)), _told():
            raise raised
    with pytest.raises(PluginError, match="^ZeroDivisionError: division by zero$"), _told():
        raise ZeroDivisionError("division by zero")
