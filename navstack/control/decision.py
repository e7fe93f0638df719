"""How a control cycle was decided, so that it can be explained afterwards."""

from dataclasses import dataclass

from navstack.types import FloatArray, Twist2D


@dataclass(frozen=True, slots=True)
class CriticScore:
    """What one critic said in one cycle."""

    critic: str  # its name in the parameter file
    raw: float | None  # its score of the chosen trajectory before weighting; None: none was legal
    weighted: float | None  # its share in that trajectory's total
    rejections: int  # trajectories that it was the first to reject


# kinds of alternatives
RUNNER_UP = "runner_up"
SLOWER = "slower"


@dataclass(frozen=True, slots=True)
class Alternative:
    """A command that was legal in one cycle, and scored worse than the one that came out."""

    kind: str  # RUNNER_UP: the best of all others; SLOWER: the best of those at most half as fast
    command: Twist2D
    total: float  # weighted sum, as in DecisionRecord
    scores: tuple[CriticScore, ...]  # in the order of evaluation; rejections are not counted


@dataclass(frozen=True, slots=True)
class Option:
    """A motion that a cycle weighed, to be drawn."""

    total: float  # weighted sum, as in DecisionRecord
    path: FloatArray  # (n, 2) [m] of the base, map frame, from where the robot is believed to be


@dataclass(frozen=True, slots=True)
class DecisionRecord:
    """One control cycle, as the one who decided it tells."""

    stamp: float  # [s]
    decided_by: str  # the controller's class in Nav2, a recovery's name, or the behavior tree
    command: Twist2D  # what came out; standstill where nothing was legal
    samples: int = 0  # trajectories compared
    rejected: int = 0  # of them
    # weighted sum of the chosen trajectory; None: none was legal, or nothing is scored
    total: float | None = None
    scores: tuple[CriticScore, ...] = ()  # in the order of evaluation
    status: str = ""  # of an optimiser; empty: there is none
