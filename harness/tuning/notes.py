"""What a study says before and after its search."""

from collections.abc import Mapping
from typing import Any

from harness.tuning.budget import Budget, further
from harness.tuning.declaration import StudyDeclaration
from harness.tuning.journal import Journal
from harness.tuning.racing import rungs
from harness.tuning.search import LEAST_GAIN, Search
from harness.tuning.study import TuningStudy


def notes_before(declaration: StudyDeclaration, options: Mapping[str, Any]) -> list[str]:
    """Notes to print before the first delivery.

    Args:
        declaration: of the study.
        options: of ``navbench run``, by name; those that were not given are None.
    """
    found = []
    if options.get("start") is not None and options.get("goal") is not None:
        found.append(
            "--start and --goal are given: training and test have other people and other noise, "
            "but the same way; the "
            "test says nothing of other ways"
        )
    if declaration.is_raced and len(rungs(declaration.episodes)) == 1:
        found.append(
            f"no trial is dropped early: {declaration.episodes} --episodes cannot be halved into "
            "parts of 5 or more; "
            "give 40, 80 or the like"
        )
    return found


def notes_after_search(
    study: TuningStudy, search: Search, journal: Journal, budget: Budget
) -> list[str]:
    """What the search left out, and how much of what follows the budget leaves time for."""
    driven, asked = len(search.trials) - 1, study.declaration.trials
    found = []
    if search.is_futile and not driven:
        found.append(
            f"the search stops: on its {len(study.plan.missions)} training missions no file can "
            f"earn {LEAST_GAIN:.2f} USD more than yours"
        )
    elif search.is_exhausted:
        found.append(
            f"after {driven} of {asked} trials there is no further point that keeps the constraints"
        )
    elif driven < asked and budget.seconds is not None:
        enough = further(len(study.plan.missions), journal.pace, budget.seconds)
        found.append(
            f"the budget of {budget.seconds:g} s cut off {asked - driven} of {asked} trials; "
            f"--resume with --budget {enough} or more tries further files"
        )
    following = study.episodes_after_search
    share = budget.share_of(following)
    if share < 1.0 and driven:
        found.append(
            f"note: the budget lasts for about {share * following:.0f} of the {following} "
            "deliveries of final choice and test; --resume with --test-episodes drives more"
        )
    return found
