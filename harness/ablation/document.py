"""The JSON document of an ablation."""

from pathlib import Path

from harness.ablation.analysis import Ablation, Arm, ArmDifference, ErrorPrice
from harness.ablation.arms import KINDS, is_buildable
from harness.economics.break_even import break_even_days
from harness.economics.prices import Prices
from harness.metrics.columns import Row
from harness.statistics.interval import Interval, interval_json
from harness.task.study import Study
from harness.world.outcome import OUTCOMES


def ablation_document(ablation: Ablation, study: Study, prices: Prices) -> Row:
    """Everything that the report tells; see docs/ablation.md for the keys."""
    return {
        "schema": 1,
        "stack": ablation.declaration.stack,
        "against": ablation.declaration.against,
        "map": Path(study.template.map_name).stem,
        "seed": study.template.seed,
        "episodes": ablation.episodes,
        "within_usd": ablation.declaration.within,
        "arms": [_arm(arm, prices) for arm in ablation.arms],
        "differences": [difference_document(difference) for difference in ablation.differences],
        "audits": {arm: audit.as_json() for arm, audit in ablation.audits.items()},
        "price_of_error": {price.kind: price_document(price) for price in ablation.prices},
    }


def _arm(arm: Arm, prices: Prices) -> Row:
    stack, intervals, runs = arm.stack, arm.result.intervals, arm.break_even
    days, low, high = (break_even_days(end, prices) for end in (runs.value, runs.low, runs.high))
    return {
        "arm": arm.name,
        "localizer": stack.localizer,
        "localization_map": stack.localization_map,
        "injected": {
            "position_m": stack.injected.position_rms,
            "heading_deg": stack.injected.heading_rms,
            "correlation_time_s": stack.injected.correlation_time,
        }
        if not stack.injected.is_zero
        else None,
        "episodes": arm.result.episodes,
        "errors": arm.result.errors,
        "outcomes": {name: interval_json(intervals.get(name)) for name in OUTCOMES},
        **{key: error.as_json() for key, error in arm.errors.items()},
        "contribution_margin_usd": arm.margin.as_json(),
        "margin_with_unseen": interval_json(arm.unseen),
        "sensors": list(stack.carries),
        "is_buildable": is_buildable(stack),
        "capex_usd": arm.capex_usd,
        "break_even_runs": runs.as_json(),
        "break_even_days": Interval(days, low, high, runs.n).as_json(),
    }


def difference_document(difference: ArmDifference) -> Row:
    """One comparison, as JSON."""
    paired = difference.paired
    return {
        "arm": difference.arm,
        "against": difference.against,
        "metric": difference.metric,
        **paired.difference.as_json(),
        "p": paired.p,
        "p_holm": paired.p_holm,
        "is_significant": paired.is_significant,
        "smallest_detectable": paired.detectable,
        "pairs_needed": paired.needed,
    }


def price_document(price: ErrorPrice) -> Row:
    """What a kind of error costs, as JSON."""
    unit = KINDS[price.kind].unit
    return {f"usd_per_run_per_{unit}": price.price.as_json(), f"levels_{unit}": list(price.levels)}
