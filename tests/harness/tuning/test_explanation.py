"""Waterfall, components, partings and the report, in a made-up world whose answers are known."""

import dataclasses
import io
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import numpy as np
import pytest
from rich.console import Console

from harness.audit.pairs import Conditions
from harness.economics.accountings import ACCOUNTINGS
from harness.economics.prices import load_prices
from harness.economics.unseen import difference_admitting_unseen, reach_of_loss
from harness.economics.valuation import MEETINGS_LOSS
from harness.metrics.columns import Row
from harness.report.figures import save_figure
from harness.report.tables import print_blocks
from harness.report.tuning.document import tuning_blocks, write_tuning
from harness.report.tuning.summary import summary
from harness.report.tuning.tables import what_happened
from harness.statistics.interval import Interval
from harness.tuning.declaration import MOST_EPISODES
from harness.tuning.evaluation import MARGIN, Candidate
from harness.tuning.explanation import EXPLANATION, Explanation, _proven_by, explain
from harness.tuning.mission_differences import mission_differences
from harness.tuning.output import DIFF, TUNED
from harness.tuning.result import StudyResult
from harness.tuning.scores import scores_document
from harness.tuning.space.constraint import parse_constraint
from harness.tuning.study_audit import audit_study
from harness.tuning.waterfall import REST, mixture, players, waterfall
from navstack.errors import InputError

PRICES = load_prices("costnav")
LINT = {"errors": 0, "warnings": 2, "new": ["short-horizon: one"], "gone": []}
ABOUT = "my_nav2.yaml, robot segway_e1, localizer gps-ekf; world paper_loose_bucket, map sidewalk."
COMMAND = ("navbench", "run", "--stack", "tuned.yaml")
MISSIONS = 30
MakeStudy = Callable[..., StudyResult]


class Counting:
    """An evaluator that tells whom it was asked for.

    Missions of ``broken`` have no result for mixtures.
    """

    def __init__(self, inner: object, broken: Sequence[int] = ()) -> None:
        self._inner, self._broken = inner, broken
        self.names: list[str] = []

    def rows(self, candidate: Candidate, missions: Sequence[int]) -> list[Row]:
        self.names.append(candidate.name)
        rows: list[Row] = self._inner.rows(candidate, missions)  # type: ignore[attr-defined]
        broken = [m in self._broken and candidate.name.startswith("mixture") for m in missions]
        return [
            {**row, "error": "lost"} if is_broken else row
            for row, is_broken in zip(rows, broken, strict=True)
        ]


def test_the_steps_add_up_to_the_difference(make_study: MakeStudy, evaluator: object) -> None:
    study = make_study()
    who = players(study, ["clearance", "horizon"])
    found = waterfall(study, Counting(evaluator), study.test_missions[:MISSIONS], who)
    assert found is not None
    before, after = ([row[MARGIN] for row in rows[:MISSIONS]] for rows in study.test_rows)
    assert found.total.value == pytest.approx((sum(after) - sum(before)) / MISSIONS)
    assert sum(step.gain_usd_per_run.value or 0.0 for step in found.steps) == pytest.approx(
        found.total.value
    )
    assert found.steps[0].player == "clearance"
    assert found.unseen
    assert found.episodes == 32 * MISSIONS


def test_every_mixture_is_driven_once_on_the_same_missions(
    make_study: MakeStudy, evaluator: object
) -> None:
    study, counting = make_study(), Counting(evaluator)
    waterfall(study, counting, study.test_missions[:2], players(study, []))
    assert len(counting.names) == len(set(counting.names)) == 32
    assert {"original", "incumbent"} <= set(counting.names)


def test_without_margins_no_mixture_is_driven(make_study: MakeStudy, evaluator: object) -> None:
    """As in a world that has no cargo."""

    class WithoutCargo(Counting):
        def rows(self, candidate: Candidate, missions: Sequence[int]) -> list[Row]:
            return [{**row, MARGIN: None} for row in super().rows(candidate, missions)]

    study, counting = make_study(), WithoutCargo(evaluator)
    assert waterfall(study, counting, study.test_missions[:2], players(study, [])) is None
    assert counting.names == ["original"]


def test_a_mission_that_a_mixture_lost_is_left_out(
    make_study: MakeStudy, evaluator: object
) -> None:
    study = make_study()
    missions = study.test_missions[:5]
    found = waterfall(study, Counting(evaluator, missions[:2]), missions, players(study, []))
    assert found is not None
    assert found.missions == 3
    assert waterfall(study, Counting(evaluator, missions), missions, players(study, [])) is None


def test_the_fifth_player_is_the_rest(make_study: MakeStudy) -> None:
    who = players(make_study(), ["speed", "clearance"])
    assert [player.title for player in who] == ["speed", "clearance", "horizon", "samples", REST]
    assert who[-1].names == ("stop", "idle")


def test_what_a_constraint_binds_changes_together(make_study: MakeStudy) -> None:
    study = make_study()
    bound = parse_constraint("horizon * speed <= 6", ("horizon", "speed"), "test")
    study = dataclasses.replace(study, space=dataclasses.replace(study.space, constraints=(bound,)))
    who = players(study, ["horizon"])
    assert who[0].names == ("horizon", "speed")
    assert len(who) == 5


def test_a_mixture_changes_every_path_of_its_parameters(make_study: MakeStudy) -> None:
    study = make_study()
    who = players(study, ["speed"])
    assert set(mixture(study, who, 1).values) == {
        "controller_server.FollowPath.max_vel_x",
        "velocity_smoother.max",
    }
    assert mixture(study, who, 0) == study.original
    assert mixture(study, who, 31) == study.incumbent


def test_partings_are_the_largest_differences(make_study: MakeStudy) -> None:
    study = make_study()
    found = mission_differences(*study.test_rows)
    back = mission_differences(*study.test_rows[::-1])
    assert [each.difference_usd for each in back] == [-each.difference_usd for each in found]
    differences = sorted(
        (abs(b[MARGIN] - a[MARGIN]) for a, b in zip(*study.test_rows, strict=True)), reverse=True
    )
    assert [abs(each.difference_usd) for each in found] == pytest.approx(differences[:3])
    assert "1 counted" in what_happened(found[0])
    first = found[0]
    assert first.replay(COMMAND).endswith(
        f"--seed {first.seed} --only {first.episode} --record full"
    )
    assert mission_differences(study.test_rows[0], study.test_rows[0]) == ()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("study")


@pytest.fixture(scope="module")
def explained(
    make_study: MakeStudy,
    evaluator: object,
    folder: Path,
) -> tuple[StudyResult, Explanation]:
    study = make_study()
    return study, explain(study, Counting(evaluator), folder, PRICES, Conditions(), MISSIONS)


def test_components_add_up_to_the_margin(explained: tuple[StudyResult, Explanation]) -> None:
    _, found = explained
    *terms, margin = found.components.values()
    for side in ("original", "incumbent"):
        assert sum(getattr(term, side) for term in terms) == pytest.approx(getattr(margin, side))
    assert margin.difference.low is not None
    assert margin.difference.low > 0.0
    optimism = found.optimism_usd_per_run
    assert optimism is not None and (optimism.low or 0.0) < (optimism.value or 0.0) < (
        optimism.high or 0.0
    )
    assert not found.audit.flagged


def test_what_meetings_cost_is_a_component_of_the_margin(
    make_study: MakeStudy, evaluator: object, tmp_path: Path
) -> None:
    study = make_study(trials=10, test=0)
    rows = tuple(
        [{**row, MEETINGS_LOSS: loss, MARGIN: row[MARGIN] - loss} for row in own]
        for own, loss in zip(study.train_rows, (4.0, 2.5), strict=True)
    )
    study = dataclasses.replace(study, train_rows=rows)
    found = explain(study, Counting(evaluator), tmp_path, PRICES, Conditions(), 0)
    *terms, margin = found.components.values()
    before, after = (float(np.mean([row[MARGIN] for row in own])) for own in rows)
    assert (margin.original, margin.incumbent) == pytest.approx((before, after))
    assert found.unseen is not None and found.unseen.value == pytest.approx(after - before)
    met = found.components[MEETINGS_LOSS]
    assert (met.what, met.original, met.incumbent) == ("People met", -4.0, -2.5)
    assert sum(term.incumbent for term in terms) == pytest.approx(after)


def test_history_rises_from_the_original(explained: tuple[StudyResult, Explanation]) -> None:
    _, found = explained
    assert found.history[0].number == 0
    values = [each.score.value or 0.0 for each in found.history]
    assert values == sorted(values)
    assert all(
        each.score.low is not None and each.score.low <= (each.score.value or 0.0)
        for each in found.history
    )


@pytest.mark.slow
def test_the_report_tells_everything(
    explained: tuple[StudyResult, Explanation], folder: Path, rendering: None
) -> None:
    study, found = explained
    scores = scores_document(study)
    (folder / TUNED).write_text("amcl: {ros__parameters: {alpha1: 0.1}}\n", encoding="utf-8")
    (folder / DIFF).write_text("-old: 1\n+new: 2\n", encoding="utf-8")
    report = write_tuning(study, scores, found, ABOUT, COMMAND, folder, "again", LINT).read_text(
        encoding="utf-8"
    )
    assert (
        "```diff\n-old: 1\n+new: 2\n```" in report
        and "- 0 errors, 2 warnings\n- new: short-horizon" in report
    )
    assert report.endswith("```\nagain\n```\n")
    first, said, more = report.split("\n\n")[:3]
    assert first == "# Tuned: my_nav2.yaml, robot segway_e1, localizer gps-ekf"
    assert said == "**Take the tuned file: it earns more on missions that it never saw.**"
    assert more == ABOUT
    assert "runs on Nav2 as it is: yes." in report
    assert "| in time, intact " in report and "| sla " not in report
    for heading in (
        "What it brings",
        "scored anew",
        "What changed",
        "From the old margin",
        "The auditor",
        "differ most",
    ):
        assert heading in report
    for stem in ("history", "slices", "waterfall"):
        assert f"({stem}.png)" in report
        assert (folder / f"{stem}.png").stat().st_size > 10_000
        assert (folder / f"{stem}.pdf").is_file()
    assert json.loads((folder / EXPLANATION).read_text(encoding="utf-8"))["audit"]["flagged"] == []
    stream = io.StringIO()
    blocks = tuning_blocks(study, scores, found, COMMAND, folder)
    print_blocks(blocks, Console(file=stream, width=120))
    assert "an improvement" in stream.getvalue()
    assert "flags nothing" in stream.getvalue()


def test_no_file_earns_more_than_the_fee(explained: tuple[StudyResult, Explanation]) -> None:
    study, found = explained
    margins = [row[MARGIN] for row in study.test_rows[1]]
    room = found.room_usd_per_run
    assert (
        room is not None
        and room.value is not None
        and room.low is not None
        and room.high is not None
    )
    assert room.value == pytest.approx(PRICES.delivery_fee.value - sum(margins) / len(margins))
    assert 0.0 <= room.low < room.value
    assert room.high > room.value + 1.0, "an unseen loss is admitted"
    assert any(f"at most {room.value:.2f} [" in line for line in summary(study, found))
    trained = dataclasses.replace(study, test_rows=())
    assert not any("at most" in line for line in summary(trained, found))


def test_the_best_of_the_search_are_scored_under_every_accounting(
    explained: tuple[StudyResult, Explanation],
) -> None:
    study, found = explained
    assert all(set(each.margins) == set(ACCOUNTINGS) for each in found.history)
    original = found.history[0]
    assert original.margins["published"] == pytest.approx(study.trials[0].values[0])
    assert original.margins["no_threshold"] <= original.margins["published"]


def test_a_front_is_shown(make_study: MakeStudy, evaluator: object, tmp_path: Path) -> None:
    study = make_study(trials=10, test=0)
    trials = tuple(
        dataclasses.replace(each, values=(each.values[0], -each.values[0])) for each in study.trials
    )
    both = dataclasses.replace(
        study,
        objectives=("margin", "-duration_s"),
        trials=trials,
        front=(0, 3),
    )
    found = explain(both, Counting(evaluator), tmp_path, PRICES, Conditions(), 0)
    (tmp_path / TUNED).write_text("amcl: {ros__parameters: {alpha1: 0.1}}\n", encoding="utf-8")
    (tmp_path / DIFF).write_text("", encoding="utf-8")
    scores = {"train": {}, "test": {}}
    report = write_tuning(both, scores, found, ABOUT, COMMAND, tmp_path, "again", LINT).read_text(
        "utf-8"
    )
    assert "## The Pareto front" in report and "| trial 3 " in report and "(front.png)" in report


def test_a_study_without_improvement_is_told_of(
    make_study: MakeStudy,
    evaluator: object,
    tmp_path: Path,
) -> None:
    study = make_study(trials=10, test=0, tuned={})
    found = explain(study, Counting(evaluator), tmp_path, PRICES, Conditions())
    assert found.waterfall is None
    assert found.optimism_usd_per_run is None
    (tmp_path / TUNED).write_text("amcl: {ros__parameters: {alpha1: 0.1}}\n", encoding="utf-8")
    (tmp_path / DIFF).write_text("", encoding="utf-8")
    report = write_tuning(
        study,
        scores_document(study),
        found,
        ABOUT,
        COMMAND,
        tmp_path,
        "again",
        LINT,
    ).read_text("utf-8")
    assert "**Keep your file: no trial earned more.**" in report
    assert "What differs" not in report and "tuned file" not in report


def test_what_is_undefined_on_the_test_is_left_out_of_the_scores(make_study: MakeStudy) -> None:
    study = dataclasses.replace(make_study(trials=10), objectives=("margin", "spl"))
    train = tuple([{**row, "spl": 0.5} for row in rows] for rows in study.train_rows)
    first, second = (
        [{**row, "spl": spl} for row in rows]
        for rows, spl in zip(study.test_rows, (0.5, None), strict=True)
    )
    scores = scores_document(
        dataclasses.replace(study, train_rows=train, test_rows=(first, second))
    )
    assert set(scores["train"]) == {"margin", "spl", "sla"} and set(scores["test"]) == {
        "margin",
        "sla",
    }
    assert set(scores["optimism"]) == {"margin", "sla"}


def test_a_difference_is_that_of_its_values_where_some_missions_have_none(
    make_study: MakeStudy,
) -> None:
    study = dataclasses.replace(make_study(trials=10), objectives=("spl",))
    first, second = (
        [{**row, "spl": None if place == gap else 0.01 * place} for place, row in enumerate(rows)]
        for rows, gap in zip(study.test_rows, (0, 5), strict=True)
    )
    train = tuple([{**row, "spl": 0.5} for row in rows] for rows in study.train_rows)
    found = scores_document(dataclasses.replace(study, train_rows=train, test_rows=(first, second)))
    score = found["test"]["spl"]
    assert score["difference"]["n"] == len(first) - 2
    assert score["incumbent"] - score["original"] == pytest.approx(score["difference"]["value"])


def test_a_gain_is_proved_by_about_so_many_missions() -> None:
    gains = np.random.default_rng(1).normal(4.0, 12.0, 30)
    pairs: Any = SimpleNamespace(
        margins=lambda _: (np.zeros(30), gains),
        prices=PRICES,
        seed=0,
        n=30,
    )
    reach = reach_of_loss(PRICES)
    enough = _proven_by(pairs, reach)
    assert enough is not None and enough > 30

    def is_proved(count: int) -> bool:
        found = difference_admitting_unseen(np.resize(gains, count), reach, np.arange(count), 0)
        return found.sign > 0

    assert is_proved(enough) and not is_proved(enough * 9 // 10)
    small: Any = SimpleNamespace(
        margins=lambda _: (np.zeros(640), np.full(640, 0.29)), prices=PRICES, seed=0, n=640
    )
    number = _proven_by(small, reach)
    assert number is not None and 5120 < number <= MOST_EPISODES, "beyond the last doubling"
    pairs.margins = lambda _: (gains, np.zeros(30))
    assert _proven_by(pairs, reach) is None, "a loss is no gain"


def test_a_flag_stands_in_the_report(
    explained: tuple[StudyResult, Explanation], auditor_studies: ModuleType
) -> None:
    study, found = explained
    stacks = auditor_studies.drawn_deliveries(np.random.default_rng(3), 60)
    _, exploiting = auditor_studies.exploiting_study(stacks, "left_standing", 100, PRICES, 0)
    lines = summary(
        study, dataclasses.replace(found, audit=audit_study(exploiting, PRICES, Conditions()))
    )
    assert any("THE AUDITOR FLAGS" in line and "standing still" in line for line in lines)


def test_a_full_disk_is_one_line_for_figures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rendering: None
) -> None:
    monkeypatch.setattr(
        "harness.report.figures.replacing", lambda path: open("/dev/full", "wb", buffering=0)
    )
    with pytest.raises(
        InputError, match="cannot be written \\(No space left on device\\); make room"
    ):
        save_figure(tmp_path / "a", 1.0, lambda axes: None)
    monkeypatch.undo()
    assert [
        path.read_bytes()[:4] for path in save_figure(tmp_path / "a", 1.0, lambda axes: None)
    ] == [
        b"%PDF",
        b"\x89PNG",
    ]


@pytest.mark.parametrize(
    ("difference", "unseen", "said"),
    [
        ((1.0, 3.0), (0.5, 4.0), "an improvement"),
        ((1.0, 3.0), (-0.5, 4.0), "an improvement in these deliveries, which one more could undo"),
        ((-3.0, -1.0), (-4.0, 0.5), "a loss in these deliveries, which one more could undo"),
        ((-3.0, -1.0), (-4.0, -0.5), "a loss"),
        ((-1.0, 1.0), (-3.0, 3.0), "not significant"),
        ((1.0, 3.0), None, "an improvement"),
    ],
)
def test_a_gain_is_called_one_if_no_unseen_loss_could_undo_it(
    explained: tuple[StudyResult, Explanation],
    difference: tuple[float, float],
    unseen: tuple[float, float] | None,
    said: str,
) -> None:
    study, found = explained
    margin = dataclasses.replace(
        found.components["contribution_margin"],
        difference=Interval(sum(difference) / 2.0, *difference, 40),
    )
    changed = dataclasses.replace(
        found,
        components={**found.components, "contribution_margin": margin},
        unseen=None if unseen is None else Interval(0.0, *unseen, 40),
    )
    line = next(line for line in summary(study, changed) if line.startswith("margin "))
    low, high = unseen or difference
    assert line.endswith(f"[{low:.2f}, {high:.2f}], {said}.")
