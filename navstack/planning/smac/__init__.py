"""The planners of nav2_smac_planner: A* on the grid, Hybrid-A*, and A* on a state lattice."""
