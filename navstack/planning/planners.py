"""The global planners by their plugin names. A new planner adds one line."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from navstack.planning.incremental_navfn import IncrementalNavfn
from navstack.planning.navfn import NavfnPlanner
from navstack.planning.ompl_planner import OmplPlanner
from navstack.planning.planner import Planner

PlannerFactory = Callable[[Any, np.random.Generator], Planner]  # from its parameters and random numbers

PLANNERS: Mapping[str, PlannerFactory] = {
    "nav2_navfn_planner::NavfnPlanner": NavfnPlanner,
    "navstack::IncrementalNavfn": IncrementalNavfn,
    "navstack::OmplPlanner": OmplPlanner,
}
