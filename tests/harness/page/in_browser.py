"""What tests of pages in a browser have in common."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

SOON = 20.0  # [s] that anything may take on a busy machine

Browse = Callable[[Path, int], Any]


def wait(browser: Any, condition: str) -> Any:
    """What a JavaScript expression gives once it is true."""
    from selenium.webdriver.support.ui import WebDriverWait

    return WebDriverWait(browser, SOON, 0.05).until(
        lambda each: each.execute_script(f"return {condition}")
    )


def choose(browser: Any, select: str, value: str) -> None:
    """Choose an entry of a list, as a user does."""
    from selenium.webdriver.common.by import By
    from selenium.webdriver.support.ui import Select

    Select(browser.find_element(By.ID, select)).select_by_value(value)


def shown(browser: Any) -> list[list[str]]:
    """The cells of the list of deliveries."""
    rows: list[list[str]] = browser.execute_script(
        "return [...document.querySelectorAll('#deliveries-table tbody tr')]"
        ".map(row => [...row.cells].map(cell => cell.textContent))"
    )
    return rows


def picture(browser: Any) -> str:
    """What the replay's canvas shows, once its size is known."""
    wait(browser, "document.querySelector('#player canvas').ratio")
    content: str = browser.execute_script(
        "return document.querySelector('#player canvas').toDataURL()"
    )
    return content
