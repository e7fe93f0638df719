"""What a user asked of a study, kept in its folder.

With it a study goes on where it was cut off.
"""

import re
from dataclasses import dataclass

from harness.meetings.estimators import DELIVERIES, MEETINGS
from navstack.errors import InputError

MARGIN_OBJECTIVE = "margin"
SPACE = "search_space.yaml"  # in the study's params/
ORIGINAL = "original.nav2.yaml"  # the user's file, comments and all
MOST_TRIALS = 10_000
MOST_FINALISTS = 100
MOST_EPISODES = 10_000  # training missions, or test missions
# numbers of missions that another session may change
SIZES = ("test_episodes", "final_episodes", "waterfall_missions")
# deliveries of a search from which on its test and final choice have their full size
_FULL_SEARCH = 3200
_DURATION = re.compile(r"(?:(\d+(?:\.\d+)?)h)?(?:(\d+(?:\.\d+)?)m)?(?:(\d+(?:\.\d+)?)s)?")


@dataclass(frozen=True, slots=True)
class StudyDeclaration:
    """A study but for what ``run.json`` says."""

    stack: str  # as the user gave it
    space: str  # name of the search space; of several, with + between them
    objective: str
    sampler: str
    trials: int  # beside the original
    episodes: int  # training missions
    test_episodes: int
    is_raced: bool
    waterfall_missions: int  # on which the explanation drives mixtures of old and new values
    budget: float | None  # [s] of wall time; None: as long as it takes
    sensors: str  # of the stack: a name of params/sensors, or an absolute path
    robot: str
    # of the ``navbench run`` that drives the test again, but for stack, seed and episodes
    options: tuple[str, ...]
    finalists: int = 0  # trials of the final choice, beside the original
    final_episodes: int = 0  # training missions that it alone drives
    is_fitted: bool = False  # whether fewer training missions are driven where the budget is short
    estimator: str = DELIVERIES  # of the training missions; the test is of whole deliveries

    def __post_init__(self) -> None:
        """Check what the types cannot.

        Raises:
            InputError: a number out of range.
        """
        for option, value, least, most in (
            ("--trials", self.trials, 1, MOST_TRIALS),
            ("--episodes", self.episodes, 2, MOST_EPISODES),
            ("--test-episodes", self.test_episodes, 0, MOST_EPISODES),
            ("--finalists", self.finalists, 0, MOST_FINALISTS),
            ("--final-episodes", self.final_episodes, 0, MOST_EPISODES),
        ):
            if not least <= value <= most:
                raise InputError(f"{option} {value} is out of range; give {least} to {most}")
        if self.estimator == MEETINGS and self.objective != MARGIN_OBJECTIVE:
            raise InputError(
                f"--objective {self.objective}: meetings tell the margin alone; give --objective "
                f"{MARGIN_OBJECTIVE}, or leave out --estimator meetings"
            )

    @property
    def is_by_meetings(self) -> bool:
        """Whether training missions are driven by meetings with people."""
        return self.estimator == MEETINGS


def sizes(trials: int, episodes: int) -> dict[str, int]:
    """Missions of test, final choice and explanation that a user leaves to us.

    Fewer where the search is small.
    """
    share = min(1.0, trials * episodes / _FULL_SEARCH)
    return {
        "test_episodes": max(20, round(400 * share)),
        "final_episodes": max(4, round(128 * share)),
        "waterfall_missions": round(40 * share),
    }


def parse_duration(text: str) -> float:
    """A duration in [s], given as ``90s``, ``30m`` or ``1h30m``.

    Raises:
        InputError: it is none, or nothing.
    """
    parts = _DURATION.fullmatch(text.strip().lower())
    numbers: tuple[str, ...] = ()
    if parts:
        numbers = parts.groups("0")
    seconds = sum(
        float(number) * unit for number, unit in zip(numbers, (3600.0, 60.0, 1.0), strict=False)
    )
    if seconds <= 0.0:
        raise InputError(
            f"--budget '{text}' is no duration; give hours, minutes, seconds, e.g. 90s, 30m or "
            "1h30m"
        )
    return seconds
