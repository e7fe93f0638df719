"""The global planners by their plugin names. A new planner adds one line."""

from collections.abc import Callable, Mapping
from typing import Any

from navstack.planning.incremental_navfn import IncrementalNavfn
from navstack.planning.navfn import NavfnPlanner
from navstack.planning.ompl_planner import OmplPlanner
from navstack.planning.planner import Planner, RobotShape

PlannerFactory = Callable[[Any, RobotShape | None], Planner]  # from its parameters and the robot's shape

PLANNERS: Mapping[str, PlannerFactory] = {
    "nav2_navfn_planner::NavfnPlanner": lambda params, _: NavfnPlanner(params),
    "navstack::IncrementalNavfn": lambda params, _: IncrementalNavfn(params),
    "navstack::OmplPlanner": OmplPlanner,
}
