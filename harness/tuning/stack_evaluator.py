"""The evaluator that drives: a patched Nav2 file becomes a stack for the workers of ``run``."""

import contextlib
import dataclasses
import hashlib
import json
import math
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from harness.audit.pairs import EVENTS
from harness.economics.accountings import PUBLISHED
from harness.economics.prices import Prices
from harness.economics.valuation import margins
from harness.episode.episode import Delivery, run_episode
from harness.episode.files import nav2_parameters, prices_of
from harness.execution.workers import Finished, Workers
from harness.meetings.delivery import deliver
from harness.metrics.columns import Row
from harness.storage.texts import clean_text
from harness.study.drive import record_of
from harness.task.stack import Stack
from harness.task.study import EpisodeTask
from harness.tuning.evaluation import (
    FIRST_TEST,
    MARGIN,
    SHARED_MARGIN,
    Candidate,
    OutOfTimeError,
    seed_and_episode,
)
from harness.tuning.journal import REFUSED, Journal, Key
from harness.tuning.space.paths import with_values
from navstack.errors import ParameterError

SHARED_FAULT = "no_threshold_shared_fault"  # accounting of SHARED_MARGIN

OnEpisode = Callable[[Candidate, Row], None]


class StackEvaluator:
    """Drives what the journal does not have yet."""

    def __init__(
        self,
        template: EpisodeTask,
        workers: Workers,
        journal: Journal,
        on_episode: OnEpisode,
        files: Path,
        is_by_meetings: bool = False,
    ) -> None:
        """Drive nothing yet.

        Args:
            template: any task of the study: its stack is the original, its seed that of the
                training missions.
            workers: where episodes run.
            journal: where they are kept.
            on_episode: hears of each episode that was driven, once it is kept.
            files: folder that all workers see, for the candidates' files.
            is_by_meetings: whether training missions are driven by meetings with people.
        """
        self._template, self.workers, self._journal, self._on_episode = (
            template,
            workers,
            journal,
            on_episode,
        )
        self._nav2 = nav2_parameters(template.stack.nav2_file, template.allow_unknown)
        self._prices = prices_of(template.prices)
        self._shared: dict[Key, float | None] = {}
        self._files, self._is_by_meetings = files, is_by_meetings
        # [s] of the monotonic clock at which driving ends
        self.until = math.inf

    def rows(self, candidate: Candidate, missions: Sequence[int]) -> list[Row]:
        """As :class:`harness.tuning.evaluation.Evaluator` has it."""
        self.drive((candidate,), missions)
        return [self._row(candidate, mission) for mission in missions]

    def drive(self, candidates: Sequence[Candidate], missions: Sequence[int]) -> None:
        """Drive what the journal lacks, one mission after the other by all candidates.

        Where the time ends early, all have finished much the same missions.

        Raises:
            InputError: a candidate's values cannot be had.
            OutOfTimeError: :attr:`until` came first; what was finished is kept.
        """
        different = {each.key: each for each in candidates}.values()
        missing = [
            (mission, candidate)
            for mission in dict.fromkeys(missions)
            for candidate in different
            if self._journal.get(candidate, mission) is None
        ]
        for is_test in (False, True):
            those = [each for each in missing if (each[0] >= FIRST_TEST) == is_test]
            if those:
                self._drive(those, self._is_by_meetings and not is_test)

    def _row(self, candidate: Candidate, mission: int) -> Row:
        """A row that the journal has, with what is worked out from it: once."""
        row = self._journal.get(candidate, mission)
        assert row is not None, "it has been driven"
        key = candidate.key, mission
        if key not in self._shared:
            self._shared[key] = margin_of(row, self._prices, SHARED_FAULT)
        return {**row, SHARED_MARGIN: self._shared[key]}

    def _drive(self, missing: Sequence[tuple[int, Candidate]], is_by_meetings: bool) -> None:
        work: Callable[[EpisodeTask], Delivery] = run_episode
        if is_by_meetings:
            work = partial(deliver, original=self._template.stack)
        stacks: dict[str, Stack] = {}
        asked: dict[tuple[str, int, int], tuple[int, Candidate]] = {}
        for mission, candidate in missing:
            if candidate.name not in stacks:
                stacks[candidate.name] = self._stack_or_refusal(candidate, missing)
            delivery = seed_and_episode(self._template.seed, mission)
            asked[candidate.name, *delivery] = mission, candidate
        tasks = (
            dataclasses.replace(self._template, stack=stacks[name], seed=seed, episode=episode)
            for name, seed, episode in asked
        )
        left = len(asked)
        with contextlib.closing(self.workers.run(work, tasks, self.until)) as runs:
            for finished in runs:
                task = finished.task
                mission, candidate = asked[task.stack.name, task.seed, task.episode]
                row = _row(finished, self._prices)
                self._journal.add(candidate, mission, row)
                self._on_episode(candidate, row)
                left -= 1
        if left:
            raise OutOfTimeError(f"{left} of {len(asked)} deliveries are left")

    def _stack_or_refusal(
        self, candidate: Candidate, missing: Sequence[tuple[int, Candidate]]
    ) -> Stack:
        """What drives a candidate.

        Raises:
            ParameterError: its values cannot be had; rows say so for whoever goes on.
        """
        try:
            return self._stack(candidate)
        except ParameterError as error:
            row: Row = {
                "stack": "",
                "outcome": None,
                "error": clean_text(f"{REFUSED}{error}"),
                MARGIN: None,
                EVENTS: [],
            }
            for mission, other in missing:
                if other.key == candidate.key:
                    self._journal.add(candidate, mission, row)
            raise ParameterError(row["error"]) from None

    def _stack(self, candidate: Candidate) -> Stack:
        """The original for no values; else with a file of its own, whose name tells its content."""
        stack = dataclasses.replace(self._template.stack, name=candidate.name)
        if not candidate.values:
            return stack
        digest = hashlib.sha256(json.dumps(candidate.key).encode()).hexdigest()
        path = self._files / f"{digest[:16]}.nav2.yaml"
        if not path.exists():
            with_values(self._nav2, candidate.values, self._template.allow_unknown).dump(path)
        return dataclasses.replace(stack, nav2_file=str(path))


def _row(finished: Finished[EpisodeTask, Delivery], prices: Prices) -> Row:
    """The row of an episode with its margin; of one without a result its error, as in a run."""
    record = record_of(finished)
    return {**record["row"], MARGIN: margin_of(record["row"], prices), EVENTS: record["events"]}


def margin_of(row: Row, prices: Prices, accounting: str = PUBLISHED) -> float | None:
    """Contribution margin [USD] of one delivery.

    Args:
        row: of the delivery, with its events for another accounting than the published one.
        prices: the price file.
        accounting: of contacts, see :mod:`harness.economics.accountings`.

    Returns:
        None where the delivery has no result, or its cargo is not modelled.
    """
    if row.get("error") is not None or row["pieces_at_start"] is None:
        return None
    events = [
        {**event, "stack": row["stack"], "episode": row["episode"]} for event in row.get(EVENTS, ())
    ]
    margin = margins([row], prices, events, accounting)
    if margin is None:
        return None
    return float(margin[0])
