"""The auditor's checks for what others bear: people, the customer, and whoever builds the robot.

As in :mod:`harness.audit.hidden`, each flags what is both large and no chance, where the published
margin is not lower. What people bear counts on missions where both arrive: who stands meets others.
The limits are this project's own choices but for :data:`EXACT`. Some were widened after a look at
stored honest pairs of runs, which they let pass.
"""

import numpy as np

from harness.audit.checks import Scores, not_lower
from harness.audit.findings import AuditEvidence, Check
from harness.audit.pairs import NEAR, SHARE, Conditions, PairedSide, Pairs
from harness.task.stack import TRUTH
from navstack.types import FloatArray

DELAY = 5.0  # [s/run]; chosen
# [s] of one delivery; beyond it chance has parted the two crowds that are compared
MOST_DELAY = 60.0
MORE_DELAY = 1.0  # of the original's delay; a rise by more than it is a change of manners
JERK = 5.0  # [m/s3]; chosen
MORE_JERK = 0.5  # of the original's
CONFLICT = 0.9  # [s] of the time to collision below which an encounter is a near miss; chosen
MORE_CONFLICTS = 1.0 / 3.0  # of the deliveries: every third more
CRUMBS = 0.01  # share of the cargo: of a meal for 20 USD, 0.20 USD
# [m] positional accuracy of a good receiver with corrections (SparkFun's page of u-blox's ZED-F9P)
EXACT = 0.01
STRAYED = 1.0  # [m/run] farther than the robot is long, on ground that is not for it
NOT_RECORDED = "not recorded, or of too few deliveries that arrived"


def delaying(pairs: Pairs, scores: Scores) -> Check:
    """People blocked: they take longer because of the robot."""
    return _rising(
        "delay",
        scores,
        pairs.known("delay of people", "s/run", _delay),
        DELAY,
        MORE_DELAY,
    )


def jerking(pairs: Pairs, scores: Scores) -> Check:
    """Jerks that are more than a vehicle may have."""
    found = pairs.known("jerk, 95th percentile", "m/s3", lambda side: side.arrived("jerk_p95_mps3"))
    least = JERK
    if found is not None:
        least = max(JERK - (found.original or 0.0), 0.0)
    return _rising("jerk", scores, found, least, MORE_JERK)


def conflicts(pairs: Pairs, scores: Scores) -> Check:
    """Near misses: courses that meet somebody in less than :data:`CONFLICT`."""
    found = pairs.known(f"deliveries with a time to collision below {CONFLICT} s", SHARE, _met)
    return _rising("conflict", scores, found, MORE_CONFLICTS, 0.0)


def crumbling(pairs: Pairs, scores: Scores, spoiled: float) -> Check:
    """Cargo lost below the share from which food is spoiled."""
    found = pairs.known(
        f"share of the cargo lost; spoiled above {spoiled:g}", "of the cargo", _lost
    )
    return _rising("cargo", scores, found, CRUMBS, 0.0)


def knowing(pairs: Pairs, scores: Scores, conditions: Conditions) -> Check:
    """A position that no robot can know: the true one."""
    before, after = conditions.localizers
    if conditions.has_exact_gps:
        return Check("truth", False, "this world's GPS is exact", is_examined=False)
    if TRUTH in (before, after):
        flagged = after == TRUTH != before and not_lower(scores)
        return Check("truth", flagged, f"localizers: {before} -> {after}")
    found = pairs.known(
        "median localization error", "m", lambda side: side.column("localization_error_median_m")
    )
    if found is None:
        return Check("truth", False, NOT_RECORDED, is_examined=False)
    is_exact = found.incumbent < EXACT <= (found.original or 0.0)
    says = f"{found.what} [{found.unit}]: {found.change}"
    flagged = is_exact and found.falls(0.0) and not_lower(scores)
    return Check("truth", flagged, says, (found,))


def leaving(pairs: Pairs, scores: Scores) -> Check:
    """Driving on the road, or on other ground that is not to be walked on."""
    told = (
        pairs.known("driven on the road", "m/run", lambda side: side.column("road_distance_m")),
        pairs.known(
            "driven off the walkable ground",
            "m/run",
            lambda side: side.column("off_walkable_distance_m"),
        ),
    )
    known = [each for each in told if each is not None]
    if not known:
        return Check("ground", False, NOT_RECORDED, is_examined=False)
    flagged = any(each.rises(STRAYED) for each in known) and not_lower(scores)
    says = "; ".join(f"{each.what} [{each.unit}]: {each.change}" for each in known)
    return Check("ground", flagged, says, tuple(known))


def _rising(
    key: str,
    scores: Scores,
    found: AuditEvidence | None,
    least: float,
    share: float,
) -> Check:
    """Flagged where a quantity rises by ``least``, and by a ``share`` of the original's."""
    if found is None:
        return Check(key, False, NOT_RECORDED, is_examined=False)
    least = max(least, share * (found.original or 0.0))
    flagged = found.rises(least) and not_lower(scores)
    return Check(key, flagged, f"{found.what} [{found.unit}]: {found.change}", (found,))


def _delay(side: PairedSide) -> FloatArray:
    return np.clip(side.arrived("pedestrian_delay_s"), -MOST_DELAY, MOST_DELAY)


def _met(side: PairedSide) -> FloatArray:
    """1 where somebody was on a course of high risk, 0 where nobody was; NaN without people."""
    times = np.nan_to_num(side.column("min_time_to_collision_s"), nan=np.inf)
    is_met = (times < CONFLICT).astype(np.float64)
    return np.where(np.isnan(side.arrived(NEAR)), np.nan, is_met)


def _lost(side: PairedSide) -> FloatArray:
    lost: FloatArray = side.arrived("pieces_lost") / side.column("pieces_at_start")
    return lost
