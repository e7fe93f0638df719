"""What was tuned, and whether to take the tuned file: the first thing that a study says."""

import re
from pathlib import Path

from harness.economics.cost_terms import MARGIN
from harness.metrics.columns import Row
from harness.report.short.setup import nearest
from harness.statistics.interval import Interval, fewest_missions
from harness.task.study import EpisodeTask
from harness.tuning.declaration import StudyDeclaration
from harness.tuning.explanation import Explanation
from harness.tuning.result import StudyResult

TAKE, KEEP, OPEN = "Take the tuned file", "Keep your file", "Not decided"
# classes that a robot's own Nav2 does not have
_OWN_CLASS = re.compile(r"\bnavstack::\w+")


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
        f"world {world}, map {task.map_name}; {declaration.episodes} training missions, "
        f"{declaration.test_episodes} for the test, seed {task.seed}; "
        f"search space {declaration.space}."
    )


def decision(study: StudyResult, scores: Row, explanation: Explanation) -> str:
    """What to do with the tuned file, and why, in a sentence.

    Taken is a file whose margin on unseen missions is higher although an unseen loss is admitted.

    Args:
        study: what was searched.
        scores: of :func:`harness.tuning.scores.scores_document`.
        explanation: what the study says.
    """
    margin = explanation.components.get(MARGIN)
    if not study.incumbent.values:
        return f"{KEEP}: no trial earned more."
    if margin is None:
        return f"{OPEN}: the margin is undefined, because the cargo was not simulated."
    if not study.is_tested:
        return f"{OPEN}: the tuned file drove no unseen mission; search again with --test-episodes."
    bounds = explanation.unseen or margin.difference
    if bounds.sign > 0:
        return f"{TAKE}: it earns more on missions that it never saw."
    if margin.difference.sign < 0:
        return f"{KEEP}: your file earns more on missions that the search never saw.{_other_aim(study)}"
    return f"{OPEN}: {_more(scores, margin.difference)}"


def _other_aim(study: StudyResult) -> str:
    """What to do where something else than the margin was searched for."""
    aim = study.objectives[0]
    if aim == "margin":
        return ""
    return f" What raises {aim} does not raise the margin here; search with --objective margin."


def _more(scores: Row, difference: Interval) -> str:
    """What would decide."""
    if difference.n < fewest_missions():
        return f"{difference.n} test missions are too few; {fewest_missions()} are the least."
    needed = scores["test"].get("margin", {}).get("pairs_needed")
    if difference.sign > 0:
        return "one more loss of a kind that was not seen would undo the gain."
    if needed is None or needed <= difference.n:
        return f"the two files earn alike on {difference.n} test missions."
    return f"about {needed - difference.n:,d} more test missions would decide."


def as_nav2(tuned: str) -> str:
    """Whether a Nav2 without our plugins drives a file, in a sentence.

    Args:
        tuned: text of the file.
    """
    own = sorted(set(_OWN_CLASS.findall(tuned)))
    if own:
        return f"runs on Nav2 as it is: no, it needs {', '.join(own)} of this program."
    return "runs on Nav2 as it is: yes."
