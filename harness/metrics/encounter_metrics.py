"""Metrics of contacts and of the people around."""

from harness.metrics.metric import OURS, PAPER, Better, Metric, averaged, count

HIGHER, LOWER, NEITHER = Better.HIGHER, Better.LOWER, Better.NEITHER
HALL = "Hall 1966, The Hidden Dimension"
NO_CARGO = "the cargo is not simulated"
NOBODY_NEAR = "nobody came within 20 m"
NO_PEOPLE = "this world has no people"
NOT_IN_WORLD = "no such thing stands in this world"

PRICED_PROPERTY = ("mailbox", "trash_bin", "building_glass", "bollard", "plant", "fence")

CONTACTS = (
    averaged(
        "collision_impulse_ns",
        "Avg Collision Impulse",
        LOWER,
        "Sum of the impulses of all counted contacts (at least 50 N s with one partner in one physics step).",
        PAPER,
        is_published=True,
    ),
    averaged(
        "collision_delta_v_mps",
        "Avg Collision Δv",
        LOWER,
        "Mean over the counted contacts with people of impulse over the robot's mass; 0 without any.",
        PAPER,
        is_published=True,
    ),
    Metric(
        "pedestrian_injury_usd",
        "Pedestrian Injury Cost",
        LOWER,
        "Expected cost of the injuries of all counted contacts with people.",
        PAPER,
        mean_key="pedestrian_injury_usd_per_run",
        is_published=True,
    ),
    count("pedestrian_contacts", "Pedestrian contacts", "Counted contacts with people.", PAPER),
    *(
        Metric(
            f"{kind}_contacts",
            f"{kind.replace('_', ' ').title()} Contact",
            LOWER,
            f"Counted contacts with {kind.replace('_', ' ')} of at least 100 N s.",
            PAPER,
            undefined=NOT_IN_WORLD,
            is_count=True,
            mean_key=f"{kind}_contacts",
            is_published=True,
        )
        for kind in PRICED_PROPERTY
    ),
    count(
        "soft_contacts",
        "Uncounted contacts",
        "Contact events that the published rule does not count: too soft, or in its pause after a counted one.",
        OURS,
    ),
    Metric(
        "pieces_at_start",
        "Pieces at the start",
        NEITHER,
        "Pieces of popcorn in the bucket at the start.",
        PAPER,
        undefined=NO_CARGO,
        is_count=True,
    ),
    averaged(
        "pieces_lost",
        "Pieces lost",
        LOWER,
        "Of these, outside the bucket at the end.",
        PAPER,
        undefined=NO_CARGO,
        is_count=True,
    ),
)

PEOPLE = (
    averaged(
        "min_pedestrian_distance_m",
        "Least distance to people",
        HIGHER,
        "Least distance between the robot's true rectangle and a person's disc; 0: they touched.",
        OURS,
        undefined=NOBODY_NEAR,
        decimals=2,
    ),
    averaged(
        "min_time_to_collision_s",
        "Least time to collision",
        HIGHER,
        "Least time, over all ticks and people within 20 m, after which robot and person would touch if both kept "
        "their true velocities, at most 60 s. The robot is a row of discs of half its width, moving and turning as it "
        "does; 0: they touched.",
        "Hayward 1972, Highway Research Record 384",
        undefined="nobody within 20 m was ever on a collision course",
        decimals=2,
    ),
    averaged(
        "intimate_intrusion_s",
        "Time in intimate zones",
        LOWER,
        "Time with somebody nearer than 0.45 m, from surface to surface.",
        HALL,
        undefined=NO_PEOPLE,
    ),
    averaged(
        "personal_intrusion_s",
        "Time in personal zones",
        LOWER,
        "Time with somebody nearer than 1.2 m, from surface to surface, intimate zone included.",
        HALL,
        undefined=NO_PEOPLE,
    ),
    averaged(
        "pedestrian_delay_s",
        "Delay of people",
        LOWER,
        "How much longer people take because of the robot, summed over all: each person's errands are compared with "
        "those of a twin crowd, with the same random numbers, that never meets the robot. What is compared is when "
        "each finishes the first errand that is unfinished here or there at the end, the rest of it walked freely. "
        "The two crowds part after the first who makes way, so single deliveries say little: compare means of many.",
        OURS,
        undefined="nobody makes way for the robot (random_walk, replay), or there is nobody",
        decimals=2,
    ),
    averaged(
        "intimate_intrusion_percent",
        "Share of time in intimate zones",
        LOWER,
        "The same over the duration.",
        HALL,
        undefined=NO_PEOPLE,
        decimals=1,
    ),
    averaged(
        "personal_intrusion_percent",
        "Share of time in personal zones",
        LOWER,
        "The same over the duration.",
        HALL,
        undefined=NO_PEOPLE,
        decimals=1,
    ),
)
