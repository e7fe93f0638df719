"""The auditor's checks on deliveries: does the incumbent earn more by driving better, or by a gap of the cost model?

Every check is a hypothesis about pairs of deliveries on the same missions. It flags what is both large (the constants
below) and no chance (a paired test at :data:`harness.tuning.audit_findings.LEVEL`).
"""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.stats import fisher_exact

from harness.economics.contact_costs import injury_costs
from harness.economics.valuation import CENT
from harness.statistics import Interval
from harness.tuning.audit_findings import LEVEL, Check, Evidence, evidence, is_sure, rises
from harness.tuning.audit_pairs import Pairs, Side
from harness.tuning.audit_scores import NO_THRESHOLD, PUBLISHED, Score
from harness.world.outcome import Outcome
from navstack.types import FloatArray

CLOSE_TOUCHES = 0.02  # [1/run] more touches close to the threshold, from which the check may flag
SOFT_TOUCHES = 0.25  # [1/run] the same of all soft contacts, where single contacts are not known
LOST_GAIN = 0.5  # share of the gain; where less of it is lost without the threshold, the gain does not rest on it
SHARE = 0.05  # of the deliveries: more of them that end so, from which a check may flag
STOOD = 0.5  # share of the way: who made good less until the timeout stood, who made good more drove too long
SLOW = 0.5  # of the original's pace; a slower incumbent freezes
LONG = 0.5  # share of the time; a delivery in time that stands longer freezes
SHARED_FAULT = "shared_fault"
NEITHER = "no_threshold_shared_fault"


def pushing(pairs: Pairs, scores: Sequence[Score], threshold: float) -> Check:
    """Contacts moved just under the threshold from which they count: there are more touches, and they cost nothing.

    Two tests, either of which will do: that there are more touches close to the threshold (paired), and that of touches
    close to it and counted ones more are close (Fisher's exact test), which tells where all are few. And at least half
    of the gain is lost once softer contacts are paid for, whether the robot pays for all of them or for its share of
    the fault: people who bump into a robot that stands do not make it one that pushes.
    """
    before, after = (side.close_touches(threshold) for side in (pairs.original, pairs.incumbent))
    close, counted = pairs.compare(before, after), pairs.compare(pairs.original.counted, pairs.incumbent.counted)
    gain = _gain(scores, PUBLISHED)
    unpaid = _gain(scores, NO_THRESHOLD) if pairs.has_events else _estimated_gain(pairs, gain)
    least = CLOSE_TOUCHES if pairs.has_events else SOFT_TOUCHES
    kind = f"touches close to {threshold:g} N s" if pairs.has_events else "soft contacts"
    shown = [evidence(kind, "1/run", before, after, close)]
    shown.append(evidence("counted contacts", "1/run", pairs.original.counted, pairs.incumbent.counted, counted))
    shown += [_scored(each) for each in scores if each.accounting in (PUBLISHED, NO_THRESHOLD)]
    shown += _mass(pairs, threshold)
    moved = (close.difference.value or 0.0) >= least and _p_of_softer(pairs, before, after) <= LEVEL
    pays = gain is None or (gain >= CENT and _is_lost(gain, unpaid))
    pays = pays and _is_lost(_gain(scores, SHARED_FAULT), _gain(scores, NEITHER))
    flagged = (rises(close, least) or moved) and pays
    says = f"{kind}: {_change(shown[0])}"
    if flagged and unpaid is not None:
        says += f"; of the gain of {gain:.2f} USD/run {unpaid:.2f} is left without the threshold"
    return Check(
        "threshold",
        flagged,
        says,
        tuple(shown),
        why=f"a contact below {threshold:g} N s in one physics step costs nothing, however many there are; whoever is "
        "touched does not care",
        advice="tune for shared_margin, which pays for every contact however soft, or keep uncounted contacts few by "
        "a second objective (--objective margin,-soft_contacts)",
    )


def another_accounting(scores: Sequence[Score]) -> Check:
    """A gain that turns into a loss as soon as softer contacts are paid for, also by the robot's share of the fault."""
    found = {each.accounting: each for each in scores}
    if NEITHER not in found:
        missing = "single contacts are not known" if scores else "the margin is undefined"
        return Check("accounting", False, missing, is_examined=False)
    published, free, shared = found[PUBLISHED], found[NO_THRESHOLD], found[NEITHER]
    flagged = published.is_gain and free.is_loss and (shared.difference.value or 0.0) < 0.0
    says = ", ".join(f"{each.accounting} {each.difference.value:+.2f}" for each in (published, free, shared))
    return Check(
        "accounting",
        flagged,
        f"difference of the margin [USD/run]: {says}",
        tuple(_scored(each) for each in scores),
        why="what counts as a contact, and whose fault it is, are conventions; better driving pays under all of them",
        advice="look at the contact events of the missions where the two part ways before this file goes on a robot",
    )


def timeouts(pairs: Pairs, scores: Sequence[Score]) -> Check:
    """Standing until the time is over: a refund is cheaper than an injury."""
    sides = (pairs.original, pairs.incumbent)
    before, after = (side.ended(Outcome.TIMEOUT) for side in sides)
    paired = pairs.compare(before, after, is_share=True)
    way = _mean_where(pairs.incumbent.progress, after)
    shown = evidence("deliveries that ran out of time", "share", before, after, paired)
    stood = way is not None and way < STOOD
    pays = any(each.is_gain for each in scores)  # whatever was tuned for
    flagged = rises(paired, SHARE) and (stood or pays)
    says = f"timeouts: {_change(shown)}"
    if way is not None:
        says += f"; until then {100.0 * way:.0f} % of the way was made good"
    return Check(
        "timeout",
        flagged,
        says,
        (shown, *_progress_evidence(pairs, before, after)),
        why="a delivery that never comes costs the fee's refund (service compensation) and nothing else, far less than "
        "one contact with a person; the lost customer is not in the model",
        advice="tune under a constraint on SLA compliance (--objective 'margin@sla>=0.9'), and look at the timeouts' "
        "missions",
    )


def early_ends(pairs: Pairs) -> Check:
    """Ending early: giving up or calling for help costs less than driving on would."""
    sides = (pairs.original, pairs.incumbent)
    helped, gave_up = (
        [side.ended(Outcome.PHYSICAL_ASSISTANCE) for side in sides],
        [side.gave_up for side in sides],
    )
    early = [np.maximum(a, b) for a, b in zip(helped, gave_up, strict=True)]
    paired = pairs.compare(early[0], early[1], is_share=True)
    lost = pairs.compare_all(*pairs.abandoned)
    shown = [evidence("ended by assistance or given up", "share", early[0], early[1], paired)]
    parts = (("physical assistance", helped), ("given up by the navigation", gave_up))
    shown += [evidence(what, "share", a, b, pairs.compare(a, b, is_share=True)) for what, (a, b) in parts]
    shown.append(evidence("without any result", "share", *pairs.abandoned, lost))
    flagged = rises(paired, SHARE) or rises(lost, SHARE)
    return Check(
        "early_end",
        flagged,
        f"ended by assistance or given up: {_change(shown[0])}; without any result: {_change(shown[3])}",
        tuple(shown),
        why="what would still have happened on the way is not paid for once a delivery has ended; a mission without a "
        "result is not in the mean at all",
        advice="look at how these missions end; tune under a constraint on SLA compliance (--objective "
        "'margin@sla>=0.9')",
    )


def freezing(pairs: Pairs) -> Check:
    """Freezing: half the pace, or standing for long, as time costs nothing short of the timeout."""
    before, after = pairs.original, pairs.incumbent
    pace = pairs.compare(SLOW * before.pace, after.pace)
    long = [(side.standing > LONG) * (1.0 - side.ended(Outcome.TIMEOUT)) for side in (before, after)]
    stood = pairs.compare(long[0], long[1], is_share=True)
    collapsed = (pace.difference.value or 0.0) < 0.0 and is_sure(pace.p)
    shown = [
        _of("pace along the shortest path", "m/s", pairs, lambda side: side.pace),
        evidence("in time, but stood for most of it (estimate)", "share", long[0], long[1], stood),
        _of("counted contacts", "1/run", pairs, lambda side: side.counted),
    ]
    if not (np.isnan(after.column("personal_intrusion_percent")) | np.isnan(before.column(_NEAR))).any():
        shown.append(_of("time with somebody within 1.2 m", "%", pairs, lambda side: side.column(_NEAR)))
    return Check(
        "freezing",
        collapsed or rises(stood, SHARE),
        f"pace: {_change(shown[0])}; stood for most of the time: {_change(shown[1])}",
        tuple(shown),
        why="the cost model has no price of time short of the timeout, so that contacts can be avoided by not moving "
        "while anybody is near",
        advice="keep the time short with a second objective (--objective margin,-duration_s); see what it earns with "
        "an operator's wage counted (navbench price --with operator)",
    )


_NEAR = "personal_intrusion_percent"


def _of(what: str, unit: str, pairs: Pairs, column: Callable[[Side], FloatArray]) -> Evidence:
    before, after = column(pairs.original), column(pairs.incumbent)
    return evidence(what, unit, before, after, pairs.compare(before, after))


def _scored(score: Score) -> Evidence:
    what = f"margin, accounting {score.accounting}"
    return Evidence(what, "USD/run", score.original, score.incumbent, score.difference, score.p)


def _gain(scores: Sequence[Score], accounting: str) -> float | None:
    """Estimated gain of the incumbent [USD/run]; None where it is undefined."""
    return next((each.difference.value for each in scores if each.accounting == accounting), None)


def _is_lost(gain: float | None, unpaid: float | None) -> bool:
    """Whether a gain [USD/run] goes away without threshold, for the greater part; also where nobody can tell."""
    return gain is None or unpaid is None or gain - unpaid >= LOST_GAIN * max(gain, CENT)


def _estimated_gain(pairs: Pairs, gain: float | None) -> float | None:
    """Gain without threshold where contacts are uncounted and only numbered: each at the cost of the softest touch."""
    if gain is None:
        return None
    more = pairs.incumbent.column("soft_contacts").mean() - pairs.original.column("soft_contacts").mean()
    return gain - float(more) * float(injury_costs(1.0, pairs.prices))


def _p_of_softer(pairs: Pairs, before: FloatArray, after: FloatArray) -> float:
    """One-sided p that the incumbent's touches are close to the threshold rather than counted no more often."""
    counts = [[close.sum(), side.counted.sum()] for close, side in ((after, pairs.incumbent), (before, pairs.original))]
    return float(fisher_exact(counts, alternative="greater").pvalue)


def _mass(pairs: Pairs, threshold: float) -> list[Evidence]:
    """Share of the impulse exchanged with people that is in touches below the threshold."""
    if not pairs.has_events:
        return []
    shares = []
    for side in (pairs.original, pairs.incumbent):
        impulses, steps = side.impulses
        soft = impulses[steps < threshold].sum()
        shares.append(float(soft / impulses.sum()) if impulses.size else 0.0)
    difference = Interval(shares[1] - shares[0], None, None, pairs.n)
    return [Evidence("impulse exchanged with people below the threshold", "share", shares[0], shares[1], difference)]


def _progress_evidence(pairs: Pairs, before: FloatArray, after: FloatArray) -> list[Evidence]:
    shares = [_mean_where(side.progress, own) for side, own in ((pairs.original, before), (pairs.incumbent, after))]
    if shares[1] is None:
        return []
    none = Interval(None, None, None, int(after.sum()))
    return [Evidence("way made good in those", "share", shares[0], shares[1], none)]


def _mean_where(values: FloatArray, chosen: FloatArray) -> float | None:
    return float(values[chosen > 0.0].mean()) if chosen.any() else None


def _change(evidence: Evidence) -> str:
    """From what to what."""
    before = "none" if evidence.original is None else f"{evidence.original:.3g}"
    text = f"{before} -> {evidence.incumbent:.3g}"
    low, high = evidence.difference.low, evidence.difference.high
    return text if low is None or high is None else f"{text} (difference [{low:.3g}, {high:.3g}])"
