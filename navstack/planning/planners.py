"""The global planners by their plugin names. A new planner adds one line.

OMPL is imported when a planner of it is made: it takes 0.1 s and 20 MB.
"""

from collections.abc import Callable, Mapping
from typing import Any

from navstack.planning.incremental_navfn import IncrementalNavfn
from navstack.planning.navfn import NavfnPlanner
from navstack.planning.planner import Planner, RobotShape


def _ompl_planner(params: Any, shape: RobotShape | None) -> Planner:
    from navstack.planning.ompl_planner import OmplPlanner

    return OmplPlanner(params, shape)


PlannerFactory = Callable[[Any, RobotShape | None], Planner]  # from its parameters and the robot's shape

PLANNERS: Mapping[str, PlannerFactory] = {
    "nav2_navfn_planner::NavfnPlanner": lambda params, _: NavfnPlanner(params),
    "navstack::IncrementalNavfn": lambda params, _: IncrementalNavfn(params),
    "navstack::OmplPlanner": _ompl_planner,
}
