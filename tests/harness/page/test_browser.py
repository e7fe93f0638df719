"""The page in a real Chromium.

It opens from a file, filters, plays and scrubs, and asks nobody for anything.
"""

import json
import time

import pytest

from harness.report.repriced import SHOWN, TITLES
from harness.study.manifest import map_digest
from harness.world.map.scene_io import load_scene
from navbench.api.report import report
from navbench.api.runs import load

from .in_browser import choose, picture, shown, wait

EVIL = "<script>alert(1)"
INTERACTIVE_MS = 3000.0
FRAME_MS = 1000.0 / 30.0
LEAST_FRAMES = 30  # in a second of playing
TRIES = 4  # of what takes a while on a busy machine
WIDTHS = (1440, 390)


def replay_facts(browser, number):
    """What the page was given of a recorded delivery."""
    facts = browser.execute_script(
        f"return JSON.parse(document.getElementById('data').textContent).replays[{number}]"
    )
    return facts


def requested(browser):
    """Where the page asked for something, by scheme."""
    messages = [json.loads(entry["message"])["message"] for entry in browser.get_log("performance")]
    sent = [each["params"] for each in messages if each["method"] == "Network.requestWillBeSent"]
    # the empty tab's
    own = [each["request"]["url"] for each in sent if not each["documentURL"].startswith("chrome")]
    return {url.split(":", 1)[0] for url in own}


@pytest.fixture(scope="module")
def folder(write_run_to, record, tmp_path_factory):
    """Two stacks of 30 deliveries, three of them recorded."""
    folder = write_run_to(tmp_path_factory.mktemp("runs"))(
        "one",
        stacks=("mine", EVIL),
        episodes=30,
        crowd=1.5,
        map_sha256=map_digest(load_scene("sidewalk")),
    )
    record(folder, "mine", range(2), beams=360, people=20)
    record(folder, EVIL, range(1))
    return folder


@pytest.fixture(scope="module")
def page(folder):
    """Its report."""
    report([load(folder)], folder.parent / "report.html")
    return folder.parent / "report.html"


@pytest.mark.parametrize("width", WIDTHS)
def test_a_report_works_from_a_file(page, browse, width):
    browser = browse(page, width)
    wait(browser, "document.documentElement.dataset.ready")
    wait(browser, "document.querySelector('#player').dataset.ready")
    assert opening(browser) < INTERACTIVE_MS
    assert browser.execute_script("return document.documentElement.scrollWidth") <= width
    # data, program, recordings
    assert browser.execute_script("return document.scripts.length") == 1 + 1 + 3
    assert EVIL in browser.execute_script("return document.querySelector('.cards').textContent")
    labels = (
        "return [...document.querySelectorAll('.figure > svg, canvas')]"
        ".map(each => each.getAttribute('aria-label'))"
    )
    charts = browser.execute_script(labels)
    assert len(charts) >= 6 and all(charts)
    _check_who_pays(browser)
    _check_filters(browser)
    _check_replay(browser)
    assert [entry["message"] for entry in browser.get_log("browser")] == []
    assert {"file"} <= requested(browser) <= {"file", "data"}


def opening(browser):
    """How long the page took to be ready [ms].

    The quickest of some times, for others may be using the machine.
    """
    took = []
    for _ in range(TRIES):
        took.append(float(wait(browser, "document.documentElement.dataset.ready")))
        if took[-1] < INTERACTIVE_MS:
            break
        browser.refresh()
    wait(browser, "document.querySelector('#player').dataset.ready")
    return min(took)


def _check_who_pays(browser):
    """The first accounting's margins are those of the cards."""
    rows_of = "[...document.querySelectorAll('#liability tbody tr')]"
    cells = f"return {rows_of}.map(row => [...row.cells].map(cell => cell.textContent))"
    rows = browser.execute_script(cells)
    cards = browser.execute_script(
        "return [...document.querySelectorAll('.cards .big')].map(c => c.textContent)"
    )
    assert [row[0] for row in rows] == [TITLES[name] for name in SHOWN]
    assert len(rows[0]) == len(cards) > 1, "the last card is a published stack's"
    assert all(text.startswith(card) for text, card in zip(rows[0][1:], cards[:-1], strict=True))


def _check_filters(browser):
    everything = shown(browser)
    profits = [float(row[3].replace("−", "-")) for row in everything]
    assert profits == sorted(profits)
    choose(browser, "by-stack", "1")
    assert {row[1] for row in shown(browser)} == {EVIL}
    choose(browser, "by-cost", "person")
    assert all(int(row[7]) > 0 for row in shown(browser))
    choose(browser, "by-outcome", "timeout")
    assert {row[5] for row in shown(browser)} <= {"late"}
    told = browser.execute_script("return document.querySelector('#list-count').textContent")
    assert told == f"{len(shown(browser))} of 60 deliveries"
    for key, value in (("by-stack", ""), ("by-cost", "all"), ("by-outcome", "")):
        choose(browser, key, value)
    browser.execute_script("document.querySelector('th[data-key=duration] button').click()")
    times = [float(row[11]) for row in shown(browser)]
    assert times == sorted(times)


def _check_replay(browser):
    openers = "[...document.querySelectorAll('#deliveries-table [data-replay]')]"
    numbers = browser.execute_script(f"return {openers}.map(each => each.dataset.replay)")
    number = next(each for each in numbers if replay_facts(browser, each)["reasons"])
    browser.execute_script(f"{openers}.find(each => each.dataset.replay === '{number}').click()")
    wait(browser, f"document.querySelector('#player').dataset.ready === '{number}'")
    blank = picture(browser)
    slider = "document.querySelector('#player .seek')"
    move = f"const s = {slider}; s.value = arguments[0]; s.dispatchEvent(new Event('input'))"
    browser.execute_script(move, 6.0)
    assert browser.execute_script("return document.querySelector('#player').dataset.time") == "6.00"
    assert picture(browser) != blank
    browser.execute_script("document.querySelector('#player .play').click()")
    wait(browser, "Number(document.querySelector('#player').dataset.time) > 6.5")
    browser.execute_script("document.querySelector('#player .play').click()")
    browser.execute_script(move, 0.0)
    jumps = (
        "[...document.querySelectorAll('#player .transport button')].find(b => "
        "b.textContent.startsWith('Next'))"
    )
    if not browser.execute_script(f"return {jumps}.disabled"):
        browser.execute_script(f"{jumps}.click()")
        facts = replay_facts(browser, number)
        paid = [hit[2] for hit in facts["contacts"] if hit[5] > 0]
        stop = min(paid + [why["time"] for why in facts["reasons"]])
        assert (
            browser.execute_script("return document.querySelector('#player').dataset.time")
            == f"{stop - 2.0:.2f}"
        )
    _check_reasons(browser, move)
    _check_end(browser, number, move)
    drawing = (
        f"const s = {slider}, began = performance.now();"
        "for (let k = 0; k < 60; k++) { s.value = k / 10; s.dispatchEvent(new Event('input')); }"
        "return (performance.now() - began) / 60"
    )
    assert any(browser.execute_script(drawing) < FRAME_MS for _ in range(TRIES))


def _check_end(browser, number, move):
    """In the end everything has been paid: what the delivery cost is what its bill says."""
    browser.execute_script(move, 1e6)
    facts = (
        "Object.fromEntries([...document.querySelectorAll('#player dt')]"
        ".map(dt => [dt.textContent, dt.nextSibling.textContent]))"
    )
    told = browser.execute_script(f"return {facts}['costs so far']")
    assert told == f"${replay_facts(browser, number)['money']['opex']:,.2f}"
    assert (
        browser.execute_script("return document.querySelectorAll('#player .costs .later').length")
        == 0
    )
    assert browser.execute_script(f"return {facts}['ended']")


def _check_reasons(browser, move):
    """Why an event cost what it cost opens as it comes near, or when it is chosen.

    Its text fits.
    """
    browser.execute_script(move, 0.0)
    opened = "return [...document.querySelectorAll('#player .why details')].map(each => each.open)"
    reasons = browser.execute_script(opened)
    assert reasons and not any(reasons)
    first = "document.querySelector('#player .why details')"
    stamp = browser.execute_script(f"return Number({first}.dataset.time)")
    browser.execute_script(move, max(stamp - 1.0, 0.0))
    assert sum(browser.execute_script(opened)) == 1
    browser.execute_script(move, 0.0)
    assert not any(browser.execute_script(opened))
    browser.execute_script(f"{first}.querySelector('summary').click()")
    assert browser.execute_script(opened)[0]
    assert (
        browser.execute_script("return document.querySelector('#player').dataset.time")
        == f"{max(stamp - 2.0, 0):.2f}"
    )
    told = browser.execute_script(
        "return document.querySelector('#player .why details[open] p').textContent"
    )
    assert len(told) > 40 and "undefined" not in told
    assert browser.execute_script(
        "const box = document.querySelector('#player .why').getBoundingClientRect();"
        "return box.left >= 0 && box.right <= document.documentElement.clientWidth"
    )


@pytest.mark.slow
def test_a_large_report_is_quick(write_run, record, navbench, browse, tmp_path):
    """Three stacks of 100 deliveries, 20 of them with a replay.

    Soon there, and 30 pictures a second and more.
    """

    def long(row):
        row["duration_s"] = 120.0

    digest = map_digest(load_scene("sidewalk"))
    folder = write_run(
        "large",
        stacks=("a", "b", "c"),
        episodes=100,
        change=long,
        map_sha256=digest,
    )
    for stack, count in (("a", 7), ("b", 7), ("c", 6)):
        record(folder, stack, range(count), beams=360, people=20)
    navbench("report", folder, "--replays", 20, "--out", tmp_path / "report.html")
    browser = browse(tmp_path / "report.html", 1440)
    assert opening(browser) < INTERACTIVE_MS
    assert browser.execute_script("return document.scripts.length") == 1 + 1 + 20
    play = "document.querySelector('#player .play').click()"
    frames = "return Number(document.querySelector('#player').dataset.frames || 0)"
    shown = []
    for _ in range(TRIES):
        before = browser.execute_script(f"{play}; {frames}")
        time.sleep(1.0)
        shown.append(browser.execute_script(f"{frames}") - before)
        browser.execute_script(play)
        if shown[-1] >= LEAST_FRAMES:
            break
    assert max(shown) >= LEAST_FRAMES


def test_keys_play_and_the_theme_can_be_chosen(page, browse):
    from selenium.webdriver.common.by import By
    from selenium.webdriver.common.keys import Keys

    browser = browse(page, 1440)
    wait(browser, "document.querySelector('#player').dataset.ready")
    canvas = browser.find_element(By.CSS_SELECTOR, "#player canvas")
    browser.execute_script(
        "arguments[0].scrollIntoView({behavior: 'instant'}); arguments[0].focus()", canvas
    )
    canvas.send_keys(Keys.ARROW_RIGHT, Keys.ARROW_RIGHT)
    assert browser.execute_script("return document.querySelector('#player').dataset.time") == "2.00"
    canvas.send_keys(" ")
    wait(browser, "Number(document.querySelector('#player').dataset.time) > 2.2")
    slider = browser.find_element(By.CSS_SELECTOR, "#player .seek")
    slider.send_keys(Keys.HOME, Keys.ARROW_RIGHT, " ")  # it plays, and stops
    time = "return document.querySelector('#player').dataset.time"
    assert float(browser.execute_script(time)) < 2.0
    assert (
        browser.execute_script("return document.querySelector('#player .play').textContent")
        == "▶ Play"
    )
    before = browser.execute_script("return getComputedStyle(document.body).backgroundColor")
    browser.execute_script("document.querySelector('#theme').click()")
    assert (
        browser.execute_script("return getComputedStyle(document.body).backgroundColor") != before
    )
    assert [entry["message"] for entry in browser.get_log("browser")] == []


def test_a_replay_alone_works_from_a_file(folder, navbench, browse, tmp_path):
    file = tmp_path / "replay.html"
    assert navbench("replay", f"{folder}:mine", 1, "--html", file)[0] == 0
    browser = browse(file, 390)
    wait(browser, "document.querySelector('#player').dataset.ready")
    assert (
        browser.execute_script("return document.querySelector('h1').textContent")
        == "mine, episode 1"
    )
    assert browser.execute_script("return document.documentElement.scrollWidth") <= 390
    assert [entry["message"] for entry in browser.get_log("browser")] == []


def test_the_head_tells_what_all_runs_rest_on(write_run, navbench, browse, tmp_path):
    folders = [
        write_run(name, stacks=(name,), episodes=4, seed=seed)
        for name, seed in (("one", 3), ("two", 5))
    ]
    assert navbench("report", *folders, "--out", tmp_path / "report.html")[0] == 0
    browser = browse(tmp_path / "report.html", 1440)
    wait(browser, "document.documentElement.dataset.ready")
    head = browser.execute_script("return document.querySelector('.masthead .sub').textContent")
    assert "8 deliveries · map sidewalk · seed 3, 5 · people" in head


@pytest.fixture
def late_sizes(browser):
    """Pages learn the sizes of their parts a second late, as on a busy machine."""
    script = (
        "const Prompt = ResizeObserver;"
        "ResizeObserver = class extends Prompt {"
        "  constructor(act) { super((...seen) => setTimeout(() => act(...seen), 1000)); }"
        "};"
    )
    added = browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": script})
    yield
    browser.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", added)


@pytest.mark.usefixtures("late_sizes")
def test_show_all_counts_before_the_first_picture(page, browse):
    browser = browse(page, 1440)
    wait(browser, "document.querySelector('#player').dataset.ready")
    show_all = "document.querySelector('#player [aria-label=\"Show all\"]').click()"
    pressed = "return document.querySelector('#player [aria-pressed]').getAttribute('aria-pressed')"
    early = browser.execute_script(
        f"{show_all}; return !document.querySelector('#player canvas').ratio"
    )
    assert early and browser.execute_script(pressed) == "false"
    whole = picture(browser)
    browser.execute_script(show_all)
    assert browser.execute_script(pressed) == "false"
    assert picture(browser) == whole


def test_a_replay_opened_from_the_list_takes_the_keys_and_follows(page, browse):
    from selenium.webdriver.common.keys import Keys

    browser = browse(page, 1440)
    wait(browser, "document.querySelector('#player').dataset.ready")
    follow = (
        "return document.querySelector('#player [aria-label=\"Follow the "
        "robot\"]').getAttribute('aria-pressed')"
    )
    browser.execute_script("document.querySelector('#player [aria-label=\"Show all\"]').click()")
    wait(browser, f"{follow.removeprefix('return ')} === 'false'")
    number = browser.execute_script(
        "const other = [...document.querySelectorAll('#deliveries-table [data-replay]')]"
        ".find(b => b.dataset.replay !== document.querySelector('#player').dataset.ready);"
        "other.click(); return other.dataset.replay"
    )
    wait(browser, f"document.querySelector('#player').dataset.ready === '{number}'")
    assert browser.execute_script(follow) == "true"
    browser.switch_to.active_element.send_keys(Keys.ARROW_RIGHT)
    assert browser.execute_script("return document.querySelector('#player').dataset.time") == "1.00"


def test_paper_is_light_and_shows_what_is_folded(page, browse):
    browser = browse(page, 1440)
    wait(browser, "document.querySelector('#player').dataset.ready")
    browser.execute_script(
        "if (document.documentElement.dataset.theme === 'light') "
        "document.querySelector('#theme').click()"
    )
    choose(browser, "by-outcome", "timeout")
    dark = picture(browser)
    folded = browser.execute_script(
        "return document.querySelectorAll('details:not([open])').length"
    )
    browser.execute_script("dispatchEvent(new Event('beforeprint'))")
    assert browser.execute_script("return document.documentElement.dataset.theme") == "light"
    assert picture(browser) != dark  # drawn anew at once: the printer does not wait
    assert (
        folded
        and browser.execute_script("return document.querySelectorAll('details:not([open])').length")
        == 0
    )
    assert "too late" in browser.execute_script(
        "return document.querySelector('.printonly').textContent"
    )
    browser.execute_script("dispatchEvent(new Event('afterprint'))")
    assert browser.execute_script("return document.documentElement.dataset.theme") == "dark"
    assert (
        browser.execute_script("return document.querySelectorAll('details:not([open])').length")
        == folded
    )


@pytest.mark.parametrize("width", WIDTHS)
def test_two_stacks_drive_the_same_mission_in_one_replay(page, browse, width):
    browser = browse(page, width)
    wait(browser, "document.querySelector('#player').dataset.ready")
    numbers = browser.execute_script(
        "return JSON.parse(document.getElementById('data').textContent).replays.map(each => "
        "[each.entry, each.episode])"
    )
    alone, other, own = numbers.index([0, 1]), numbers.index([1, 0]), numbers.index([0, 0])
    choose(browser, "which", str(alone))  # its mission has been recorded once only
    wait(browser, f"document.querySelector('#player').dataset.ready === '{alone}'")
    assert browser.execute_script("return document.getElementById('beside')") is None
    choose(browser, "which", str(own))
    wait(browser, f"document.querySelector('#player').dataset.ready === '{own}'")
    lines = "document.querySelectorAll('#player g path').length"
    wait(browser, f"{lines} === 3")
    before = picture(browser)
    choose(browser, "beside", str(other))
    wait(browser, f"{lines} === 6")  # speed, clearance and costs of both
    assert picture(browser) != before
    legend = browser.execute_script("return document.querySelector('#player .legend').textContent")
    assert "mine, episode 0" in legend and f"{EVIL}, episode 0" in legend
    assert browser.execute_script("return document.documentElement.scrollWidth") <= width
    choose(browser, "beside", "")
    wait(browser, f"{lines} === 3")
    assert picture(browser) == before
    assert [entry["message"] for entry in browser.get_log("browser")] == []
