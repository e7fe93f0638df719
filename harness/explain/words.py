"""The seconds before a moment in plain words."""

from collections import Counter
from collections.abc import Mapping

import numpy as np

from harness.economics.accountings import PERSON
from harness.explain.evidence import WEIGHTED, Evidence
from harness.explain.moments import ASSISTANCE, SPOILED, STUCK_PLACE, TIMEOUT, Moment
from harness.explain.seconds import NEAR, Seconds
from harness.metrics.columns import Row
from harness.metrics.decisions import column_prefix
from navstack.control.decision import RUNNER_UP, SLOWER, Alternative
from navstack.types import FloatArray

FAULTS = {
    "robot_into_person": "the robot moved into the person",
    "person_into_robot": "the person moved into the robot",
    "person_into_standing_robot": "the person walked into the robot as it stood",
    "robot_into_property": "the robot moved into it",
}
REASONS = {"orientation": "it tipped over", "impulse": "its contacts used up what it withstands"}
CHANGED = 0.2  # [m/s] of speed within the last second that is called braking or speeding up
SLOW = 0.1  # [m/s] of a command that nobody wants slower
STANDS = 0.05  # [m/s] below which the robot stands
TOUCHING = 0.05  # [m]
SAME_TIME = 0.1  # [s]
TELL_ALTERNATIVES = ("DWBLocalPlanner", "ExpectedCostController")  # the controllers that do
SHARES = 3  # of a score that are named


def paragraph(evidence: Evidence, seconds: Seconds, before: Moment | None = None) -> str:
    """A short paragraph on what led to a moment.

    A shorter one if that was told of the moment ``before`` it.
    """
    if before is not None and is_same(before, seconds.moment):
        return f"{what(evidence, seconds)} The seconds before are those of event {before.number}."
    sentences = [what(evidence, seconds), _motion(seconds), _person(seconds)]
    if not evidence.row["gave_up"]:  # else it was not the controller's choice
        sentences += [decided(seconds), _against(seconds)]
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
    """How it drove, and whether it braked."""
    speed, commanded = seconds.speed, seconds.command[:, 0]
    early = int(np.abs(seconds.at + 1.0).argmin())
    if np.abs(speed).max() < STANDS and np.abs(commanded).max() < STANDS:
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
    return (
        f"In the {-seconds.at[0]:.1f} s before, it drove {_span(speed)} m/s and {when}{braked} "
        f"(commanded {commanded[early]:z.2f}, then {commanded[-1]:z.2f} m/s)."
    )


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


def decided(seconds: Seconds) -> str:
    """Who decided, and what was illegal."""
    rows = seconds.decisions
    if not rows:
        return "Nothing in this stack decides."
    count = Counter(row["decided_by"] for row in rows)
    who = ", ".join(f"{name} {number}" for name, number in count.most_common())
    text = f"Cycles decided: {who}."
    nothing = sum(bool(row["samples"]) and row["rejected"] >= row["samples"] > 1 for row in rows)
    if nothing:
        text += f" In {nothing} of them no trajectory was legal."
    statuses = Counter(row["status"] for row in rows if row["status"] not in ("", "solved", None))
    if statuses:
        text += (
            " Optimiser: "
            + ", ".join(f"{name} in {number}" for name, number in statuses.items())
            + "."
        )
    monitor = Counter(
        row["monitor_action"] for row in rows if row["monitor_action"] not in ("none", None)
    )
    if monitor:
        text += (
            " Collision monitor: "
            + ", ".join(f"{name} in {number}" for name, number in monitor.items())
            + "."
        )
    return text


def _against(seconds: Seconds) -> str:
    """Which critic decided in the telling cycle."""
    row = seconds.telling
    if row is None:
        return ""
    text = f"At {seconds.moment.stamp - row['stamp_s']:.1f} s before, {row['decided_by']}"
    rejections, samples, shares = rejected_by(row), row["samples"], shares_of(row)
    if row["total_score"] is None and row["rejected"] >= samples:
        if row["status"]:
            why = f"its optimiser {row['status']}"
        else:
            why = _counts(rejections)
        return f"{text} found nothing legal ({why})."
    text += (
        f" chose {row['wanted_linear_x_mps']:z.2f} m/s, {row['wanted_angular_z_radps']:+.2f} rad/s"
    )
    if rejections and samples > 1:
        text += f"; illegal were {row['rejected']} of {samples} ({_counts(rejections)})"
    if shares:
        named = ", ".join(
            f"{name} {100.0 * share:.0f} %" for name, share in list(shares.items())[:SHARES]
        )
        text += f"; its score of {row['total_score']:.3g} came from {named}"
    return f"{text}. {_preferred(seconds, row)}".strip()


def _preferred(seconds: Seconds, row: Row) -> str:
    """Why it was not slower, and what came second."""
    if row["decided_by"] not in TELL_ALTERNATIVES:
        return ""
    if seconds.weighed is None:
        return "What else it weighed is not in the recording (--again tells)."
    other = alternatives_at(seconds, row)
    slower, second = other.get(SLOWER), other.get(RUNNER_UP)
    if second is None:
        return "Nothing else was legal."
    own = row["total_score"]
    if abs(row["wanted_linear_x_mps"]) < SLOW:
        text = ""
    elif slower is None:
        text = "Nothing legal was at most half as fast. "
    else:
        gaps = list(deciding_critics(row, slower).items())[:SHARES]
        spoke = ", ".join(f"{name} +{gap:.3g}" for name, gap in gaps)
        text = (
            f"The best at most half as fast ({slower.command.linear_x:z.2f} m/s) would have scored "
        )
        text += f"{_apart(slower.total - own)}{f'; what decided: {spoke}' if gaps else ''}. "
    speeds = f"{second.command.linear_x:z.2f} m/s, {second.command.angular_z:+.2f} rad/s"
    return f"{text}Second came {speeds} ({_apart(second.total - own)})."


def _apart(gap: float) -> str:
    """How much dearer; what is cheaper may still be left, as changing one's mind has its price."""
    return f"{abs(gap):.3g} {'less' if gap < 0.0 else 'more'}"


def rejected_by(row: Row) -> dict[str, int]:
    """Trajectories that each critic was the first to reject, most first."""
    counts = {
        key.removesuffix("_rejected"): value
        for key, value in row.items()
        if key.endswith("_rejected") and value
    }
    return dict(sorted(counts.items(), key=lambda each: -each[1]))


def shares_of(row: Row) -> dict[str, float]:
    """Share of each critic or term in the absolute sum of a decision's scores, largest first.

    None where that is 0.
    """
    weighted = {
        key.removesuffix(WEIGHTED): abs(value)
        for key, value in row.items()
        if key.endswith(WEIGHTED) and value
    }
    total = sum(weighted.values())
    return {
        name: value / total for name, value in sorted(weighted.items(), key=lambda each: -each[1])
    }


def alternatives_at(seconds: Seconds, row: Row) -> dict[str, Alternative]:
    """What the command of a decision was preferred to, by kind."""
    return {each.kind: each for each in (seconds.weighed or {}).get(row["stamp_s"], ())}


def deciding_critics(row: Row, other: Alternative) -> dict[str, float]:
    """The critics that favour the chosen command over another, and by how much, most first."""
    gaps = {name: gap for name, gap in gaps_to(row, other).items() if gap > 0.0}
    return dict(sorted(gaps.items(), key=lambda each: -each[1]))


def gaps_to(row: Row, other: Alternative) -> dict[str, float]:
    """Each critic's weighted score of another command less that of the chosen one."""
    pairs = ((column_prefix(score.critic), score.weighted) for score in other.scores)
    return {name: (score or 0.0) - (row[f"{name}{WEIGHTED}"] or 0.0) for name, score in pairs}


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


def _counts(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{name} {number}" for name, number in counts.items()) or "no critic said why"


def _span(values: FloatArray) -> str:
    low, high = float(values.min()), float(values.max())
    if high - low < 0.05:
        return f"{high:z.2f}"
    return f"{low:z.2f} to {high:z.2f}"
