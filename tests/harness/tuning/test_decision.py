"""What a study says first, on outcomes where it just flips."""

import json
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from harness.economics.cost_terms import MARGIN
from harness.report.tuning.decision import Advice, as_nav2, decision, next_command
from harness.report.tuning.summary import starting_point
from harness.statistics.interval import Interval
from harness.storage.shipped import shipped
from harness.study.stored_run import load_run

STORED = Path(__file__).resolve().parents[3] / "results" / "baseline" / "published_3"

ALIKE = Interval(0.0, -1.0, 1.0, 40)
GAIN = Interval(2.0, 0.01, 4.0, 40)
LOSS = Interval(-2.0, -4.0, -0.01, 40)
OPEN = Interval(2.0, -0.01, 4.0, 40)
FEW = Interval(2.0, 0.01, 4.0, 5)


def advice(
    difference: Interval = GAIN,
    unseen: Interval | None = GAIN,
    needed: int | None = None,
    proven_by: int | None = None,
    room: Interval | None = None,
    shortfall: tuple[float, float] = (0.0, 0.0),
    **study: Any,
) -> Advice:
    usual = {
        "incumbent": SimpleNamespace(values={"a": 1}),
        "is_tested": True,
        "objectives": ("margin",),
        "trials": (None, None),
        "train_missions": (0, 1),
        "has_room": False,
    }
    explanation = SimpleNamespace(
        components={MARGIN: SimpleNamespace(difference=difference)},
        unseen=unseen,
        proven_by=proven_by,
        room_usd_per_run=room,
    )
    # under the name that scores have
    scores = {
        "test": {
            "margin": {"pairs_needed": needed, "shortfall": (0.0, 0.0)},
            "margin@sla>=0.9": {"shortfall": shortfall},
        }
    }
    found: Any = SimpleNamespace(**usual | study)
    told: Any = explanation
    return decision(found, scores, told)


NOBODY = SimpleNamespace(values={})


@pytest.mark.parametrize(
    ("given", "text"),
    [
        (
            {"difference": Interval(0.0, None, None, 3), "unseen": ALIKE},
            "Not decided: 3 test missions are too few; 20 would tell more.",
        ),
        ({}, "Take the tuned file: it earns more on missions that it never saw."),
        ({"unseen": None}, "Take the tuned file: it earns more on missions that it never saw."),
        (
            {"shortfall": (0.0, 0.35)},
            "Keep your file: the tuned one earns more, but misses sla>=0.9 by 0.350 on unseen",
        ),
        ({"shortfall": (0.4, 0.35)}, "Take the tuned file"),
        (
            {"unseen": OPEN, "needed": 30, "proven_by": 60},
            "Not decided: one more loss of a kind that was not seen would undo the gain; about 20 "
            "more test missions would decide.",
        ),
        (
            {"difference": OPEN, "unseen": OPEN, "needed": 47, "proven_by": 44},
            "is not significant; about 7 more test missions would decide.",
        ),
        (
            {"difference": OPEN, "unseen": GAIN, "needed": 47, "proven_by": 40},
            "Not decided: the gain of 2.00 [-0.01, 4.00] USD is not significant; about 7 more test",
        ),
        (
            {"difference": OPEN, "unseen": OPEN, "needed": 47},
            "Keep your file: a gain as small as 2.00 [-0.01, 4.00] USD takes more than 10,000 test",
        ),
        ({"difference": ALIKE, "unseen": ALIKE}, "Keep your file: the tuned one does not earn"),
        ({"difference": LOSS, "unseen": LOSS}, "Keep your file: the tuned one does not earn more"),
        (
            {"difference": LOSS, "unseen": LOSS, "objectives": ("cvar",)},
            "What raises cvar does not raise the margin here; search with --objective margin.",
        ),
        ({"incumbent": NOBODY}, "Keep your file: no trial earned more."),
        (
            {"incumbent": NOBODY, "trials": (None,)},
            "Keep your file: on its 2 training missions no file can earn 0.50 USD more; none was",
        ),
        (
            {"incumbent": NOBODY, "trials": (None,), "is_tested": False},
            "Not decided: on its 2 training missions no file can earn 0.50 USD more; none was "
            "tried, and no unseen mission was driven: search on more.",
        ),
        (
            {"incumbent": NOBODY, "trials": (None,), "has_room": True},
            "Not decided: the budget ended before another file was tried.",
        ),
        (
            {"incumbent": NOBODY, "trials": (None,), "room": Interval(0.6, 0.1, 9.0, 40)},
            "Not decided: no other file was tried, as its 2 training missions leave less than 0.50",
        ),
        ({"is_tested": False}, "Not decided: the tuned file drove no unseen mission; 20 would"),
        (
            {"difference": Interval(0.0, None, None, 1), "unseen": ALIKE},
            "Not decided: 1 test mission is too few; 20 would tell more.",
        ),
        (
            {"difference": FEW, "unseen": None, "needed": 4, "proven_by": 9},
            "Not decided: 5 test missions are too few; about 4 more test missions would decide.",
        ),
    ],
)
def test_the_decision(given: dict[str, Any], text: str) -> None:
    assert text in str(advice(**given))


@pytest.mark.parametrize(
    "given",
    [
        {"unseen": OPEN, "needed": 30, "proven_by": 60},
        {"difference": OPEN, "unseen": OPEN, "needed": 47, "proven_by": 44},
        {"difference": FEW, "unseen": None, "needed": 4, "proven_by": 9},
    ],
)
def test_the_next_command_drives_the_missions_that_would_decide(
    given: dict[str, Any], tmp_path: Path
) -> None:
    found = advice(**given)
    (more,) = re.findall(r"about (\d+) more", str(found))
    total = int(more) + given.get("difference", GAIN).n
    following = next_command(found, tmp_path, "again", 1.0)
    assert following == f"navbench tune --resume {tmp_path} --test-episodes {total}"


def test_a_decided_study_leads_to_its_test_to_other_spaces_or_to_a_larger_search(
    tmp_path: Path,
) -> None:
    assert next_command(advice(), tmp_path, "again", 1.0) == "again"
    kept = advice(difference=LOSS, unseen=LOSS)
    assert next_command(kept, tmp_path, "again", 1.0) == "navbench list spaces"
    words = ["navbench", "tune", "--stack", "a.yaml", "--episodes", "2", "--out", "there"]
    (tmp_path / "run.json").write_text(json.dumps({"command": words}), encoding="utf-8")
    room = Interval(0.6, 0.1, 9.0, 40)
    futile = advice(incumbent=NOBODY, trials=(None,), room=room)
    once_more = "navbench tune --stack a.yaml --episodes 32"
    assert next_command(futile, tmp_path, "again", 1.0) == once_more


def test_a_study_whose_budget_ended_before_a_trial_goes_on_with_more(tmp_path: Path) -> None:
    words = ["navbench", "tune", "--stack", "a.yaml", "--budget", "5m"]
    (tmp_path / "run.json").write_text(json.dumps({"command": words}), encoding="utf-8")
    cut = Advice(
        "Not decided", "the budget ended before another file was tried.", episodes=10, is_cut=True
    )
    going_on = f"navbench tune --resume {tmp_path} --budget 9m"  # ten times 10 missions of 2 s more
    assert next_command(cut, tmp_path, "again", 2.0) == going_on


@pytest.mark.parametrize(
    ("given", "pace", "budget"),
    [
        (["--budget", "4m"], 3.0, "16m"),  # ten times 32 missions of 3 s
        (["--budget=4m"], 3.0, "16m"),
        (["--budget", "1h"], 3.0, "60m"),
        (["--budget", "4m"], 0.5, "4m"),
    ],
)
def test_the_next_search_has_a_budget_in_which_it_can_be_driven(
    given: list[str], pace: float, budget: str, tmp_path: Path
) -> None:
    words = ["navbench", "tune", "--stack", "a.yaml", *given, "--episodes", "8"]
    (tmp_path / "run.json").write_text(json.dumps({"command": words}), encoding="utf-8")
    futile = advice(incumbent=NOBODY, trials=(None,), room=Interval(0.6, 0.1, 9.0, 40))
    once_more = f"navbench tune --stack a.yaml --episodes 32 --budget {budget}"
    assert next_command(futile, tmp_path, "again", pace) == once_more


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("stock", "yes."),
        ("dwb_contact", "no, it needs ExpectedContact of this program."),
        ("mpc", "no, it needs navstack::JerkLimitedMPC of this program."),
    ],
)
def test_a_file_with_a_class_of_this_program_does_not_run_on_nav2_as_it_is(
    name: str, said: str
) -> None:
    told = as_nav2(shipped("params") / "nav2" / f"{name}.yaml")
    assert told == f"runs on Nav2 as it is: {said}"


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
