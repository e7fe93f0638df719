"""Parameters of AMCL: names and defaults are those of Nav2 Jazzy."""

from dataclasses import dataclass

from navstack.params.checks import check_signs, require

LASER_MODELS = ("beam", "likelihood_field", "likelihood_field_prob")
# name -> spelling of releases before plugins
MOTION_MODELS = {
    "nav2_amcl::DifferentialMotionModel": "differential",
    "nav2_amcl::OmniMotionModel": "omnidirectional",
}
_WHOSE = "amcl"
_POSITIVE = "laser_likelihood_max_dist sigma_hit pf_err resample_interval min_particles max_particles"
_NOT_NEGATIVE = """
    alpha1 alpha2 alpha3 alpha4 alpha5 beam_skip_distance lambda_short pf_z recovery_alpha_slow recovery_alpha_fast
    update_min_a update_min_d z_hit z_max z_rand z_short recovery_candidates
"""


@dataclass(frozen=True, slots=True)
class AmclParams:
    """Node ``amcl`` (``amcl_node.cpp``). Frames, topics and what concerns publishing have no effect here."""

    robot_model_type: str = "nav2_amcl::DifferentialMotionModel"
    alpha1: float = 0.2  # [-] variance of a rotation per squared rotation
    alpha2: float = 0.2  # [rad2/m2] variance of a rotation per squared translation
    alpha3: float = 0.2  # [-] variance of a translation per squared translation
    alpha4: float = 0.2  # [m2/rad2] variance of a translation per squared rotation
    alpha5: float = 0.2  # [-] variance of a sideways translation per squared translation; omnidirectional only

    laser_model_type: str = "likelihood_field"
    max_beams: int = 60  # of a scan, evenly spaced
    laser_max_range: float = 100.0  # [m] beyond which there is no return; 0 or less: the scan's own
    laser_min_range: float = -1.0  # [m] up to which there is no return; 0 or less: the scan's own
    laser_likelihood_max_dist: float = 2.0  # [m] an obstacle farther from a return is taken to be that far
    sigma_hit: float = 0.2  # [m] standard deviation of a return about an obstacle
    z_hit: float = 0.5  # [-] share of returns from what is on the map
    z_rand: float = 0.5  # [-] share of returns from anywhere
    z_max: float = 0.05  # [-] share of beams without return; beam model only
    z_short: float = 0.05  # [-] share of returns from what stands in front of the map; beam model only
    lambda_short: float = 0.1  # [1/m] by which those fall off with the range
    do_beamskip: bool = False  # likelihood_field_prob ignores beams that most particles find off the map
    beam_skip_distance: float = 0.5  # [m] to an obstacle within which a return agrees with the map
    beam_skip_threshold: float = 0.3  # [-] share of the particles that must agree for a beam to count
    beam_skip_error_threshold: float = 0.9  # [-] share of ignored beams from which on none is ignored

    min_particles: int = 500
    max_particles: int = 2000
    pf_err: float = 0.05  # [-] allowed distance between the true distribution and the particles'
    pf_z: float = 0.99  # [-] quantile of the normal distribution for the probability of staying within pf_err
    resample_interval: int = 1  # scans that count between two resamplings
    recovery_alpha_slow: float = 0.0  # [-] rate of the slow average of the weights; 0: no random particles
    recovery_alpha_fast: float = 0.0  # [-] rate of the fast one
    recovery_candidates: int = 0  # poses anywhere of which a scan picks the random particles; 0: they are just
    # anywhere, as in Nav2, which has no such parameter
    update_min_d: float = 0.25  # [m] along x or y of odometry after which a scan counts
    update_min_a: float = 0.2  # [rad] of rotation after which a scan counts
    random_seed: int = -1  # of the particle filter; negative: the generator that is given at reset

    def __post_init__(self) -> None:
        check_signs(self, _POSITIVE, _NOT_NEGATIVE, _WHOSE)
        require(self, "max_beams", self.max_beams >= 2, "2 or more", _WHOSE)
        models = ", ".join(LASER_MODELS)
        require(self, "laser_model_type", self.laser_model_type in LASER_MODELS, f"one of {models}", _WHOSE)
        known = (*MOTION_MODELS, *MOTION_MODELS.values())
        require(self, "robot_model_type", self.robot_model_type in known, f"one of {', '.join(known)}", _WHOSE)

    @property
    def most_particles(self) -> int:
        """``max_particles``, but never less than ``min_particles``, as Nav2 corrects it."""
        return max(self.min_particles, self.max_particles)
