"""What ``navbench ablate`` found: what each arm knew of its position and what it earned."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from harness.ablation.analysis import Ablation, Arm, ArmDifference, ErrorPrice, wrong_maps
from harness.ablation.arms import KINDS, is_buildable
from harness.economics.cost_terms import MARGIN
from harness.economics.valuation import margins
from harness.report.audit import audit_sentence
from harness.report.blocks import Block, Chart, Table, Text, declared, notes_of
from harness.report.numbers import (
    UNDEFINED,
    all_of,
    bounds_text,
    count_text,
    counted,
    interval_text,
    number_text,
    p_text,
)
from harness.report.short.setup import robot_price_line
from harness.report.texts import OUTCOMES, notes
from harness.report.verdict import DOUBT, MOST, going_on, repeated, undecided
from harness.statistics.interval import admitting
from harness.storage.texts import quoted

METRICS = {
    MARGIN: "margin [USD/run]",
    "sla": f"share {OUTCOMES['sla']}",
    "avg_localization_error_median_m": "localization error [m]",
}
NOT_BUILDABLE = "not buildable"
MORE = 4  # times as many missions, where those driven tell nothing


def ablation_blocks(ablation: Ablation, figures: Sequence[Path], folder: Path) -> list[Block]:
    """What the arms did, how they differ, what that says, and where it is."""
    sentences = [sentence(difference) for difference in ablation.differences]
    more = [*_wrong_maps(ablation), *map(price_sentence, ablation.prices)]
    more += [f"{arm}: {audit_sentence(audit)}" for arm, audit in ablation.audits.items()]
    priced = [robot_price_line(ablation.run, ablation.run.prices())]
    return [
        _outcomes(ablation),
        _money(ablation),
        _differences(ablation),
        *map(Text, [*sentences, "", *more]),
        *notes_of(notes("ablation")),
        *map(Chart, figures),
        Text(f"run folder: {folder}", "whole"),
        *(Text(line, "whole") for line in [*deciding(ablation), *priced] if line),
    ]


def deciding(ablation: Ablation) -> list[str]:
    """The command that would decide all margins that are not significant, in a line.

    None where arms drive no further than their margins are to be known, or it is hopeless.
    """
    if ablation.declaration.within is not None:
        return []
    open_ones = [each.paired for each in ablation.of(MARGIN) if not each.paired.is_significant]
    needed = max((pair.needed or pair.fewest for pair in open_ones if pair.differs), default=0)
    if not 0 < needed <= MOST:
        return []
    command = repeated(ablation.run, needed)
    if not command:
        return []
    return [f"to decide every margin: {command}"]


def _outcomes(ablation: Ablation) -> Table:
    rows = []
    for arm in ablation.arms:
        known = arm.result.intervals
        rates = [interval_text(known.get(name), absent="not modelled") for name in OUTCOMES]
        rows.append((arm.name, str(arm.result.episodes), str(arm.result.errors), *rates))
    return declared("ablation_outcomes", rows, stack=ablation.declaration.stack)


def _money(ablation: Ablation) -> Table:
    rows = []
    for arm in ablation.arms:
        sensors, *investment = investment_of(arm)
        position = interval_text(arm.errors["localization_error_median_m"], 3)
        tail = number_text(arm.errors["localization_error_p95_m"].value)
        heading = number_text(arm.errors["heading_error_median_deg"].value)
        margin = interval_text(arm.unseen, absent="undefined")
        rows.append((arm.name, sensors, position, tail, heading, margin, *investment))
    return declared("ablation_money", rows)


def investment_of(arm: Arm) -> tuple[str, str, str]:
    """Sensors, capital expenditure and break-even point in words."""
    if not is_buildable(arm.stack):
        return "none exists", NOT_BUILDABLE, UNDEFINED
    sensors = " + ".join(arm.stack.carries) or "none"
    return sensors, count_text(arm.capex_usd), _break_even(arm)


def _break_even(arm: Arm) -> str:
    if arm.capex_usd is None or arm.unseen is None:
        return UNDEFINED
    runs = arm.break_even
    value = count_text(runs.value, "never")
    if arm.unseen.low is None or runs.low is None:
        return value
    return f"{value} [{runs.low:,.0f}, {count_text(runs.high, 'never')}]"


def _differences(ablation: Ablation) -> Table:
    rows = []
    for difference in ablation.differences:
        paired = difference.paired
        cells = (
            interval_text(admitting(paired.difference, difference.unseen), None),
            p_text(paired.p_holm),
            str(paired.difference.n),
            number_text(paired.detectable, None),
            count_text(paired.needed),
        )
        rows.append((difference.arm, difference.against, METRICS[difference.metric], *cells))
    return declared("ablation_differences", rows)


def next_command(ablation: Ablation, folder: Path) -> str:
    """More missions where every delivery earned the same; else the dearest one explained."""
    earned: set[float] = set()  # to the cent
    for stack in ablation.run.stacks:
        margin = margins(stack.rows, ablation.run.prices())
        earned.update([math.nan] if margin is None else np.round(margin, 2).tolist())
    more = ""
    if len(earned) == 1 and min(earned) > 0.0:
        driven = max(arm.result.episodes for arm in ablation.arms)
        more = going_on("ablate", folder, MORE * driven)
    return more or f"navbench explain {quoted(folder)}"


def sentence(difference: ArmDifference) -> str:
    """What one comparison says, and what it does not: the first of two less the second."""
    paired = difference.paired
    subject, n = _subject(difference), paired.difference.n
    if not paired.differs:
        return f"{subject} on {all_of(n, 'mission')}, which says nothing of what is rare."
    told = f"{counted(n, 'mission')}, adjusted p {p_text(paired.p_holm)}"
    if paired.is_significant:
        doubt = ""
        if (difference.unseen or paired.difference).sign == 0:
            doubt = DOUBT
        return f"{subject}: significant ({told}){doubt}."
    text = f"{subject}: not significant ({told})"
    text += undecided(paired)
    if paired.detectable is not None:
        text += f"; with {n}, differences from {paired.detectable:.3g} on are found"
    return f"{text}."


def _subject(difference: ArmDifference) -> str:
    """The two arms, and the difference of their metric."""
    gap, whose = admitting(difference.paired.difference, difference.unseen), difference.against
    is_money = difference.metric == MARGIN
    if not difference.paired.differs:
        verb = "earned the same as" if is_money else f"has the same {METRICS[difference.metric]} as"
        return f"{difference.arm} {verb} {whose}"
    value = gap.value or 0.0
    if is_money and value < 0.0:
        earned = f"{interval_text(gap.negated, None)} USD a delivery less"
        return f"{difference.arm} earned {earned} than {whose}"
    if is_money:
        earned = f"{interval_text(gap, None)} USD a delivery more"
        return f"{difference.arm} earned {earned} than {whose}"
    signed = f"{number_text(value, None, True)} {bounds_text(gap, None, True)}".rstrip()
    return f"{difference.arm} less {whose}, {METRICS[difference.metric]}: {signed}"


def price_sentence(price: ErrorPrice) -> str:
    """What an error costs."""
    unit = {"m": "metre", "deg": "degree"}[KINDS[price.kind].unit]
    levels = ", ".join(f"{level:g}" for level in price.levels)
    subject = f"price of {price.kind} error (RMS of {levels} {KINDS[price.kind].unit}):"
    if price.price.value is None:
        return f"{subject} undefined, no mission with a margin was finished at every level."
    verdict = ""
    if price.price.low is None or price.price.high is None:
        verdict = (
            ", too few missions, or all alike to a cent, for an interval: "
            "that says nothing about rare events"
        )
    elif not price.price.sign:
        verdict = ", not significant"
    cost = f"{interval_text(price.price, None)} USD per run per {unit}"
    return f"{subject} {cost}, n = {price.price.n}{verdict}."


def _wrong_maps(ablation: Ablation) -> list[str]:
    """What each wrong map costs."""
    pairs = wrong_maps([arm.stack for arm in ablation.arms])
    found = [each for each in ablation.of(MARGIN) if (each.arm, each.against) in pairs]
    return [f"what the wrong map costs: {sentence(each)}" for each in found]
