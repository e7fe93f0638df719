"""A real browser for whatever writes pages, and the memory of the processes that run tests."""

import contextlib
import gc
import resource
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from harness.execution.process_cache import forget
from harness.execution.workers import give_memory_back

CHROMIUM, DRIVER = "chromium", "chromedriver"
SWITCHES = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)
MEMORY = Path("/proc/self/statm")  # pages of this process; the second number: resident ones
ROOM = 800e6  # [bytes] beyond which a process forgets the worlds of earlier tests
GROWTH = 50e6  # [bytes] since it forgot last: every object is looked at, which takes half a second
left = [ROOM - GROWTH]  # [bytes] what was still there after it forgot


def pytest_sessionstart() -> None:
    give_memory_back()


def resident() -> float:
    """Memory of this process [bytes]; 0: the system does not say."""
    return int(MEMORY.read_text().split()[1]) * resource.getpagesize() if MEMORY.exists() else 0.0


def pytest_runtest_logfinish() -> None:
    if resident() > left[-1] + GROWTH:
        forget()
        gc.collect()
        left.append(resident())


@pytest.fixture
def browse(tmp_path: Path) -> Iterator[Callable[[Path | str, int], Any]]:
    """Open a file or an address in headless Chromium at a width; the test is skipped where there is none."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    chromium, driver = shutil.which(CHROMIUM), shutil.which(DRIVER)
    if chromium is None or driver is None:
        pytest.skip("Chromium is not installed: apt-get install chromium chromium-driver")
    with contextlib.ExitStack() as open_browsers:

        def show(page: Path | str, width: int) -> Any:
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
            browser.get(page.as_uri() if isinstance(page, Path) else page)
            return browser

        yield show
