"""The margins of a page's stacks with contacts accounted for in other ways."""

from collections.abc import Sequence
from typing import Any

from harness.analysis.repricing import accounted_margins
from harness.economics.accountings import PUBLISHED
from harness.report.page.entries import Entry
from harness.report.repriced import ACCOUNTING_NOTE, TITLES

Json = dict[str, Any]


def accountings(entries: Sequence[Entry]) -> Json | None:
    """A row for each accounting, a cell for each stack; None where all are alike, or margins are undefined.

    Raises:
        InputError: rows and events of a run are of different states.
    """
    known = [accounted_margins(entry.run, [(entry.run, entry.stack)]) for entry in entries]
    if not any(each[name] != each[PUBLISHED] for each in known for name in each):
        return None
    rows = [
        {"title": title, "cells": [each[name].as_json() if name in each else None for each in known]}
        for name, title in TITLES.items()
    ]
    return {"note": ACCOUNTING_NOTE, "rows": rows}
