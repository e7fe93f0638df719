"""``tools/check_speed.py``: noise does not fail it, a slowdown and other rows do."""

import importlib
import math
import random
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]
LOOP = "nav2-stock incremental"


@pytest.fixture(scope="module")
def check_speed() -> ModuleType:
    return importlib.import_module("tools.check_speed")


class Imagined:
    """A version whose deliveries take a set time, on a machine with noise that drifts."""

    drift = random.Random(7)
    asked: list[str] = []

    def __init__(self, name: str, factor: float, row: dict[str, float] | None = None) -> None:
        self._name, self._factor, self._row = name, factor, row or {"distance_m": 2.0}

    def ask(self, loop: str, episode: int, seconds: float | None) -> None:
        self.asked.append(self._name)

    def answer(self) -> dict[str, object]:
        noise = self.drift.gauss(1.0, 0.1)
        return {"simulated": 20.0, "processor": 0.5 * self._factor * noise, "row": self._row}


@pytest.mark.parametrize(
    ("factor", "is_slower"), [(1.0, False), (1.1, False), (1.5, True), (0.7, False)]
)
def test_noise_does_not_fail_the_check_and_a_slowdown_does(
    check_speed: ModuleType,
    factor: float,
    is_slower: bool,
) -> None:
    Imagined.asked.clear()
    speed = check_speed.compare_speed(
        Imagined("a", 1.0), Imagined("b", factor), "paper-gps", 12, 20.0
    )
    assert Imagined.asked == ["a", "b", *["a", "b", "b", "a"] * 12]
    assert speed.ratio.n == 12 and speed.ratio.value == pytest.approx(factor, rel=0.12)
    assert speed.is_slower(0.15) == is_slower


def test_rows_that_differ_are_named(
    check_speed: ModuleType, capsys: pytest.CaptureFixture[str]
) -> None:
    one = {"distance_m": 2.0, "jerk_p95_mps3": math.nan, "old": 1.0}
    two = {"distance_m": 2.0000000000000004, "jerk_p95_mps3": math.nan, "new": 1.0}
    rows = check_speed.compare_rows(
        Imagined("a", 1.0, one), Imagined("b", 1.0, two), "paper-gps", 2
    )
    assert (rows.differing, rows.columns, rows.only_in_one) == (
        (0, 1),
        ("distance_m",),
        ("new", "old"),
    )
    assert not check_speed.show_rows(rows)
    assert "columns: distance_m" in capsys.readouterr().out
    same = check_speed.compare_rows(
        Imagined("a", 1.0, one), Imagined("b", 1.0, one), "paper-gps", 2
    )
    assert check_speed.show_rows(same)


def test_a_folder_without_the_program_is_not_compared(
    check_speed: ModuleType, tmp_path: Path
) -> None:
    with pytest.raises(check_speed.Failure, match="holds no version"):
        check_speed.Driver(tmp_path)
    with (
        pytest.raises(check_speed.Failure, match="neither a commit"),
        check_speed.version("no-such-commit", ROOT),
    ):
        pass


@pytest.mark.slow
def test_check_speed_finds_a_busy_loop_that_was_planted(tmp_path: Path) -> None:
    """A version that wastes time in every tick fails, with the same rows."""
    for name in ("navstack", "maps", "params"):
        (tmp_path / name).symlink_to(ROOT / name)
    shutil.copytree(ROOT / "harness", tmp_path / "harness")  # its compiled code, too
    world = tmp_path / "harness" / "world" / "pybullet_world.py"
    tick = "        self._pedestrians.see_robot(self._state)\n"
    waste = "        for _ in range(400_000):\n            pass\n"
    assert tick in world.read_text()
    world.write_text(world.read_text().replace(tick, waste + tick))
    command = [sys.executable, "-m", "tools.check_speed", "--against", str(ROOT)]
    short = [
        "--tree",
        str(tmp_path),
        "--loop",
        LOOP,
        "--deliveries",
        "2",
        "--seconds",
        "3",
        "--rows",
        "1",
    ]
    done = subprocess.run([*command, *short], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "SLOWER" in done.stdout, done.stdout + done.stderr
    assert "1 of 1 rows are identical" in done.stdout
