"""``navbench ablate --estimator meetings`` and ``compare`` on its folder."""

import contextlib
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from harness.ablation.analysis import AblationDeclaration
from harness.ablation.arms import arms_of
from harness.ablation.meetings import MeetingsArms
from harness.meetings import crowd, estimate
from harness.meetings.kept import FILE
from harness.meetings.results import MeetingsResult, unseen_loss
from harness.report.short.meetings_arms import next_command, short_arms
from harness.study.places import Where
from harness.task.stack import load_stack
from navbench.api.ablate import ablate, resume_ablation
from navstack.types import FloatArray
from tests.rules import short_rules

Driven = Callable[[], contextlib.AbstractContextManager[None]]


@pytest.fixture(scope="module")
def found(
    driven_in_process: Driven, tmp_path_factory: pytest.TempPathFactory, hall: Path
) -> MeetingsArms:
    """Three arms, two missions and then one more."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "short.yaml").write_text(short_rules(2.0))
    with pytest.MonkeyPatch.context() as patch, driven_in_process():
        patch.setattr(crowd, "LONG", 130.0)
        patch.setattr(estimate, "NUMBER", 1)
        first = ablate(
            "nav2-stock",
            localizers=("ground_truth", "gps"),
            errors=("position=0.5",),
            estimator="meetings",
            out=folder / "run",
            rules=str(folder / "short.yaml"),
            map=str(hall),
            episodes=2,
            where=Where(workers=1),
        )
        assert isinstance(first, MeetingsArms) and first.missions == 2
        more = resume_ablation(folder / "run", where=Where(workers=1), episodes=3)
    assert isinstance(more, MeetingsArms)
    return more


def made_up(names: tuple[str, ...], margins: FloatArray) -> MeetingsArms:
    """What arms come to that earned so on each mission [USD], shape (n, arms)."""
    result = MeetingsResult(
        episodes=tuple(range(len(margins))),
        margins=margins,
        hits=np.zeros_like(margins),
        arms=(),
        strata=(),
        farthest_off=0.0,
        unseen_weight=0.3,
    )
    return MeetingsArms(
        declaration=AblationDeclaration("nav2-amcl", names[0]),
        arms=arms_of(load_stack("nav2-amcl"), names, ()),
        folder=Path("run"),
        where="",
        episodes=len(margins),
        seed=3,
        result=result,
    )


def test_a_difference_is_the_same_whatever_other_arms_there_are() -> None:
    margins = np.random.default_rng(1).normal(0.0, 1.0, (40, 3))
    *_, of_three = made_up(("ground_truth", "gps", "amcl"), margins).differences
    (of_two,) = made_up(("ground_truth", "amcl"), margins[:, [0, 2]]).differences
    assert of_three.arm == of_two.arm == "amcl"
    assert of_three.paired.p == of_two.paired.p


def test_an_unseen_hit_is_admitted_for_all_comparisons_together() -> None:
    margins = np.random.default_rng(1).normal(0.0, 1.0, (40, 3))
    for each in made_up(("ground_truth", "gps", "amcl"), margins).differences:
        assert each.paired.tests == 2 and each.unseen is not None
        half = unseen_loss(0.3, 40, tests=2)
        assert each.unseen.high == pytest.approx((each.unseen.value or 0.0) + half)
        assert each.unseen.low == pytest.approx((each.unseen.value or 0.0) - half)


def test_every_arm_has_driven_every_mission(found: MeetingsArms) -> None:
    document = found.as_json()
    assert (document["missions"], document["episodes"], document["errors"]) == (3, 3, 0)
    assert [arm["arm"] for arm in document["arms"]] == ["ground_truth", "gps", "position=0.5"]
    assert [each["arm"] for each in document["differences"]] == ["gps", "position=0.5"]
    assert document["price_of_error"]["position"]["levels_m"] == [0.0, 0.5]
    assert document["arms"][0]["contribution_margin_usd"]["n"] == 3
    assert found.result is not None and found.result.margins.shape == (3, 3)


def test_the_screen_answers_first_and_names_the_method(found: MeetingsArms) -> None:
    lines = [block.text for block in short_arms(found)]
    assert lines[0].startswith("nav2-stock, 3 missions by each of 3; world paper_loose_bucket")
    assert "sensors rtk_good" in lines[0]
    assert "ground_truth" in lines[1]
    assert any(line.startswith("price of position error") for line in lines)
    assert any(line.startswith("estimator meetings: ") for line in lines)
    assert next_command(found).startswith(f"navbench ablate --resume {found.folder} --episodes ")


def test_two_arms_are_compared_by_their_meetings(navbench, found: MeetingsArms) -> None:
    first, second = f"{found.folder}:ground_truth", f"{found.folder}:gps"
    status, text, _ = navbench("compare", first, second, "--json")
    document = json.loads(text)
    assert status == 0 and document["against"] == "ground_truth"
    difference = document["differences"]["contribution_margin"]
    (whole,) = (each for each in found.as_json()["differences"] if each["arm"] == "gps")
    assert difference["value"] == whole["value"] and difference["p"] is not None
    assert document["pairs"] == document["missions"] == difference["n"]
    assert [document[side]["stack"] for side in "ab"] == ["ground_truth", "gps"]
    status, text, _ = navbench("compare", first, second)
    assert status == 0 and text.splitlines()[-1].startswith("next: navbench ablate --resume ")


@pytest.mark.parametrize(
    ("first", "second", "told"),
    [
        ("{run}:gps", "{run}:nobody", "no stack 'nobody'"),
        ("{run}", "{run}", "has several stacks"),
        ("{run}:gps", "{run}:gps", "given twice"),
        ("{run}:gps", "elsewhere:gps", "within one folder only"),
        ("{run}:gps", "{run}:ground_truth --metric sla", "leave out --metric"),
    ],
)
def test_what_cannot_be_compared_is_one_line(
    navbench, found: MeetingsArms, first: str, second: str, told: str
) -> None:
    words = first.format(run=found.folder), *second.format(run=found.folder).split()
    status, out, err = navbench("compare", *words)
    assert (status, out) == (1, "") and told in err


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (("--only", "1"), "leave out --only"),
        (("--record", "full"), "leave out --record"),
        (("--world", "social_force"), "all set out at once"),
        (("--pedestrians", "0"), "nobody to meet"),
    ],
)
def test_where_it_cannot_be_no_folder_is_made(
    navbench, tmp_path: Path, more: tuple[str, ...], told: str
) -> None:
    out = tmp_path / "run"
    words = ("--localizers", "gps,ground_truth", "--estimator", "meetings", "--out", out)
    status, text, err = navbench("ablate", *words, *more)
    assert (status, text) == (1, "") and told in err
    assert not out.exists()


def test_a_line_that_was_cut_off_is_driven_again(
    navbench, found: MeetingsArms, short_missions: None
) -> None:
    missions = found.folder / FILE
    whole = missions.read_bytes()
    missions.write_bytes(whole[:-9])
    (first, second) = (f"{found.folder}:{name}" for name in ("ground_truth", "gps"))
    status, text, _ = navbench("compare", first, second, "--json")
    assert status == 0 and json.loads(text)["missions"] == 2
    assert missions.read_bytes() == whole[:-9], "whoever only reads removes nothing"
    status, _, said = navbench("ablate", "--resume", found.folder, "--retry-errors")
    assert status == 1 and "--retry-errors is for whole deliveries" in said
    status, _, said = navbench("ablate", "--resume", found.folder, "--workers", "1")
    assert status == 0 and "going on after 2 of 3 missions" in said
    assert missions.read_bytes() == whole


@pytest.fixture
def short_missions(monkeypatch: pytest.MonkeyPatch, driven_in_process: Driven):
    monkeypatch.setattr(crowd, "LONG", 130.0)
    monkeypatch.setattr(estimate, "NUMBER", 1)
    with driven_in_process():
        yield
