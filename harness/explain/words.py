"""The seconds before a moment in plain words."""

import numpy as np

from harness.economics.accountings import PERSON
from harness.explain.decision_words import against, all_rejected, decided
from harness.explain.evidence import Evidence
from harness.explain.moments import ASSISTANCE, SPOILED, STUCK_PLACE, TIMEOUT, Moment
from harness.explain.seconds import NEAR, Seconds
from harness.explain.tipping import TIPPED, has_tipped, held_up, tipping
from harness.metrics.columns import Row
from navstack.types import FloatArray

FAULTS = {
    "robot_into_person": "the robot moved into the person",
    "person_into_robot": "the person moved into the robot",
    "person_into_standing_robot": "the person walked into the robot as it stood",
    "robot_into_property": "the robot moved into it",
}
REASONS = {
    TIPPED: "it tipped over",
    "impulse": "its contacts used up what it withstands",
    "stack failed": "its stack ended in an error",
}
CHANGED = 0.2  # [m/s] of speed within the last second that is called braking or speeding up
STANDS = 0.05  # [m/s] below which the robot stands
LONG = 1.0  # [s] from which on its standing is told
TOUCHING = 0.05  # [m]
SAME_TIME = 0.1  # [s]


def paragraph(evidence: Evidence, seconds: Seconds, before: Moment | None = None) -> str:
    """A short paragraph on what led to a moment.

    A shorter one if that was told of the moment ``before`` it.
    """
    if before is not None and is_same(before, seconds.moment):
        return f"{what(evidence, seconds)} The seconds before are those of event {before.number}."
    sentences = [what(evidence, seconds)]
    if has_tipped(evidence, seconds.moment):
        sentences += tipping(evidence, seconds)
    if seconds.moment.kind == TIMEOUT:
        sentences += held_up(evidence, seconds)
    sentences += [_motion(seconds), _stood_since(evidence, seconds), _person(seconds)]
    if not evidence.row["gave_up"]:  # else it was not the controller's choice
        sentences += [decided(seconds), against(seconds)]
    sentences += [_believed(seconds), _tracked(evidence, seconds), _cargo(evidence, seconds)]
    return " ".join(sentence for sentence in sentences if sentence)


def is_same(before: Moment, moment: Moment) -> bool:
    """Whether two moments are one: then the seconds before them are the same, too."""
    return moment.stamp - before.stamp < SAME_TIME


def what(evidence: Evidence, seconds: Seconds) -> str:
    """What happened, when, and what it cost."""
    moment = seconds.moment
    cost = "cost undefined without cargo"
    if moment.cost is not None:
        cost = f"{moment.cost:.2f} USD"
    ended = {SPOILED: _spoiled, TIMEOUT: _timed_out, ASSISTANCE: _needed_help}
    happened = ended.get(moment.kind, _touched)(evidence.row, moment)
    return f"Event {moment.number}, {moment.stamp:.1f} s, {cost}: {happened}."


def _spoiled(row: Row, moment: Moment) -> str:
    lost, pieces = int(row["pieces_lost"]), row["pieces_at_start"]
    return f"the food was spoiled; {lost} of {pieces} pieces were lost in the end"


def _timed_out(row: Row, moment: Moment) -> str:
    text = "it was still on its way"
    if row["duration_s"] - moment.stamp > 1.0:
        text = f"from here on it stayed within {STUCK_PLACE:g} m"
    if row["gave_up"]:
        text += f"; the navigator gave up: {row['gave_up']} ({row['navigator_error']})"
    left = f"{row['goal_distance_m']:.1f} m from the goal"
    return f"{text}; at {row['duration_s']:.0f} s time was up, {left}"


def _needed_help(row: Row, moment: Moment) -> str:
    text = f"the robot needed help: {REASONS.get(row['reason'], row['reason'])}"
    if moment.event is not None:
        text += f" ({row['collision_impulse_ns']:.0f} N s in all)"
    return text


def _touched(row: Row, moment: Moment) -> str:
    event = moment.event
    assert event is not None
    partner = f"a {event['kind'].replace('_', ' ')}"
    speeds = f"the robot came with {event['robot_speed_mps']:z.2f} m/s"
    if event["partner"] == PERSON:
        partner = f"person {event['partner_id']}"
        speeds += f", the person with {event['partner_speed_mps']:z.2f} m/s"
    hit = f"it hit {partner} with"
    if event["fault"].startswith("person_into"):
        hit = f"{partner} hit it with"
    fault = FAULTS.get(event["fault"], event["fault"])
    return f"{hit} {event['impulse_ns']:.0f} N s; {speeds}: {fault}"


def _motion(seconds: Seconds) -> str:
    """How it drove, and whether it braked; empty: there was nothing before."""
    if seconds.at[0] >= 0.0:
        return ""  # it happened as the delivery began
    speed, commanded = seconds.speed, seconds.command[:, 0]
    early = int(np.abs(seconds.at + 1.0).argmin())
    if _stands(seconds):
        return f"It stood still for the whole {-seconds.at[0]:.1f} s."
    change = float(commanded[-1] - commanded[early])
    if change < -CHANGED:
        braked = "braked"
    elif change > CHANGED:
        braked = "sped up"
    else:
        braked = "neither braked nor sped up"
    when = ""
    if -seconds.at[0] >= 1.0:
        when = "in the last second "
    stood = float(np.diff(seconds.at)[np.abs(speed[:-1]) < STANDS].sum())
    moving, drove = speed[np.abs(speed) >= STANDS], f"drove {_span(speed)} m/s"
    if stood >= LONG and len(moving):
        drove = f"stood for {stood:.1f} s, else drove {_span(moving)} m/s"
    return (
        f"In the {-seconds.at[0]:.1f} s before, it {drove} and {when}{braked} "
        f"(commanded {commanded[early]:z.2f}, then {commanded[-1]:z.2f} m/s)."
    )


def _stands(seconds: Seconds) -> bool:
    """Whether it stood all the while, as it was commanded."""
    return bool(max(np.abs(seconds.speed).max(), np.abs(seconds.command[:, 0]).max()) < STANDS)


def _stood_since(evidence: Evidence, seconds: Seconds) -> str:
    """Since when, and what was rejected from then on; empty: it did not stand all the while."""
    if not _stands(seconds):
        return ""
    stamps, until = evidence.stamps, seconds.moment.stamp
    moves = (np.abs(evidence.trace[:, 4]) >= STANDS) & (stamps <= until)
    if not moves.any():
        return "It never moved."
    since = float(stamps[moves][-1])
    text = f"It had stood since {since:.1f} s"
    rows = [row for row in evidence.decisions if since <= row["stamp_s"] <= until]
    if refused := all_rejected(rows):
        text += f"; {refused}"
    return f"{text}."


def _person(seconds: Seconds) -> str:
    """How far the person was, and how fast the gap closed."""
    if seconds.person is None:
        return f"Nobody was within {NEAR:g} m."
    named = "The person"
    if seconds.moment.person is None:
        named = f"The nearest, person {seconds.person},"
    known = np.flatnonzero(np.isfinite(seconds.distance) & np.isfinite(seconds.closing))
    if not len(known):
        return ""
    distance = seconds.distance[known]
    first, least, fastest = (
        float(distance[0]),
        float(distance.min()),
        float(seconds.closing[known].max()),
    )
    if first < TOUCHING:
        return f"{named} was against the robot already at the first."
    closing = " the gap did not close"
    if fastest > 0.0:
        closing = f" the gap closed at up to {fastest:.1f} m/s"
    return f"{named} was {first:.1f} m away at first and {least:.2f} m at the least;{closing}."


def _believed(seconds: Seconds) -> str:
    """How far the belief was off."""
    if np.isnan(seconds.decided_off).all():
        return ""
    mean, last, turned = (
        np.nanmean(seconds.decided_off),
        seconds.position_error[-1],
        np.degrees(seconds.heading_error),
    )
    health = {row["health"] for row in seconds.decisions} - {"tracking", None}
    said = ""
    if health:
        said = f" (it called itself {' and '.join(sorted(health))})"
    return (
        f"It believed itself {mean:.2f} m from the truth on average{said}, {last:.2f} m and "
        f"{turned[-1]:.1f} deg in the end."
    )


def _tracked(evidence: Evidence, seconds: Seconds) -> str:
    """What the tracker had of the person."""
    if not any(len(tracks) for tracks in evidence.tracks):
        if seconds.person is not None:
            return "This stack tracked nothing that moves."
        return ""
    if seconds.person is None:
        return ""
    since = seconds.tracked_since
    if since is not None:
        how = f"{np.nanmean(seconds.track_error):.2f} m off on average"
        return f"The tracker had the person without a gap for the last {since:.1f} s, {how}."
    share = float(np.mean(~np.isnan(seconds.track_error)))
    if share == 0.0:
        return "The tracker never had the person."
    return f"The tracker had the person {100.0 * share:.0f} % of the time, but not in the end."


def _cargo(evidence: Evidence, seconds: Seconds) -> str:
    """How the cargo was shaken."""
    if evidence.row["pieces_at_start"] is None:
        return ""
    lost = int(seconds.pieces_lost[-1] - seconds.pieces_lost[0])
    pieces = "no piece was lost"
    if not (lost <= 0):
        pieces = f"{lost} piece{'s' if lost > 1 else ''} went over the edge"
    return (
        f"The cargo felt up to {np.max(seconds.shaking):.1f} m/s2, and {pieces} in these seconds."
    )


def _span(values: FloatArray) -> str:
    low, high = float(values.min()), float(values.max())
    if high - low < 0.05:
        return f"{high:z.2f}"
    return f"{low:z.2f} to {high:z.2f}"
