"""The tables of a tuning study."""

import math
from collections.abc import Mapping, Sequence

from harness.audit.findings import AuditEvidence
from harness.economics.cost_terms import COST_TERMS
from harness.metrics.columns import Row
from harness.report.audit import audit_table
from harness.report.blocks import Block, ReplayCommand, Table, declared
from harness.report.numbers import (
    UNDEFINED,
    bounds_text,
    count_text,
    interval_text,
    number_text,
    p_text,
)
from harness.report.repriced import SHOWN
from harness.report.texts import OUTCOMES, TEXTS, notes
from harness.statistics.interval import Interval
from harness.tuning.evaluation import MARGIN as MARGIN_USD
from harness.tuning.explanation import Explanation
from harness.tuning.mission_differences import MissionDifference
from harness.tuning.objective import score_text
from harness.tuning.result import StudyResult
from harness.tuning.space.paths import is_list
from harness.tuning.waterfall import Step

LONG = 1_000_000  # from here on whole numbers are told by their power of ten


def sheets(
    study: StudyResult,
    scores: Row,
    explanation: Explanation,
    command: Sequence[str],
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
        audit_table(explanation.audit.checks),
        _partings(explanation.partings),
        *(ReplayCommand(each.replay(command)) for each in explanation.partings),
    ]


def _scores(scores: Row, explanation: Explanation) -> Table:
    """Every objective, the margin and the share in time and intact.

    Each is told on training missions and on unseen ones.
    """
    rows, missed = [], []
    for part, title in (("train", "training"), ("test", "unseen test")):
        for name, score in (scores[part] or {}).items():
            difference = Interval(**score["difference"])
            cells = (
                str(difference.n),
                value_text(float(score["original"])),
                value_text(float(score["incumbent"])),
                interval_text(difference),
                _p(score["p"], difference),
                count_text(score["pairs_needed"]),
            )
            rows.append((OUTCOMES.get(name, name), title, *cells))
            missed += _missed(name, title, score["shortfall"])
    if explanation.optimism_usd_per_run is not None:
        optimism = interval_text(explanation.optimism_usd_per_run)
        rows.append(("margin", "optimism", "", "", "", optimism, "", ""))
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
    rows = []
    for trial in study.trials:
        cells = [_name(trial.number).removeprefix("trial "), trial.state, str(len(trial.missions))]
        cells += [f"{value:.4g}" for value in trial.told[:1]] or [UNDEFINED]
        cells += [value_text(trial.point.get(name, UNDEFINED)) for name in names]
        rows.append(cells)
    return declared("tuning_trials", rows, columns=names, objective=study.objectives[0])


def _name(trial: int) -> str:
    """What the trial of a number is called."""
    if trial:
        return f"trial {trial}"
    return "original"


def _finals(study: StudyResult) -> Table:
    """Who met in the final choice."""
    trials = {trial.number: trial for trial in study.trials}
    objective = study.objectives[0]
    rows = []
    for each in study.finals:
        in_training = score_text(objective, trials[each.number].values[0])
        score = UNDEFINED
        if math.isfinite(each.value):
            score = score_text(objective, each.value)
        rows.append((_name(each.number), in_training, score, str(each.missions)))
    return declared("tuning_finals", rows, objective=objective)


def _front(study: StudyResult) -> Table:
    """What a Pareto study has to offer."""
    front: Sequence[int] = ()
    if len(study.objectives) > 1:
        front = sorted(study.front, key=lambda number: -study.trials[number].values[0])
    rows = []
    for number in front:
        values = [f"{value:.4g}" for value in study.trials[number].values]
        rows.append((_name(number), *values))
    return declared("tuning_front", rows, columns=study.objectives)


def _bests(explanation: Explanation) -> Table:
    """How the best so far changed, under three accountings."""
    bests = explanation.history
    names = [name for name in SHOWN if all(name in best.margins for best in bests)]
    rows = []
    for best in bests:
        margins = (number_text(best.margins[name]) for name in names)
        rows.append((_name(best.number), interval_text(best.score), *margins))
    if len(rows) < 2 or not names:
        rows = []
    return declared("tuning_bests", rows, columns=[TEXTS.accountings[name] for name in names])


def _changes(study: StudyResult, shares: Mapping[str, float]) -> Table:
    order = [*shares, *(each.name for each in study.space.parameters)]
    new = study.incumbent.values
    if not new:
        return declared("tuning_changes", ())
    rows = []
    for each in sorted(study.space.parameters, key=lambda each: order.index(each.name)):
        values = [value_text(new[path]) for path in each.paths if path in new]
        allowed = " | ".join(map(value_text, each.choices)) or f"{each.low:g} .. {each.high:g}"
        if is_list(each.original):
            allowed = f"{len(each.choices)} lists"
        cells = (value_text(each.original), *(values or ["unchanged"])[:1], allowed, each.unit)
        rows.append((each.name, each.paths[0], *cells, number_text(shares.get(each.name))))
    return declared("tuning_changes", rows)


def _waterfall(explanation: Explanation) -> Table:
    found = explanation.waterfall
    if found is None:
        return Table("", (), ())
    rows = [("original file", number_text(found.original), "")]
    rows += [_step(step) for step in found.steps]
    total = f"total {interval_text(found.total)}"
    rows.append(("tuned file", number_text(found.incumbent), total))
    return declared(
        "tuning_waterfall",
        rows,
        missions=found.missions,
        kind=found.kind,
        episodes=found.episodes,
    )


def _step(step: Step) -> tuple[str, str, str]:
    """A step and what it gains."""
    gain = step.gain_usd_per_run
    return step_title(step), number_text(gain.value, is_signed=True), bounds_text(gain)


def _components(explanation: Explanation) -> Table:
    rows = []
    for key, each in explanation.components.items():
        decimals = 2
        if key in COST_TERMS:
            decimals = COST_TERMS[key].decimals
        rows.append((each.what, *_both(each, decimals)))
    return declared("tuning_components", rows)


def _both(found: AuditEvidence, digits: int = 2) -> tuple[str, ...]:
    """Money of original and incumbent, and their difference."""
    means = (number_text(number or 0.0, digits) for number in (found.original, found.incumbent))
    return (*means, interval_text(found.difference, digits), _p(found.p or 0.0, found.difference))


def _accountings(explanation: Explanation) -> Table:
    scores = explanation.audit.scores
    rows = [(TEXTS.accountings[name], *_both(scores[name])) for name in SHOWN if name in scores]
    return declared("tuning_accountings", rows)


def _partings(partings: Sequence[MissionDifference]) -> Table:
    rows = [
        (
            f"seed {each.seed}, delivery {each.episode}",
            f"{each.difference_usd:+.2f}",
            what_happened(each),
        )
        for each in partings
    ]
    return declared("tuning_partings", rows)


def what_happened(found: MissionDifference) -> str:
    """What happened to each, in a sentence."""
    return f"old file: {_happened(found.original)}; new file: {_happened(found.incumbent)}"


def _happened(row: Row) -> str:
    way = f"{row['duration_s']:.0f} s and {row['distance_m']:.0f} m"
    said = f"{OUTCOMES.get(row['outcome'], row['outcome'])} ({row['reason']}) after {way}"
    contacts, soft = row["pedestrian_contacts"], row["soft_contacts"]
    if contacts or soft:
        said += f", {contacts} counted and {soft} uncounted contacts"
    if row["gave_up"]:
        said += f", gave up: {row['gave_up']}"
    return f"{said}, {number_text(row[MARGIN_USD])} USD"


def _p(p: float, difference: Interval) -> str:
    """The p value of a difference; none where no pairs are apart."""
    if difference.low is None:
        return UNDEFINED
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
    if isinstance(value, int) and abs(value) >= LONG:
        return f"{value:.4g}".replace("e+0", "e")
    return str(value)
