"""A real browser, what tests need not make anew, and the memory of the processes that run them."""

import compileall
import contextlib
import functools
import gc
import os
import resource
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from harness.execution.executors import InProcess, give_memory_back
from harness.execution.process_cache import forget
from harness.execution.workers import Workers
from harness.report import figures
from harness.study.compile_ahead import compile_new, every_module
from navstack.costmap.map_io import save_map
from navstack.costmap.occupancy_grid import OccupancyGrid
from navstack.params.nav2_file import file as nav2_file
from navstack.params.nav2_file import merged, ros_yaml, yaml_text
from navstack.types import Pose2D

# Debian's name, and those of Google's packages
CHROMIUM, DRIVER = ("chromium", "google-chrome", "chrome"), "chromedriver"
SWITCHES = (
    *("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)
ROOT = Path(__file__).parents[1]
PACKAGES = ("navstack", "harness", "navbench", "tools")
MEMORY = Path("/proc/self/statm")  # pages of this process; the second number: resident ones
SHARE = 0.4  # of the machine's memory for the processes that run tests, one per core
# [bytes] of one; beyond it a process forgets the worlds of earlier tests
LEAST_ROOM, MOST_ROOM = 0.8e9, 1.1e9
# [bytes] since it forgot last: a world and a brain, which take two seconds to make anew
GROWTH = 300e6
RENDERED = figures.rendered
left: list[float] = []  # [bytes] what was still there after it forgot


def pytest_sessionstart(session: pytest.Session) -> None:
    give_memory_back()
    if getattr(session.config.option, "numprocesses", None) and not hasattr(
        session.config, "workerinput"
    ):
        # once, what each process of tests, and each that they start, would compile for itself
        compile_new(every_module())
        for package in PACKAGES:
            compileall.compile_dir(ROOT / package, quiet=1)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Modules with slow tests begin first, so that none of them is what all others wait for."""
    long = {item.path for item in items if item.get_closest_marker("slow")}
    items.sort(key=lambda item: item.path not in long)


def pytest_collection_finish() -> None:
    """All modules are imported, and stay: no later look for garbage goes through them."""
    gc.collect()
    gc.freeze()


def resident() -> float:
    """Memory of this process [bytes]; 0: the system does not say."""
    return int(MEMORY.read_text().split()[1]) * resource.getpagesize() if MEMORY.exists() else 0.0


def room() -> float:
    """Memory that one process may take [bytes]."""
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    return min(max(SHARE * memory / (os.cpu_count() or 1), LEAST_ROOM), MOST_ROOM)


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Slow tests have the most room: some make worlds of their own beside those of the process."""
    if item.get_closest_marker("slow") and resident() > LEAST_ROOM:
        forget()
        gc.collect()


def pytest_runtest_logfinish() -> None:
    if resident() > (left[-1] + GROWTH if left else room()):
        forget()
        gc.collect()
        left.append(resident())


@pytest.fixture(scope="session", autouse=True)
def quick_disk() -> Iterator[None]:
    """No test waits until files are on the disk: none takes the power away."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(os, "fsync", lambda descriptor: None)
        yield


def sketched(figure: Any, suffixes: Sequence[str]) -> list[bytes]:
    """What :func:`figures.rendered` gives, of a figure of one white dot."""
    dot = BytesIO()
    Image.new("RGB", (1, 1), "white").save(dot, "png")
    contents = {".png": dot.getvalue(), ".pdf": b"%PDF-1.4\n", ".svg": b"<svg/>"}
    return [contents[suffix] for suffix in suffixes]


@pytest.fixture(scope="session", autouse=True)
def sketches() -> Iterator[None]:
    """Figures are drawn, but their files are not rendered, which takes two seconds each."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "rendered", sketched)
        yield


@pytest.fixture(scope="session", autouse=True)
def known_files() -> Iterator[None]:
    """Nav2 files of the same content are parsed and written once.

    Each command does both for each stack, which takes it half a second.
    """
    texts: dict[str, str] = {}

    def dumped(nested: Mapping[str, Any]) -> str:
        content = repr(nested)
        if content not in texts:
            texts[content] = merged.dump(nested)
        return texts[content]

    compose = functools.lru_cache(maxsize=40)(yaml_text.compose_text.__wrapped__)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(nav2_file, "dump", dumped)
        patch.setattr(ros_yaml, "compose_text", compose)
        yield


@pytest.fixture
def rendering() -> Iterator[None]:
    """Figures are rendered, as the program does."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "rendered", RENDERED)
        yield


@contextlib.contextmanager
def _in_process() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            Workers.__init__,
            "__defaults__",
            (InProcess, *(Workers.__init__.__defaults__ or ())[1:]),
        )
        yield


@pytest.fixture
def in_process() -> Iterator[None]:
    """Deliveries are driven in this process.

    Others take seconds to start, and give the same rows.
    """
    with _in_process():
        yield


@pytest.fixture(scope="session")
def driven_in_process() -> Callable[[], contextlib.AbstractContextManager[None]]:
    """The same as a context, for fixtures that are made once for several tests."""
    return _in_process


@pytest.fixture(scope="session")
def hall(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The map of a hall of 60 m by 40 m.

    A world on it is made in a tenth of the time that a shipped map takes.
    """
    cells = np.zeros((400, 600), dtype=np.int8)
    cells[[0, -1]], cells[:, [0, -1]] = 100, 100
    path = tmp_path_factory.mktemp("hall") / "hall.yaml"
    save_map(OccupancyGrid(cells, 0.1, Pose2D()), path)
    return path


@pytest.fixture(scope="session")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """One headless Chromium for all tests of a process.

    Those that need it are skipped where there is none.
    """
    webdriver = pytest.importorskip("selenium.webdriver", reason="selenium is not installed")
    chromium = next(filter(None, map(shutil.which, CHROMIUM)), None)
    driver = shutil.which(DRIVER)
    if chromium is None or driver is None:
        pytest.skip("Chromium is not installed: apt-get install chromium chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = chromium
    for switch in (*SWITCHES, f"--user-data-dir={tmp_path_factory.mktemp('profile')}"):
        options.add_argument(switch)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    started = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    yield started
    started.quit()


@pytest.fixture
def browse(browser: Any) -> Iterator[Callable[[Path | str, int], Any]]:
    """Open a file or an address in the browser at a width, with nothing of the pages before it.

    A page that plays deliveries takes a third of a core, so none is left open.
    """

    def show(page: Path | str, width: int) -> Any:
        browser.get("about:blank")
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
        # else a page of a window in the background hears of no focus
        browser.execute_cdp_cmd("Emulation.setFocusEmulationEnabled", {"enabled": True})
        browser.execute_cdp_cmd(
            "Storage.clearDataForOrigin", {"origin": "*", "storageTypes": "all"}
        )
        for log in ("browser", "performance"):
            browser.get_log(log)
        browser.get(page.as_uri() if isinstance(page, Path) else page)
        return browser

    yield show
    browser.get("about:blank")
