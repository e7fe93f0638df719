"""The path smoothers by their plugin names. A new smoother adds one line."""

from collections.abc import Callable, Mapping
from typing import Any

from navstack.planning.smoother import Smoother
from navstack.planning.smoothers.constrained_smoother import ConstrainedSmoother
from navstack.planning.smoothers.savitzky_golay import SavitzkyGolaySmoother
from navstack.planning.smoothers.simple_smoother import SimpleSmoother

SmootherFactory = Callable[[Any], Smoother]  # from its parameters

SMOOTHERS: Mapping[str, SmootherFactory] = {
    "nav2_smoother::SimpleSmoother": SimpleSmoother,
    "nav2_smoother::SavitzkyGolaySmoother": SavitzkyGolaySmoother,
    "nav2_constrained_smoother::ConstrainedSmoother": ConstrainedSmoother,
}
