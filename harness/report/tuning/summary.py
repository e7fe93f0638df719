"""What a tuning study found, in sentences."""

from collections.abc import Sequence

import numpy as np

from harness.audit.auditor import Audit
from harness.economics.cost_model import running
from harness.economics.cost_terms import COST_LABELS, MARGIN
from harness.economics.prices import Prices
from harness.economics.valuation import CENT, deliveries, meetings_losses
from harness.metrics.columns import Row
from harness.report.audit import audit_sentence
from harness.report.numbers import all_of, counted, interval_text, number_text
from harness.statistics.interval import Interval, admitting, fewest_missions
from harness.tuning.explanation import Explanation
from harness.tuning.objective import score_text
from harness.tuning.result import COMPLETE, FAILED, PRUNED, StudyResult


def summary(study: StudyResult, explanation: Explanation) -> list[str]:
    """What the study found, in sentences: the proof first, then whether to trust it."""
    states = [trial.state for trial in study.trials[1:]]
    lines = []
    if states:
        lines.append(
            f"{counted(len(states), 'trial')}: {states.count(COMPLETE)} on "
            f"{all_of(len(study.train_missions), 'training mission')}, "
            f"{states.count(PRUNED)} dropped on the way, {states.count(FAILED)} failed."
        )
    if not study.incumbent.values:
        return [*lines, *_room(study, explanation)]
    lines += [
        _chosen_by(study),
        _proof(study, explanation),
        *_room(study, explanation),
        *explanation.notes,
    ]
    return [*lines, _audit_text(explanation.audit)]


def starting_point(rows: Sequence[Row], prices: Prices) -> str:
    """What the original file earns, what is left to gain, and by what it loses.

    Args:
        rows: of its training missions, none of an error.
        prices: the price file.
    """
    each = deliveries(rows, prices.rolling_resistance_force)
    costs = running(each, prices)
    if costs.contribution_margin is None:
        return "your file's margin is undefined, because the cargo was not simulated"
    met = float(np.mean(meetings_losses(rows)))
    earned = float(np.mean(costs.contribution_margin)) - met
    left = prices.delivery_fee.value - earned
    text = f"your file earns {number_text(earned)} USD a delivery on "
    text += counted(len(rows), "training mission")
    if left < CENT:
        return f"{text}, the whole fee: nothing can be gained on them"
    means = {label: float(np.mean(costs.amounts[key])) for key, label in COST_LABELS.items()}
    means["people met"] = met
    lost = sorted(means.items(), key=lambda one: -one[1])
    told = ", ".join(f"{label} {mean:.2f}" for label, mean in lost if mean >= CENT)
    missed = prices.delivery_fee.value - float(np.mean(costs.amounts["revenue"]))
    if missed >= CENT:
        told = ", ".join(filter(None, (f"fees not earned {missed:.2f}", told)))
    return f"{text}; at most {left:.2f} to gain: {told}"


def _audit_text(audit: Audit) -> str:
    """Whether the auditor flags the optimum."""
    text = audit_sentence(audit)
    if audit.flagged:
        return f"{text} Read its evidence below before using the file."
    if looks := "; ".join(check.look for check in audit.checks if check.look):
        text += f" Look at values at an end of their range: {looks}."
    return text


def _chosen_by(study: StudyResult) -> str:
    """What the best trial gained on the missions that chose it."""
    best = next(trial for trial in study.trials if trial.candidate.key == study.incumbent.key)
    name = study.objectives[0]
    before, after = (score_text(name, trial.values[0]) for trial in (study.trials[0], best))
    return f"best: trial {best.number}, {name} {before} -> {after} on them, which chose it."


def _proof(study: StudyResult, explanation: Explanation) -> str:
    margin = explanation.components.get(MARGIN)
    if margin is None:
        return "The margin is undefined, because the cargo was not simulated."
    where = "training missions that chose it (no evidence)"
    if study.is_tested:
        where = "unseen test missions"
    means = f"{number_text(margin.original)} -> {number_text(margin.incumbent)} USD a delivery"
    text = f"margin {means} on {explanation.audit.missions} {where}: "
    text += f"difference {interval_text(admitting(margin.difference, explanation.unseen))}"
    return f"{text}, {_verdict(margin.difference, explanation.unseen)}."


def _room(study: StudyResult, explanation: Explanation) -> list[str]:
    room = explanation.room_usd_per_run
    if room is None or not study.is_tested:
        return []
    left = f"{interval_text(room)} USD a delivery to gain"
    return [f"Nothing earns more than the fee, which leaves a better file at most {left}."]


def _verdict(difference: Interval, unseen: Interval | None) -> str:
    value = difference.value or 0.0
    if difference.low is None and abs(value) < CENT:
        return "alike to a cent on every mission"
    if difference.n < fewest_missions():
        return f"fewer than {fewest_missions()} missions, which decide nothing"
    if difference.low is not None and not difference.sign:
        return "not significant"
    found = "a loss"
    if value > 0.0:
        found = "an improvement"
    if unseen is not None and not unseen.sign:
        found += " in these deliveries, which one more could undo"
    return found
