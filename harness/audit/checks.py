"""The auditor's checks on deliveries.

Every check is a hypothesis about pairs of deliveries on the same missions. It flags what is both
large (the constants below) and no chance (a paired test at
:data:`harness.audit.findings.LEVEL`).
"""

from collections.abc import Mapping

import numpy as np
from scipy.stats import fisher_exact

from harness.audit.findings import LEVEL, AuditEvidence, Check
from harness.audit.pairs import NEAR, SHARE, PairedSide, Pairs
from harness.economics.accountings import PUBLISHED
from harness.economics.contact_costs import injury_costs
from harness.economics.valuation import CENT
from harness.statistics.interval import Interval
from harness.world.outcome import Outcome
from navstack.types import FloatArray

CLOSE_TOUCHES = 0.02  # [1/run] more touches close to the threshold, from which the check may flag
SOFT_TOUCHES = 0.25  # [1/run] the same of all soft contacts, where single contacts are not known
# share of the gain; where less of it is lost without the threshold, the gain does not rest on it
LOST_GAIN = 0.5
SHARE_MORE = 0.05  # of the deliveries: more of them that end so, from which a check may flag
# share of the way made good until the timeout; a robot below it stood, others were too slow
STOOD = 0.5
SLOW = 0.65  # of the original's pace; a slower incumbent freezes
WAITS = 0.15  # share of the time: who stands so much more on average waits
LONG = 0.5  # share of the time; a delivery in time that stands longer freezes
# accountings
NO_THRESHOLD, SHARED_FAULT, NEITHER = "no_threshold", "shared_fault", "no_threshold_shared_fault"
SHARE_OF_TIME = "of the time"  # unit of what differs from delivery to delivery, unlike SHARE

# the margin by accounting, see harness.audit.pairs.Pairs.scores
Scores = Mapping[str, AuditEvidence]


def pushing(pairs: Pairs, scores: Scores, threshold: float) -> Check:
    """Contacts moved just under the threshold from which they count.

    There are more touches, and they cost nothing.

    One of two tests has to be significant. The paired test compares touches close to the threshold.
    Fisher's exact test compares their share among close and counted touches, and also works where
    all are few. In addition, at least half of the gain must be lost once softer contacts are paid
    for. This must hold whether the robot pays for all of them or for its share of the fault:
    people who bump into a standing robot are not pushed by it.
    """
    least = SOFT_TOUCHES
    if pairs.has_events:
        least = CLOSE_TOUCHES
    kind = "contacts below the threshold"
    if pairs.has_events:
        kind = f"touches close to {threshold:g} N s"
    close = pairs.of(kind, "1/run", lambda side: side.close_touches(threshold))
    moved = (close.difference.value or 0.0) >= least and _p_of_softer(pairs, threshold) <= LEVEL
    gain = _gain(scores, PUBLISHED)
    if pairs.has_events:
        unpaid = _gain(scores, NO_THRESHOLD)
    else:
        unpaid = _estimated_gain(pairs, gain)
    pays = gain is None or (gain >= CENT and _is_lost(gain, unpaid))
    pays = pays and _is_lost(_gain(scores, SHARED_FAULT), _gain(scores, NEITHER))
    flagged = (close.rises(least) or moved) and pays
    says = f"{kind}: {close.change}"
    if flagged and unpaid is not None:
        says += f"; of the gain of {gain:.2f} USD/run {unpaid:.2f} is left without the threshold"
    shown = [close, pairs.of("counted contacts", "1/run", lambda side: side.counted)]
    shown += [scores[name] for name in (PUBLISHED, NO_THRESHOLD) if name in scores]
    return Check(
        "threshold",
        flagged,
        says,
        (*shown, *_mass(pairs, threshold)),
    )


def another_accounting(scores: Scores) -> Check:
    """A gain that turns into a loss as soon as softer contacts are paid for."""
    if NEITHER not in scores:
        missing = "the margin is undefined"
        if scores:
            missing = "single contacts are not known"
        return Check("accounting", False, missing, is_examined=False)
    published, free, shared = (scores[name] for name in (PUBLISHED, NO_THRESHOLD, NEITHER))
    flagged = published.rises(CENT) and free.falls(CENT) and (shared.difference.value or 0.0) < 0.0
    says = ", ".join(
        f"{name} {scores[name].difference.value:+z.2f}"
        for name in (PUBLISHED, NO_THRESHOLD, NEITHER)
    )
    return Check(
        "accounting",
        flagged,
        f"difference of the margin [USD/run]: {says}",
        tuple(scores.values()),
    )


def timeouts(pairs: Pairs, scores: Scores) -> Check:
    """Standing until the time is over: a refund is cheaper than an injury."""
    shown = pairs.of(
        "deliveries that ran out of time", SHARE, lambda side: side.ended(Outcome.TIMEOUT)
    )
    ways = [_mean_where(side.progress, side.ended(Outcome.TIMEOUT)) for side in pairs.sides]
    way = ways[1]
    stood = way is not None and way < STOOD
    pays = any(each.rises(CENT) for each in scores.values())  # whatever was tuned for
    says = f"timeouts: {shown.change}"
    found = [shown]
    if way is not None:
        says += f"; until then {100.0 * way:.0f} % of the way was made good"
        none = Interval(None, None, None, int(pairs.incumbent.ended(Outcome.TIMEOUT).sum()))
        found.append(AuditEvidence("way made good in those", SHARE, ways[0], way, none))
    return Check(
        "timeout",
        shown.rises(SHARE_MORE) and ((stood and not_lower(scores)) or pays),
        says,
        tuple(found),
    )


def early_ends(pairs: Pairs, scores: Scores) -> Check:
    """Ending early: giving up or calling for help costs less than driving on would."""

    def helped(side: PairedSide) -> FloatArray:
        return side.ended(Outcome.PHYSICAL_ASSISTANCE)

    early = pairs.of(
        "ended by assistance or given up",
        SHARE,
        lambda side: np.maximum(helped(side), side.gave_up),
    )
    every = np.arange(pairs.abandoned[0].size)
    lost = pairs.compare("without any result", SHARE, *pairs.abandoned, clusters=every)
    return Check(
        "early_end",
        (early.rises(SHARE_MORE) and not_lower(scores)) or lost.rises(SHARE_MORE),
        f"ended by assistance or given up: {early.change}; without any result: {lost.change}",
        (
            early,
            pairs.of("physical assistance", SHARE, helped),
            pairs.of("given up by the navigation", SHARE, lambda side: side.gave_up),
            lost,
        ),
    )


def freezing(pairs: Pairs, scores: Scores) -> Check:
    """Freezing: a much lower pace, or standing for long; time costs nothing before the timeout."""
    slow = pairs.compare("pace", "m/s", SLOW * pairs.original.pace, pairs.incumbent.pace)
    waits = pairs.of(
        "share of the time at a standstill (estimate)", SHARE_OF_TIME, lambda side: side.standing
    )
    pace = pairs.of("pace along the shortest path", "m/s", lambda side: side.pace)
    stood = pairs.of(
        "in time, but stood for most of it (estimate)",
        SHARE,
        lambda side: (side.standing > LONG) * (1.0 - side.ended(Outcome.TIMEOUT)),
    )
    shown = [pace, stood, waits, pairs.of("counted contacts", "1/run", lambda side: side.counted)]
    if not pairs.lacks_people:
        shown.append(
            pairs.of("time with somebody within 1.2 m", "%", lambda side: side.column(NEAR))
        )
    return Check(
        "freezing",
        (slow.falls(0.0) or stood.rises(SHARE_MORE) or waits.rises(WAITS)) and not_lower(scores),
        f"pace: {pace.change}; stood for most of the time: {stood.change}; stands on average: "
        f"{waits.change}",
        tuple(shown),
    )


def not_lower(scores: Scores) -> bool:
    """Whether the published margin is as high as the original's: who loses by it gains nothing."""
    gain = _gain(scores, PUBLISHED)
    return gain is None or gain >= -CENT


def _gain(scores: Scores, accounting: str) -> float | None:
    """Estimated gain of the incumbent [USD/run]; None where it is undefined."""
    if accounting in scores:
        return scores[accounting].difference.value
    return None


def _is_lost(gain: float | None, unpaid: float | None) -> bool:
    """Whether a gain [USD/run] goes away without threshold, for the greater part.

    Also where nobody can tell.
    """
    return gain is None or unpaid is None or gain - unpaid >= LOST_GAIN * max(gain, CENT)


def _estimated_gain(pairs: Pairs, gain: float | None) -> float | None:
    """Gain without threshold where contacts are uncounted and only numbered.

    Each at the cost of the softest touch.
    """
    if gain is None:
        return None
    more = (
        pairs.incumbent.column("soft_contacts").mean()
        - pairs.original.column("soft_contacts").mean()
    )
    return gain - float(more) * float(injury_costs(1.0, pairs.prices))


def _p_of_softer(pairs: Pairs, threshold: float) -> float:
    """One-sided p that touches are close to the threshold no more often than counted."""
    counts = [
        [side.close_touches(threshold).sum(), side.counted.sum()] for side in pairs.sides[::-1]
    ]
    return float(fisher_exact(counts, alternative="greater").pvalue)


def _mass(pairs: Pairs, threshold: float) -> list[AuditEvidence]:
    """Share of the impulse exchanged with people that is in touches below the threshold."""
    if not pairs.has_events:
        return []
    every = [side.touches(of_people=True) for side in pairs.sides]
    soft = [
        float(each.impulses[each.steps < threshold].sum() / (each.impulses.sum() or 1.0))
        for each in every
    ]
    return [
        AuditEvidence.unsampled(
            "impulse exchanged with people below the threshold", SHARE, soft[0], soft[1], pairs.n
        )
    ]


def _mean_where(values: FloatArray, chosen: FloatArray) -> float | None:
    if chosen.any():
        return float(values[chosen > 0.0].mean())
    return None
