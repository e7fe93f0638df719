"""What was tuned, and whether to take the tuned file: the first thing that a study says."""

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from harness.economics.cost_terms import MARGIN
from harness.metrics.columns import Row
from harness.report.numbers import interval_text, too_few
from harness.report.short.setup import nearest
from harness.report.verdict import again, value_of
from harness.statistics.interval import Interval, fewest_missions
from harness.storage.manifest_file import read_manifest
from harness.storage.texts import name_of
from harness.task.study import EpisodeTask
from harness.tuning.budget import enough_for, further
from harness.tuning.declaration import MOST_EPISODES, StudyDeclaration, parse_duration, sizes
from harness.tuning.explanation import Explanation
from harness.tuning.result import StudyResult
from harness.tuning.search import LEAST_GAIN
from harness.tuning.training import USUAL_MISSIONS
from navstack.params.lint.plugins import own_plugins_of
from navstack.params.nav2_file.file import inspect_nav2

TAKE, KEEP, OPEN = "Take the tuned file", "Keep your file", "Not decided"
OTHER_SPACES = "navbench list spaces"


@dataclass(frozen=True, slots=True)
class Advice:
    """What to do with the tuned file, and what would tell where nothing does yet."""

    verdict: str  # TAKE, KEEP or OPEN
    why: str  # a sentence
    test_episodes: int | None = None  # of a test that would decide; None: it is decided
    episodes: int | None = None  # training missions of a search that might find something
    is_cut: bool = False  # whether the budget ended before a file was tried

    def __str__(self) -> str:
        return f"{self.verdict}: {self.why}"


def setup_of(declaration: StudyDeclaration, task: EpisodeTask) -> str:
    """File, robot, localizer, world, map and missions of a study, in a sentence.

    Args:
        declaration: of the study.
        task: one of its deliveries, with the files of its folder.
    """
    stack = task.stack
    robot = nearest("robots", Path(stack.robot))
    world = nearest("worlds", Path(task.world))
    return (
        f"{Path(declaration.stack).name}, robot {robot}, localizer {stack.localizer}; "
        f"world {world}, map {name_of(task.map_name)}; {declaration.episodes} training missions, "
        f"{declaration.test_episodes} for the test, seed {task.seed}; "
        f"search space {declaration.space}."
    )


def decision(study: StudyResult, scores: Row, explanation: Explanation) -> Advice:
    """What to do with the tuned file, and why.

    Taken is a file whose margin on unseen missions is higher although an unseen loss is admitted,
    unless the difference is not significant.

    Args:
        study: what was searched.
        scores: of :func:`harness.tuning.scores.scores_document`.
        explanation: what the study says.
    """
    margin = explanation.components.get(MARGIN)
    if not study.incumbent.values:
        return _unchanged(study, explanation)
    if margin is None:
        return Advice(OPEN, "the margin is undefined, because the cargo was not simulated.")
    if not study.is_tested:
        count = sizes(len(study.trials), len(study.train_missions))["test_episodes"]
        why = f"the tuned file drove no unseen mission; {count} would tell more."
        return Advice(OPEN, why, count)
    bounds = explanation.unseen or margin.difference
    is_open = margin.difference.low is not None and margin.difference.sign == 0
    if bounds.sign > 0 and not is_open:
        if missed := _missed(scores):
            return Advice(KEEP, f"the tuned one earns more, but {missed}.")
        return Advice(TAKE, "it earns more on missions that it never saw.")
    if (margin.difference.value or 0.0) <= 0.0:
        if margin.difference.n < fewest_missions():
            count = sizes(len(study.trials), len(study.train_missions))["test_episodes"]
            few = too_few(margin.difference.n, "test mission")
            why = f"{few}; {count} would tell more."
            return Advice(OPEN, why, count)
        why = "the tuned one does not earn more on missions that the search never saw."
        return Advice(KEEP, f"{why}{_other_aim(study)}")
    return _more(scores, explanation, margin.difference)


def _missed(scores: Row) -> str:
    """Side conditions that the tuned file misses by more than the own one, on unseen missions."""
    said = []
    for name, score in scores["test"].items():
        before, after = score["shortfall"]
        if after > max(before, 0.0):
            said.append(f"misses {name.partition('@')[2]} by {after:.3f} on unseen missions")
    return " and ".join(said)


def _unchanged(study: StudyResult, explanation: Explanation) -> Advice:
    """No trial was better, or none was driven."""
    count = len(study.train_missions)
    if len(study.trials) > 1:
        return Advice(KEEP, "no trial earned more.")
    if study.has_room:
        why = "the budget ended before another file was tried."
        return Advice(OPEN, why, episodes=count, is_cut=True)
    why = (
        f"on its {count} training missions no file can earn {LEAST_GAIN:.2f} USD more; "
        "none was tried."
    )
    if not study.is_tested and count < USUAL_MISSIONS:
        why = f"{why.removesuffix('.')}, and no unseen mission was driven: search on more."
        return Advice(OPEN, why, episodes=USUAL_MISSIONS)
    room = explanation.room_usd_per_run
    if room is None or not study.is_tested:
        return Advice(KEEP, why)
    if (room.value or 0.0) < LEAST_GAIN:
        return Advice(KEEP, why)
    why = (
        f"no other file was tried, as its {count} training missions leave less than "
        f"{LEAST_GAIN:.2f} USD to gain. {room.n} unseen ones leave {room.value:.2f}: search on "
        "more missions."
    )
    return Advice(OPEN, why, episodes=max(2 * count, USUAL_MISSIONS))


def _other_aim(study: StudyResult) -> str:
    """What to do where something else than the margin was searched for."""
    aim = study.objectives[0]
    if aim == "margin":
        return ""
    return f" What raises {aim} does not raise the margin here; search with --objective margin."


def _more(scores: Row, explanation: Explanation, difference: Interval) -> Advice:
    """A gain that is not proved: how many missions would, at this size."""
    needed = scores["test"].get("margin", {}).get("pairs_needed")
    if explanation.proven_by is None or needed is None or needed > MOST_EPISODES:
        why = (
            f"a gain as small as {interval_text(difference)} USD takes more than {MOST_EPISODES:,d}"
        )
        return Advice(KEEP, f"{why} test missions to prove.")
    total = max(needed, explanation.proven_by, fewest_missions())
    if difference.n < fewest_missions():
        why = too_few(difference.n, "test mission")
    elif difference.sign > 0:
        why = "one more loss of a kind that was not seen would undo the gain"
    else:
        why = f"the gain of {interval_text(difference)} USD is not significant"
    more = max(total - difference.n, 1)
    return Advice(OPEN, f"{why}; about {more:,d} more test missions would decide.", total)


def next_command(advice: Advice, folder: Path, test: str, pace: float) -> str:
    """The command that comes next: what decides, or else what shows that the decision holds.

    Args:
        advice: on the file.
        folder: of the study.
        test: the command that drives the tuned file's test again.
        pace: wall time [s] that a delivery took.
    """
    if advice.test_episodes is not None:
        words = ["navbench", "tune", "--resume", str(folder)]
        return shlex.join([*words, "--test-episodes", str(advice.test_episodes)])
    if advice.verdict == TAKE:
        return test
    if advice.episodes is None:
        return OTHER_SPACES
    command = read_manifest(folder).get("command", ())
    if advice.is_cut:
        declared = value_of(command, "--budget")
        seconds = 0.0
        if declared:
            seconds = parse_duration(declared)
        budget = further(advice.episodes, pace, seconds)
        return shlex.join(["navbench", "tune", "--resume", str(folder), "--budget", budget])
    repeated = again(command, advice.episodes, _budget(command, advice.episodes, pace))
    return repeated or OTHER_SPACES


def _budget(command: Sequence[str], episodes: int, pace: float) -> str:
    """A budget in which a search on so many missions can be driven; empty: it had none."""
    declared = value_of(command, "--budget")
    if not declared:
        return ""
    return enough_for(episodes, pace, parse_duration(declared))


def as_nav2(tuned: Path) -> str:
    """Whether a Nav2 without our plugins drives a file, in a sentence."""
    own = own_plugins_of(inspect_nav2(tuned, allow_unknown=True))
    if own:
        return f"runs on Nav2 as it is: no, it needs {', '.join(own)} of this program."
    return "runs on Nav2 as it is: yes."
