"""What a user is told of a study that will run otherwise than one might think."""

from collections.abc import Mapping
from typing import Any

from harness.tuning.declaration import Declaration
from harness.tuning.journal import Journal
from harness.tuning.racing import rungs
from harness.tuning.search import Search
from harness.tuning.study import TuningStudy


def notes_before(declaration: Declaration, options: Mapping[str, Any]) -> list[str]:
    """What is to be said before anything is driven.

    Args:
        declaration: of the study.
        options: of ``navbench run``, by name; those that were not given are None.
    """
    found = []
    if options.get("start") is not None and options.get("goal") is not None:
        found.append(
            "--start and --goal are given: training and test have other people and other noise, but the same way; the "
            "test says nothing of other ways"
        )
    if declaration.is_raced and len(rungs(declaration.episodes)) == 1:
        found.append(
            f"no trial is dropped early: {declaration.episodes} --episodes cannot be halved into parts of 5 or more; "
            "give 32, 64 or the like"
        )
    return found


def notes_after_search(study: TuningStudy, search: Search, journal: Journal) -> list[str]:
    """What the search left out, and whether what follows will take longer than was meant."""
    driven, asked, budget = len(search.trials) - 1, study.declaration.trials, study.declaration.budget
    found = []
    if search.is_exhausted:
        found.append(f"after {driven} of {asked} trials there is no further point that keeps the constraints")
    elif driven < asked:
        found.append(
            f"the budget of {budget:g} s cut off {asked - driven} of {asked} trials; --resume with a longer --budget "
            "drives the rest"
        )
    missing = 0.0 if budget is None else study.time_after_search(journal) + journal.elapsed - budget
    if missing > 0.0:
        found.append(
            f"note: the {study.episodes_after_search} deliveries of final choice and test may take {missing:.0f} s "
            "longer than the budget; fewer --test-episodes and --final-episodes leave more of it for the search"
        )
    return found
