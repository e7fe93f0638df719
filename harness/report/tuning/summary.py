"""What a tuning study found, in sentences."""

from harness.audit.auditor import Audit
from harness.economics.cost_terms import MARGIN
from harness.economics.valuation import CENT
from harness.report.audit import audit_sentence
from harness.report.numbers import bounds_text, interval_text
from harness.statistics.interval import Interval, fewest_missions
from harness.tuning.explanation import Explanation
from harness.tuning.result import COMPLETE, FAILED, PRUNED, StudyResult


def summary(study: StudyResult, explanation: Explanation) -> list[str]:
    """What the study found, in sentences: the proof first, then whether to trust it."""
    states = [trial.state for trial in study.trials[1:]]
    lines = [
        f"{len(states)} trials: {states.count(COMPLETE)} on all {len(study.train_missions)} "
        "training missions, "
        f"{states.count(PRUNED)} dropped on the way, {states.count(FAILED)} failed."
    ]
    if not study.incumbent.values:
        return [*lines, *_room(study, explanation)]
    lines += [
        _proof(study, explanation),
        *_room(study, explanation),
        *explanation.notes,
    ]
    return [*lines, _audit_text(explanation.audit)]


def _audit_text(audit: Audit) -> str:
    """Whether the auditor flags the optimum."""
    text = audit_sentence(audit)
    if audit.flagged:
        return f"{text} Read its evidence below before using the file."
    if looks := "; ".join(check.look for check in audit.checks if check.look):
        text += f" Look at values at an end of their range: {looks}."
    return text


def _proof(study: StudyResult, explanation: Explanation) -> str:
    margin = explanation.components.get(MARGIN)
    if margin is None:
        return "The margin is undefined, because the cargo was not simulated."
    where = "training missions that chose it (no evidence)"
    if study.is_tested:
        where = "unseen test missions"
    means = f"{margin.original:.2f} -> {margin.incumbent:.2f} USD/run"
    text = f"margin {means} on {explanation.audit.missions} {where}: "
    text += f"difference {interval_text(margin.difference)}"
    if explanation.unseen is not None:
        bounds = bounds_text(explanation.unseen)
        text += f" ({bounds} admitting an unseen loss)"
    return f"{text}, {_verdict(margin.difference, explanation.unseen)}."


def _room(study: StudyResult, explanation: Explanation) -> list[str]:
    room = explanation.room_usd_per_run
    if room is None or not study.is_tested:
        return []
    left = f"{interval_text(room)} USD/run to gain, admitting an unseen loss"
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
