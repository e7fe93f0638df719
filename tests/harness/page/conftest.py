"""Recordings without a simulation, and pages of them in a real browser."""

import contextlib
import json
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.metrics import EPISODE_COLUMNS, EVENT_COLUMNS
from harness.table_files import read_rows, write_table

CHROMIUM, DRIVER = "chromium", "chromedriver"
SWITCHES = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)
HITS = (4.0, 9.0)  # [s] of two contacts that cost something


def arrays_of(row: dict[str, Any], seed: int = 0, beams: int = 36, people: int = 5) -> dict[str, Any]:
    """A recording of a drive along a bent line from start to goal, with everything that a replay shows."""
    rng = np.random.default_rng(seed)
    stamps = np.arange(0.1, row["duration_s"], 0.1)
    share = stamps / row["duration_s"]
    x = row["start_x_m"] + share * (row["goal_x_m"] - row["start_x_m"])
    y = row["start_y_m"] + share * (row["goal_y_m"] - row["start_y_m"]) + 3.0 * np.sin(np.pi * share)
    yaw = np.arctan2(np.gradient(y), np.gradient(x))
    speed, rows = np.hypot(np.gradient(x), np.gradient(y)) * 10.0, len(stamps)
    believed = np.column_stack((x, y, yaw)) + rng.normal(0.0, 0.05, (rows, 3))
    motion = np.column_stack((speed, np.zeros(rows)))
    crowd = np.column_stack((x, y))[:, None, :] + rng.uniform(-8.0, 8.0, people * 2).reshape(1, people, 2)
    plans = [np.column_stack((x, y))[k::10].astype(np.float32) for k in range(0, rows, 50)]
    tracks = np.column_stack((np.full(rows, 7.0), crowd[:, 0], np.zeros((rows, 2)), np.full(rows, 0.3)))
    ranges = rng.integers(2000, 12000, (rows, beams)).astype(np.uint16)
    ranges[:, 0] = 65535
    return {
        "trace": np.column_stack((stamps, x, y, yaw, motion, believed, motion)),
        "crowd": crowd,
        "pieces_lost": np.minimum(np.arange(rows) // 100, 3).astype(np.int32),
        "motion_energy_j": 30.0 * stamps,
        "odometry": np.column_stack((x - x[0], y - y[0], yaw, motion)),
        "belief_covariance": np.full((rows, 3), (0.04, 0.01, 0.02), dtype=np.float32),
        "track_count": np.ones(rows, dtype=np.int32),
        "tracks": tracks.astype(np.float32),
        "scan_stamp": stamps,
        "scan_mm": ranges,
        "scan_geometry": np.array((-np.pi, 2.0 * np.pi / beams, 0.15, 12.0, -0.2, 0.0, 0.0)),
        "plan_stamp": stamps[::50],
        "plan_size": np.array([len(plan) for plan in plans], dtype=np.int32),
        "plan_xy": np.concatenate(plans),
    }


@pytest.fixture(scope="session")
def make_arrays() -> Callable[..., dict[str, Any]]:
    """See :func:`arrays_of`."""
    return arrays_of


@pytest.fixture
def record() -> Callable[..., None]:
    """Give deliveries of a run folder recordings, and its costed contacts places and times."""

    def add(folder: Path, stack: str, episodes: range, **more: Any) -> None:
        (folder / "recordings").mkdir(exist_ok=True)
        for row in read_rows(folder / "episodes.parquet", EPISODE_COLUMNS):
            if row["stack"] == stack and row["episode"] in episodes:
                arrays = arrays_of(row, row["episode"], **more)
                np.savez_compressed(folder / "recordings" / f"{stack}-{row['episode']}.npz", **arrays)
        place_events(folder)

    return add


def place_events(folder: Path) -> None:
    """Contacts happen on the way, a few seconds apart."""
    ends = {(row["stack"], row["episode"]): row for row in read_rows(folder / "episodes.parquet", EPISODE_COLUMNS)}
    events = read_rows(folder / "events.parquet", EVENT_COLUMNS)
    for event in events:
        row = ends[event["stack"], event["episode"]]
        event |= {"x_m": row["start_x_m"] + 1.0, "y_m": row["start_y_m"] + 1.0}
        event["stamp_s"] = HITS[event["partner_id"] % 2]
    write_table(folder / "events.parquet", EVENT_COLUMNS, events)


@pytest.fixture
def rename_map() -> Callable[[Path, str], None]:
    """Let a run folder say that its map has another name."""

    def rename(folder: Path, name: str) -> None:
        about = json.loads((folder / "run.json").read_text(encoding="utf-8"))
        (folder / "run.json").write_text(json.dumps({**about, "map_name": name}), encoding="utf-8")
        rows = read_rows(folder / "episodes.parquet", EPISODE_COLUMNS)
        write_table(folder / "episodes.parquet", EPISODE_COLUMNS, [{**row, "map": name} for row in rows])

    return rename


@pytest.fixture
def browse(tmp_path: Path) -> Iterator[Callable[[Path, int], Any]]:
    """Open a page in headless Chromium at a width; the test is skipped where there is none."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    chromium, driver = shutil.which(CHROMIUM), shutil.which(DRIVER)
    if chromium is None or driver is None:
        pytest.skip("Chromium is not installed: apt-get install chromium chromium-driver")
    with contextlib.ExitStack() as open_browsers:

        def show(page: Path, width: int) -> Any:
            options = webdriver.ChromeOptions()
            options.binary_location = chromium
            for switch in (*SWITCHES, f"--user-data-dir={tmp_path / f'profile-{width}'}"):
                options.add_argument(switch)
            options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
            browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
            open_browsers.callback(browser.quit)
            size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
            browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
            browser.get_log("performance")  # of the empty page before
            browser.get(page.as_uri())
            return browser

        yield show
