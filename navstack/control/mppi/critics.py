"""The critics that a parameter file names."""

from navstack.control.mppi.critic import MppiCritic
from navstack.params.extensions import algorithms
from navstack.params.mppi import MppiParams
from navstack.types import FloatArray


def build_critics(
    params: MppiParams, footprint: FloatArray, xy_goal_tolerance: float
) -> list[MppiCritic]:
    """The enabled critics in the file's order.

    Args:
        params: which critics, and theirs.
        footprint: padded polygon (V, 2) in [m], base frame.
        xy_goal_tolerance: of the goal checker in [m].
    """
    parts = {"footprint": footprint, "xy_goal_tolerance": xy_goal_tolerance}
    table = algorithms("mppi_critics")
    enabled = [name for name in params.critics if getattr(params, name).enabled]
    return [table[name].create(name, params, parts=parts) for name in enabled]
