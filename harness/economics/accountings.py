"""Other ways to account for contacts, beside the published one.

By fault, and without its threshold.
"""

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from harness.economics.contact_costs import injury_costs, monotone_injury_costs
from harness.economics.measured import Measured
from harness.economics.prices import Prices, load_severe
from harness.metrics.columns import Row
from harness.metrics.contacts import PRICED_PROPERTY, PROPERTY_IMPULSE
from harness.storage.rows import values
from navstack.types import FloatArray

PUBLISHED, MONOTONE, AT_FAULT = "published", "monotone", "robot_at_fault"  # of :data:`ACCOUNTINGS`
COUNTED, EVENT = "counted_contact", "contact_event"  # types of rows in events.parquet
PERSON = "pedestrian"
ROBOT_MOVED = ("robot_into_person", "robot_into_property")  # faults that are the robot's
PERSON_MOVED = "person_into_standing_robot"


def is_grave(event: Row) -> bool:
    """Whether pictures show a row of ``events.parquet`` as a contact that matters.

    Those that were paid for do, and all counted ones with people: the hardest cost next to nothing,
    since injuries beyond MAIS 3 have no price.
    """
    return bool(event["type"] == COUNTED and (event["cost_usd"] or event["kind"] == PERSON))


@dataclass(frozen=True, slots=True, eq=False)
class Contacts:
    """Contacts of many deliveries; arrays have one entry per contact."""

    delivery: npt.NDArray[np.int64]  # number of the delivery's row
    kinds: npt.NDArray[np.str_]  # 'pedestrian' or the property's type
    impulses: FloatArray  # [N s]
    robot_speeds: FloatArray  # [m/s] of the robot towards the other
    partner_speeds: FloatArray  # [m/s] of the other towards the robot
    faults: npt.NDArray[np.str_]  # who moved into whom, as in events.parquet

    @property
    def with_people(self) -> npt.NDArray[np.bool_]:
        """Which of them are with people."""
        return np.asarray(self.kinds == PERSON)


def contacts_of(rows: Sequence[Row], events: Sequence[Row], kind: str) -> Contacts:
    """The contacts of deliveries.

    Args:
        rows: of the deliveries, one each.
        events: rows of ``events.parquet``; those of other deliveries are left out.
        kind: ``counted_contact`` for those that the published rule counts, ``contact_event`` for
            all, each whole.
    """
    keys = zip(values(rows, "stack"), values(rows, "episode"), strict=True)
    numbers = {key: number for number, key in enumerate(keys)}
    own = [
        event
        for event in events
        if event["type"] == kind and (event["stack"], event["episode"]) in numbers
    ]

    def column(key: str, kind: type = float) -> Any:
        return np.array([event[key] for event in own], dtype=kind)

    return Contacts(
        delivery=np.array(
            [numbers[event["stack"], event["episode"]] for event in own], dtype=np.int64
        ),
        kinds=column("kind", str),
        impulses=column("impulse_ns"),
        robot_speeds=column("robot_speed_mps"),
        partner_speeds=column("partner_speed_mps"),
        faults=column("fault", str),
    )


def whole(contacts: Contacts) -> FloatArray:
    """The robot pays for every contact, as published."""
    return np.ones(len(contacts.kinds))


def at_fault_only(contacts: Contacts) -> FloatArray:
    """The robot pays for property, and where it was at least as fast as the person."""
    return np.isin(contacts.faults, ROBOT_MOVED).astype(np.float64)


def shared(contacts: Contacts) -> FloatArray:
    """The robot pays its share of the closing speed.

    Nothing where somebody walked into it as it stood.
    """
    robot, partner = (
        np.maximum(contacts.robot_speeds, 0.0),
        np.maximum(contacts.partner_speeds, 0.0),
    )
    closing = robot + partner
    share = np.divide(robot, closing, out=np.ones_like(closing), where=closing > 0.0)
    return np.where(
        ~contacts.with_people, 1.0, np.where(contacts.faults == PERSON_MOVED, 0.0, share)
    )


# Accounting -> which contacts, and the robot's share of their cost.
ACCOUNTINGS: dict[str, tuple[str, Callable[[Contacts], FloatArray]]] = {
    MONOTONE: (COUNTED, whole),
    PUBLISHED: (COUNTED, whole),
    AT_FAULT: (COUNTED, at_fault_only),
    "shared_fault": (COUNTED, shared),
    "no_threshold": (EVENT, whole),
    "no_threshold_robot_at_fault": (EVENT, at_fault_only),
    "no_threshold_shared_fault": (EVENT, shared),
}


def injury_price(name: str) -> Callable[[FloatArray, Prices], FloatArray]:
    """What an accounting takes for contacts with people [USD], by their impulses [N s]."""
    if name == MONOTONE:
        return monotone_injury_costs
    return injury_costs


def accounted(
    each: Measured,
    rows: Sequence[Row],
    events: Sequence[Row],
    name: str,
    prices: Prices,
) -> Measured:
    """The deliveries' measurements with contacts accounted for in another way.

    Only what contacts cost changes; outcomes stay, as an episode that ended in physical assistance
    cannot go on. Property has a threshold of its own (100 N s), which stays but in ``monotone``:
    its price is that of a replacement.

    Args:
        each: arrays with an entry per delivery.
        rows: of these deliveries.
        events: rows of ``events.parquet``.
        name: one of :data:`ACCOUNTINGS`.
        prices: the price file.
    """
    kind, share_of = ACCOUNTINGS[name]
    contacts = contacts_of(rows, events, kind)
    shares, people = share_of(contacts), contacts.with_people
    costs = injury_price(name)(contacts.impulses, prices) * shares
    injuries: Any = np.bincount(
        contacts.delivery[people], weights=costs[people], minlength=len(rows)
    )
    if name == MONOTONE:
        touched = _in_proportion(each, contacts_of(rows, events, EVENT), len(rows))
        return dataclasses.replace(each, pedestrian_injury_usd_per_run=injuries, **touched)
    counts = {
        f"{kind}_contacts": _paid(contacts, kind, shares, prices, len(rows))
        for kind in PRICED_PROPERTY
    }
    in_world: dict[str, Any] = {
        key: value for key, value in counts.items() if getattr(each, key) is not None
    }
    return dataclasses.replace(each, pedestrian_injury_usd_per_run=injuries, **in_world)


def _in_proportion(each: Measured, touches: Contacts, deliveries: int) -> dict[str, Any]:
    """Every touch of property, by its impulse's share of the published threshold.

    Never less than is published.
    """
    shares = np.minimum(touches.impulses / PROPERTY_IMPULSE, 1.0)

    def summed(which: npt.NDArray[np.bool_]) -> FloatArray:
        sums = np.bincount(touches.delivery[which], weights=shares[which], minlength=deliveries)
        return sums.astype(np.float64)

    priced = np.isin(touches.kinds, PRICED_PROPERTY)
    counts = {f"{kind}_contacts": summed(touches.kinds == kind) for kind in PRICED_PROPERTY}
    found: dict[str, Any] = {
        key: np.maximum(count, getattr(each, key))
        for key, count in counts.items()
        if getattr(each, key) is not None
    }
    other = summed(~priced & ~touches.with_people) * load_severe().other_property.value
    return {**found, "other_property_usd": other}


def _paid(
    contacts: Contacts,
    kind: str,
    shares: FloatArray,
    prices: Prices,
    deliveries: int,
) -> FloatArray:
    """Paid contacts with one kind of property per delivery, weighted with the robot's share."""
    has_price = getattr(prices.property_damage, kind).value > 0.0
    paid = (contacts.kinds == kind) & (contacts.impulses >= PROPERTY_IMPULSE) & has_price
    return np.bincount(contacts.delivery[paid], weights=shares[paid], minlength=deliveries).astype(
        np.float64
    )
