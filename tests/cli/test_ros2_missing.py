"""Commands of ROS 2 where there is none for this Python."""

import sys
from pathlib import Path

import pytest

from navbench.cli.app import main

FOREIGN = """
raise ImportError("No module named 'rclpy._rclpy_pybind11'\\nThe C extension is not present")
"""


@pytest.mark.parametrize("is_there", [False, True])
@pytest.mark.parametrize("words", [["drive", "--params", "stock"], ["serve", "--name", "mine"]])
def test_ros_2_that_cannot_be_imported_is_one_line(
    is_there: bool,
    words: list[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """As where setup.bash of a ROS 2 for another Python was sourced, or none."""
    monkeypatch.setitem(sys.modules, "rclpy", None)
    reason = "import of rclpy halted; None in sys.modules"
    if is_there:
        monkeypatch.delitem(sys.modules, "rclpy")
        (tmp_path / "rclpy.py").write_text(FOREIGN)
        monkeypatch.syspath_prepend(str(tmp_path))
        reason = "No module named 'rclpy._rclpy_pybind11'"
    with pytest.raises(SystemExit) as leaving:
        main(words)
    assert leaving.value.code == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert f"ROS 2's rclpy cannot be imported by this Python 3.{sys.version_info.minor}" in said
    assert reason in said and "setup.bash of a ROS 2 for Python" in said
