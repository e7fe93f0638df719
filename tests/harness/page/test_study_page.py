"""A study's page: its Markdown in a browser, with the missions on which the files part ways."""

import pytest
from PIL import Image

from harness.report.page.document import write_study_page
from harness.report.page.markdown_blocks import sections
from harness.study.stored_run import load_run

from .in_browser import choose, wait

TEXT = """# What <b>two</b> files earn

It pays: **3.49** USD, see `tuned.yaml`,
and *nothing* else.

## A table | with a bar

| Name | USD |
| --- | ---: |
| `a\\|b` | 1.50 |
| <script>alert(1)</script> | -2.00 |

### Below it

- one
- two, with `code`

![the margin](margin.png)

![is not there](gone.png)

## What differs

```diff
-old
+new
```
"""


def test_markdown_becomes_plain_values(tmp_path):
    Image.new("RGB", (2, 2)).save(tmp_path / "margin.png")
    title, parts = sections(TEXT, tmp_path)
    assert title == "What <b>two</b> files earn"
    assert [each["title"] for each in parts] == ["", "A table | with a bar", "What differs"]
    spans = parts[0]["blocks"][0]["spans"]
    assert ["b", "3.49"] in spans and ["code", "tuned.yaml"] in spans and ["i", "nothing"] in spans
    table, heading, items, picture, missing = parts[1]["blocks"]
    assert table["right"] == [False, True]
    assert [["".join(text for _, text in cell) for cell in row] for row in table["rows"]] == [
        ["a|b", "1.50"],
        ["<script>alert(1)</script>", "-2.00"],
    ]
    assert heading == {"kind": "heading", "text": "Below it"}
    assert items["items"] == [[["", "one"]], [["", "two, with "], ["code", "code"]]]
    assert picture["data"].startswith("data:image/png;base64,") and picture["text"] == "the margin"
    assert missing == {"kind": "text", "spans": [["i", "is not there"]]}
    assert parts[2]["blocks"] == [{"kind": "code", "text": "-old\n+new\n"}]


@pytest.mark.parametrize("width", [1440, 390])
def test_it_shows_everything_and_plays_two_beside_each_other(
    write_run,
    record,
    browse,
    tmp_path,
    width,
):
    folder = write_run("partings", stacks=("original", "tuned"), episodes=3)
    record(folder, "original", range(2))
    record(folder, "tuned", range(2))
    Image.new("RGB", (400, 200), "red").save(tmp_path / "margin.png")
    (tmp_path / "report.md").write_text(TEXT, encoding="utf-8")
    page = write_study_page(tmp_path / "report.md", [load_run(str(folder))], "2026-11-25")
    assert page == tmp_path / "report.html"
    browser = browse(page, width)
    wait(browser, "document.querySelector('#player').dataset.ready")
    text = browser.execute_script("return document.body.textContent")
    for said in (
        "What <b>two</b> files earn",
        "<script>alert(1)</script>",
        "+new",
        "two, with code",
        "2026-11-25",
    ):
        assert said in text
    assert browser.execute_script("return document.querySelector('figure img').naturalWidth") == 400
    assert (
        browser.execute_script("return getComputedStyle(document.querySelector('td.n')).textAlign")
        == "right"
    )
    assert browser.execute_script("return document.documentElement.scrollWidth") <= width
    choose(browser, "which", "0")
    wait(browser, "document.querySelector('#player').dataset.ready === '0'")
    other = browser.execute_script(
        "return [...document.querySelectorAll('#beside option')].map(each => each.text)"
    )
    assert other == ["nobody", "tuned, episode 0"]
    assert [entry["message"] for entry in browser.get_log("browser")] == []


def test_without_recordings_it_is_the_text_alone(browse, tmp_path):
    (tmp_path / "index.md").write_text(TEXT, encoding="utf-8")
    browser = browse(write_study_page(tmp_path / "index.md", [], "2026-11-25"), 1440)
    wait(browser, "document.documentElement.dataset.ready")
    assert browser.execute_script("return document.querySelector('#player')") is None
    assert browser.execute_script("return document.querySelectorAll('main > section').length") == 3
    assert [entry["message"] for entry in browser.get_log("browser")] == []


def test_nothing_is_cut_off_on_a_narrow_page(browse, tmp_path):
    heads = [f"Margin of stack number {k}" for k in range(6)]
    rows = (heads, ["---"] * 6, [f"{k}.49 [-1.00, 3.49]" for k in range(6)])
    table = "\n".join(f"| {' | '.join(row)} |" for row in rows)
    command = f"navbench run {'--stack my_robot_nav2.yaml ' * 4}"
    text = f"# Wide\n\n{table}\n\n```\n{command}\n```\n"
    (tmp_path / "report.md").write_text(text, encoding="utf-8")
    browser = browse(write_study_page(tmp_path / "report.md", [], "2026-11-25"), 390)
    wait(browser, "document.documentElement.dataset.ready")
    cut_off = """return [...document.querySelectorAll('.scroll, pre')].filter(
        each => each.scrollWidth > each.clientWidth).length"""
    assert browser.execute_script(cut_off) == 0
    shown = browser.execute_script(
        "return getComputedStyle(document.querySelectorAll('td')[5], '::before').content"
    )
    assert heads[5] in shown, "each cell stands beside its column's head"
