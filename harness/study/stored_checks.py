"""Whether a stored run's tables can be of deliveries that were driven so."""

import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from harness.audit.plausible import Limits, implausible
from harness.metrics.columns import Row
from harness.metrics.contacts import PRICED_PROPERTY
from harness.storage.journal import LARGEST, NEEDED
from harness.storage.manifest_file import mixed_files
from harness.storage.parameters import parameter_folder
from harness.storage.rows import Rows
from harness.world.outcome import Outcome
from navstack.errors import InputError
from navstack.params.strict import load_yaml

ENDS = tuple(each.value for each in Outcome)
NOT_NEGATIVE = (
    "distance_m",
    "duration_s",
    "pedestrian_injury_usd",
    "collision_impulse_ns",
    "pieces_lost",
    *("pedestrian_contacts", "soft_contacts"),
    *(f"{kind}_contacts" for kind in PRICED_PROPERTY),
)
PAID_FOR = ("pedestrian_contacts", "pedestrian_injury_usd")  # null would be no money, not zero
NEEDED_OF_EVENTS = (
    *("stack", "episode", "type", "partner", "kind", "fault"),
    *("impulse_ns", "robot_speed_mps", "partner_speed_mps"),
)


def check_whole(rows: Sequence[Row], where: Path) -> None:
    """Check that deliveries can have gone so, and that none is there twice.

    Raises:
        InputError: the message names the row.
    """
    seen: set[tuple[Any, ...]] = set()
    for number, row in enumerate(rows, start=1):
        key = (row["stack"], row["stack_number"], row["seed"], row["episode"])
        if key in seen:
            raise InputError(
                f"{where}: row {number}: delivery {row['episode']} of '{row['stack']}' is there "
                "twice"
            )
        if row["error"] is None and row["outcome"] not in ENDS:
            raise InputError(
                f"{where}: row {number}: outcome '{row['outcome']}'; known are {', '.join(ENDS)}"
            )
        for name in NOT_NEGATIVE:
            if row[name] is not None and row[name] < 0.0:
                raise InputError(
                    f"{where}: row {number}: {name} {row[name]:g} is no measurement; it cannot be "
                    "negative"
                )
        seen.add(key)


def check_plausible(finished: Rows, folder: Path) -> None:
    """Check that each delivery has what it needs and can have gone so.

    Raises:
        InputError: the message names the delivery.
    """
    where = folder / "episodes.parquet"
    limits = {name: _limits(folder, name) for name in set(finished.values("stack"))}
    for row in finished:
        _check(row, (*NEEDED, *PAID_FOR), where)
        if why := implausible(row, limits[row["stack"]]):
            raise InputError(
                f"{where}: delivery {row['episode']} of '{row['stack']}' cannot have gone so: "
                f"{why}; take the table as it was written"
            )


def check_events(events: Sequence[Row], where: Path) -> None:
    """Check that each event has what it needs.

    Raises:
        InputError: one has not, or an impulse below zero.
    """
    for event in events:
        _check(event, NEEDED_OF_EVENTS, where)
        if event["impulse_ns"] < 0.0:
            raise InputError(
                f"{where}: episode {event['episode']} has an impulse of {event['impulse_ns']:g} "
                "N s, which is no measurement; it cannot be negative"
            )


def _check(row: Row, needed: tuple[str, ...], where: Path) -> None:
    """Check that a row has what it needs, and that its numbers can be measurements."""
    unsound = [key for key in needed if row[key] is None]
    for key, value in row.items():
        if isinstance(value, float) and not abs(value) <= LARGEST:
            unsound.append(key)
    if unsound:
        raise InputError(f"{where}: episode {row['episode']} has no sound '{unsound[0]}'")


def _limits(folder: Path, stack: str) -> Limits:
    """What bounds a stack's deliveries, as far as the run's parameters tell.

    Files that were changed after it had begun tell nothing of the deliveries before.
    """
    robot = _numbers(folder, f"{stack}-robot")
    rules = _numbers(folder, "rules")
    usual = Limits()
    return Limits(
        robot.get("max_speed", usual.max_speed),
        rules.get("arrival_radius", usual.arrival_radius),
        rules.get("timeout", usual.least_timeout) * rules.get("real_time_factor", 1.0),
        rules.get("spoiled_fraction", usual.spoiled_fraction),
    )


def _numbers(folder: Path, name: str) -> dict[str, float]:
    """The numbers of a file of params/; none where it cannot be read or was changed."""
    if f"params/{name}.yaml" in mixed_files(folder):
        return {}
    with contextlib.suppress(InputError, AttributeError):
        content = load_yaml(parameter_folder(folder) / f"{name}.yaml")
        return {key: value for key, value in content.items() if isinstance(value, int | float)}
    return {}
