"""What a tuning study found: its tables and its summary."""

import math
from collections.abc import Sequence

from harness.economics.accountings import ACCOUNTINGS
from harness.economics.cost_terms import MARGIN
from harness.economics.valuation import CENT
from harness.metrics.columns import Row
from harness.report.blocks import Block, Replay, Table, declared
from harness.report.numbers import bounds_text, interval_text, number_text, p_text
from harness.report.texts import notes
from harness.statistics.interval import Interval
from harness.tuning.audit.findings import AuditEvidence
from harness.tuning.explanation import Explanation
from harness.tuning.importance import Importance
from harness.tuning.mission_differences import MissionDifference, sentence
from harness.tuning.objective import score_text
from harness.tuning.result import COMPLETE, FAILED, PRUNED, StudyResult
from harness.tuning.space.paths import is_list
from harness.tuning.waterfall import Step

LONG = 1_000_000  # from here on whole numbers are told by their power of ten


def sheets(
    study: StudyResult, scores: Row, explanation: Explanation, command: Sequence[str]
) -> list[Block]:
    """Every table that has rows.

    Args:
        study: what was searched.
        scores: of :func:`harness.tuning.scores.scores_document`.
        explanation: what it says.
        command: ``navbench run`` with the tuned file, without seed and number of deliveries.
    """
    return [
        _scores(scores, explanation),
        _finals(study),
        _front(study),
        _bests(explanation),
        _changes(study, explanation.importances),
        _waterfall(explanation),
        _components(explanation),
        _accountings(explanation),
        _checks(explanation),
        _partings(explanation.partings),
        *(Replay(each.replay(command)) for each in explanation.partings),
    ]


def summary(study: StudyResult, explanation: Explanation) -> list[str]:
    """What the study found, in sentences: the proof first, then whether to trust it."""
    states = [trial.state for trial in study.trials[1:]]
    lines = [
        f"{len(states)} trials: {states.count(COMPLETE)} on all {len(study.train_missions)} "
        "training missions, "
        f"{states.count(PRUNED)} dropped on the way, {states.count(FAILED)} failed."
    ]
    if not study.incumbent.values:
        lines.append("No trial was better than the original file: it stays as it is.")
        return [*lines, *_room(explanation)]
    lines += [
        _proof(explanation),
        *_advice(study, explanation),
        *_room(explanation),
        *explanation.notes,
    ]
    flagged = explanation.audit.flagged
    if flagged:
        names = ", ".join(check.gap.title for check in flagged)
        lines.append(
            f"THE AUDITOR FLAGS THIS OPTIMUM: {names}. Read its evidence below before using the "
            "file."
        )
    else:
        examined, every = (
            sum(check.is_examined for check in explanation.audit.checks),
            len(explanation.audit.checks),
        )
        found = "could examine nothing"
        if examined:
            found = f"flags nothing ({examined} of {every} checks examined)"
        looks = "; ".join(check.look for check in explanation.audit.checks if check.look)
        lines.append(
            f"The auditor {found}."
            + (f" Look at values at an end of their range: {looks}." if looks else "")
        )
    return lines


def _proof(explanation: Explanation) -> str:
    margin = explanation.components.get(MARGIN)
    if margin is None:
        return "The margin is undefined, because the cargo was not simulated."
    where = "training missions that chose it (no evidence)"
    if explanation.audit.unseen:
        where = "unseen test missions"
    means = f"{margin.original:.2f} -> {margin.incumbent:.2f} USD/run"
    text = f"margin {means} on {explanation.audit.missions} {where}: "
    beside = ""
    if explanation.unseen is not None:
        beside = (
            f" ({bounds_text(explanation.unseen)} if a loss that has not happened yet is admitted)"
        )
    verdict = _verdict(margin.difference, explanation.unseen)
    return f"{text}difference {interval_text(margin.difference)}{beside}, {verdict}."


def _advice(study: StudyResult, explanation: Explanation) -> list[str]:
    """What to do with a file that earns less than the original."""
    margin = explanation.components.get(MARGIN)
    most = None
    if margin is not None and explanation.audit.unseen:
        most = margin.difference.high
    if most is None or most >= 0.0:
        return []
    chosen = study.objectives[0]
    why = ""
    if chosen != "margin":
        why = f": what raises {chosen} does not raise it here; search with --objective margin"
    return [f"KEEP THE ORIGINAL FILE, which has the higher margin{why}."]


def _room(explanation: Explanation) -> list[str]:
    room = explanation.room_usd_per_run
    if room is None or not explanation.audit.unseen:
        return []
    left = f"{interval_text(room)} USD/run to gain, if a loss that has not happened yet is admitted"
    return [f"Nothing earns more than the fee, which leaves a better file at most {left}."]


def _verdict(difference: Interval, unseen: Interval | None) -> str:
    if difference.low is None or difference.high is None:
        is_alike = difference.value is not None and abs(difference.value) < CENT
        if is_alike:
            return "alike to a cent on every mission"
        return "one mission, which says nothing about others"
    if difference.low <= 0.0 <= difference.high:
        return "not significant"
    is_sure = (
        unseen is None
        or unseen.low is None
        or unseen.high is None
        or unseen.low > 0.0
        or unseen.high < 0.0
    )
    found = "a loss"
    if difference.low > 0.0:
        found = "an improvement"
    if is_sure:
        return found
    return f"{found} in these deliveries, which one more could undo"


def _scores(scores: Row, explanation: Explanation) -> Table:
    """Every objective, the margin and the SLA, on training missions and on unseen ones."""
    rows, missed = [], []
    for part, title in (("train", "training"), ("test", "unseen test")):
        for name, score in (scores[part] or {}).items():
            difference = Interval(**score["difference"])
            means = value_text(float(score["original"])), value_text(float(score["incumbent"]))
            needed = "--"
            if score["pairs_needed"] is not None:
                needed = f"{score['pairs_needed']:,d}"
            cells = (
                str(difference.n),
                *means,
                interval_text(difference),
                _p(score["p"], difference),
                needed,
            )
            rows.append((name, title, *cells))
            missed += _missed(name, title, score["shortfall"])
    if explanation.optimism_usd_per_run is not None:
        rows.append(
            (
                "margin",
                "optimism",
                "",
                "",
                "",
                interval_text(explanation.optimism_usd_per_run),
                "",
                "",
            )
        )
    if {"cvar", "lower_bound"} & {row[0] for row in rows}:
        missed = [*notes("added_by_deliveries"), *missed]
    return declared("tuning_scores", rows, *missed)


def _missed(name: str, missions: str, shortfall: Sequence[float]) -> list[str]:
    """Who misses an objective's side condition, and by how much."""
    sides = zip(("original", "tuned"), shortfall, strict=True)
    said = " and ".join(f"the {side} file by {share:.3f}" for side, share in sides if share > 0.0)
    if said:
        return [f"{name} is missed on {missions} missions: {said}; only the margin is shown."]
    return []


def trials_sheet(study: StudyResult) -> Table:
    """Every trial: how far it drove, what the search was told of it, and its values."""
    names = [each.name for each in study.space.parameters]
    rows = [
        (
            "original" if not trial.number else str(trial.number),
            trial.state,
            str(len(trial.missions)),
            f"{trial.told[0]:.4g}" if trial.told else "--",
            *(value_text(trial.point[name]) if name in trial.point else "--" for name in names),
        )
        for trial in study.trials
    ]
    return declared("tuning_trials", rows, columns=names, objective=study.objectives[0])


def _finals(study: StudyResult) -> Table:
    """Who met in the final choice."""
    trials = {trial.number: trial for trial in study.trials}
    rows = [
        (
            f"trial {each.number}" if each.number else "original",
            score_text(study.objectives[0], trials[each.number].values[0]),
            score_text(study.objectives[0], each.value) if math.isfinite(each.value) else "--",
            str(each.missions),
        )
        for each in study.finals
    ]
    return declared("tuning_finals", rows, objective=study.objectives[0])


def _front(study: StudyResult) -> Table:
    """What a Pareto study has to offer."""
    rows = [
        (
            f"trial {number}" if number else "original",
            *(f"{value:.4g}" for value in study.trials[number].values),
        )
        for number in sorted(study.front, key=lambda number: -study.trials[number].values[0])
        if len(study.objectives) > 1
    ]
    return declared("tuning_front", rows, columns=study.objectives)


def _bests(explanation: Explanation) -> Table:
    """How the best so far changed, under every accounting."""
    names = [
        name for name in ACCOUNTINGS if all(name in best.margins for best in explanation.history)
    ]
    rows = [
        (
            f"trial {best.number}" if best.number else "original",
            interval_text(best.score),
            *(f"{best.margins[name]:.2f}" for name in names),
        )
        for best in (explanation.history if len(explanation.history) > 1 and names else ())
    ]
    return declared("tuning_bests", rows, columns=[name.replace("_", " ") for name in names])


def _changes(study: StudyResult, ranked: Sequence[Importance]) -> Table:
    shares = {each.name: each for each in ranked}
    order = {each.name: place for place, each in enumerate(ranked)}
    rows = []
    for each in sorted(study.space.parameters, key=lambda each: order.get(each.name, len(order))):
        new = next(
            (study.incumbent.values[path] for path in each.paths if path in study.incumbent.values),
            None,
        )
        found = shares.get(each.name)
        importance = interval_text(None if found is None else found.share)
        value = "unchanged"
        if new is not None:
            value = value_text(new)
        allowed = " | ".join(map(value_text, each.choices)) or f"{each.low:g} .. {each.high:g}"
        if is_list(each.original):
            allowed = f"{len(each.choices)} lists"
        rows.append(
            (
                each.name,
                each.paths[0],
                value_text(each.original),
                value,
                allowed,
                each.unit,
                importance,
            )
        )
    return declared("tuning_changes", rows)


def _waterfall(explanation: Explanation) -> Table:
    found = explanation.waterfall
    if found is None:
        return Table("", (), ())
    rows = [("original file", f"{found.original:.2f}", "")]
    rows += [_step(step) for step in found.steps]
    rows.append(("tuned file", f"{found.incumbent:.2f}", f"total {interval_text(found.total)}"))
    return declared(
        "tuning_waterfall", rows, missions=found.missions, kind=found.kind, episodes=found.episodes
    )


def _step(step: Step) -> tuple[str, str, str]:
    """A step and what it gains."""
    gain = step.gain_usd_per_run
    return step_title(step), number_text(gain.value, is_signed=True), bounds_text(gain)


def _components(explanation: Explanation) -> Table:
    rows = [
        (each.what, *_both(each, 5 if key == "electricity" else 2))
        for key, each in explanation.components.items()
    ]
    return declared("tuning_components", rows)


def _both(found: AuditEvidence, digits: int = 2) -> tuple[str, ...]:
    """Money of original and incumbent, and their difference."""
    means = (number_text(number or 0.0, digits) for number in (found.original, found.incumbent))
    return (*means, interval_text(found.difference, digits), _p(found.p or 0.0, found.difference))


def _accountings(explanation: Explanation) -> Table:
    rows = tuple(
        (name.replace("_", " "), *_both(each)) for name, each in explanation.audit.scores.items()
    )
    return declared("tuning_accountings", rows)


def _checks(explanation: Explanation) -> Table:
    rows = [
        (check.gap.title, check.state.upper() if check.is_flagged else check.state, check.says)
        for check in explanation.audit.checks
    ]
    notes = (
        f"{check.gap.title}: a gap, because {check.gap.why}. What to do: {check.gap.advice}."
        for check in explanation.audit.flagged
    )
    return declared("tuning_checks", rows, *notes)


def _partings(partings: Sequence[MissionDifference]) -> Table:
    rows = [
        (
            f"seed {each.seed}, delivery {each.episode}",
            f"{each.difference_usd:+.2f}",
            sentence(each),
        )
        for each in partings
    ]
    return declared("tuning_partings", rows)


def _p(p: float, difference: Interval) -> str:
    """The p value of a difference; none where no pairs are apart."""
    if difference.low is None:
        return "--"
    return p_text(p)


def step_title(step: Step) -> str:
    """A step's parameters with their old and new values; a group by its names alone."""
    names = ", ".join(step.changes)
    if len(step.changes) > 1:
        if step.player not in (names, " + ".join(step.changes)):
            return f"{step.player} ({names})"
        return step.player
    ((before, after),) = step.changes.values()
    if is_list(before):
        return step.player
    return f"{step.player} {value_text(before)} -> {value_text(after)}"


def value_text(value: object) -> str:
    """A parameter's value as a reader wants it."""
    if isinstance(value, float):
        return f"{value:.4g}"
    is_long = isinstance(value, int) and abs(value) >= LONG
    if is_long:
        return f"{value:.4g}".replace("e+0", "e")
    return str(value)
