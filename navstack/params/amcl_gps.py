"""Parameters of AMCL with GPS: what fixes count beside scans. AMCL's own stand in its node.

Nav2 has none like this.
"""

from dataclasses import dataclass

from navstack.params.checks import Positive, PositiveInt, check, require


@dataclass(frozen=True, slots=True)
class AmclGpsParams:
    """Node ``amcl_gps``, this program's own."""

    # [m] per axis of a fix that states none; stand-alone receivers' data sheets: 2.5 m
    position_std: Positive = 2.0
    # CEP
    # [m] per axis below which no fix is believed, whatever the receiver reports:
    position_std_floor: Positive = 0.5
    # multipath of the code (Joerger & Pervan 2020: that of a satellite at the zenith)
    # [s] of a fix's error, same source (10 to 900 s): fixes within it tell little
    correlation_time: Positive = 10.0
    # anew
    # [-] of the t-distribution of a fix's error, whose heavy tails make it robust
    degrees_of_freedom: Positive = 4.0
    # (Lange, Little & Taylor 1989, J. Am. Stat. Assoc.); assumed
    # [-] Mahalanobis distance beyond which a fix and the belief disagree; 1 of
    rejection_threshold: Positive = 3.717
    # 1000 right fixes is farther off (chi-square, 2)
    # fixes in a row that disagree, after which particles are drawn about the fix
    patience: PositiveInt = 3
    recovery_share: Positive = 0.02  # [-] of the particles that are drawn then, each time
    # poses about the fix of which a scan picks these particles
    recovery_candidates: PositiveInt = 2000
    # [rad] of half of these poses about the inertial unit's heading; the rest have
    heading_std_floor: Positive = 0.1
    # any

    def __post_init__(self) -> None:
        check(self, "amcl_gps", finite=True)
        require(self, "recovery_share", self.recovery_share <= 1.0, "at most 1", "amcl_gps")
