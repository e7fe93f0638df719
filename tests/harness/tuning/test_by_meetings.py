"""Training missions by meetings with people, test missions by whole deliveries."""

from pathlib import Path
from typing import Any

import pytest

from harness.economics.prices import load_prices
from harness.economics.valuation import MEETINGS_LOSS, margins
from harness.execution.executors import InProcess
from harness.execution.workers import Workers
from harness.meetings import crowd
from harness.report.tuning.summary import starting_point
from harness.task.study import EpisodeTask, make_study
from harness.tuning.evaluation import FIRST_TEST, MARGIN, Candidate
from harness.tuning.journal import Journal
from harness.tuning.stack_evaluator import StackEvaluator
from tests.rules import short_rules

ORIGINAL = Candidate("original", {})
PRICES = load_prices("costnav")


@pytest.fixture(scope="module")
def task(tmp_path_factory: pytest.TempPathFactory, hall: Path) -> EpisodeTask:
    rules = tmp_path_factory.mktemp("rules") / "rules.yaml"
    rules.write_text(short_rules(12.0))
    study = make_study(
        stacks=["nav2-gps-ekf"],
        episodes=2,
        seed=3,
        pedestrians=20,
        map_name=str(hall),
        rules=str(rules),
        workers=1,
    )
    return study.template


@pytest.fixture(scope="module")
def rows(task: EpisodeTask, tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    """Of a training mission and a test mission, as a second session reads them."""
    folder = tmp_path_factory.mktemp("study")
    for _ in range(2):
        with (
            pytest.MonkeyPatch.context() as patch,
            Journal(folder) as journal,
            Workers(1, InProcess) as workers,
        ):
            patch.setattr(crowd, "LONG", 130.0)
            evaluator = StackEvaluator(
                task, workers, journal, lambda *_: None, folder, is_by_meetings=True
            )
            found = evaluator.rows(ORIGINAL, [0, FIRST_TEST])
    return found


def test_a_training_mission_costs_what_meetings_do(rows: list[dict[str, Any]]) -> None:
    training, test = rows
    assert training[MEETINGS_LOSS] != 0.0 and training["pedestrian_contacts"] == 0
    assert test.get(MEETINGS_LOSS) is None
    alone = {**training, MEETINGS_LOSS: None}
    for row, margin in ((training, training[MARGIN]), (test, test[MARGIN])):
        assert margins([row], PRICES) == pytest.approx(margin)
    difference = margins([alone], PRICES) - training[MARGIN]
    assert difference == pytest.approx(training[MEETINGS_LOSS])


def test_the_starting_point_tells_what_people_cost(rows: list[dict[str, Any]]) -> None:
    dear = {**rows[0], MEETINGS_LOSS: 2.5}
    margin = margins([dear], PRICES)
    assert margin is not None
    told = starting_point([dear], PRICES)
    assert f"earns {margin[0]:.2f} USD" in told
    assert "people met 2.50" in told


@pytest.mark.parametrize(
    ("more", "told"),
    [
        (("--objective", "cvar"), "meetings tell the margin alone"),
        (("--world", "social_force"), "all set out at once"),
    ],
)
def test_where_it_cannot_be_it_is_one_line(navbench, more: tuple[str, ...], told: str) -> None:
    status, out, err = navbench("tune", "--estimator", "meetings", *more)
    assert (status, out) == (1, "") and told in err
    assert len(err.strip().splitlines()) == 1
