"""Why a delivery cost what it cost: evidence, words, figures, a document."""

import dataclasses
import json
from collections.abc import Sequence
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

from harness.analysis.compare import side_of
from harness.execution.process_cache import forget_changed
from harness.explain.activities import Activity, activities
from harness.explain.document import Explained, Saving, explained, explanation_document
from harness.explain.evidence import (
    Evidence,
    decisions_beside,
    delivery_row,
    drive_again,
    events_of,
    recorded,
    recording_file,
)
from harness.explain.legs import ToldLeg, drive_leg_again
from harness.explain.moments import (
    Moment,
    costliest,
    costs_of,
    is_costly,
    moments_of,
)
from harness.explain.rewind import rewind as drive_rewound
from harness.explain.seconds import seconds_before, since_cause
from harness.report.explain import explanation_blocks
from harness.report.explain_figure import FORMATS, draw_seconds
from harness.report.page.recording_code import load_recording
from harness.report.tables import print_blocks, report_console
from harness.storage.files import require_writable, write_text, writing
from harness.storage.parameters import parameter_folder
from harness.study.stored_run import StoredRun
from harness.world.outcome import Rules
from navbench.api.progress import say
from navbench.api.report import map_of
from navbench.api.runs import Run
from navstack.errors import InputError
from navstack.params.strict import load_dataclass

LEAST_BEFORE, MOST_BEFORE = 0.2, 60.0  # [s] shown before an event


@dataclass(frozen=True)
class Explanation:
    """What is to be said of a delivery."""

    evidence: Evidence
    told: list[Explained]
    saving: Saving | None  # None: nothing was rewound
    figures: list[Path]
    activities: list[Activity]  # where the time went, the most first
    leg: ToldLeg | None = None  # that is told of, of a mission on a district

    def as_json(self) -> dict[str, Any]:
        """As ``navbench explain --json`` prints it."""
        figures = [str(figure) for figure in self.figures]
        told = (self.evidence, self.told, self.saving, self.activities)
        leg = None
        if self.leg is not None:
            leg = self.leg.document()
        return {**explanation_document(*told), "leg": leg, "figures": figures}


def explain(
    run: Run,
    episode: int,
    *,
    event: int | None = None,
    before: float | None = None,
    leg: int | None = None,
    again: bool = False,
    rewind: Sequence[str] = (),
    plot: Path | None = None,
    out: Path | None = None,
) -> Explanation | None:
    """Why a delivery cost what it cost: the seconds before each event that had to be paid for.

    Args:
        run: with one stack.
        episode: number of the delivery.
        event: number of the event; None: all, and the costliest for ``plot`` and ``rewind``.
        before: [s] that are shown before the event, and rewound; None: since the robot was held
            up, 5 to 20.
        leg: number of the leg of a mission on a district, from 0; None: the costliest.
        again: whether it is driven again even if it was recorded.
        rewind: ``PATH=VALUE`` of parameters, of which is worked out what they would have saved.
        plot: figure to draw; None: none.
        out: folder for the document, the text and a figure of each event; None: none.

    Returns:
        None where nothing cost anything.

    Raises:
        InputError: something that was given cannot be used.
    """
    _check_choices(event, before)
    forget_changed()
    if plot is not None:
        require_writable("figure", plot, FORMATS)
    if out is not None:
        with writing(out):
            out.mkdir(parents=True, exist_ok=True)
    stored = run.stored
    side_of(stored)  # one stack
    _check_leg(stored, leg, rewind)
    is_told = is_costly(delivery_row(stored, episode), events_of(stored, episode))
    if not is_told and rewind:
        raise InputError(
            f"--rewind: nothing in delivery {episode} cost anything; give one that lost something"
        )
    if not is_told:
        return None
    rules = load_dataclass(Rules, parameter_folder(stored.folder) / "rules.yaml")
    told_leg = None
    if stored.has_legs:
        say(f"mission {episode} of {stored.stacks[0].name} is driven again")
        told_leg = drive_leg_again(stored, episode, rules, leg)
        evidence = told_leg.evidence
    else:
        evidence = _evidence(stored, episode, again)
    chosen = moments_of(evidence, rules, stored.prices())
    if event is not None:
        count = len(chosen)
        if event > count:
            raise InputError(f"--event {event}: the delivery has {count}; give 1 to {count}")
        chosen = [chosen[event - 1]]
    if told_leg is None:
        evidence = dataclasses.replace(evidence, scene=map_of(stored, "the explanation"))
    told = explained(evidence, [seconds_before(evidence, moment, before) for moment in chosen])
    saving = _saving(stored, evidence, chosen, rewind, before) if rewind else None
    figures = _draw(evidence, told, plot, out)
    spent = activities(evidence, evidence.scene)
    explanation = Explanation(evidence, told, saving, figures, spent, told_leg)
    if out is not None:
        _write(explanation, out)
    return explanation


def document_text(explanation: Explanation) -> str:
    """The document as it is printed and written."""
    return json.dumps(explanation.as_json(), indent=2, allow_nan=False) + "\n"


def _write(explanation: Explanation, out: Path) -> None:
    plain = StringIO()
    blocks = explanation_blocks(
        explanation.evidence,
        explanation.told,
        explanation.saving,
        explanation.figures,
        explanation.activities,
    )
    print_blocks(blocks, report_console(plain))
    with writing(out):
        write_text(out / "explanation.json", document_text(explanation))
        write_text(out / "explanation.txt", plain.getvalue())


def _check_choices(event: int | None, before: float | None) -> None:
    """Check what does not depend on the delivery.

    Raises:
        InputError: there is no such event, or no such time before one.
    """
    if event is not None and event < 1:
        raise InputError(f"--event {event}: events are counted from 1")
    if before is not None and not LEAST_BEFORE <= before <= MOST_BEFORE:
        raise InputError(f"--before {before}: allowed is {LEAST_BEFORE:g} to {MOST_BEFORE:g} s")


def _check_leg(run: StoredRun, leg: int | None, rewind: Sequence[str]) -> None:
    """Check what is asked of a leg.

    Raises:
        InputError: a leg is asked for on a map, or a rewind on a district.
    """
    if leg is not None and not run.has_legs:
        raise InputError(f"--leg {leg}: {run.folder} has no legs; it was driven on one map")
    if rewind and run.has_legs:
        raise InputError("--rewind is for deliveries on one map; leave it out for a district's")


def _evidence(run: StoredRun, episode: int, again: bool) -> Evidence:
    """What there is to tell of a delivery on a map."""
    file = recording_file(run, episode)
    if not again and file.is_file() and decisions_beside(file).is_file():
        return recorded(run, episode, load_recording(file), file)
    say(f"episode {episode} of {run.stacks[0].name} is driven again")
    return drive_again(run, episode)


def _saving(
    run: StoredRun,
    evidence: Evidence,
    moments: list[Moment],
    settings: Sequence[str],
    before: float | None,
) -> Saving:
    """What the costliest moment would have cost with other parameters from before it on."""
    moment = costliest(moments)
    prices = run.prices()
    if before is None:
        before = since_cause(evidence, moment)
    before = min(before, moment.stamp)
    rewound = drive_rewound(run, evidence, settings, moment.stamp - before)
    costs = costs_of(evidence.row, prices)
    new_costs = costs_of(rewound.delivery.row, prices)
    return Saving(rewound, moment, before, evidence.row, costs, new_costs)


def _draw(
    evidence: Evidence, told: list[Explained], plot: Path | None, out: Path | None
) -> list[Path]:
    """Draw what was asked for; returns the files."""
    if plot is None and out is None:
        return []
    files = []
    costly = costliest([each.seconds.moment for each in told])
    for each in told:
        number = each.seconds.moment.number
        wanted = []
        if plot is not None and each.seconds.moment is costly:
            wanted.append(plot)
        if out is not None:
            wanted += [out / f"event-{number}{suffix}" for suffix in (".pdf", ".png")]
        if wanted:
            draw_seconds(evidence, each.seconds, evidence.scene, wanted)
            files += wanted
    return files
