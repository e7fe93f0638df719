"""Contacts of a delivery: cost, fault, and the rows of ``events.parquet``."""

from collections.abc import Hashable, Iterable, Sequence

from harness.metrics.columns import Row
from harness.world.truth import Contact, CountedContact, Partner, Truth

PRICED_PROPERTY = ("mailbox", "trash_bin", "building_glass", "bollard", "plant", "fence")
STANDING = 0.05  # [m/s]
PROPERTY_IMPULSE = 100.0  # [N s] from which a contact with property is paid for (published)


def is_paid(contact: CountedContact) -> bool:
    """Whether a counted contact costs money: with a person, or hard enough with priced property."""
    if contact.partner is Partner.PEDESTRIAN:
        return True
    return contact.kind in PRICED_PROPERTY and contact.impulse >= PROPERTY_IMPULSE


def property_contacts(
    contacts: Sequence[CountedContact], kinds: frozenset[str]
) -> dict[str, int | None]:
    """Paid contacts per priced kind of property under ``<kind>_contacts``.

    None: no such thing in this world.
    """
    paid = [c.kind for c in contacts if c.partner is Partner.PROPERTY and is_paid(c)]
    counts: dict[str, int | None] = {f"{kind}_contacts": None for kind in PRICED_PROPERTY}
    return counts | {
        f"{kind}_contacts": paid.count(kind) for kind in PRICED_PROPERTY if kind in kinds
    }


def was_counted(
    stamp: float,
    duration: float,
    partner: Hashable,
    counted: Iterable[tuple[float, Hashable]],
) -> bool:
    """Whether the published rule counts a contact event.

    Args:
        stamp: when the event began [s].
        duration: how long it lasted [s].
        partner: whom or what the robot touched; anything that can be compared.
        counted: stamps [s] and partners of the counted contacts.
    """
    end = stamp + duration + 1e-6
    return any(other == partner and stamp - 1e-6 <= moment <= end for moment, other in counted)


def soft_contacts(truth: Truth) -> int:
    """Contact events that the published rule does not count.

    Too soft, or in its pause after a counted one.
    """
    counted = [(c.stamp, (c.partner, c.partner_id)) for c in truth.counted_contacts]
    return sum(
        not was_counted(c.stamp, c.duration, (c.partner, c.partner_id), counted)
        for c in truth.contacts
    )


def event_rows(truth: Truth, costs: Sequence[float]) -> list[Row]:
    """The events of an episode: counted contacts with their ``costs`` [USD], and contact events.

    Contact events show the same impacts whole and those that are not counted; they carry no cost.
    """
    rows = [
        _event_row("counted_contact", c) | {"cost_usd": cost}
        for c, cost in zip(truth.counted_contacts, costs, strict=True)
    ]
    rows += [
        _event_row("contact_event", c)
        | {
            "impacts": c.impacts,
            "delta_v_mps": c.delta_v,
            "peak_step_impulse_ns": c.peak_step_impulse,
            "duration_s": c.duration,
        }
        for c in truth.contacts
    ]
    return sorted(rows, key=lambda row: (row["stamp_s"], row["type"], row["partner_id"]))


def _event_row(kind: str, contact: Contact | CountedContact) -> Row:
    """What counted contacts and contact events have in common."""
    return {
        "type": kind,
        "stamp_s": contact.stamp,
        "partner": contact.partner.value,
        "kind": contact.kind,
        "partner_id": contact.partner_id,
        "impulse_ns": contact.impulse,
        "closing_speed_mps": contact.robot_speed + contact.partner_speed,
        "robot_speed_mps": contact.robot_speed,
        "partner_speed_mps": contact.partner_speed,
        "x_m": contact.x,
        "y_m": contact.y,
        "fault": fault(contact),
    }


def fault(contact: Contact | CountedContact) -> str:
    """Who moved into whom; a robot slower than ``STANDING`` along the normal was walked into."""
    if contact.partner is Partner.PROPERTY:
        return "robot_into_property"
    if abs(contact.robot_speed) < STANDING:
        return "person_into_standing_robot"
    if contact.robot_speed >= contact.partner_speed:
        return "robot_into_person"
    return "person_into_robot"
