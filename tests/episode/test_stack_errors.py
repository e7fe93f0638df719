"""An error of a stack is a failed delivery; one of the machine leaves no result."""

import dataclasses
import math
from collections.abc import Sequence
from pathlib import Path

import pytest

import navbench
from harness.economics.valuation import MOST_LEFT_OUT, has_too_few, value
from harness.episode.episode import STACK_FAILED, Delivery, run_episode
from harness.execution.executors import InProcess
from harness.execution.workers import Workers
from harness.storage.texts import LONGEST_TEXT
from harness.study.drive import record_of
from harness.task.brain import Brain
from harness.task.study import EpisodeTask, make_study
from navstack.control.decision import DecisionRecord
from navstack.errors import InputError, NavstackError, PlanningError
from navstack.navigation_status import Trouble
from navstack.types import Belief, Generators, Observation, Pose2D, Twist2D
from tests.rules import short_rules

RULES = short_rules(2.0)
OF_THE_STACK: Sequence[type[Exception]] = (
    NavstackError,
    PlanningError,
    ValueError,
    ZeroDivisionError,
    RecursionError,
    AssertionError,
    StopIteration,
)
OF_THE_MACHINE: Sequence[type[Exception]] = (MemoryError, OSError, ConnectionResetError)


class Fails(Brain):
    """Raises in its first tick after a time, or in its reset."""

    def __init__(self, error: type[Exception], after: float) -> None:
        self._error, self._after = error, after

    def reset(self, goal: Pose2D, initial_belief: Belief, generators: Generators) -> None:
        if self._after < 0.0:
            raise self._error("out of ideas")

    def tick(self, observation: Observation) -> Twist2D:
        if observation.stamp >= self._after:
            raise self._error("out of ideas")
        return Twist2D(0.5, 0.0, 0.0)


class Stuck(Brain):
    """Stands, with much to tell."""

    @property
    def trouble(self) -> Trouble:
        return Trouble(history="53.0 s no plan; " * 100)


class Mumbles(Fails):
    """Drives, but cannot say what it decided."""

    @property
    def decision(self) -> DecisionRecord | None:
        raise ValueError("lost for words")


@pytest.fixture
def task(tmp_path: Path, hall: Path) -> EpisodeTask:
    """A delivery of two seconds."""
    (tmp_path / "short.yaml").write_text(RULES)
    return make_study(
        stacks=["parked"],
        episodes=1,
        pedestrians=2,
        map_name=str(hall),
        rules=str(tmp_path / "short.yaml"),
    ).template


def driven(task: EpisodeTask, error: type[Exception], after: float) -> Delivery:
    return run_episode(task, lambda parts, world: Fails(error, after))


@pytest.mark.parametrize("after", [-1.0, 0.0, 1.0])
@pytest.mark.parametrize("error", OF_THE_STACK)
def test_an_error_of_the_stack_is_a_delivery_that_needs_assistance(
    task: EpisodeTask,
    error: type[Exception],
    after: float,
) -> None:
    row = driven(task, error, after).row
    assert (row["outcome"], row["reason"]) == ("physical_assistance", STACK_FAILED)
    assert row["stack_error"] == f"{error.__name__}: out of ideas"
    assert row["duration_s"] == pytest.approx(max(after, 0.0), abs=0.1)
    assert (row["distance_m"] > 0.1) == (after > 0.0)


@pytest.mark.parametrize("after", [-1.0, 1.0])
@pytest.mark.parametrize("error", OF_THE_MACHINE)
def test_an_error_of_the_machine_leaves_no_result(
    task: EpisodeTask,
    error: type[Exception],
    after: float,
) -> None:
    with Workers(1, InProcess) as workers:
        (finished,) = workers.run(lambda each: driven(each, error, after), [task])
    row = record_of(finished)["row"]
    assert row["error"] == f"{error.__name__}: out of ideas" and "outcome" not in row


def test_a_sound_delivery_has_no_error(task: EpisodeTask) -> None:
    assert run_episode(task).row["stack_error"] is None


def test_no_margin_is_told_where_more_than_a_hundredth_has_no_result(
    in_process: None,
    task: EpisodeTask,
    tmp_path: Path,
    hall: Path,
) -> None:
    run = navbench.run(
        "parked",
        2,
        map=str(hall),
        pedestrians=0,
        rules=task.rules,
        workers=1,
        out=tmp_path / "run",
    )
    (stack,), prices = run.stored.stacks, run.stored.prices()
    told = value(stack.rows, stack, prices, 0, left_out=0).economics
    assert told.contribution_margin is not None and MOST_LEFT_OUT == 0.01
    silent = value(stack.rows, stack, prices, 0, left_out=1)
    assert silent.economics.contribution_margin is silent.economics.break_even_runs is None
    assert "contribution_margin" not in silent.intervals
    assert silent.economics.opex == told.opex
    assert not has_too_few(99, 1) and has_too_few(98, 1) and has_too_few(0, 1)


def test_a_long_history_is_the_same_driven_and_stored(task: EpisodeTask) -> None:
    driven = run_episode(task, lambda *_: Stuck())
    assert len(driven.row["navigator_history"]) == LONGEST_TEXT
    with Workers(1, InProcess) as workers:
        (finished,) = workers.run(lambda _: driven, [task])
    assert record_of(finished)["row"] == driven.row


def test_a_decision_that_cannot_be_told_is_an_error_of_the_stack(task: EpisodeTask) -> None:
    recorded = dataclasses.replace(task, keep_decisions=True)
    delivery = run_episode(recorded, lambda parts, world: Mumbles(ValueError, 99.0))
    assert delivery.row["outcome"] == "physical_assistance"
    assert "ValueError: lost for words" in delivery.row["stack_error"]


@pytest.mark.parametrize("command", [Twist2D(math.nan, 0.0, 0.0), Twist2D("1", 0.0, 0.0), None])  # type: ignore[arg-type]
def test_what_is_no_command_is_not_driven(hall: Path, command: Twist2D) -> None:
    delivery = navbench.make_world("parked", map=str(hall), pedestrians=0)
    before = delivery.truth.pose
    with pytest.raises(InputError, match="give a Twist2D of finite numbers"):
        delivery.drive(command)
    assert delivery.truth.pose == before
