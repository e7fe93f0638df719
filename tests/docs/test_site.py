"""The site builds without a warning, asks nobody for anything, and fits a telephone."""

import contextlib
import json
import logging
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from harness.metrics.catalog import EPISODE_METRICS, RUN_METRICS
from navstack.params.lint.rules import RULES

from .blocks import ROOT

pytest.importorskip("mkdocs", reason="mkdocs is not installed: pip install 'navbench[dev]'")
pytest.importorskip(
    "material", reason="mkdocs-material is not installed: pip install 'navbench[dev]'"
)

WIDTHS = (1440, 390)
SHOWN = ("index", "quick_start", "add_a_controller", "metrics", "money", "measured")
SOON = 20.0  # [s] that anything may take on a busy machine


class Warnings(logging.Handler):
    """Keeps what is complained of."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a record."""
        self.texts.append(record.getMessage())


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built as ``make docs`` does."""
    from mkdocs.commands.build import build
    from mkdocs.config import load_config

    folder, handler, logger = (
        tmp_path_factory.mktemp("site"),
        Warnings(),
        logging.getLogger("mkdocs"),
    )
    logger.addHandler(handler)
    try:
        config = load_config(str(ROOT / "mkdocs.yml"), site_dir=str(folder), strict=True)
        with contextlib.suppress(SystemExit):
            build(config)
    finally:
        logger.removeHandler(handler)
    assert not handler.texts
    return folder


def test_every_page_is_there(site: Path) -> None:
    for page in (ROOT / "docs").glob("*.md"):
        assert (site / f"{page.stem}.html").is_file(), page.name


def test_pages_have_what_is_made_for_them(site: Path) -> None:
    metrics = (site / "metrics.html").read_text(encoding="utf-8")
    assert all(
        f"<code>{metric.key}</code>" in metrics for metric in (*EPISODE_METRICS, *RUN_METRICS)
    )
    assert all(
        f"<code>{rule.id}</code>" in (site / "lint.html").read_text(encoding="utf-8")
        for rule in RULES
    )
    assert all((site / f"{name}.html").is_file() for name in ("published_3", "helsinki"))
    assert (site / "measured.html").is_file() and (site / "measured" / "margin.png").is_file()


def test_nothing_is_loaded_from_elsewhere(site: Path) -> None:
    for page in site.glob("**/*.html"):
        text = page.read_text(encoding="utf-8")
        assert not re.findall(
            r"<(?:script|img|iframe|link)[^>]*(?:src|href)=\"?(?:https?:)?//[^>]*>", text
        ), page.name


@pytest.mark.parametrize("width", WIDTHS)
def test_pages_in_a_folder_fit_and_ask_nobody(
    site: Path, width: int, browse: Callable[[str, int], Any]
) -> None:
    address = site.as_uri()
    browser = browse(f"{address}/{SHOWN[0]}.html", width)
    for page in SHOWN:
        browser.get(f"{address}/{page}.html")
        assert browser.execute_script("return document.documentElement.scrollWidth") <= width, page
    find(browser)
    assert not [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]
    messages = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    asked = [
        each["params"]["request"]["url"]
        for each in messages
        if each["method"] == "Network.requestWillBeSent"
    ]
    assert asked and not [
        url for url in asked if not url.startswith((address, "data:", "blob:", "chrome"))
    ]


def find(browser: Any) -> None:
    """Search for a word, as a user does; a result leads to its page."""
    from selenium.webdriver.support.ui import WebDriverWait

    browser.execute_script(
        "const query = document.querySelector('[data-md-component=search-query]');"
        "document.querySelector('#__search').click(); query.focus(); query.value = 'Gauss-Markov';"
        "query.dispatchEvent(new Event('keyup', {bubbles: true})); query.dispatchEvent(new "
        "Event('input'))"
    )
    links = (
        "return [...document.querySelectorAll('.md-search-result__link')].map(each => each.href)"
    )
    found = WebDriverWait(browser, SOON).until(lambda each: each.execute_script(links))
    assert any("sensors" in link or "ablation" in link for link in found)
