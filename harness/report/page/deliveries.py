"""The deliveries of a page one by one: the list, and where they drove and touched something."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from harness.economics.accountings import COUNTED, EVENT
from harness.metrics.columns import Row
from harness.metrics.contacts import PRICED_PROPERTY
from harness.metrics.replay_log import simplified
from harness.report.page.entries import PageEntry
from harness.report.page.origin import Place
from harness.report.replay import contacts_shown
from navstack.types import FloatArray

Json = dict[str, Any]

# Columns of the list: key, and how a row of episodes.parquet gives it.
FACTS = {
    "duration": "duration_s",
    "distance": "distance_m",
    "lost": "pieces_lost",
    "people": "pedestrian_contacts",
    "soft": "soft_contacts",
    "injury": "pedestrian_injury_usd",
    "nearest": "min_pedestrian_distance_m",
    "localization": "localization_error_p95_m",
    "recoveries": "recoveries",
}
MONEY = {"profit": "contribution_margin", "cost": "opex"}
PATH_TOLERANCE = 0.05  # [m] of a trajectory on the map


def recording_of(entry: PageEntry, episode: int) -> Path:
    """Where a delivery's recording would be."""
    return entry.run.folder / "recordings" / f"{entry.stack.name}-{episode}.npz"


def delivery_list(entries: Sequence[PageEntry]) -> Json:
    """All deliveries, column by column."""
    columns: dict[str, list[Any]] = {
        name: []
        for name in ("entry", "episode", "outcome", "reason", "property", "touched", *MONEY, *FACTS)
    }
    for number, entry in enumerate(entries):
        rows = entry.stack.rows
        columns["entry"] += [number] * len(rows)
        for name in ("episode", "outcome", "reason"):
            columns[name] += [row[name] for row in rows]
        columns["property"] += [
            sum(row[f"{kind}_contacts"] or 0 for kind in PRICED_PROPERTY) for row in rows
        ]
        own = (entry.events[row["episode"]] for row in rows)
        columns["touched"] += [
            any(event["type"] in (COUNTED, EVENT) for event in events) for events in own
        ]
        for name, key in FACTS.items():
            columns[name] += [rounded(row[key]) for row in rows]
        for name, term in MONEY.items():
            columns[name] += [rounded(value, 4) for value in money_of(entry, term)]
    return columns


def money_of(entry: PageEntry, term: str) -> list[float | None]:
    """What each delivery comes to in one term of the cost model [USD].

    None where it is undefined.
    """
    values = entry.running.amounts[term]
    if values is None:
        return [None] * len(entry.stack.rows)
    spread: list[float | None] = np.broadcast_to(values, len(entry.stack.rows)).tolist()
    return spread


def rounded(value: Any, decimals: int = 3) -> Any:
    """A number as short as the page shows it."""
    if isinstance(value, float):
        return round(value, decimals)
    return value


def missions_of(entries: Sequence[PageEntry]) -> list[list[Any]]:
    """Start and goal [m] of every delivery: entry, episode, label of the map, four coordinates."""
    return [
        [number, row["episode"], entry.map_label, *ends_of(entry, row)]
        for number, entry in enumerate(entries)
        for row in entry.stack.rows
    ]


def ends_of(entry: PageEntry, row: Row) -> list[Any]:
    """X and y [m] of a delivery's start and goal as the page counts them."""
    (x, y), keys = entry.origin, ("start_x_m", "start_y_m", "goal_x_m", "goal_y_m")
    return [_less(row[key], less) for key, less in zip(keys, (x, y, x, y), strict=True)]


def _less(value: Any, origin: float) -> Any:
    """A coordinate [m] from an origin; None stays."""
    if value is None:
        return None
    return rounded(value - origin, 2)


def contacts_of(entries: Sequence[PageEntry]) -> list[list[Any]]:
    """Contacts: entry, episode, x, y [m], time [s], kind, impulse [N s], cost [USD], is counted."""
    return [
        [number, episode, *contact]
        for number, entry in enumerate(entries)
        for episode, events in entry.events.items()
        for contact in contacts(events, entry.origin)
    ]


def contacts(events: Sequence[Row], origin: Place) -> list[list[Any]]:
    """The contacts of one delivery as the page shows them; see :func:`contacts_of`."""
    return [
        [
            _less(event["x_m"], origin[0]),
            _less(event["y_m"], origin[1]),
            rounded(event["stamp_s"], 2),
            event["kind"],
            rounded(event["impulse_ns"], 1),
            rounded(event["cost_usd"] or 0.0, 2),
            event["type"] == COUNTED,
        ]
        for event in contacts_shown(events)
    ]


def trajectory(trace: FloatArray, origin: Place) -> list[int]:
    """Where a recorded delivery drove.

    X and y in turn, in centimetres, each less the one before.
    """
    whole = np.rint(100.0 * simplified(trace[:, 1:3] - origin, PATH_TOLERANCE)).astype(np.int64)
    steps: list[int] = np.diff(whole, axis=0, prepend=0).ravel().tolist()
    return steps
