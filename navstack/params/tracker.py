"""Parameters of the tracker of moving obstacles; Nav2 has none like it."""

from dataclasses import dataclass

from navstack.ranges import NotNegative, Parameters, Positive, PositiveInt


@dataclass(frozen=True, slots=True)
class TrackerParams(Parameters, whose="tracker", finite=True):
    """Node ``tracker``, this program's own."""

    max_range: Positive = 12.0  # [m] beyond which returns are not looked at
    # [m] of an obstacle on the map, along x and y: a return there is part of the map
    background_margin: Positive = 0.2
    # whether the map is subtracted after the scan has been aligned with it, as far as the belief's
    # covariance allows; ``background_margin`` then grows where the place stays unsure
    aligns_scans: bool = False
    # [m] between returns of neighbouring beams that belong together, beside the spacing of beams
    # on a surface seen at a slant (Borges & Aldon 2004, J. Intell. Robot. Syst. 40)
    cluster_gap: Positive = 0.25
    min_points: PositiveInt = 2  # returns of a cluster
    max_width: Positive = 1.0  # [m] of a cluster; what is wider is no person
    body_radius: Positive = 0.3  # [m] of a person: how far the centre is behind the nearest return
    position_std: Positive = 0.05  # [m] of a body's measured centre that is wholly seen
    occluded_std: Positive = 0.2  # [m] of one that something nearer hides in part
    acceleration_std: Positive = 0.7  # [m/s2] white, of a body's motion
    # [m/s2] the same of a body that turns; 0: no second model
    turning_acceleration_std: NotNegative = 0.0
    straight_time: Positive = 8.0  # [s] between two turns of a body
    turning_time: Positive = 0.7  # [s] of a turn
    # [m/s] along x and y of a body that is seen for the first time
    initial_speed_std: Positive = 1.0
    # [-] squared Mahalanobis distance up to which a cluster can be a track's next place: 99.9 % of
    # the chi-squared distribution of two degrees of freedom
    gate: Positive = 13.8
    min_hits: PositiveInt = 3  # clusters until a track is reported
    max_coasting: Positive = 0.8  # [s] without a cluster, after which a track ends
