"""What a study says first, on outcomes where it just flips."""

import dataclasses
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from harness.economics.cost_terms import MARGIN
from harness.report.tuning.decision import as_nav2, decision
from harness.report.tuning.summary import starting_point
from harness.statistics.interval import Interval
from harness.study.stored_run import load_run

STORED = Path(__file__).resolve().parents[3] / "results" / "baseline" / "published_3"

ALIKE = Interval(0.0, -1.0, 1.0, 40)
GAIN = Interval(2.0, 0.01, 4.0, 40)
LOSS = Interval(-2.0, -4.0, -0.01, 40)
OPEN = Interval(2.0, -0.01, 4.0, 40)


def said(
    difference: Interval = GAIN,
    unseen: Interval | None = GAIN,
    needed: int | None = None,
    **study: Any,
) -> str:
    usual = {
        "incumbent": SimpleNamespace(values={"a": 1}),
        "is_tested": True,
        "objectives": ("margin",),
    }
    explanation = SimpleNamespace(
        components={MARGIN: SimpleNamespace(difference=difference)}, unseen=unseen
    )
    # under the name that scores have
    scores = {"test": {"margin": {"pairs_needed": needed}}}
    found: Any = SimpleNamespace(**usual | study)
    told: Any = explanation
    return decision(found, scores, told)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({}, "Take the tuned file: it earns more on missions that it never saw."),
        ({"unseen": None}, "Take the tuned file: it earns more on missions that it never saw."),
        ({"unseen": OPEN}, "Not decided: one more loss of a kind that was not seen"),
        (
            {"difference": OPEN, "unseen": OPEN, "needed": 47},
            "Not decided: about 7 more test missions would decide.",
        ),
        (
            {"difference": ALIKE, "unseen": ALIKE},
            "Not decided: the two files earn alike on 40 test missions.",
        ),
        ({"difference": LOSS, "unseen": LOSS}, "Keep your file: your file earns more"),
        (
            {"difference": LOSS, "unseen": LOSS, "objectives": ("cvar",)},
            "What raises cvar does not raise the margin here; search with --objective margin.",
        ),
        (
            {"incumbent": SimpleNamespace(values={})},
            "Keep your file: no trial earned more.",
        ),
        ({"is_tested": False}, "Not decided: the tuned file drove no unseen mission"),
        (
            {"difference": dataclasses.replace(GAIN, n=5), "unseen": None},
            "Not decided: 5 test missions are too few; 6 are the least.",
        ),
    ],
)
def test_the_decision(given: dict[str, Any], text: str) -> None:
    assert text in said(**given)


def test_a_file_with_a_class_of_this_program_does_not_run_on_nav2_as_it_is() -> None:
    assert as_nav2("plugin: dwb_core::DWBLocalPlanner") == "runs on Nav2 as it is: yes."
    own = as_nav2("critics: [navstack::ExpectedContact]\nplugin: 'navstack::JerkLimitedMPC'")
    assert own == (
        "runs on Nav2 as it is: no, it needs navstack::ExpectedContact, navstack::JerkLimitedMPC "
        "of this program."
    )


def test_a_search_begins_with_what_the_file_earns_and_what_is_left_to_gain() -> None:
    def told(stack: str) -> str:
        run = load_run(str(STORED / f"sidewalk:{stack}"))
        return starting_point(run.stacks[0].rows[:100], run.prices())

    first, losses = told("nav2-gps-ekf").split(" to gain: ")
    (left,) = re.findall(r"at most ([\d.]+)$", first)
    parts = [float(each) for each in re.findall(r" ([\d.]+)(?:,|$)", losses)]
    assert sum(parts) == pytest.approx(float(left), abs=0.01 * len(parts))
    assert "injuries 3.10" in losses
    assert told("evasive-gps-ekf").endswith(", the whole fee: nothing can be gained on them")
