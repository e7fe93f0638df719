"""What single figures and controls of the page say, in a real Chromium."""

import json
import re

import numpy as np
import pytest
import shapely

from harness.metrics.columns import EPISODE_COLUMNS
from harness.report.page.document import report_page
from harness.storage.shipped import shipped
from harness.storage.tables import read_rows
from harness.study.manifest import map_digest
from harness.study.stored_run import load_run
from harness.world.map.scene_io import load_scene
from harness.world.physics.robot import RobotParams
from harness.world.world_params import WorldParams
from navstack.geometry import transform_points
from navstack.params.strict import load_dataclass
from navstack.types import Pose2D

from .in_browser import choose, shown, wait

DATA = re.compile(r'(<script type="application/json" id="data">)(.*?)(</script>)', re.DOTALL)
FACTS = (
    "Object.fromEntries([...document.querySelectorAll('#player dt')]"
    ".map(dt => [dt.textContent, dt.nextSibling.textContent]))"
)
TEXTS = "return [...document.querySelectorAll(arguments[0])].map(each => each.textContent)"
MOVE = (
    "const s = document.querySelector('#player .seek'); s.value = arguments[0]; "
    "s.dispatchEvent(new Event('input'))"
)


def opened(browse, path, folders, change=None):
    """A browser that shows the report of some runs, its data perhaps changed."""
    page = report_page([load_run(str(folder)) for folder in folders], 20, "")
    found = DATA.search(page)
    assert found
    data = json.loads(found[2])
    if change is not None:
        change(data)
    path.write_text(
        page[: found.start(2)] + json.dumps(data) + page[found.end(2) :], encoding="utf-8"
    )
    browser = browse(path, 1440)
    wait(browser, "document.documentElement.dataset.ready")
    if data["replays"]:
        wait(browser, "document.querySelector('#player').dataset.ready")
    return browser


def texts(browser, selector):
    """Of all elements that match."""
    found = browser.execute_script(TEXTS, selector)
    return found


@pytest.mark.parametrize("reach", [0.06, 0.7, 4.6, 5.5, 60.0])
def test_the_ticks_of_a_waterfall_are_told_apart(reach, write_run, browse, tmp_path):
    def narrow(data):
        margin = {"v": -0.2 * reach, "lo": None, "hi": None}
        data["waterfall"] = [
            {
                "label": "mine",
                "revenue": 0.8 * reach,
                "terms": [["refunds", reach]],
                "margin": margin,
            }
        ]

    browser = opened(browse, tmp_path / "r.html", [write_run("one", episodes=3)], narrow)
    wait(browser, "document.querySelector('#waterfall svg')")
    ticks = texts(browser, "#waterfall svg text[text-anchor=middle]")
    assert len(ticks) > 3 and len(set(ticks)) == len(ticks), ticks


def test_without_cargo_nothing_is_claimed_of_money(write_run, browse, tmp_path):
    def arrive(row):
        row |= {"outcome": "arrived", "pieces_lost": None, "pieces_at_start": None}

    browser = opened(browse, tmp_path / "r.html", [write_run("bare", episodes=5, change=arrive)])
    first = texts(browser, ".card:first-child dt, .card:first-child dd")
    assert first[first.index("break-even") + 1] == "undefined"
    assert not any("has its own" in text for text in texts(browser, "#waterfall .note"))


def test_one_delivery_has_no_interval_and_prices_are_told_exactly(write_run, browse, tmp_path):
    browser = opened(
        browse,
        tmp_path / "r.html",
        [write_run(name, episodes=n) for name, n in (("one", 1), ("many", 9))],
    )
    one, many = texts(browser, "#profit .legend > span")
    assert "after 1" in one and "95 %" not in one
    assert "after 9, 95 % of resampled" in many
    wait(browser, "document.querySelector('#profit svg')")
    assert len(texts(browser, "#profit path[fill-opacity]")) == 1
    prices = texts(browser, "#basis details tr > *")
    assert prices[prices.index("electricity") + 1] == "0.2704"


def test_the_chooser_names_the_map_that_is_drawn(write_run, browse, tmp_path):
    digest = map_digest(load_scene("sidewalk"))
    folders = [
        write_run(name, episodes=2, map_sha256=known)
        for name, known in (("a", "0" * 64), ("b", digest))
    ]
    browser = opened(browse, tmp_path / "r.html", folders)
    labels = ["sidewalk (000000000000)", f"sidewalk ({digest[:12]})"]
    assert texts(browser, "#which-map option") == labels
    assert browser.execute_script("return document.querySelector('#which-map').value") == labels[1]


def test_what_a_tip_tells_needs_no_mouse(write_run, browse, tmp_path):
    def tip_over(row):
        row["reason"] = "arrived" if row["outcome"] == "sla" else "orientation"
        things = (
            name for name in row if name.endswith("_contacts") and name != "pedestrian_contacts"
        )
        row |= dict.fromkeys(things, 0)

    folders = [
        write_run(name, stacks=(name,), episodes=20, change=tip_over) for name in ("one", "two")
    ]
    browser = opened(browse, tmp_path / "r.html", folders)
    assert {row[5] for row in shown(browser)} >= {"in time", "assistanceorientation"}
    head = "document.querySelector('th[data-key=soft] button')"
    browser.execute_script(f"{head}.focus()")
    told = browser.execute_script("return document.querySelector('#tip').textContent")
    assert told.startswith("contacts that the published rule does not count")
    assert browser.execute_script(f"return {head}.getAttribute('aria-description')") == told
    browser.execute_script(f"{head}.blur()")
    assert browser.execute_script("return document.querySelector('#tip').style.display") == "none"
    tap = (
        "document.querySelector('#waterfall rect').dispatchEvent(new "
        "PointerEvent('pointerdown', {bubbles: true}))"
    )
    wait(browser, "document.querySelector('#waterfall rect')")
    browser.execute_script(tap)
    assert "per delivery" in browser.execute_script(
        "return document.querySelector('#tip').textContent"
    )
    assert "needed" in texts(browser, "#comparison thead th")
    touching = {
        (event["stack"], event["episode"])
        for folder in folders
        for event in load_run(str(folder)).events
    }
    choose(browser, "by-cost", "contact")
    assert {(row[1], int(row[2])) for row in shown(browser)} == touching


def test_the_nearest_person_is_as_far_as_the_bodies_are_apart(
    write_run,
    record,
    make_arrays,
    browse,
    tmp_path,
):
    folder = write_run("one", episodes=1)
    record(folder, "mine", range(1))
    browser = opened(browse, tmp_path / "r.html", [folder])
    arrays = make_arrays(read_rows(folder / "episodes.parquet", EPISODE_COLUMNS)[0], 0)
    outline = load_dataclass(RobotParams, shipped("params") / "robots" / "segway_e1.yaml").polygon
    radius = load_dataclass(WorldParams, shipped("params") / "worlds" / "easy.yaml").people.radius
    for row in (0, 50, 120):
        browser.execute_script(MOVE, float(arrays["trace"][row, 0]))
        told = browser.execute_script(f"return {FACTS}['nearest person']")
        body = shapely.Polygon(
            transform_points(Pose2D(*arrays["trace"][row, 1:4].tolist()), outline)
        )
        apart = float(np.min(shapely.distance(body, shapely.points(arrays["crowd"][row])))) - radius
        assert float(told.removesuffix(" m")) == pytest.approx(max(apart, 0.0), abs=0.08)


def test_of_two_quick_choices_the_last_is_shown_and_no_listeners_pile_up(
    write_run,
    record,
    browse,
    tmp_path,
):
    folder = write_run("one", episodes=4)
    record(folder, "mine", range(3))
    browser = opened(browse, tmp_path / "r.html", [folder])
    slow = (
        "window.added = 0; const add = window.addEventListener;"
        "window.addEventListener = function (...given) { window.added += 1; return "
        "add.apply(window, given); };"
        "let calls = 0; const read = Response.prototype.arrayBuffer;"
        "Response.prototype.arrayBuffer = function () { const bytes = read.call(this);"
        " return calls++ ? bytes : new Promise(done => setTimeout(() => done(bytes), 700)); };"
        "const pick = document.querySelector('#which');"
        "const others = ['0', '1', '2'].filter(each => each !== "
        "document.querySelector('#player').dataset.ready);"
        "for (const each of others) { pick.value = each; pick.dispatchEvent(new Event('change')); }"
        "setTimeout(() => { window.settled = true; }, 1500); return others[1]"
    )
    last = browser.execute_script(slow)
    wait(browser, "window.settled")
    assert browser.execute_script("return document.querySelector('#player').dataset.ready") == last
    assert texts(browser, "#player .side > h3:first-child") == [f"mine, episode {last}"]
    assert browser.execute_script("return window.added") == 0
    canvas = "document.querySelector('#player canvas')"
    assert (
        browser.execute_script(f"return {canvas}.getAttribute('aria-label')")
        == f"Replay of mine, episode {last}"
    )
    assert (
        browser.execute_script("return document.querySelector('#player').hasAttribute('aria-busy')")
        is False
    )


@pytest.mark.parametrize(
    ("outcome", "title"),
    [
        ("sla", "Nothing was lost: the delivery that earned least"),
        ("timeout", "The dearest delivery"),
    ],
)
def test_a_delivery_without_a_loss_is_not_called_the_dearest(
    outcome,
    title,
    write_run,
    record,
    browse,
    tmp_path,
):
    folder = write_run("one", episodes=1, crowd=0.0, change=lambda row: row.update(outcome="sla"))
    record(folder, "mine", range(1))

    def end_so(data):
        data["replays"][0]["outcome"] = outcome

    browser = opened(browse, tmp_path / "r.html", [folder], end_so)
    assert texts(browser, "#reel h3") == [title]
