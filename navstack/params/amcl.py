"""Parameters of AMCL: names and defaults are those of Nav2 Jazzy. Those with GPS are our own."""

from dataclasses import dataclass
from typing import Annotated

from navstack.ranges import (
    POSITIVE,
    NegativeReplaced,
    NotNegative,
    OpenQuantity,
    Parameters,
    Positive,
    PositiveInt,
    Quantity,
    Replaced,
    Whole,
    at_least,
    at_most,
    one_of,
    up_to,
    within,
)

SHORTEST_RANGE = 0.01  # [m] that a laser may have at most
MOST_PARTICLES = 1_000_000  # 100 MB, and more than a second for each scan
LASER_MODELS = ("beam", "likelihood_field", "likelihood_field_prob")
# name -> spelling of releases before plugins
MOTION_MODELS = {
    "nav2_amcl::DifferentialMotionModel": "differential",
    "nav2_amcl::OmniMotionModel": "omnidirectional",
}
Alpha = Annotated[float, within(0, 1e6)]
# shares, that need not add up to 1; a likelihood is a product of cubes of them
ShareOfReturns = Annotated[float, within(0, 100)]
Particles = Annotated[int, within(1, MOST_PARTICLES)]
Interval = Annotated[int, Replaced(range(1, 2**31), 1)]
MotionModel = Annotated[str, one_of((*MOTION_MODELS, *MOTION_MODELS.values()))]


@dataclass(frozen=True, slots=True)
class AmclParams(Parameters, whose="amcl", finite=True):
    """Node ``amcl`` (``amcl_node.cpp``).

    Frames, topics and what concerns publishing have no effect here.
    """

    robot_model_type: MotionModel = "nav2_amcl::DifferentialMotionModel"
    alpha1: Alpha = 0.2  # [-] variance of a rotation per squared rotation
    alpha2: Alpha = 0.2  # [rad2/m2] variance of a rotation per squared translation
    alpha3: Alpha = 0.2  # [-] variance of a translation per squared translation
    alpha4: Alpha = 0.2  # [m2/rad2] variance of a translation per squared rotation
    # [-] variance of a sideways translation per squared translation; omnidirectional only
    alpha5: Alpha = 0.2

    laser_model_type: Annotated[str, one_of(LASER_MODELS)] = "likelihood_field"
    max_beams: Annotated[int, at_least(2)] = 60  # of a scan, evenly spaced
    laser_max_range: OpenQuantity = (
        100.0  # [m] beyond which there is no return; 0 or less: the scan's own
    )
    laser_min_range: OpenQuantity = (
        -1.0
    )  # [m] up to which there is no return; 0 or less: the scan's own
    # [m] an obstacle farther from a return is taken to be that far
    laser_likelihood_max_dist: Annotated[float, NegativeReplaced(2.0), up_to(1000)] = 2.0
    # [m] standard deviation of a return about an obstacle
    sigma_hit: Annotated[float, within(1e-4, 1000)] = 0.2
    z_hit: ShareOfReturns = 0.5  # [-] share of returns from what is on the map
    z_rand: ShareOfReturns = 0.5  # [-] share of returns from anywhere
    z_max: ShareOfReturns = 0.05  # [-] share of beams without return; beam model only
    # [-] share of returns from what stands in front of the map; beam model only
    z_short: ShareOfReturns = 0.05
    # [1/m] by which those fall off with the range
    lambda_short: Annotated[float, within(0, 1e6)] = 0.1
    # likelihood_field_prob ignores beams that most particles find off the map
    do_beamskip: bool = False
    # [m] to an obstacle within which a return agrees with the map
    beam_skip_distance: NotNegative = 0.5
    # [-] share of the particles that must agree for a beam to count
    beam_skip_threshold: Quantity = 0.3
    # [-] share of ignored beams from which on none is ignored
    beam_skip_error_threshold: Quantity = 0.9

    min_particles: Annotated[int, NegativeReplaced(500), within(0, MOST_PARTICLES)] = 500
    max_particles: Annotated[int, NegativeReplaced(2000), within(0, MOST_PARTICLES)] = 2000
    pf_err: Positive = 0.05  # [-] allowed distance between the true distribution and the particles'
    # [-] quantile of the normal distribution for the probability of staying within pf_err
    pf_z: NotNegative = 0.99
    resample_interval: Interval = 1  # scans that count between two resamplings
    # [-] rate of the slow average of the weights; 0: no random particles
    recovery_alpha_slow: NotNegative = 0.0
    recovery_alpha_fast: NotNegative = 0.0  # [-] rate of the fast one
    # poses anywhere of which a scan picks the random particles; 0: no choice, as in Nav2, which
    # has no such parameter
    recovery_candidates: Annotated[int, within(0, MOST_PARTICLES)] = 0
    # random particles are drawn from the free cells of every other row and column only
    freespace_downsampling: bool = False
    # [m] along x or y of odometry after which a scan counts; negative: every one does
    update_min_d: Quantity = 0.25
    update_min_a: Quantity = 0.2  # [rad] of rotation after which a scan counts
    random_seed: Whole = (
        -1
    )  # of the particle filter; negative: the generator that is given at reset

    @property
    def most_particles(self) -> int:
        """``max_particles``, but never less than ``min_particles``, as Nav2 corrects it."""
        return max(self.min_particles, self.max_particles)

    def _check_together(self) -> None:
        self._require(
            "laser_max_range",
            self.laser_max_range <= 0.0 or self.laser_max_range >= SHORTEST_RANGE,
            f"0 or less (the scan's own), or at least {SHORTEST_RANGE:g}",
        )
        self._require("max_particles", self.most_particles > 0, "1 or more without min_particles")


@dataclass(frozen=True, slots=True)
class AmclGpsParams(Parameters, whose="amcl_gps", finite=True):
    """Node ``amcl_gps``, this program's own: what fixes count beside scans."""

    # [m] per axis of a fix that states none; data sheets of stand-alone receivers: 2.5 m CEP
    position_std: Positive = 2.0
    # [m] per axis: smaller ones that a receiver reports are raised to this. Multipath of the code
    # (Joerger & Pervan 2020: that of a satellite at the zenith)
    position_std_floor: Positive = 0.5
    # [s] of a fix's error, same source (10 to 900 s): fixes within it repeat the same error
    correlation_time: Positive = 10.0
    # [-] of the t-distribution of a fix's error, whose heavy tails make it robust
    # (Lange, Little & Taylor 1989, J. Am. Stat. Assoc.); assumed
    degrees_of_freedom: Positive = 4.0
    # [-] Mahalanobis distance beyond which a fix and the belief disagree; 1 of 1000 right fixes is
    # farther off (chi-square, 2 degrees of freedom)
    rejection_threshold: Positive = 3.717
    # fixes in a row that disagree, after which particles are drawn about the fix
    patience: PositiveInt = 3
    recovery_share: Annotated[float, POSITIVE, at_most(1)] = (
        0.02  # [-] of the particles that are drawn then, each time
    )
    # poses about the fix of which a scan picks these particles
    recovery_candidates: Particles = 2000
    # [rad] of half of these poses about the inertial unit's heading; the others have any heading
    heading_std_floor: Positive = 0.1
