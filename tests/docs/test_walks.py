"""A stranger's walk: an extension is written into few files of a copy of the product."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest

from .blocks import ROOT

PACKAGES = ("harness", "navstack")
SKIPPED = shutil.ignore_patterns("__pycache__", "_shipped")
COMMANDS = """
import contextlib, io, json, sys
from navbench.cli.app import main

for words in json.loads(sys.argv[1]):
    printed = io.StringIO()
    try:
        with contextlib.redirect_stdout(printed):
            main(words)
    except SystemExit as ended:
        print(json.dumps((ended.code or 0, printed.getvalue())))
"""


class Walk:
    """A copy of the product, to be edited and tried."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for package in PACKAGES:
            shutil.copytree(ROOT / package, folder / package, ignore=SKIPPED)

    def edit(self, file: str, *changes: tuple[str, str]) -> None:
        """Replace passages of a file, each of which stands there once."""
        path = self.folder / file
        text = path.read_text(encoding="utf-8")
        for old, new in changes:
            assert text.count(old) == 1, f"{file}: {old}"
            text = text.replace(old, new)
        path.write_text(text, encoding="utf-8")

    def append(self, file: str, text: str) -> None:
        """Add to the end of a file."""
        path = self.folder / file
        path.write_text(path.read_text(encoding="utf-8") + text, encoding="utf-8")

    def printed(self, program: str) -> list[str]:
        """The words that a program prints which imports the copy."""
        done = self.python("-c", program)
        assert done.returncode == 0, done.stderr
        return done.stdout.split()

    def python(self, *words: str) -> subprocess.CompletedProcess[str]:
        """A run of Python on the copy, and on what is not copied; without compiling."""
        paths = os.pathsep.join((str(self.folder), str(ROOT)))
        environment = os.environ | {"PYTHONPATH": paths, "NUMBA_DISABLE_JIT": "1"}
        return subprocess.run(
            [sys.executable, *words],
            cwd=self.folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=120,
            check=False,
        )

    def navbench(self, *commands: Sequence[str]) -> list[tuple[int, str]]:
        """Exit status and what is printed of each of several commands of the copy.

        All run in one process.
        """
        done = self.python("-c", COMMANDS, json.dumps(commands))
        assert done.returncode == 0, done.stderr
        return [tuple(json.loads(line)) for line in done.stdout.splitlines()]


@pytest.fixture
def walk(tmp_path: Path) -> Walk:
    return Walk(tmp_path)


ODOMETRY = "harness/world/sensors/wheel_odometry.py"
DRIVE_WITH_AN_OFFSET = """
import dataclasses
import numpy as np
from pathlib import Path
from harness.world.physics.body_state import BodyState
from harness.world.sensors.suite import SensorParams
from harness.world.sensors.wheel_odometry import WheelOdometry
from navstack.params.strict import load_dataclass

path = Path("sensors.yaml")
params = load_dataclass(SensorParams, path).odometry
for offset in (0.0, params.velocity_offset):
    sensor = WheelOdometry(dataclasses.replace(params, velocity_offset=offset))
    sensor.reset(BodyState(), np.random.default_rng(0))
    message = sensor.measure(BodyState(vx=1.0), np.empty((0, 4)), 0.0)
    print(message.twist.linear_x)
"""


def test_a_sensor_error_is_one_file(walk: Walk) -> None:
    walk.edit(
        ODOMETRY,
        (
            "    latency: ",
            "    velocity_offset: float = 0.0  # [m/s] of the reported forward velocity\n"
            "    latency: ",
        ),
        ("linear * body.vx + ", "linear * body.vx + params.velocity_offset + "),
    )
    preset = (ROOT / "params" / "sensors" / "rtk_good.yaml").read_text(encoding="utf-8")
    with_error = preset.replace("odometry:\n", "odometry:\n  velocity_offset: 0.25  # [m/s]\n")
    (walk.folder / "sensors.yaml").write_text(with_error, encoding="utf-8")
    plain, offset = map(float, walk.printed(DRIVE_WITH_AN_OFFSET))
    assert offset - plain == pytest.approx(0.25)


SUITE, BAROMETER, TYPES = (
    "harness/world/sensors/suite.py",
    "harness/world/sensors/barometer.py",
    "navstack/types.py",
)
BAROMETER_TEXT = '''"""A barometer."""

import numpy as np

from harness.world.physics.body_state import BodyState
from harness.world.sensors.sensor import Sensor
from navstack.types import FloatArray


class Barometer(Sensor[float]):
    """Measures the air pressure in [hPa]."""

    def reset(self, body: BodyState, rng: np.random.Generator) -> None:
        """Keep the generator of the white noise."""
        self._rng = rng

    def measure(self, body: BodyState, pedestrians: FloatArray, stamp: float) -> float:
        """The pressure now."""
        return float(1013.0 + self._rng.standard_normal())
'''
MEASURE_ONCE = """
from pathlib import Path
import numpy as np
from harness.task.study import RandomStreams
from harness.world.map.scene import Scene
from harness.world.physics.body_state import BodyState
from harness.world.sensors.suite import SensorParams, SensorSuite
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.params.strict import load_dataclass
from navstack.types import Pose2D

grid = OccupancyGrid(np.zeros((20, 20), dtype=np.int8), 0.1, Pose2D())
params = load_dataclass(SensorParams, Path("sensors.yaml"))
suite = SensorSuite(params, Scene("test", (), (), grid, grid), 0.3)
suite.reset(BodyState(), RandomStreams(0, 0))
print(suite.measure(BodyState(), np.empty((0, 4)), 0.0).pressure)
"""


def test_a_sensor_is_its_file_its_message_and_its_mount(walk: Walk) -> None:
    (walk.folder / BAROMETER).write_text(BAROMETER_TEXT, encoding="utf-8")
    walk.edit(
        TYPES,
        (
            "    scan: LaserScan | None = None\n",
            "    scan: LaserScan | None = None\n    pressure: float | None = None  # [hPa]\n",
        ),
    )
    walk.edit(
        SUITE,
        (
            "from harness.world.sensors.gps_receiver",
            "from harness.world.sensors.barometer import Barometer\n"
            "from harness.world.sensors.gps_receiver",
        ),
        (
            "        self._lidar = ",
            '        self._pressure = Channel("barometer", Barometer(), 10.0, 0.0)\n'
            "        self._lidar = ",
        ),
        (
            "            self._odometry,\n",
            "            self._pressure,\n            self._odometry,\n",
        ),
        (
            "            scan=self._lidar",
            "            pressure=self._pressure.deliver(body, pedestrians, stamp),\n"
            "            scan=self._lidar",
        ),
    )
    shutil.copy(ROOT / "params" / "sensors" / "rtk_good.yaml", walk.folder / "sensors.yaml")
    (pressure,) = walk.printed(MEASURE_ONCE)
    assert float(pressure) == pytest.approx(1013.0, abs=5.0)
    assert "type: ignore" not in (walk.folder / SUITE).read_text(encoding="utf-8")


CATALOG = "harness/metrics/catalog.toml"
ENTRY = """
[groups.Motion.added_mps]
title = "Speed, 95th percentile"
better = "higher"
meaning = "95th percentile of the true forward speed."
source = "ours"
mean_key = "avg_added_mps"
decimals = 2
series = "speed"
statistic = "p95"
"""
DRIVE_AND_SUM_UP = """
import numpy as np
from harness.metrics.columns import EPISODE_COLUMNS
from harness.metrics.delivery_log import DeliveryLog
from harness.metrics.encounters import Body
from harness.metrics.summary import summarize_more
from harness.report.table_rows import further_metrics
from harness.world.map.scene import Scene
from harness.world.truth import Truth
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.types import Pose2D, Twist2D

def truth(tick):
    people = np.empty((0, 4))
    return Truth(0.1 * tick, Pose2D(), 0.0, Twist2D(0.1 * tick), people, (), (), None)

ground = OccupancyGrid(np.zeros((1, 1), np.int8), 100.0, Pose2D())
log = DeliveryLog(
    truth(0), Scene("flat", (), (), ground, ground), Body((0.0, 0.0), (0.5, 0.25), 0.3)
)
for tick in range(1, 101):
    log.record(truth(tick), None)
row = dict.fromkeys(EPISODE_COLUMNS) | log.measurements(truth(100))
assert "avg_added_mps" in [row.key for s in further_metrics().sections for row in s.rows]
print(EPISODE_COLUMNS["added_mps"], row["added_mps"])
print(summarize_more([row])["avg_added_mps"])
"""


def test_a_metric_is_one_file(walk: Walk) -> None:
    walk.append(CATALOG, ENTRY)
    kind, value, mean = walk.printed(DRIVE_AND_SUM_UP)
    assert kind == "double"
    assert float(value) == float(mean) == pytest.approx(9.5)


FORMULAS = "harness/metrics/formulas.py"
FORMULA = '''def speed_range(series: Mapping[str, FloatArray]) -> float | None:
    """Fastest less slowest."""
    return float(np.ptp(series["speed"]))


# By group of the catalog'''
FORMULA_ENTRY = """    "Motion": (
        Metric(
            key="added_mps",
            title="Range of speeds",
            better=Better.NEITHER,
            meaning="Fastest less slowest true forward speed.",
            source="ours",
            mean_key="avg_added_mps",
            decimals=2,
            formula=speed_range,
        ),
"""


def test_a_metric_with_a_formula_of_its_own_is_one_file(walk: Walk) -> None:
    walk.edit(
        FORMULAS, ("# By group of the catalog", FORMULA), ('    "Motion": (\n', FORMULA_ENTRY)
    )
    kind, value, mean = walk.printed(DRIVE_AND_SUM_UP)
    assert kind == "double"
    assert float(value) == float(mean) == pytest.approx(10.0)
