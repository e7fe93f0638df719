"""Parameters of the path smoothers: names and defaults are those of Nav2 Jazzy."""

from dataclasses import dataclass

from navstack.errors import ParameterError


def _require_not_negative(params: object, *names: str) -> None:
    for name in names:
        if not getattr(params, name) >= 0:
            raise ParameterError(f"{name} {getattr(params, name)} is negative; 0 or more is allowed")


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
        _require_not_negative(self, "tolerance", "max_its", "w_data", "w_smooth", "refinement_num")


@dataclass(frozen=True, slots=True)
class SavitzkyGolayParams:
    """``nav2_smoother::SavitzkyGolaySmoother``; window and order are Nav2 main's (7 and 3, fixed, in Jazzy)."""

    do_refinement: bool = True  # smooth the smoothed path again
    refinement_num: int = 2  # so many times
    enforce_path_inversion: bool = True  # smooth the stretches between cusps apart
    window_size: int = 7  # poses, odd
    poly_order: int = 3  # of the polynomial fitted to them

    def __post_init__(self) -> None:
        _require_not_negative(self, "refinement_num", "poly_order")
        if self.window_size < 3 or self.window_size % 2 == 0:
            raise ParameterError(f"window_size {self.window_size} is not an odd number of at least 3")
        if self.poly_order >= self.window_size:
            raise ParameterError(f"poly_order {self.poly_order} is not below window_size {self.window_size}")


@dataclass(frozen=True, slots=True)
class OptimizerParams:
    """How long a path is improved."""

    max_iterations: int = 100  # of each attempt
    fn_tol: float = 1e-7  # relative improvement of the sum of squares below which it ends

    def __post_init__(self) -> None:
        _require_not_negative(self, "max_iterations", "fn_tol")


@dataclass(frozen=True, slots=True)
class ConstrainedSmootherParams:
    """``nav2_constrained_smoother::ConstrainedSmoother``; defaults are Nav2's but for the downsampling.

    The sum of the weighted squares is made small; Nav2's solver squares each of them once more, so that the same
    weights are milder there.
    """

    w_curve: float = 30.0  # of the excess over the highest curvature [1/m]; raised until the bound holds
    w_dist: float = 0.0  # of the distance [m] from the given path; raised where the path would meet an obstacle
    w_smooth: float = 2000000.0  # of second differences [m] between points one cell apart
    w_cost: float = 0.015  # of the costmap's cost
    minimum_turning_radius: float = 0.4  # [m]; 1 over it bounds the curvature
    path_downsampling_factor: int = 2  # every so many-th pose is moved, the others are interpolated (Nav2: 1)
    keep_start_orientation: bool = True  # set out along the first pose, unless it looks elsewhere than the path
    keep_goal_orientation: bool = True  # arrive along the last pose, likewise
    reversing_enabled: bool = True  # smooth the stretches between cusps apart
    optimizer: OptimizerParams = OptimizerParams()

    def __post_init__(self) -> None:
        _require_not_negative(self, "w_curve", "w_dist", "w_smooth", "w_cost")
        if not self.minimum_turning_radius > 0.0:
            raise ParameterError(f"minimum_turning_radius {self.minimum_turning_radius} m is not positive")
        if self.path_downsampling_factor < 1:
            raise ParameterError(f"path_downsampling_factor {self.path_downsampling_factor} is not at least 1")
