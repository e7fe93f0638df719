"""What decided in the seconds before a moment, in plain words."""

from collections import Counter
from collections.abc import Mapping, Sequence

from harness.explain.evidence import WEIGHTED
from harness.explain.seconds import Seconds
from harness.metrics.columns import Row
from harness.metrics.decisions import column_prefix
from navstack.control.decision import RUNNER_UP, SLOWER, Alternative

SLOW = 0.1  # [m/s] of a command that nobody wants slower
TELL_ALTERNATIVES = ("DWBLocalPlanner", "ExpectedCostController")  # the controllers that do
ALTERED = 0.1  # [m/s] or [rad/s] between choice and command from which on it is told
SHARES = 3  # of a score that are named


def decided(seconds: Seconds) -> str:
    """Which controllers decided, and how often they rejected every trajectory."""
    rows = seconds.decisions
    if not rows:
        return "Nothing decided in these seconds."
    count = Counter(row["decided_by"] for row in rows)
    who = ", ".join(f"{name} {number}" for name, number in count.most_common())
    text = f"Cycles decided: {who}."
    nothing = sum(row["rejected"] >= row["samples"] > 1 for row in rows)
    if nothing:
        text += f" In {nothing} of them every trajectory was rejected."
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


def all_rejected(rows: Sequence[Row]) -> str:
    """Which controller rejected every command, when, and by which critics; empty: none did."""
    refused = [row for row in rows if row["rejected"] >= row["samples"] > 1]
    if not refused:
        return ""
    first, last = refused[0], refused[-1]
    when = f"from {first['stamp_s']:.1f} to {last['stamp_s']:.1f} s"
    why = _counts(rejected_by(last))
    return f"{last['decided_by']} rejected every command {when} ({why})"


def against(seconds: Seconds) -> str:
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
        return f"{text} rejected every command ({why})."
    text += (
        f" chose {row['wanted_linear_x_mps']:z.2f} m/s, {row['wanted_angular_z_radps']:+.2f} rad/s"
    )
    text += _passed_on(row)
    if rejections and samples > 1:
        text += f"; {row['rejected']} of {samples} were rejected ({_counts(rejections)})"
    if shares:
        named = ", ".join(
            f"{name} {100.0 * share:.0f} %" for name, share in list(shares.items())[:SHARES]
        )
        text += f"; its score of {row['total_score']:.3g} came from {named}"
    return f"{text}. {_preferred(seconds, row)}".strip()


def _passed_on(row: Row) -> str:
    """How smoother and monitor changed the command; empty: by less than :data:`ALTERED`."""
    speed, turn = row["command_linear_x_mps"], row["command_angular_z_radps"]
    slowed = abs(speed - row["wanted_linear_x_mps"])
    turned = abs(turn - row["wanted_angular_z_radps"])
    if slowed < ALTERED and turned < ALTERED:
        return ""
    who = "the velocity smoother"
    if row["monitor_action"] not in ("none", None):
        who += " and the collision monitor"
    return f", of which {who} let {speed:z.2f} m/s, {turn:+.2f} rad/s reach the wheels"


def _preferred(seconds: Seconds, row: Row) -> str:
    """Why it was not slower, and what came second."""
    if row["decided_by"] not in TELL_ALTERNATIVES:
        return ""
    if seconds.weighed is None:
        return "What else it weighed is not in the recording (--again tells)."
    other = alternatives_at(seconds, row)
    slower, second = other.get(SLOWER), other.get(RUNNER_UP)
    if second is None:
        return "All others were rejected."
    own = row["total_score"]
    if abs(row["wanted_linear_x_mps"]) < SLOW:
        text = ""
    elif slower is None:
        text = "All that were at most half as fast were rejected. "
    else:
        gaps = list(deciding_critics(row, slower).items())[:SHARES]
        spoke = ", ".join(f"{name} +{gap:.3g}" for name, gap in gaps)
        text = (
            f"The best at most half as fast ({slower.command.linear_x:z.2f} m/s) would have scored "
        )
        text += _apart(slower.total - own)
        if gaps:
            text += f"; what decided: {spoke}"
        text += ". "
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


def _counts(counts: Mapping[str, int]) -> str:
    return ", ".join(f"{name} {number}" for name, number in counts.items()) or "no critic said why"
