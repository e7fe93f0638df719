"""Parameters of the path smoother: names and defaults are those of Nav2 Jazzy."""

from dataclasses import dataclass

from navstack.errors import ParameterError


@dataclass(frozen=True, slots=True)
class SimpleSmootherParams:
    """``nav2_smoother::SimpleSmoother``."""

    tolerance: float = 1e-10  # [m] it ends once all poses together move less than this in one iteration
    max_its: int = 1000  # iterations, after which the last but one is taken
    w_data: float = 0.2  # pull towards the given path
    w_smooth: float = 0.3  # pull towards the middle of the neighbours
    do_refinement: bool = True  # smooth the smoothed path again
    refinement_num: int = 2  # so many times
    enforce_path_inversion: bool = True  # smooth the stretches between cusps apart

    def __post_init__(self) -> None:
        for name in ("tolerance", "max_its", "w_data", "w_smooth", "refinement_num"):
            if not getattr(self, name) >= 0:
                raise ParameterError(f"{name} {getattr(self, name)} is negative; 0 or more is allowed")
