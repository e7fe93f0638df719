"""Parameters of the path smoother: names and defaults are those of Nav2 Jazzy."""

from dataclasses import dataclass

from navstack.params.checks import NotNegative, NotNegativeInt, check


@dataclass(frozen=True, slots=True)
class SimpleSmootherParams:
    """``nav2_smoother::SimpleSmoother``."""

    # [m] it ends once all poses together move less than this in one iteration
    tolerance: NotNegative = 1e-10
    max_its: NotNegativeInt = 1000  # iterations, after which the last but one is taken
    w_data: NotNegative = 0.2  # pull towards the given path
    w_smooth: NotNegative = 0.3  # pull towards the middle of the neighbours
    do_refinement: bool = True  # smooth the smoothed path again
    refinement_num: NotNegativeInt = 2  # so many times
    enforce_path_inversion: bool = True  # smooth the stretches between cusps apart

    def __post_init__(self) -> None:
        check(self)
