"""What tests of pages in a browser have in common."""

SOON = 20.0  # [s] that anything may take on a busy machine


def wait(browser, condition):
    """What a JavaScript expression gives once it is true."""
    from selenium.webdriver.support.ui import WebDriverWait

    return WebDriverWait(browser, SOON, 0.05).until(
        lambda each: each.execute_script(f"return {condition}")
    )


def choose(browser, select, value):
    """Choose an entry of a list, as a user does."""
    from selenium.webdriver.common.by import By
    from selenium.webdriver.support.ui import Select

    Select(browser.find_element(By.ID, select)).select_by_value(value)


def shown(browser):
    """The cells of the list of deliveries."""
    rows = browser.execute_script(
        "return [...document.querySelectorAll('#deliveries-table tbody tr')]"
        ".map(row => [...row.cells].map(cell => cell.textContent))"
    )
    return rows


def picture(browser):
    """What the replay's canvas shows, once its size is known."""
    wait(browser, "document.querySelector('#player canvas').ratio")
    content = browser.execute_script("return document.querySelector('#player canvas').toDataURL()")
    return content
