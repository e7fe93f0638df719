"""What the figures of a page rest on.

Deliveries, seeds, world, prices, versions, and what they do not say.
"""

import hashlib
import json
import platform
import shlex
from collections.abc import Sequence
from importlib.metadata import version
from typing import Any

from harness.economics.contact_costs import forgives
from harness.economics.price import price_keys
from harness.report.page.entries import PageEntry
from harness.report.short.setup import people_of
from harness.study.stored_run import CONDITIONS, StoredRun

Json = dict[str, Any]


def basis(entries: Sequence[PageEntry], notes: Sequence[str]) -> Json:
    """The section "What these figures rest on".

    Args:
        entries: the stacks of the page.
        notes: what else is to be known of this page.
    """
    runs: dict[tuple[str, ...], list[PageEntry]] = {}
    for entry in entries:
        about = entry.run.about  # stacks of one folder may have been driven by other commands
        driven = entry.run.folder.resolve(), about.get("command"), about.get("versions")
        runs.setdefault(tuple(map(str, driven)), []).append(entry)
    return {
        "runs": [_run(of_run[0].run, of_run) for of_run in runs.values()],
        "isForgiving": any(forgives(entry.prices) for entry in entries),
        "prices": _prices(entries),
        "notes": list(notes),
        "made": {"navbench": version("navbench"), "python": platform.python_version()},
    }


def _run(run: StoredRun, entries: Sequence[PageEntry]) -> Json:
    about = run.about
    command = about.get("command")
    return {
        "folder": run.folder.resolve().name,
        "command": shlex.join(map(str, command)) if isinstance(command, list) else "",
        "deliveries": {entry.label: len(entry.stack.rows) for entry in entries},
        "errors": sum(entry.stack.errors for entry in entries),
        "seed": run.seed,
        "missions": about.get("missions"),
        "map": run.map_name,
        "map version": str(about.get("map_sha256", ""))[:12],
        "people": people_of(run),
        **{f"{name} version": digest(run.condition(name)) for name in CONDITIONS},
        "versions": {str(key): str(value) for key, value in about.get("versions", {}).items()},
    }


def digest(content: Any) -> str:
    """The first twelve digits of the SHA-256 of a condition's content."""
    try:
        text = json.dumps(content, sort_keys=True, default=str)
    except TypeError:  # keys that are no texts, or of several kinds
        text = repr(content)
    return hashlib.sha256(text.encode("utf-8", "replace")).hexdigest()[:12]


def _prices(entries: Sequence[PageEntry]) -> list[Json]:
    """Every price of the first run, and where another run has another."""
    first = price_keys(entries[0].prices)
    others = [price_keys(entry.prices) for entry in entries[1:]]
    return [
        {
            "key": key,
            "value": price.value,
            "unit": price.unit,
            "source": price.source,
            "differs": any(other[key].value != price.value for other in others),
        }
        for key, price in first.items()
    ]
