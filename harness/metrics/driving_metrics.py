"""Metrics of the task, the drive, the belief and the navigation."""

from harness.metrics.metric import OURS, PAPER, Better, Metric, averaged, count

HIGHER, LOWER, NEITHER = Better.HIGHER, Better.LOWER, Better.NEITHER
NAV2 = "Nav2's default behavior tree"
NO_BELIEF = "the robot does not localize"

TASK = (
    averaged(
        "shortest_path_m",
        "Shortest path",
        NEITHER,
        "Length of the shortest path from start to goal on the navigation mesh.",
        PAPER,
    ),
    Metric(
        "duration_s",
        "Avg Runtime",
        LOWER,
        "Simulated time until the outcome.",
        PAPER,
        mean_key="avg_runtime_h",
        mean_divisor=3600.0,
        is_published=True,
    ),
    Metric(
        "distance_m",
        "Avg Distance",
        NEITHER,
        "Length of the true path.",
        PAPER,
        mean_key="avg_distance_km",
        mean_divisor=1000.0,
        is_published=True,
    ),
    Metric(
        "average_speed_mps",
        "Avg Velocity",
        HIGHER,
        "Distance over duration.",
        PAPER,
        mean_key="avg_velocity_mps",
        is_published=True,
    ),
    Metric("goal_distance_m", "Distance left", LOWER, "Straight distance to the goal at the end.", OURS),
    averaged(
        "spl",
        "SPL",
        HIGHER,
        "Success weighted by path length: 0 if the robot did not arrive, else shortest path over the larger of "
        "distance and shortest path. The goal's radius counts as arrival, so a path may be shorter than the shortest; "
        "it counts as 1.",
        "Anderson et al. 2018, arXiv:1807.06757",
        decimals=3,
    ),
)

MOTION = (
    averaged(
        "path_irregularity_radpm",
        "Path irregularity",
        LOWER,
        "Accumulated turning (sum of absolute changes of the true yaw from tick to tick) per metre driven. The "
        "definition there subtracts the turning of the most direct path; here nothing is subtracted.",
        "Guzzi et al. 2013, ICRA, Human-friendly robot navigation in dynamic environments",
        undefined="less than 1 m was driven",
        decimals=3,
    ),
    averaged(
        "jerk_p95_mps3",
        "Jerk, 95th percentile",
        LOWER,
        "95th percentile of the magnitude of the second derivative of the true forward speed, from a cubic fitted to "
        "each 0.5 s of ticks (Savitzky and Golay 1964).",
        OURS,
        undefined="less than 0.5 s was driven",
        decimals=2,
    ),
    averaged(
        "lateral_acceleration_p95_mps2",
        "Lateral acceleration, 95th percentile",
        LOWER,
        "95th percentile of the magnitude of true forward speed times yaw rate, smoothed as the jerk is.",
        OURS,
        undefined="less than 0.5 s was driven",
        decimals=2,
    ),
    Metric("max_tilt_rad", "Largest tilt", LOWER, "Largest angle between robot and vertical.", PAPER),
    averaged(
        "motion_energy_kwh",
        "Energy at the wheels",
        LOWER,
        "Mechanical work that the motors delivered to the wheels in the simulation; braking gives nothing back.",
        OURS,
        decimals=5,
    ),
    averaged(
        "published_energy_kwh",
        "Energy, published formula",
        LOWER,
        "Rolling resistance force of the prices file times distance.",
        PAPER,
        decimals=5,
    ),
)

STATISTICS = (("mean", "mean"), ("median", "median"), ("p95", "95th percentile"), ("max", "largest"))
PRINTED = ("mean", "p95")

LOCALIZATION = tuple(
    averaged(
        f"{error}_{key}_{unit}",
        f"{title}, {name}",
        LOWER,
        f"{name.capitalize()} over the ticks of {meaning}.",
        OURS,
        undefined=NO_BELIEF,
        decimals=3 if key in PRINTED else None,
    )
    for error, title, unit, meaning in (
        ("localization_error", "Localization error", "m", "the distance between believed and true position"),
        ("heading_error", "Heading error", "rad", "the angle between believed and true yaw"),
    )
    for key, name in STATISTICS
)

NAVIGATION = (
    count("plans", "Plans", "Paths that the planner found.", NAV2, NEITHER, mean=False),
    count("failed_plans", "Failed plans", "Times that the planner found none.", NAV2, mean=False),
    count("failed_controls", "Failed attempts to follow", "Times that following a path failed.", NAV2, mean=False),
    count(
        "recoveries", "Recoveries", "Times that the tree turned to its recoveries; in one, several may be tried.", NAV2
    ),
    count("clearings", "Clearings of both costmaps", "Begun as a recovery.", NAV2),
    count("spins", "Spins", "Begun as a recovery.", NAV2),
    count("waits", "Waits", "Begun as a recovery.", NAV2),
    count("backups", "Backups", "Begun as a recovery.", NAV2),
    count("failed_recoveries", "Failed recoveries", "Recoveries that the next in turn took over from.", NAV2),
)
