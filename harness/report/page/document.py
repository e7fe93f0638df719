"""The page as one HTML text: template, style, scripts and data, nothing fetched from anywhere.

Every text from a run goes through JSON (with ``<`` escaped) into DOM text nodes; the content
security policy lets the browser execute only the scripts of this package, by their hashes, and
request nothing.
"""

import base64
import hashlib
import html
import json
import re
from collections.abc import Sequence
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any

from harness.report import texts
from harness.report.page.basis import basis
from harness.report.page.deliveries import contacts_of, delivery_list, missions_of
from harness.report.page.entries import PageEntry, entries_of, notes_of
from harness.report.page.markdown_blocks import sections
from harness.report.page.recording_code import FINE
from harness.report.page.replays import (
    Again,
    Recorded,
    chosen,
    has_dearest,
    recorded_of,
    replay,
    trajectories,
)
from harness.report.page.scenery import sceneries
from harness.report.page.sections import figures
from harness.storage.files import write_text, writing
from harness.study.stored_run import StoredRun
from navstack.params.strict import read_text

Json = dict[str, Any]

MOST_REPLAYS = 40  # of a study's page
REEL = 3  # deliveries that play side by side

SCRIPTS = (
    "core.js",
    "charts.js",
    "profit_charts.js",
    "tables.js",
    "episodes.js",
    "scenery.js",
    "overview.js",
    "replay_code.js",
    "replay_view.js",
    "replay_strip.js",
    "replay_reasons.js",
    "replay.js",
    "reel.js",
    "study.js",
    "main.js",
)


def report_page(
    runs: Sequence[StoredRun],
    most_replays: int,
    date: str,
    again: Again | None = None,
    more_notes: Sequence[str] = (),
) -> str:
    """The report of some runs.

    Args:
        runs: whose stacks to show.
        most_replays: recorded deliveries that the page carries.
        date: of today, as the page says it.
        again: recordings of deliveries that were driven again for the page.
        more_notes: what else is to be said of its deliveries.

    Raises:
        InputError: no delivery finished.
    """
    entries = entries_of(runs)
    readable, ways, troubles = trajectories(recorded_of(entries, again))
    carried = chosen(readable, most_replays)
    replays = [replay(each) for each in carried]
    scenery, notes = sceneries(entries)
    notes += [*notes_of(runs), *more_notes]
    left = len(readable) - len(replays)
    if left:
        notes.append(
            f"{left} more recorded deliveries are not in this page: navbench replay RUN EPISODE "
            "shows them."
        )
    return page_text(
        "report",
        " · ".join(dict.fromkeys(entry.label for entry in entries)),
        date,
        labels_of(entries),
        replays,
        **figures(entries),
        deliveries=delivery_list(entries),
        scenery=scenery,
        missions=missions_of(entries),
        contacts=contacts_of(entries),
        trajectories=ways,
        reel=REEL,
        hasDearest=has_dearest(carried, entries, REEL),
        basis=basis(entries, [*notes, *troubles]),
    )


def write_study_page(markdown: Path, runs: Sequence[StoredRun], date: str) -> Path:
    """Write a study's page in Markdown as HTML beside it, with replays; returns its path.

    Args:
        markdown: the page, beside its pictures.
        runs: with recorded deliveries, of which the page carries :data:`MOST_REPLAYS`; none: no
            replays.
        date: of today, as the page says it.

    Raises:
        InputError: it cannot be written.
    """
    entries = []
    if runs:
        entries = entries_of(runs)
    readable, _, troubles = trajectories(recorded_of(entries))
    scenery, notes = sceneries(entries)
    title, parts = sections(read_text(markdown), markdown.parent)
    lede = " ".join((*texts.notes("parted"), *notes, *troubles))
    replays = [replay(each) for each in chosen(readable, MOST_REPLAYS)]
    more = {"sections": parts, "lede": lede, "scenery": scenery, "made": version("navbench")}
    page = markdown.with_suffix(".html")
    with writing(page):
        write_text(page, page_text("study", title, date, labels_of(entries), replays, **more))
    return page


def replay_page(recorded: Recorded, date: str) -> str:
    """A page with the replay of one delivery, its scans whole."""
    entry = recorded.entry
    scenery, notes = sceneries([entry])
    label = f"{entry.label}, episode {recorded.row['episode']}"
    known = basis([entry], notes)
    replays = [replay(recorded, FINE)]
    return page_text("replay", label, date, [entry.label], replays, scenery=scenery, basis=known)


def labels_of(entries: Sequence[PageEntry]) -> list[str]:
    """How the page names its stacks."""
    return [entry.label for entry in entries]


def page_text(
    kind: str,
    title: str,
    date: str,
    labels: Sequence[str],
    replays: Sequence[Json],
    **more: Any,
) -> str:
    """The HTML text; ``more``: what a page of this kind shows."""
    entries = [{"label": label} for label in labels]
    shown = [{**each, "data": None} for each in replays]
    data = {"kind": kind, "title": title, "date": date, "entries": entries, **more}
    data["replays"] = shown
    style, script = (
        _asset("page.css"),
        "(() => {\n'use strict';\n" + "\n".join(map(_asset, SCRIPTS)) + "\n})();",
    )
    policy = (
        f"default-src 'none'; img-src data:; style-src '{_hash(style)}'; script-src "
        f"'{_hash(script)}'; "
        "base-uri 'none'; form-action 'none'"
    )
    parts = {
        "policy": policy,
        "title": html.escape(_written(title)),
        "style": style,
        "data": embedded(data),
        "recordings": "\n".join(
            f'<script type="text/plain" id="recording-{number}">{each["data"]}</script>'
            for number, each in enumerate(replays)
        ),
        "script": script,
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], _asset("page.html"))


def embedded(data: Any) -> str:
    """JSON that can stand inside a script element whatever texts it holds."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    text = _written(text)
    for character in "<>&\u2028\u2029":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return text


def _written(text: str) -> str:
    """A text without what UTF-8 does not have: half a surrogate pair, which JSON lets through."""
    return text.encode("utf-8", "replace").decode()


def _asset(name: str) -> str:
    return (files("harness.report.page") / "assets" / name).read_text(encoding="utf-8")


def _hash(text: str) -> str:
    """As a content security policy names an inline script or style."""
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()
