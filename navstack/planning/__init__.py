"""Global planners: from a start, a goal and a costmap to a path."""
