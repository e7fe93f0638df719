"""A real browser for whatever writes pages."""

import contextlib
import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

CHROMIUM, DRIVER = "chromium", "chromedriver"
SWITCHES = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)


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
